#include "solver/step/plan.hpp"

#include "solver/module.hpp"
#include "solver/scene/instrument_rods.hpp"

#include <algorithm>
#include <filesystem>

namespace amontons {
namespace {

// Measured on the examples; sizes in bytes.
constexpr double kProgram = 12e6;        // code, libraries, stacks
constexpr double kPicture = 270e6;       // VTK, mapped and at work
constexpr double kPerUnknown = 2.5e3;    // state, blocks, factor and contact points of a beam
constexpr double kPerSolidUnknown = 1e4; // state, matrices, factor, columns of a solid
constexpr double kPerRigid = 5.5e4;      // state and contacts of a rigid body
constexpr double kPerTriangle = 300;     // surface, its index, running maximum, buffers of output
constexpr double kSampledWall = 15e6;    // blocks of a sampled distance along the wire's way,
constexpr double kBoundedWall = 8e6;     // of a wall whose tubes bound it where nothing is near

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
               const std::vector<Obstacle>& obstacles, const LinearPlan& linear)
{
    if (instruments_are_rods(scene))
        return make_plan(with_instruments_as_rods(scene), bodies, obstacles, linear);
    Plan plan;
    plan.linear = linear;
    const bool direct = linear.taken.empty() || linear.taken == "direct";

    // ---- Bodies, surfaces and pairs
    plan.bodies = bodies;
    for (const Obstacle& o : obstacles)
        if (const ObstacleInput* input = body_named(scene.obstacles, o.name))
            plan.surfaces.push_back({o.name, surface_facts(*input, o)});
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

    // ---- Methods used
    const bool dynamic = scene.time.kind == "dynamic";
    const auto any = [&](auto&& condition) {
        return std::any_of(scene.obstacles.begin(), scene.obstacles.end(), condition);
    };
    const auto any_solid = [&](const char* motion) {
        return std::any_of(scene.solids.begin(), scene.solids.end(), [&](const SolidInput& b) {
            return (is_hyperelastic(b) ? "hyperelastic" : b.motion) == motion;
        });
    };
    const bool beams = !scene.beams.empty(), solids = !scene.solids.empty(),
               rigids = !scene.rigids.empty();
    if (beams)
        plan.uses.push_back("geometrically exact beams, block-tridiagonal factor (O(n) a solve)");
    if (std::any_of(scene.contact.begin(), scene.contact.end(), [&](const ContactLaw& law) {
            const auto is_beam = [&](const std::string& name) {
                return std::any_of(scene.beams.begin(), scene.beams.end(),
                                   [&](const BeamInput& b) { return b.name == name; });
            };
            return is_beam(law.between[0]) && is_beam(law.between[1]);
        }))
        plan.uses.push_back("instruments in one another: their nodes in one order along their "
                            "common length, one banded factor");
    const auto any_rod = [&](const char* elements) {
        return std::any_of(scene.rods.begin(), scene.rods.end(),
                           [&](const RodInput& b) { return b.elements == elements; });
    };
    if (any_rod("exact"))
        plan.uses.push_back("rods of geometrically exact elements, block-tridiagonal factor");
    if (any_rod("corotational"))
        plan.uses.push_back("rods of corotational elements, block-tridiagonal factor");
    if (scene.time.path > 0) plan.uses.push_back("steps along the path of balances");
    if (any_solid("linear"))
        plan.uses.push_back("linear solids in frames that are fixed, driven or float with them");
    if (any_solid("corotational"))
        plan.uses.push_back("corotational solids, Newton with their exact tangent");
    if (any_solid("hyperelastic"))
        plan.uses.push_back(beams ? "hyperelastic walls: one tangent for many steps, and what it "
                                    "misses as an offset"
                                  : "hyperelastic solids, Newton with their exact tangent");
    if (solids && direct)
        plan.uses.push_back("CHOLMOD's supernodal Cholesky factor, nodes in METIS's order");
    if (rigids) plan.uses.push_back("rigid bodies, angular momentum as their state");
    if (!scene.couplings.empty()) plan.uses.push_back("joints and springs as rows of the problem");
    plan.uses.push_back(dynamic ? "implicit dynamic steps" : "quasi-static steps");
    if (!scene.contact.empty())
        plan.uses.push_back(std::string(friction ? "Signorini and Coulomb" : "Signorini") +
                            (dynamic && !beams ? " for the velocities at the end of each step"
                                               : " on the geometry at the end of each step"));
    if (scene.contact_solver.given())
        plan.uses.push_back(
            "contact problems solved by " +
            quoted_text(scene.contact_solver.command + scene.contact_solver.function));
    const auto touches = [](const auto& inputs, const std::string& name) {
        return name == "*" || std::any_of(inputs.begin(), inputs.end(),
                                          [&](const auto& b) { return b.name == name; });
    };
    const auto pair_of_solids = [&](const char* discretisation) {
        return std::any_of(scene.contact.begin(), scene.contact.end(), [&](const ContactLaw& law) {
            return law.discretisation == discretisation && touches(scene.solids, law.between[0]) &&
                   touches(scene.solids, law.between[1]);
        });
    };
    const bool several = scene.solids.size() > 1;
    if (several && pair_of_solids("mortar"))
        plan.uses.push_back("contact of solids by dual mortar functions");
    if (several && pair_of_solids("nodal")) plan.uses.push_back("contact of solids at their nodes");
    if (any([](const ObstacleInput& o) { return !is_sampled(o); }))
        plan.uses.push_back("walls in closed form");
    if (any(is_sampled)) plan.uses.push_back("walls as sampled signed distances");

    // ---- Parts left out, and why
    const auto leave = [&](bool out, const char* what, const std::string& why) {
        if (out) plan.leaves_out.push_back({what, why});
    };
    const bool vtp = any(is_vtp);
    const bool vtk_there = !find_module("vtk").empty();
    if (scene.output.picture && vtk_there)
        plan.uses.push_back("module vtk, after the run: picture");
    if (vtp) plan.uses.push_back("module vtk: surface from a .vtp file");
    leave(!vtk_there, "VTK", "its module is not installed: no picture");
    leave(vtk_there && !scene.output.picture && !vtp, "VTK", "no picture is requested");
    leave(!scene.output.plots, "gnuplot", "no plots are requested");
    leave(scene.contact.empty(), "contact detection and solver", "no pair of bodies can touch");
    leave(!friction && !scene.contact.empty(), "friction",
          "every coefficient is 0: one row a contact, not three");
    leave(!dynamic, "inertia", "time.kind is \"quasi_static\"");
    if (beams)
        leave(true, "dense Delassus operator",
              "contact forces are condensed into the beam's blocks");
    leave(!beams && scene.rods.empty(), "beams", "no wire and no rod");
    leave(!rigids, "rigid bodies that move", "none in the scene");
    if (!direct)
        plan.uses.push_back("module petsc: Krylov's methods with algebraic multigrid" +
                            std::string(linear.taken == "distributed" ? ", on all ranks" : "") +
                            "; contact by Newton's method without W");
    leave(!solids, "CHOLMOD", "no solid body");
    leave(solids && !direct, "CHOLMOD", "no factor is made");
    leave(direct, "PETSc, MPI",
          !solids                      ? "no solid body"
          : linear.requested == "auto" ? "solids are solved by factors, " + linear.why
                                       : "factors are requested");
    leave(true, "CGAL", "nothing is to be meshed");
    leave(beams,
          scene.beams.size() > 1
              ? "contact of wires with themselves, and side by side with one another"
              : "contact of a wire with itself",
          "cannot be solved yet: they would pass through");
    leave(solids, "contact of a solid with itself", "not searched for: it would pass through");

    if (scene.output.picture && !find_module("vtk").empty()) plan.picture = kPicture;
    plan.memory = linear.path(linear.taken) ? 0 : kProgram; // which a path counts, too

    // ---- Predicted memory and time
    for (const BodyPlan& b : bodies)
        plan.memory += b.kind == "solid" && !linear.paths.empty() ? 0
                       : b.kind == "solid"                        ? kPerSolidUnknown * b.unknowns
                       : b.kind == "rigid"                        ? kPerRigid
                                                                  : kPerUnknown * b.unknowns;
    if (const LinearPath* taken = linear.path(linear.taken)) plan.memory += taken->memory;
    for (const Obstacle& o : obstacles)
        plan.memory += kPerTriangle * static_cast<double>(*o.model.triangle_count);
    for (const ObstacleInput& o : scene.obstacles)
        if (is_sampled(o)) plan.memory += from_file(o) ? kSampledWall : kBoundedWall;
    if (!beams) {
        plan.path = !scene.rods.empty() ? "free motion of each body, Newton's method on the rods"
                    : solids && !direct ? "no free motion of its own"
                    : solids            ? "free motion of each body"
                                        : "free motion of the rigid bodies";
        if (!scene.contact.empty() || !scene.couplings.empty())
            plan.path += dynamic
                             ? "; contacts as the step finds them at its start, one problem for all"
                             : "; one contact problem for all, again until the geometry at the "
                               "end of the step holds";
    } else {
        plan.path = scene.contact.empty() ? "Newton on the beams"
                                          : "Newton on the beams; inside it open, stick and slip "
                                            "by pivoting with one block-tridiagonal factor a trial";
    }
    return plan;
}

} // namespace amontons
