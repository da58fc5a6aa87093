#include "solver/program/changed_simulation.hpp"

#include "solver/program/interrupt.hpp"
#include "solver/program/session.hpp"
#include "solver/scene/build.hpp"
#include "solver/scene/read.hpp"

namespace amontons {

ChangedSimulation::ChangedSimulation(const Scene& scene, std::vector<std::string> overrides,
                                     std::vector<Obstacle> obstacles,
                                     const SimulationOptions& options, std::atomic<bool>& stop,
                                     const Session& session)
    : file_(scene.file)
    , overrides_(std::move(overrides))
    , options_(options)
    , stop_(stop)
    , session_(session)
    , now_(make_simulation(scene, std::move(obstacles), options))
{
}

RunSummary ChangedSimulation::run(StepObserver& observer, const std::atomic<bool>& stop)
{
    /// Stops the run after a step where lines have come.
    struct Watch : StepObserver {
        StepObserver& inner;
        ChangedSimulation& owner;
        std::vector<std::string> lines;
        Watch(StepObserver& o, ChangedSimulation& s) : inner(o), owner(s) {}
        void on_step(const StepRecord& record) override
        {
            inner.on_step(record);
            if (lines = owner.lines_.take(owner.session_); !lines.empty()) owner.stop_ = true;
        }
    } watch(observer, *this);
    while (true) {
        RunSummary summary = now_->run(watch, stop);
        if (watch.lines.empty() || was_interrupted() || summary.status != "interrupted")
            return summary;
        stop_ = false;
        for (const std::string& line : watch.lines)
            change(line);
        watch.lines.clear();
    }
}

void ChangedSimulation::change(const std::string& line)
{
    std::vector<std::string> overrides = overrides_;
    overrides.push_back(line);
    try {
        Scene scene = read_scene(file_, overrides);
        place_introducers(scene);
        std::unique_ptr<Simulation> next = make_simulation(scene, build_obstacles(scene), options_);
        next->restore(now_->save());
        now_ = std::move(next);
        overrides_ = std::move(overrides);
        session_.say("set " + line);
    } catch (const InputError& error) {
        session_.say(std::string("not set: ") + error.what());
    }
}

} // namespace amontons
