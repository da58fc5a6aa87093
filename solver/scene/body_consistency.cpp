#include "solver/scene/body_consistency.hpp"

#include "solver/material/law.hpp"
#include "solver/scene/instrument_rods.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace amontons {
namespace {

void check_mesh(const MeshInput& m, const std::string& place, Findings& findings)
{
    constexpr double kMostCells = 1e5; // along one side: more is a slip of the unit
    for (int axis = 0; axis < 3 && m.generate == "box"; ++axis)
        if (m.cells[axis] != std::floor(m.cells[axis]) || m.cells[axis] > kMostCells)
            findings.add({place + "/cells"}, fmt::format("{}", m.cells[axis]),
                         fmt::format("whole numbers <= {:g}", kMostCells));
    if (m.generate == "tube" && m.radius == 0 && !m.centreline.pieces.empty())
        findings.add({place + "/radius", place + "/centreline"}, "nothing",
                     "a number > 0 [m] (pieces carry no radius of their own)");
}

void check_sets(const SolidInput& b, const std::string& place, Findings& findings)
{
    for (const SetInput& s : b.sets) {
        const std::string here = place + "/sets/" + s.name;
        const int ways = int(s.box.given) + s.ball.given + s.plane.given + s.faces_like.given +
                         !s.faces.empty() + !s.nodes.empty();
        if (s.name == "all")
            findings.add({here}, "a set \"all\"", "another name: \"all\" is every node");
        if (ways != 1)
            findings.add({here}, ways == 0 ? "no place" : fmt::format("{} places", ways),
                         "one of \"box\", \"ball\", \"plane\", \"faces_like\", \"faces\", "
                         "\"nodes\"");
        if (s.within > 0 && !s.plane.given)
            findings.add({here + "/within", here + "/plane"}, fmt::format("{}", s.within),
                         "nothing without a \"plane\"");
        if (s.of == "nodes" && !s.box.given && !s.ball.given && !s.plane.given)
            findings.add({here + "/of"}, "\"nodes\"",
                         "\"faces\": only a box, a ball and a plane hold nodes inside");
    }
}

void check_material(const SolidInput& b, const std::string& place, Findings& findings)
{
    if (b.material.law.empty()) {
        if (is_hyperelastic(b) && b.poisson_ratio < 0)
            findings.add({place + "/poisson_ratio"}, fmt::format("{}", b.poisson_ratio),
                         ">= 0 of a hyperelastic solid");
    } else {
        const Hyperelastic m{find_law(b.material.law), b.material.constants};
        for (const Issue& issue : issues_of(m, "", place + "/material")) {
            std::vector<std::string> places{issue.place};
            for (const MaterialConstant& c : m.law->constants)
                places.push_back(place + "/material/" + c.name);
            findings.add(places, issue.found, issue.allowed);
        }
        if (b.motion == "corotational")
            findings.add({place + "/motion", place + "/material"}, "\"corotational\"",
                         "\"hyperelastic\" beside a material");
        if (b.youngs_modulus != 0 || b.poisson_ratio != 0)
            findings.add({place + "/material", place + "/youngs_modulus", place + "/poisson_ratio"},
                         "a material, and constants beside it",
                         "either \"material\", or \"youngs_modulus\" and \"poisson_ratio\"");
    }
    if (is_hyperelastic(b) && b.stiffness_damping > 0)
        findings.add({place + "/stiffness_damping"}, fmt::format("{}", b.stiffness_damping),
                     "0 of a hyperelastic solid: it would resist turns");
}

void check_solid(const SolidInput& b, const Scene& scene, Findings& findings)
{
    const std::string place = "/bodies/" + b.name;
    check_mesh(b.mesh, place + "/mesh", findings);
    check_sets(b, place, findings);
    check_material(b, place, findings);
    if (scene.time.kind == "dynamic" && !(b.density > 0))
        findings.add({place + "/density", "/time/kind"}, "nothing",
                     "a number > 0 [kg/m^3]: time.kind is \"dynamic\"");
    if (b.drive.given && b.hold.empty())
        findings.add({place + "/drive"}, "a drive without \"hold\"",
                     "\"hold\" with the sets that are fixed to what drives the body");
    for (const ProbeInput& p : b.probes)
        if (int(bool(p.at)) + !p.set.empty() + p.line.given > 1)
            findings.add({place + "/probes/" + p.name}, "several places",
                         "one of \"at\", \"set\" and \"line\"");
    if (b.drive.given && !b.supports.empty())
        findings.add({place + "/drive", place + "/supports"}, "a drive and supports",
                     "one of the two: supports hold a body where it began (a \"hold\" with x, y, z "
                     "moves a set against them)");
    for (std::size_t i = 0; i < b.supports.size(); ++i)
        if (b.supports[i].normal == 0 && b.supports[i].tangential == 0)
            findings.add({fmt::format("{}/supports/{}", place, i)}, "a support of nothing",
                         "\"normal\" or \"tangential\" > 0 [N/m^3]");
    for (std::size_t i = 0; i < b.hold.size(); ++i) {
        const HoldInput& h = b.hold[i];
        const std::string here = fmt::format("{}/hold/{}", place, i);
        if (!h.angle.empty() && h.gradient)
            findings.add({here + "/angle", here + "/gradient"}, "a turn and a gradient",
                         "one of the two");
        if (!h.over.empty() && !h.gradient)
            findings.add({here + "/over"}, "a factor on nothing", "a \"gradient\" beside it");
        if (!h.affine() && !h.about.isZero(0))
            findings.add({here + "/about"}, "a place for nothing",
                         "an \"angle\" or a \"gradient\" beside it");
    }
    for (std::size_t i = 0; i < b.hold.size(); ++i)
        if (b.hold[i].axes != b.hold[0].axes && !b.start.turn.isZero(0))
            findings.add({fmt::format("{}/hold/{}/axes", place, i)}, quoted_text(b.hold[i].axes),
                         quoted_text(b.hold[0].axes) +
                             " as of the body's first hold, since it begins turned");
    for (std::size_t i = 0; i < b.loads.size(); ++i) {
        const LoadInput& l = b.loads[i];
        const std::string here = fmt::format("{}/loads/{}", place, i);
        if (l.pressure.empty() && l.volume.empty() && !l.traction && !l.force)
            findings.add({here}, "a load of nothing", "\"pressure\", \"traction\" or \"force\"");
        if (!l.volume.empty() && !l.pressure.empty())
            findings.add({here}, "a volume and a pressure", "one of the two");
        if (!l.volume.empty() && (!is_hyperelastic(b) || scene.time.kind == "dynamic"))
            findings.add({here + "/volume"}, "a volume",
                         "\"pressure\": volumes are of hyperelastic solids in quasi-static steps");
    }
}

void check_rigid(const RigidInput& b, const Scene& scene, Findings& findings)
{
    const std::string place = "/bodies/" + b.name;
    const bool mass = b.mass.has_value() || b.density > 0;
    if (b.mass && b.density > 0)
        findings.add({place + "/mass", place + "/density"}, "a mass and a density",
                     "either \"mass\" or \"density\"");
    if (b.inertia) {
        constexpr double kRounding = 1e-9; // a flat body has the sum itself
        const Vec3& i = *b.inertia;
        if (i.sum() * (1 + kRounding) < 2 * i.maxCoeff())
            findings.add({place + "/inertia"}, fmt::format("[{}, {}, {}]", i[0], i[1], i[2]),
                         "none above the sum of the other two: no body has such an inertia");
    }
    if (scene.time.kind == "dynamic" && !mass && !b.drive.given)
        findings.add({place + "/mass", place + "/density", "/time/kind"}, "nothing",
                     "a mass > 0 [kg] or a density > 0 [kg/m^3]: time.kind is \"dynamic\"");
}

/// Joints act on patches of solids, never on single nodes.
void check_patches(const CouplingInput& c, const Scene& scene, const std::string& place,
                   Findings& findings)
{
    const bool solid[] = {body_named(scene.solids, c.between[0]) != nullptr,
                          body_named(scene.solids, c.between[1]) != nullptr};
    const bool both = solid[0] && solid[1], one = solid[0] || solid[1];
    for (std::size_t k = 0; k < 2; ++k) {
        const bool second = k == 1 && both;
        if (!solid[k] || c.radius > 0 || !(second ? c.to_set : c.set).empty()) continue;
        findings.add({place + (second ? "/to_set" : "/set"), place + "/radius"}, "nothing",
                     fmt::format("\"{}\": a set of faces of \"{}\", or \"radius\" [m] about "
                                 "\"{}\": joints and springs act on a patch of a solid",
                                 second ? "to_set" : "set", c.between[k],
                                 k == 1 && c.to ? "to" : "at"));
    }
    if (!c.to_set.empty() && !both)
        findings.add({place + "/to_set"}, quoted_text(c.to_set),
                     one ? "\"set\": one of the two bodies is a solid" : "two solids");
    if (!one && !c.set.empty())
        findings.add({place + "/set"}, quoted_text(c.set), "a solid: other bodies have no sets");
    if (!one && c.radius > 0)
        findings.add({place + "/radius"}, fmt::format("{:g}", c.radius),
                     "a solid: other bodies are held at the place itself");
    const bool all_named = !c.set.empty() && (!both || !c.to_set.empty());
    if (one && all_named && c.radius > 0)
        findings.add({place + "/set", place + "/radius"},
                     fmt::format("{} and {:g}", quoted_text(c.set), c.radius),
                     "either a set or a radius");
}

void check_couplings(const Scene& scene, Findings& findings)
{
    for (std::size_t i = 0; i < scene.couplings.size(); ++i) {
        const CouplingInput& c = scene.couplings[i];
        const std::string place = fmt::format("/couplings/{}", i);
        for (std::size_t k = 0; k < 2; ++k) {
            const std::string& name = c.between[k];
            if (k == 1 && name == "world") continue;
            if (std::find(scene.order.begin(), scene.order.end(), name) != scene.order.end())
                continue;
            const std::string near = nearest_name(name, scene.order);
            findings.add({fmt::format("{}/between/{}", place, k)}, quoted_text(name),
                         near.empty() ? "a body of the scene"
                                      : quoted_text(near) + " (nearest name)");
        }
        if (c.between[0] == c.between[1])
            findings.add({place + "/between"}, "a body and itself", "two bodies");
        check_patches(c, scene, place, findings);
        const bool turns = c.kind == "turn_spring",
                   line = c.kind == "spring" || c.kind == "distance";
        const bool springs = turns || c.kind == "spring";
        if (springs && !(c.stiffness > 0))
            findings.add({place + "/stiffness"}, "nothing",
                         fmt::format("a number > 0 [{}] of a {}", turns ? "N m/rad" : "N/m",
                                     turns ? "turn spring" : "spring"));
        if (line && !c.to)
            findings.add({place + "/to"}, "nothing",
                         fmt::format("the {}'s end on the second body [m]", c.kind));
        if (c.kind == "distance" && c.to) {
            const double length = (c.at - *c.to).norm(), specified = c.length.value_or(length);
            constexpr double kSame = 1e-6;
            if (!(length > 0))
                findings.add({place + "/to"}, "the place of `at`",
                             "another place: a distance of 0 m is a joint of kind \"ball\"");
            else if (std::abs(specified - length) > kSame * length)
                findings.add({place + "/length"}, fmt::format("{:g}", specified),
                             fmt::format("{:g} [m], the distance of `at` and `to`", length));
        }
        if (c.damping > 0 && !springs)
            findings.add({place + "/damping"}, fmt::format("{:g}", c.damping),
                         fmt::format("0, of a {}: springs have it", c.kind));
        if (c.damping > 0 && springs && scene.time.kind != "dynamic")
            findings.add({place + "/damping", "/time/kind"}, fmt::format("{:g}", c.damping),
                         "0, or time.kind \"dynamic\": at rest nothing is damped");
        if (turns && std::ranges::none_of(scene.couplings, [&](const CouplingInput& h) {
                constexpr double kParallel = 1e-9;
                const bool same = h.between == c.between ||
                                  (h.between[0] == c.between[1] && h.between[1] == c.between[0]);
                return h.kind == "hinge" && same &&
                       h.axis.normalized().cross(c.axis.normalized()).norm() <= kParallel;
            }))
            findings.add({place + "/axis"},
                         fmt::format("[{:g}, {:g}, {:g}]", c.axis.x(), c.axis.y(), c.axis.z()),
                         "the axis of a coupling of kind \"hinge\" between the same two bodies");
    }
}

} // namespace

