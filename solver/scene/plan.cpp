#include "solver/scene/plan.hpp"

#include "solver/module.hpp"

#include <algorithm>
#include <filesystem>

namespace amontons {
namespace {

// Measured on the examples; sizes in bytes.
constexpr double kProgram = 12e6;     // code, libraries, stacks
constexpr double kPerUnknown = 2.5e3; // state, blocks, factor and contact points of a beam
constexpr double kPerTriangle = 300;  // surface, its index, running maximum, buffers of output
constexpr double kSampledWall = 30e6; // blocks of a sampled distance along the wire's way

bool from_file(const ObstacleInput& o)
{
    return o.surface.generate.empty();
}

bool is_sampled(const ObstacleInput& o)
{
    return from_file(o) || o.surface.generate == "vessel";
}

bool is_vtp(const ObstacleInput& o)
{
    return from_file(o) && std::filesystem::path(o.surface.file).extension() == ".vtp";
}

} // namespace

Plan make_plan(const Scene& scene, const std::vector<BodyPlan>& bodies,
               const std::vector<Obstacle>& obstacles)
{
    Plan plan;
    plan.bodies = bodies;
    bool friction = false;
    for (const ContactLaw& law : scene.contact) {
        double largest = law.friction;
        for (const BeamInput& b : scene.beams)
            if (b.name == law.between[0] || b.name == law.between[1])
                for (const BeamSegment& s : b.segments)
                    largest = std::max(largest, s.friction.value_or(0));
        friction |= largest > 0;
        plan.pairs.push_back({law.between[0], law.between[1],
                              largest > 0 ? "coulomb" : "frictionless", law.friction});
    }

    const bool dynamic = scene.time.kind == "dynamic";
    const auto any = [&](auto&& condition) {
        return std::any_of(scene.obstacles.begin(), scene.obstacles.end(), condition);
    };
    plan.uses.push_back("geometrically exact beams, block-tridiagonal factor (O(n) a solve)");
    plan.uses.push_back(dynamic ? "implicit dynamic steps" : "quasi-static steps");
    if (!scene.contact.empty())
        plan.uses.push_back(friction
                                ? "Signorini and Coulomb on the geometry at the end of each step"
                                : "Signorini on the geometry at the end of each step");
    if (any([](const ObstacleInput& o) { return !is_sampled(o); }))
        plan.uses.push_back("walls in closed form");
    if (any(is_sampled)) plan.uses.push_back("walls as sampled signed distances");

    const auto leave = [&](bool out, const char* what, const char* why) {
        if (out) plan.leaves_out.push_back({what, why});
    };
    const bool vtp = any(is_vtp);
    const bool vtk_there = !find_module("vtk").empty();
    if (scene.output.picture && vtk_there)
        plan.uses.push_back("module vtk, after the run: picture");
    if (vtp) plan.uses.push_back("module vtk: surface from a .vtp file");
    leave(!vtk_there, "VTK", "its module is not installed: no picture");
    leave(vtk_there && !scene.output.picture && !vtp, "VTK", "no picture is asked for");
    leave(!scene.output.plots, "gnuplot", "no plots are asked for");
    leave(scene.contact.empty(), "contact detection and solver", "no pair of bodies can meet");
    leave(!friction && !scene.contact.empty(), "friction",
          "every coefficient is 0: one row a contact, not three");
    leave(!dynamic, "inertia", "time.kind is \"quasi_static\"");
    leave(true, "dense Delassus operator", "contact forces are condensed into the beam's blocks");
    leave(true, "CHOLMOD", "no solid body");
    leave(true, "PETSc, MPI", "no large solid body");
    leave(true, "CGAL", "nothing is to be meshed");
    leave(true,
          scene.beams.size() > 1 ? "contact of wires with one another and with themselves"
                                 : "contact of a wire with itself",
          "cannot be solved yet: they would pass through");

    plan.memory = kProgram;
    for (const BodyPlan& b : bodies)
        plan.memory += kPerUnknown * b.unknowns;
    for (const Obstacle& o : obstacles)
        plan.memory += kPerTriangle * static_cast<double>(o.model.surface.triangles.size());
    plan.memory += kSampledWall * static_cast<double>(std::count_if(
                                      scene.obstacles.begin(), scene.obstacles.end(), is_sampled));
    plan.path = scene.contact.empty() ? "Newton on the beams"
                                      : "Newton on the beams; inside it open, stick and slip by "
                                        "pivoting with one block-tridiagonal factor a trial";
    return plan;
}

} // namespace amontons
