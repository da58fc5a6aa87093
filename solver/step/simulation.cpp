#include "solver/step/simulation.hpp"

#include "mesh/base/phase_timer.hpp"
#include "solver/scene/instrument_rods.hpp"
#include "solver/step/body_simulation.hpp"
#include "solver/step/wire_simulation.hpp"

namespace amontons {

RunSummary Simulation::run(StepObserver& observer, const std::atomic<bool>& stop)
{
    while (true) {
        const StepResult r = step(stop);
        if (r.outcome != StepResult::Outcome::accepted) return conclude(r);
        const Stopwatch watch;
        observer.on_step(r.record);
        spent_on_output(watch.seconds());
    }
}

const std::vector<InputInfo>& Simulation::inputs() const
{
    static const std::vector<InputInfo> none;
    return none;
}

double Simulation::input(std::size_t number) const
{
    throw InputError({{"", "input " + std::to_string(number), "no such input", "none"}});
}

void Simulation::set_input(std::size_t number, double)
{
    throw InputError({{"", "input " + std::to_string(number), "no such input", "none"}});
}

std::unique_ptr<Simulation> make_simulation(const Scene& scene, std::vector<Obstacle> obstacles,
                                            const SimulationOptions& options)
{
    for (Obstacle& o : obstacles)
        o.model.wall.prepare(options.cache, options.threads);
    if (instruments_are_rods(scene))
        return std::make_unique<BodySimulation>(with_instruments_as_rods(scene),
                                                std::move(obstacles), options);
    if (!scene.beams.empty()) // solids are walls of vessels
        return std::make_unique<WireSimulation>(scene, std::move(obstacles));
    if (scene.solids.empty() && scene.rigids.empty() && scene.rods.empty())
        return std::make_unique<WireSimulation>(scene, std::move(obstacles));
    return std::make_unique<BodySimulation>(scene, std::move(obstacles), options);
}

} // namespace amontons
