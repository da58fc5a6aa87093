#include "solver/program/changed_simulation.hpp"

#include "solver/obstacle/build.hpp"
#include "solver/program/session.hpp"
#include "solver/scene/read.hpp"

namespace amontons {

ChangedSimulation::ChangedSimulation(const Scene& scene, std::vector<std::string> overrides,
                                     std::vector<Obstacle> obstacles,
                                     const SimulationOptions& options, const Session& session)
    : file_(scene.file)
    , overrides_(std::move(overrides))
    , options_(options)
    , session_(session)
    , now_(make_simulation(scene, std::move(obstacles), options))
{
}

StepResult ChangedSimulation::step(const std::atomic<bool>& stop, double not_beyond)
{
    if (begun_)
        for (const std::string& line : lines_.take(session_))
            change(line);
    StepResult result = now_->step(stop, not_beyond);
    begun_ = begun_ || result.outcome == StepResult::Outcome::accepted;
    return result;
}

void ChangedSimulation::change(const std::string& line)
{
    std::vector<std::string> overrides = overrides_;
    overrides.push_back(line);
    try {
        Scene scene = read_scene(file_, overrides);
        place_introducers(scene);
        std::unique_ptr<Simulation> next = make_simulation(scene, build_obstacles(scene), options_);
        next->take_over(*now_);
        now_ = std::move(next);
        overrides_ = std::move(overrides);
        session_.print_line("set " + line);
    } catch (const InputError& error) {
        session_.print_line(std::string("not set: ") + error.what());
    }
}

} // namespace amontons