void check_bodies(const Scene& scene, Findings& findings)
{
    for (const SolidInput& b : scene.solids)
        check_solid(b, scene, findings);
    for (const RigidInput& b : scene.rigids)
        check_rigid(b, scene, findings);
    check_couplings(scene, findings);
    if (!scene.contact_solver.command.empty() && !scene.contact_solver.function.empty())
        findings.add({"/contact_solver/function", "/contact_solver/command"},
                     quoted_text(scene.contact_solver.function) + " beside a command",
                     "either of them");
    if (scene.contact_solver.given() && scene.solids.empty() && scene.rigids.empty())
        findings.add({"/contact_solver"}, "a scene of beams or rods alone",
                     "a scene with solids or rigid bodies: contact of beams and rods is found in "
                     "Newton's method for their balance, and there is no problem to hand over");
    else if (scene.contact_solver.given() && !scene.beams.empty() && !instruments_are_rods(scene))
        findings.add({"/contact_solver"}, "a scene of beams",
                     "a scene without beams: their contact is found in Newton's method for their "
                     "balance, and there is no problem to hand over");
    if (scene.contact_solver.given() && scene.accuracy.solver != "auto")
        findings.add({"/accuracy/solver", "/contact_solver"},
                     quoted_text(scene.accuracy.solver) + " beside contact_solver",
                     "either of them");
    if (scene.time.kind != "dynamic")
        for (std::size_t i = 0; i < scene.contact.size(); ++i)
            if (scene.contact[i].restitution > 0)
                findings.add({fmt::format("/contact/{}/restitution", i), "/time/kind"},
                             fmt::format("{}", scene.contact[i].restitution),
                             "0, or \"kind\": \"dynamic\"");
}

} // namespace amontons
