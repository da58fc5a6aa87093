#pragma once

#include "solver/step/tests/keep.hpp"
#include "solver/step/wire_simulation.hpp"

// A wire in a vessel of small size, for tests.

namespace amontons {

/// A wire pushed into a tube of radius 5 mm with a bend of 90 degrees; rigid, or a wall of 1.5 mm.
inline Scene vessel_scene(double E, double mu, double depth, double stiffness = 1)
{
    Scene scene;
    scene.file = "test.json";
    CentrelineInput line;
    line.pieces.resize(3);
    line.pieces[0].length = 0.02;
    line.pieces[1].radius = 0.03;
    line.pieces[1].angle = 1.5707963267948966;
    line.pieces[2].length = 0.03;
    scene.order = {"vessel", "wire"};
    SolidInput vessel;
    vessel.name = "vessel";
    vessel.mesh.generate = "tube";
    vessel.mesh.centreline = line;
    vessel.mesh.radius = 0.005;
    vessel.mesh.thickness = 0.0015;
    vessel.mesh.around = 16;
    vessel.mesh.along = 40;
    vessel.mesh.through = 1;
    vessel.mesh.element = "H8";
    vessel.youngs_modulus = E * stiffness;
    vessel.poisson_ratio = 0.45;
    vessel.hold.resize(2);
    vessel.hold[0].set = "start";
    vessel.hold[1].set = "end";
    scene.solids = {vessel};
    BeamInput wire;
    wire.name = "wire";
    BeamSegment g;
    g.length = 0.12;
    g.radius = 4.445e-4;
    g.EI = {5.2e-4 * stiffness, 5.2e-4 * stiffness};
    g.GJ = {4e-4 * stiffness, 4e-4 * stiffness};
    g.EA = {5000 * stiffness, 5000 * stiffness};
    g.element = 2.5e-3;
    wire.segments = {g};
    wire.insertion = {{0, 0}, {1, depth}};
    scene.beams = {wire};
    scene.contact = {{{"wire", "vessel"}, mu}};
    scene.time.step = 1e-3 / depth; // 1 mm
    scene.time.end = 1;
    return scene;
}

struct Run {
    RunSummary summary;
    Keep keep;
    std::vector<BodyRecord> bodies;
};

inline Run run(const Scene& scene, std::vector<Obstacle> obstacles = {})
{
    Run r;
    std::atomic<bool> never{false};
    WireSimulation s(scene, std::move(obstacles));
    r.summary = s.run(r.keep, never);
    r.bodies = s.body_records();
    for (BodyRecord& b : r.bodies)
        b.elements = nullptr; // follows the simulation
    return r;
}

} // namespace amontons
