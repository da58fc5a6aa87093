// amontons solve PROBLEM.hdf5: one contact problem from an FCLib file, solved and certified.

#include "contact/solvers/solve.hpp"
#include "mesh/base/file.hpp"
#include "mesh/base/phase_timer.hpp"
#include "solver/fclib_file.hpp"
#include "solver/outside_solver.hpp"
#include "solver/program/interrupt.hpp"
#include "solver/program/session.hpp"
#include "solver/scene/json_text.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <fmt/format.h>
#include <functional>
#include <future>
#include <string_view>
#include <unistd.h>

namespace amontons {
namespace {

struct SolveArguments {
    std::string problem, output, solver = name(ContactSolver::automatic);
    bool judge = false;  ///< the /solution that is in the file
    std::string command; ///< of an external solver
    SolverOptions options;
};

struct Solved {
    ContactSolution solution;
    Eigen::VectorXd motion; ///< of a global problem's bodies
    const char* delassus = "";
    std::string by; ///< the program that solved it, if it was another one
    double read_seconds = 0, condense_seconds = 0;
};

std::vector<std::string> solver_names()
{
    std::vector<std::string> names;
    for (ContactSolver solver : kContactSolvers)
        names.emplace_back(name(solver));
    return names;
}

ContactSolver solver_of(const std::string& requested)
{
    const std::vector<std::string> names = solver_names();
    std::string all;
    for (std::size_t k = 0; k < names.size(); ++k) {
        if (names[k] == requested) return kContactSolvers[k];
        all += (k == 0 ? "" : ", ") + names[k];
    }
    const std::string near = nearest_name(requested, names);
    if (!near.empty()) all += " (nearest name: " + near + ")";
    throw InputError({{"(--solver)", "", quoted_text(requested), all}});
}

/// Tries what writing the result will do, so that no solve is lost to a path that cannot be, and no
/// problem to its solution.
/// @throws InputError
void check_writable(const std::string& path, const std::string& problem)
{
    namespace fs = std::filesystem;
    const auto refuse = [&](const std::string& found) {
        throw InputError({{path, "", found, "a file that can be written"}});
    };
    std::error_code ignored;
    if (fs::is_directory(path, ignored)) refuse("a folder");
    if (fs::equivalent(path, problem, ignored))
        throw InputError({{path, "", "the problem itself", "another file"}});
    if (fs::exists(path, ignored) && !fs::is_regular_file(path, ignored)) return; // /dev/stdout
    const std::string probe = path + "." + std::to_string(::getpid()) + ".tmp";
    const int file = ::open(probe.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (file < 0) refuse(std::strerror(errno));
    ::close(file);
    ::unlink(probe.c_str());
}

/// @param answer  of a problem (W, q, mu): solves or judges it
Solved answer_of(const FclibProblem& file,
                 const std::function<ContactSolution(const ContactProblem&)>& answer)
{
    Solved s;
    const auto form = [](const Delassus& W) {
        return W.is_dense()       ? "dense"
               : W.is_sparse()    ? "sparse"
               : W.is_of_bodies() ? "of bodies"
                                  : "matrix-free";
    };
    if (file.local) {
        s.solution = answer(*file.local);
        s.delassus = form(file.local->W);
        return s;
    }
    const Stopwatch watch;
    const CondensedProblem condensed(*file.global);
    s.condense_seconds = watch.seconds();
    s.delassus = form(condensed.contact().W);
    s.solution = answer(condensed.contact());
    s.motion = condensed.motion(s.solution.reaction);
    return s;
}

Solved solve_file(const FclibProblem& file, const SolverOptions& options)
{
    return answer_of(file, [&](const ContactProblem& p) { return solve(p, options); });
}

/// Certifies a reaction of another program, as those of the program's own solvers are certified.
/// @param where  names the file in messages
/// @throws InputError  no reaction, or one of another size
Solved judge(const FclibProblem& file, const std::optional<FclibSolution>& given,
             const std::string& where, double tolerance)
{
    if (!given || given->r.size() == 0)
        throw InputError({{where, "/solution/r", "nothing", "a reaction that can be judged"}});
    return answer_of(file, [&](const ContactProblem& p) {
        if (given->r.size() != p.q.size())
            throw InputError({{where, "/solution/r", fmt::format("{} numbers", given->r.size()),
                               fmt::format("{}, the rows of the problem", p.q.size())}});
        return judged(p, given->r, tolerance);
    });
}

Eigen::Index bilateral_of(const FclibProblem& file)
{
    const std::vector<ContactKind>& kind = file.local ? file.local->kind : file.global->kind;
    return std::count(kind.begin(), kind.end(), ContactKind::bilateral);
}

/// Runs an external solver. Its output is written to stderr.
Solved solve_by_command(const SolveArguments& a, const FclibProblem& file, std::string_view bytes,
                        Session& session)
{
    try {
        // The solution that a file brings along would pass for that of a command that copies the
        // file and writes none of its own: zeros are in its place.
        std::string hidden;
        if (file.solution) {
            FclibSolution none = *file.solution;
            for (Eigen::VectorXd* v : {&none.r, &none.u, &none.v})
                v->setZero();
            hidden = with_solution(bytes, none, bilateral_of(file));
        }
        const OutsideAnswer answer =
            run_outside_solver({a.command, ".", a.options.max_seconds}, a.problem,
                               a.options.tolerance, &stop_on_interrupt(), hidden);
        if (!answer.printed.empty()) session.print_line(answer.printed);
        Solved s = judge(file, answer.solution, "the file of the command", a.options.tolerance);
        s.by = a.command;
        s.solution.certificate.seconds = answer.seconds;
        return s;
    } catch (const NoOutsideAnswer& none) {
        throw InputError(
            {{"(--solver-command)", "", quoted_text(a.command) + ", which " + none.what(),
              "a command that is given two files, PROBLEM and SOLVED, and writes the second: a "
              "copy of the first with /solution (r, u)"}});
    }
}

/// The same, ended by the first Ctrl-C with what it has reached.
/// @return  empty if the solver is in a step, or W in the making, that takes long: it then still
///          runs, and only the end of the process ends it
std::optional<Solved> solve_until_interrupted(const FclibProblem& file, SolverOptions options)
{
    using namespace std::chrono_literals;
    constexpr std::chrono::seconds kGrace = 5s; // for the step that the solver is in
    const std::atomic<bool>& stop = stop_on_interrupt();
    options.stop = &stop;
    std::future<Solved> result =
        std::async(std::launch::async, [&, options] { return solve_file(file, options); });
    while (result.wait_for(20ms) != std::future_status::ready)
        if (stop && result.wait_for(kGrace) != std::future_status::ready) {
            // The future's end would wait for the solve.
            new std::future<Solved>(std::move(result));
            return {};
        }
    return result.get();
}

bool interrupted(const Certificate& c)
{
    return c.status == SolveStatus::out_of_time && was_interrupted();
}

/// What the solve ended with, as the user sees it.
const char* outcome(const Certificate& c)
{
    return interrupted(c) ? "interrupted" : name(c.status);
}

std::string solution_json(const SolveArguments& a, const FclibProblem& file, const Solved& s)
{
    const Certificate& c = s.solution.certificate;
    JsonText json;
    json.open('{')
        .member("status", outcome(c))
        .member("error", c.error)
        .member("tolerance", c.tolerance)
        .member("threshold", c.threshold)
        .member("rounding", c.rounding)
        .member("scaled_error", c.scaled_error)
        .member("solver", s.by.empty() ? name(c.solver) : s.by)
        .member("iterations", c.iterations)
        .member("seconds", c.seconds)
        .member("contacts", c.contacts);
    if (c.analysed)
        json.member("rank_deficient", c.rank_deficient).member("indefinite", c.indefinite);
    else
        json.key("rank_deficient").json("null").key("indefinite").json("null");
    json.member("level", c.level == ContactLevel::position ? "position" : "velocity")
        .member("worst_penetration", c.worst_penetration)
        .member("worst_cone_violation", c.worst_cone_violation)
        .member("worst_dissipation", c.worst_dissipation)
        .member("worst_contact", c.worst_contact);
    if (c.status == SolveStatus::infeasible) {
        json.key("proof").open('{').key("contacts").open('[');
        for (const int i : c.proof.contacts)
            json.value(i);
        json.close(']')
            .member("size", c.proof.direction.norm())
            .member("closing", c.proof.closing)
            .member("holds_up_to", c.proof.holds_up_to)
            .close('}');
    }
    json.member("problem", a.problem)
        .member("title", file.title)
        .member("kind", file.local ? "local" : "global")
        .member("delassus", s.delassus)
        .member("read_seconds", s.read_seconds)
        .member("condense_seconds", s.condense_seconds)
        .member("output", a.output)
        .key("history")
        .open('[');
    for (const ErrorPoint& p : s.solution.history)
        json.open('{')
            .member("iteration", p.iteration)
            .member("seconds", p.seconds)
            .member("error", p.error)
            .close('}');
    json.close(']').close('}');
    return json.text() + "\n";
}

/// At most ten points of the history: the first, the last, and each time the iterations doubled.
std::vector<ErrorPoint> short_history(const std::vector<ErrorPoint>& history)
{
    constexpr std::size_t kLines = 10;
    std::vector<ErrorPoint> lines;
    if (history.empty()) return lines;
    double factor = 2;
    do {
        lines.clear();
        for (const ErrorPoint& p : history)
            if (lines.empty() || p.iteration >= factor * lines.back().iteration) lines.push_back(p);
        if (lines.back().iteration != history.back().iteration) lines.push_back(history.back());
        factor *= 1.5;
    } while (lines.size() > kLines);
    return lines;
}

std::string human_text(const SolveArguments& a, const FclibProblem& file, const Solved& s)
{
    const Certificate& c = s.solution.certificate;
    const bool position = c.level == ContactLevel::position;
    const char* length = position ? "m" : "m/s";
    const char* force = position ? "N" : "N s";
    std::string t;
    const auto row = [&](const char* what, const std::string& value) {
        t += fmt::format("  {:<20} {}\n", what, value);
    };
    t += fmt::format("{}: {}\n", a.problem, outcome(c));
    if (!file.title.empty()) row("title", file.title);
    row("error", fmt::format("{:.3e}, threshold {:.1e} (scaled by contact: {:.1e})", c.error,
                             c.threshold, c.scaled_error));
    row("contacts", fmt::format("{}, W {}", c.contacts, s.delassus));
    row("solver", !a.command.empty() ? fmt::format("{}, {:.3g} s", s.by, c.seconds)
                  : a.judge          ? s.by
                                     : fmt::format("{}, {} iterations, {:.3g} s", name(c.solver),
                                                   c.iterations, c.seconds));
    row("worst penetration", fmt::format("{:.3e} {}", c.worst_penetration, length));
    row("worst cone violation", fmt::format("{:.3e} {}", c.worst_cone_violation, force));
    row("worst dissipation", fmt::format("{:.3e} J", c.worst_dissipation));
    if (c.worst_contact >= 0) row("worst contact", std::to_string(c.worst_contact));
    if (c.status == SolveStatus::infeasible) {
        std::string contacts;
        for (std::size_t k = 0; k < c.proof.contacts.size() && k < 10; ++k)
            contacts += (k == 0 ? "" : ", ") + std::to_string(c.proof.contacts[k]);
        if (c.proof.contacts.size() > 10)
            contacts += fmt::format(" and {} more", c.proof.contacts.size() - 10);
        row("no solution", fmt::format("whatever the reaction, contacts {} overlap by {:.3e} {} "
                                       "in sum",
                                       contacts, c.proof.closing, length));
    }
    if (!s.solution.history.empty()) {
        t += fmt::format("  {:>10} {:>12} {:>10}\n", "iteration", "seconds", "error");
        for (const ErrorPoint& p : short_history(s.solution.history))
            t += fmt::format("  {:>10} {:>12.3e} {:>10.2e}\n", p.iteration, p.seconds, p.error);
    }
    if (!a.output.empty()) row("written", a.output);
    return t;
}

void run_solve(SolveArguments& a, Session& session)
{
    a.options.solver = solver_of(a.solver);
    a.options.analyse = true;
    if (!a.output.empty()) check_writable(a.output, a.problem);
    const Stopwatch watch;
    const std::string bytes = read_file(a.problem);
    const FclibProblem file = parse_fclib(bytes, a.problem);
    const double read_seconds = watch.seconds();
    session.detail(fmt::format("read in {:.3f} s", read_seconds));

    std::optional<Solved> solved;
    if (a.judge) {
        solved = judge(file, file.solution, a.problem, a.options.tolerance);
        solved->by = "the file's";
    } else if (!a.command.empty()) {
        solved = solve_by_command(a, file, bytes, session);
    } else {
        solved = solve_until_interrupted(file, a.options);
    }
    if (!solved) {
        session.error("interrupted" + (a.output.empty() ? "" : "; " + a.output + " not written"));
        if (session.json) session.print("{\"status\": \"interrupted\"}\n");
        std::_Exit(kInterrupted);
    }
    solved->read_seconds = read_seconds;
    const Certificate& c = solved->solution.certificate;
    if (!a.output.empty()) {
        write_file(a.output,
                   with_solution(bytes,
                                 {solved->solution.reaction, solved->solution.u, solved->motion},
                                 bilateral_of(file)));
    }
    if (!is_solved(c.status)) {
        session.exit_code = interrupted(c) ? kInterrupted : kSolveFailed;
        session.error((interrupted(c) ? "interrupted: " : "") + report(c));
    }
    if (session.json)
        session.print(solution_json(a, file, *solved));
    else if (!session.quiet)
        session.print(human_text(a, file, *solved));
}

} // namespace

void add_solve(CLI::App& program, Session& session)
{
    const auto a = std::make_shared<SolveArguments>(); // lives as long as the callback
    CLI::App* command =
        program.add_subcommand("solve", "Solve a contact problem from an FCLib file");
    command->add_option("PROBLEM", a->problem, "HDF5 file of a local or global problem")
        ->type_name("FILE")
        ->required();
    std::string names;
    for (const std::string& n : solver_names())
        names += (names.empty() ? "" : ", ") + n;
    CLI::Option* solver = command->add_option("--solver,-s", a->solver, "One of: " + names)
                              ->type_name("NAME")
                              ->capture_default_str();
    CLI::Option* judged =
        command->add_flag("--judge", a->judge,
                          "Solves nothing: certifies the /solution in the file as a result of the "
                          "program's own solvers");
    command
        ->add_option(
            "--solver-command", a->command,
            "Another solver: a command that is given two files, PROBLEM and SOLVED, and "
            "writes the second, a copy of the first with /solution; certified like the others")
        ->type_name("CMD")
        ->excludes(judged)
        ->excludes(solver);
    judged->excludes(solver);
    command
        ->add_option("--tolerance", a->options.tolerance,
                     "Natural-map error to reach; 0: down to round-off")
        ->type_name("NUMBER")
        ->capture_default_str();
    command->add_option("--max-time", a->options.max_seconds, "Ends the solve after this time [s]")
        ->type_name("SECONDS");
    command
        ->add_option("--max-iterations", a->options.max_iterations,
                     "Ends the solve after this many iterations")
        ->type_name("N")
        ->capture_default_str();
    command->add_option("--output,-o", a->output, "A copy of the file with /solution: u and r")
        ->type_name("FILE");
    command->add_flag("--least-norm", a->options.least_norm,
                      "Of several reactions, the one of least norm");
    command
        ->add_option("--threads", a->options.threads,
                     "Threads; the result is the same for any number")
        ->check(CLI::Range(1, 1024));
    command->add_flag("--json", session.json, "One JSON object on stdout");
    command->callback([a, &session] { run_solve(*a, session); });
}

} // namespace amontons
