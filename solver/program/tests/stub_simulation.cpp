// A simulation without physics, to test what stands around it: a straight wire that moves
// along the introducer's axis and touches at its tip. Deterministic; its state is one number.
// AMONTONS_STUB_PAUSE [s] slows each step; AMONTONS_STUB_FAIL is the step that fails.

#include "mesh/base/curve.hpp"
#include "mesh/base/error.hpp"
#include "mesh/base/phase_timer.hpp"
#include "solver/step/recorded_problem.hpp"
#include "solver/step/simulation.hpp"

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <thread>

namespace amontons {

namespace {

class StubSimulation final : public Simulation {
public:
    StubSimulation(const Scene& scene, std::vector<Obstacle> obstacles)
        : state_(new State{scene, std::move(obstacles)})
    {
    }
    StepResult step(const std::atomic<bool>& stop, double not_beyond) override;
    RunSummary conclude(const StepResult& last) override;
    void spent_on_output(double) override {}
    const RunSummary& so_far() const override { return summary_; }
    const std::vector<Obstacle>& obstacles() const override;
    std::vector<BodyPlan> plan() const override;
    std::vector<double> max_contact_force(std::size_t obstacle) const override;
    std::vector<RecordedProblem> contact_problems() const override;
    std::vector<BodyRecord> body_records() const override { return {}; }
    std::vector<std::byte> save() const override;
    void restore(const std::vector<std::byte>& state) override;

private:
    struct State {
        Scene scene;
        std::vector<Obstacle> obstacles;
        std::int64_t step = -1; ///< the last finished one
        int contacts_max = 0;
    };
    std::unique_ptr<State> state_;
    RunSummary summary_;
};

const std::vector<Obstacle>& StubSimulation::obstacles() const
{
    return state_->obstacles;
}

std::vector<RecordedProblem> StubSimulation::contact_problems() const
{
    return {};
}

std::vector<BodyPlan> StubSimulation::plan() const
{
    std::vector<BodyPlan> plan;
    for (const ObstacleInput& o : state_->scene.obstacles)
        plan.push_back({o.name, "obstacle", 0});
    for (const BeamInput& b : state_->scene.beams)
        plan.push_back({b.name, "beam", 600});
    return plan;
}

std::vector<double> StubSimulation::max_contact_force(std::size_t obstacle) const
{
    return std::vector<double>(state_->obstacles[obstacle].model.surface->points.size(), 0.25);
}

std::vector<std::byte> StubSimulation::save() const
{
    std::vector<std::byte> bytes(sizeof state_->step);
    std::memcpy(bytes.data(), &state_->step, bytes.size());
    return bytes;
}

void StubSimulation::restore(const std::vector<std::byte>& state)
{
    if (state.size() != sizeof state_->step)
        throw InputError({{"checkpoint", "", "a state of another size", "this scene's"}});
    std::memcpy(&state_->step, state.data(), state.size());
}

StepResult StubSimulation::step(const std::atomic<bool>& stop, double)
{
    using enum StepResult::Outcome;
    const Scene& scene = state_->scene;
    const BeamInput& beam = scene.beams.front();
    const auto number = [](const char* name) {
        const char* text = std::getenv(name);
        return text ? std::atof(text) : -2;
    };
    const double pause = number("AMONTONS_STUB_PAUSE"), fails = number("AMONTONS_STUB_FAIL");
    const auto last = static_cast<std::int64_t>(std::ceil(scene.time.end / scene.time.step - 1e-9));
    if (state_->step >= last) return {};
    if (stop && state_->step >= 0) return {interrupted, "stopped by the user", {}};
    const Stopwatch watch;
    if (pause > 0) std::this_thread::sleep_for(std::chrono::duration<double>(pause));
    if (static_cast<double>(state_->step) == fails) return {failed, "step 9 cannot be solved", {}};
    StepRecord r;
    r.step = static_cast<int>(++state_->step);
    r.time = std::min(scene.time.end, r.step * scene.time.step);
    const double depth = curve_value(beam.insertion, r.time);
    BeamRecord& b = r.beams.emplace_back();
    b.name = beam.name;
    constexpr int kPoints = 200;
    b.fields = {{"radius", "m", 1, {}},   {"curvature", "1/m", 1, {}},
                {"twist", "rad", 1, {}},  {"axial_force", "N", 1, {}},
                {"moment", "N m", 3, {}}, {"arc_length", "m", 1, {}}};
    for (int i = 0; i < kPoints; ++i) {
        const double s = depth * i / (kPoints - 1);
        b.points.push_back(beam.introducer.at + s * beam.introducer.direction.normalized());
        b.fields[0].values.push_back(beam.segments.front().radius);
        b.fields[1].values.push_back(std::sin(s));
        b.fields[2].values.push_back(0.1 * s);
        b.fields[3].values.push_back(-0.1);
        b.fields[4].values.insert(b.fields[4].values.end(), {0, 0, s});
        b.fields[5].values.push_back(s);
    }
    for (int i = 0; i < r.step % 4; ++i) {
        ContactRecord c;
        c.point = b.points.back();
        c.normal = Vec3::UnitZ();
        c.force = {0.01, 0, 0.1};
        c.normal_force = 0.1;
        c.status = ContactStatus::slip;
        c.body_a = 1;
        r.contacts.push_back(c);
    }
    r.step_length = scene.time.step;
    r.iterations = 4;
    r.certificate.error = 1e-10 * (1 + r.step % 7);
    r.certificate.tolerance = scene.accuracy.contact;
    r.energy.work = r.energy.elastic = depth;
    r.quantities = {
        {"depth", "m", depth}, {"push_force", "N", 0.1 * std::sin(r.time)}, {"torque", "N m", 0}};
    r.seconds = watch.seconds();
    state_->contacts_max = std::max(state_->contacts_max, static_cast<int>(r.contacts.size()));
    return {accepted, "", r};
}

RunSummary StubSimulation::conclude(const StepResult& last)
{
    using enum StepResult::Outcome;
    const Scene& scene = state_->scene;
    RunSummary summary;
    summary.status = last.outcome == done     ? "done"
                     : last.outcome == failed ? "failed"
                                              : "interrupted";
    summary.message = last.message;
    summary.contacts_max = state_->contacts_max;
    summary.steps = static_cast<int>(state_->step);
    summary.time = std::min(scene.time.end, summary.steps * scene.time.step);
    summary.quantities = {{"depth", "m", curve_value(scene.beams.front().insertion, summary.time)},
                          {"passed_through", "", 0}};
    summary.texts = {{"branch", ""}};
    return summary;
}

} // namespace

std::unique_ptr<Simulation> make_simulation(const Scene& scene, std::vector<Obstacle> obstacles,
                                            const SimulationOptions&)
{
    return std::make_unique<StubSimulation>(scene, std::move(obstacles));
}

} // namespace amontons
