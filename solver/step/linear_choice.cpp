#include "solver/step/linear_choice.hpp"

#include "contact/rigid/shape_distance.hpp"
#include "mesh/box_tree.hpp"
#include "solver/body/drive.hpp"
#include "solver/body/solid_body.hpp"
#include "solver/large/large_matrix.hpp"
#include "solver/step/body_build.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

namespace amontons {
namespace {

constexpr double kTouchingShare = 1.0 / 6; // of an outside: what of it touches itself, at most
constexpr double kMostTouching = 1.0 / 2;  // the same of all bodies that it touches, together
constexpr std::size_t kFewNodes = 2000;    // of a mesh: below, a factor is faster whatever touches
constexpr double kNearShare = 0.01;        // of the smaller body: what is so near may touch, too

/// Whether every axis is prescribed somewhere. What is left free all the same (three nodes in a
/// row) shows when the body is made.
bool is_apparently_held(const SolidInput& input)
{
    bool axis[3] = {false, false, false};
    for (const HoldInput& h : input.hold) {
        const bool all = h.x.empty() && h.y.empty() && h.z.empty();
        axis[0] |= all || !h.x.empty();
        axis[1] |= all || !h.y.empty();
        axis[2] |= all || !h.z.empty();
    }
    return axis[0] && axis[1] && axis[2];
}

/// Whether a body of that name (or, for "*", some other one than `but`) moves under contact.
bool is_compliant(const Scene& scene, const std::string& name, const std::string& but)
{
    const auto meant = [&](const std::string& other) {
        return name == "*" ? other != but : other == name;
    };
    return std::ranges::any_of(scene.solids, [&](const SolidInput& s) { return meant(s.name); }) ||
           std::ranges::any_of(scene.rods, [&](const RodInput& r) { return meant(r.name); }) ||
           std::ranges::any_of(
               scene.rigids, [&](const RigidInput& r) { return meant(r.name) && !r.drive.given; });
}

/// Distance from a box [m].
double away_from(const AxisBox& box, const Vec3& x)
{
    return (box.low - x).cwiseMax(x - box.high).cwiseMax(0).norm();
}

/// How many nodes of a solid's side of a pair may touch at once: those that are about as near to
/// the other side as the nearest one, where the run begins. A body that slides or rolls has as many
/// later.
double touching_nodes(const Scene& scene, std::span<const SolidInput> solids,
                      const std::vector<VolumeMesh>& meshes, const std::vector<Obstacle>& obstacles,
                      std::size_t i, const ContactSurface& surface, const std::string& other)
{
    const SolidInput& own = solids[i];
    const VolumeMesh& mesh = meshes[i];
    const auto& nodes = surface.outside.used_nodes;
    const double share = kTouchingShare * double(nodes.size());
    if (mesh.nodes.size() < kFewNodes) return share;
    const Placement at = start_placement(own.start);
    std::vector<Vec3> x;
    BoundingBox all;
    for (const std::int32_t node : nodes) {
        x.push_back(at * mesh.nodes[std::size_t(node)]);
        all.add(x.back());
    }
    if (x.empty() || other == own.name) return share;
    double size = (all.high - all.low).matrix().norm();
    std::function<double(const Vec3&)> away;
    const auto from_box = [&](const AxisBox& box) {
        size = std::min(size, (box.high - box.low).norm());
        away = [box](const Vec3& p) { return away_from(box, p); };
    };
    for (std::size_t k = 0; k < solids.size(); ++k)
        if (solids[k].name == other) {
            BoundingBox box;
            const Placement there = start_placement(solids[k].start);
            for (const Vec3& node : meshes[k].nodes)
                box.add(there * node);
            from_box({box.low, box.high});
        }
    for (const Obstacle& o : obstacles)
        if (o.name == other)
            away = [&wall = o.model.wall, hint = WallHint()](const Vec3& p) mutable {
                const double clear = wall.clearance(p, hint);
                return clear > 0 ? clear : wall.distance(p, hint);
            };
    for (const RigidInput& r : scene.rigids)
        if (r.name == other) {
            std::vector<Issue> reported_by_build_bodies;
            const RigidShape shape = build_shape(r.shape, scene, reported_by_build_bodies);
            const Placement there = start_placement(r.start);
            const Pose pose{there.shift, there.turn};
            from_box(axis_box(shape, pose));
            if (is_round(shape) || std::holds_alternative<Box>(shape))
                away = [shape, there, near = std::int32_t(-1)](const Vec3& p) mutable {
                    return shape_distance(shape, there.turn.conjugate() * (p - there.shift), near)
                        .distance;
                };
        }
    if (!away) return share; // of rods
    double least = std::numeric_limits<double>::infinity();
    std::vector<double> d;
    for (const Vec3& p : x) {
        d.push_back(away(p));
        least = std::min(least, d.back());
    }
    const double near = std::max(least, 0.0) + kNearShare * size;
    return double(std::ranges::count_if(d, [&](double own_d) { return own_d <= near; }));
}

} // namespace

LinearPlan choose_linear(const Scene& scene, std::span<const SolidInput> solids,
                         const std::vector<VolumeMesh>& meshes,
                         const std::vector<Obstacle>& obstacles, std::span<const ContactLaw> laws,
                         std::span<const std::array<const ContactSurface*, 2>> surfaces, bool all)
{
    if (meshes.empty()) return {};
    std::vector<SolidSize> sizes;
    double friction = 0;
    for (const ContactLaw& law : scene.contact)
        friction = std::max(friction, law.friction);
    const auto outside_of = [&](std::size_t i) -> const ContactSurface* {
        for (std::size_t k = 0; k < laws.size(); ++k)
            for (std::size_t side = 0; side < 2; ++side)
                if (laws[k].between[side] == scene.solids[i].name && surfaces[k][side])
                    return surfaces[k][side];
        return nullptr;
    };
    for (std::size_t i = 0; i < meshes.size(); ++i) {
        const SolidInput& input = scene.solids[i];
        SolidSize s;
        s.name = input.name;
        s.mesh = &meshes[i];
        for (std::size_t k = 0; k < laws.size(); ++k)
            for (std::size_t side = 0; side < 2; ++side)
                if (laws[k].between[side] == input.name && surfaces[k][side])
                    s.rows += (friction > 0 ? 3 : 1) *
                              touching_nodes(scene, solids, meshes, obstacles, i,
                                             *surfaces[k][side], laws[k].between[1 - side]);
        // However many bodies it may touch, it has one outside.
        if (const ContactSurface* outside = outside_of(i))
            s.rows = std::min(s.rows, (friction > 0 ? 3.0 : 1.0) * kMostTouching *
                                          double(outside->outside.used_nodes.size()));
        s.friction = friction > 0;
        s.material = {input.youngs_modulus, input.poisson_ratio, input.density};
        if (scene.time.kind == "dynamic")
            std::tie(s.of_mass, s.of_stiffness) =
                matrix_shares(time_rule(scene.time), scene.time.step, input.mass_damping,
                              input.stiffness_damping);
        s.held = [&input, &mesh = meshes[i], &file = scene.file] {
            std::vector<std::int32_t> dofs;
            for (const SolidConditions::Held& held : find_conditions(input, mesh, file).held)
                dofs.push_back(held.dof);
            return dofs;
        };
        // What is compliant on both sides, or joints, need W.
        s.columns = !scene.couplings.empty();
        for (const ContactLaw& law : scene.contact)
            for (std::size_t side = 0; side < 2; ++side)
                if (law.between[side] == input.name || law.between[side] == "*")
                    s.columns |= is_compliant(scene, law.between[1 - side], input.name);
        if (scene.contact_solver.given())
            s.only_direct = "contact_solver is given W, which factors make";
        else if (scene.haptic.given)
            s.only_direct = "a hand holds a body: its operator is condensed by factors";
        else if (input.motion != "linear" || is_hyperelastic(input))
            s.only_direct = input.name + " is not linear: its matrix changes in every iteration";
        else if (!input.supports.empty())
            s.only_direct = input.name + " has supports, which only factors include";
        else if (scene.time.kind != "dynamic" && !is_apparently_held(input))
            s.only_direct = input.name + " is held by its contacts alone";
        sizes.push_back(std::move(s));
    }
    const double steps = scene.time.step > 0 ? std::ceil(scene.time.end / scene.time.step) : 1;
    return plan_linear(sizes, scene.solver.linear, scene.time.kind == "dynamic", steps,
                       parallel_ranks(), all);
}

} // namespace amontons
