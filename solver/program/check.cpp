// amontons check SCENE: validates, prints the plan, runs nothing.

#include "solver/large/large_matrix.hpp"
#include "solver/obstacle/build.hpp"
#include "solver/output/meanings.hpp"
#include "solver/program/scene_arguments.hpp"
#include "solver/program/session.hpp"
#include "solver/scene/json_text.hpp"
#include "solver/scene/read.hpp"
#include "solver/step/plan.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <fmt/format.h>

namespace amontons {
namespace {

std::string plan_text(const Plan& plan)
{
    std::string t = "bodies\n";
    for (const BodyPlan& b : plan.bodies) {
        t += fmt::format("  {:<16} {}, {} unknowns\n", b.name, b.kind, b.unknowns);
        for (const SetSize& s : b.sets)
            t += s.faces > 0 ? fmt::format("    set {:<10} {} faces, {} nodes, {:.4g} m^2\n",
                                           s.name, s.faces, s.nodes, s.area)
                             : fmt::format("    set {:<10} {} nodes\n", s.name, s.nodes);
    }
    // No list is begun that has nothing in it.
    std::string surfaces;
    for (const Plan::Surface& s : plan.surfaces)
        if (!s.facts.side.empty())
            surfaces += fmt::format(
                "  {}: free space {} of it, {}{} holes\n", s.name, s.facts.side,
                s.facts.volume ? fmt::format("{:.4g} m^3, ", *s.facts.volume) : "", s.facts.holes);
    if (!surfaces.empty()) t += "surfaces\n" + surfaces;
    t += "pairs that can touch\n";
    for (const Plan::Pair& p : plan.pairs)
        t += fmt::format("  {} - {}: {}, friction {:g}\n", p.a, p.b, p.law, p.friction);
    if (plan.pairs.empty()) t += "  none\n";
    if (!plan.uses.empty()) t += "uses\n";
    for (const std::string& u : plan.uses)
        t += "  " + u + "\n";
    if (!plan.leaves_out.empty()) t += "leaves out\n";
    for (const Plan::LeftOut& l : plan.leaves_out)
        t += fmt::format("  {}: {}\n", l.what, l.why);
    t += fmt::format("predicted\n  memory {:.0f} MB{}\n  path   {}\n", plan.memory / 1e6,
                     plan.picture > 0
                         ? fmt::format("; the picture, drawn after the run by a process "
                                       "of its own, {:.0f} MB",
                                       plan.picture / 1e6)
                         : "",
                     plan.path);
    const LinearPlan& linear = plan.linear;
    if (linear.paths.empty()) return t;
    t += fmt::format("linear systems of solids: {}, {}\n", linear.taken, linear.why);
    for (const LinearPath& p : linear.paths)
        t += p.possible ? fmt::format("  {:<12} {:>7.0f} MB {:>9.3g} s  {}\n", p.name,
                                      p.memory / 1e6, p.seconds, p.why)
                        : fmt::format("  {:<12} not possible: {}\n", p.name, p.why);
    t += fmt::format("  {:.0f} MB are free\n", linear.available / 1e6);
    if (!linear.refusal.empty()) t += "  a run is refused: " + linear.refusal + "\n";
    return t;
}

/// Keeps the first state of a run, which ends there.
struct FirstState : StepObserver {
    explicit FirstState(std::atomic<bool>& stop_flag) : stop(stop_flag) {}
    void on_step(const StepRecord& record) override
    {
        names = record.quantities;
        seen = true;
        stop = true;
    }
    std::atomic<bool>& stop;
    std::vector<Quantity> names;
    bool seen = false;
};

/// Every quantity of the history and of the end of a run, with unit and meaning. Its first state is
/// made for that.
void report_quantities(Simulation& simulation, Session& session)
{
    std::atomic<bool> stop{false};
    FirstState first(stop);
    const RunSummary summary = simulation.run(first, stop);
    if (!first.seen) {
        session.error("no first state, whose quantities could be named: " + summary.message);
        session.exit_code = kSolveFailed;
        return;
    }
    std::vector<Quantity> all = first.names;
    const auto add = [&](const std::string& name, const std::string& unit) {
        if (std::ranges::none_of(all, [&](const Quantity& q) { return q.name == name; }))
            all.push_back({name, unit, 0});
    };
    for (const Quantity& q : summary.quantities)
        add(q.name, q.unit);
    for (const NamedText& t : summary.texts)
        add(t.name, "");
    std::size_t width = 0;
    for (const Quantity& q : all)
        width = std::max(width, q.name.size());
    JsonText json;
    json.open('[');
    for (const Quantity& q : all) {
        const Meaning* m = meaning_of(q.name);
        const std::string text = m ? std::string(m->text) : "";
        if (session.json)
            json.open('{')
                .member("name", q.name)
                .member("unit", q.unit)
                .member("meaning", text)
                .close('}');
        else
            session.print(fmt::format("{:<{}}  {:<8} {}\n", q.name, width,
                                      q.unit.empty() ? "" : "[" + q.unit + "]", text));
    }
    if (session.json) session.print(json.close(']').text() + "\n");
}

} // namespace

void add_check(CLI::App& program, Session& session)
{
    const auto arguments = std::make_shared<SceneArguments>();
    CLI::App* command =
        program.add_subcommand("check", "Validate a scene and print the plan; run nothing");
    add_scene_arguments(*command, *arguments);
    command->add_flag("--json", session.json, "One JSON object on stdout");
    const auto quantities = std::make_shared<bool>(false);
    command->add_flag(
        "--quantities", *quantities,
        "Instead: all quantities with unit and meaning; makes the first state of the run");
    command->callback([arguments, quantities, &session] {
        ParallelRun parallel; // has the number of ranks
        if (parallel.served()) return;
        settle(*arguments);
        Scene scene = read_scene(arguments->scene, arguments->overrides);
        place_introducers(scene);
        std::vector<Issue> odd;
        std::vector<Obstacle> obstacles = build_obstacles(scene, &odd);
        SimulationOptions how;
        how.refuse = false;
        const std::unique_ptr<Simulation> simulation =
            make_simulation(scene, std::move(obstacles), how);
        session.warn(odd);
        session.warn(simulation->warnings());
        if (*quantities) {
            report_quantities(*simulation, session);
            return;
        }
        const Plan plan = make_plan(scene, simulation->plan(), simulation->obstacles(),
                                    simulation->linear_plan());
        session.print(session.json ? plan_json(plan) : plan_text(plan));
    });
}

} // namespace amontons
