#include "solver/record/contact_bodies.hpp"

#include "solver/scene/instrument_rods.hpp"

namespace amontons {

ContactBodies contact_bodies(const Scene& scene)
{
    ContactBodies bodies;
    const auto add = [&](const std::string& name, const char* kind) {
        bodies.names.push_back(name);
        bodies.kinds.emplace_back(kind);
    };
    for (const ObstacleInput& o : scene.obstacles)
        add(o.name, "obstacle");
    const bool rods = instruments_are_rods(scene);
    for (const BeamInput& b : scene.beams)
        if (!rods) add(b.name, "beam");
    for (const std::string& name : scene.order)
        if (rods && body_named(scene.beams, name))
            add(name, "beam");
        else if (body_named(scene.solids, name))
            add(name, "solid");
        else if (body_named(scene.rigids, name))
            add(name, "rigid");
        else if (body_named(scene.rods, name))
            add(name, "rod");
    return bodies;
}

} // namespace amontons
