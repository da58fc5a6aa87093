#include "solver/step/simulation.hpp"

#include "solver/step/body_simulation.hpp"
#include "solver/step/wire_simulation.hpp"

namespace amontons {

std::unique_ptr<Simulation> make_simulation(const Scene& scene, std::vector<Obstacle> obstacles,
                                            const SimulationOptions& options)
{
    if (!scene.beams.empty()) // solids are walls of vessels
        return std::make_unique<WireSimulation>(scene, std::move(obstacles));
    if (scene.solids.empty() && scene.rigids.empty() && scene.rods.empty())
        return std::make_unique<WireSimulation>(scene, std::move(obstacles));
    return std::make_unique<BodySimulation>(scene, std::move(obstacles), options);
}

} // namespace amontons
