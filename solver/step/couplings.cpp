#include "solver/step/couplings.hpp"

#include "solver/body/rigid_body.hpp"
#include "solver/body/rod_body.hpp"
#include "solver/body/solid_body.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <numbers>
#include <optional>

namespace amontons {
namespace {

/// The pose of an anchor's patch.
PatchPose pose_at_anchor(const std::vector<BodyRef>& bodies, const CoupledPlace& anchor)
{
    return patch_pose(*anchor.patch, bodies[std::size_t(anchor.body)].solid->places());
}

/// Rotation and place of the body that an anchor is fixed to.
/// @param pose  of its patch, if it has one
JointFrames::Frame frame_of(const std::vector<BodyRef>& bodies, const CoupledPlace& anchor,
                            const PatchPose* pose)
{
    JointFrames::Frame f;
    if (anchor.body < 0) return f;
    if (pose) {
        f = {Eigen::Quaterniond(pose->turn), pose->turn, pose->centre};
        return f;
    }
    const BodyRef& b = bodies[std::size_t(anchor.body)];
    const Placement p = b.rod ? b.rod->node_pose(anchor.node) : b.rigid->placement();
    f = {p.turn, p.turn.toRotationMatrix(), p.shift};
    return f;
}

void find_frames(const std::vector<BodyRef>& bodies, const Coupling& c, JointFrames& frames)
{
    frames.input = c.input;
    frames.poses.clear();
    for (const CoupledPlace* anchor : {&c.a, &c.b})
        if (anchor->patch) frames.poses.push_back(pose_at_anchor(bodies, *anchor));
    frames.a = frame_of(bodies, c.a, c.a.patch ? &frames.poses.front() : nullptr);
    frames.b = frame_of(bodies, c.b, c.b.patch ? &frames.poses.back() : nullptr);
}

/// How a body has turned where an anchor is.
Eigen::Quaterniond turn_of(const std::vector<BodyRef>& bodies, const CoupledPlace& anchor,
                           const PatchPose* pose)
{
    return frame_of(bodies, anchor, pose).turn;
}

/// Arms of the places where a row's forces act.
void find_arms(const Coupling& c, CouplingRow& row)
{
    if (c.a.patch) row.arm_a = row.point_a - row.poses.front().centre;
    if (c.b.patch) row.arm_b = row.point_b - row.poses.back().centre;
}

} // namespace

CouplingRow coupling_row(const std::vector<BodyRef>& bodies, const Coupling& c, double known)
{
    JointFrames frames;
    CouplingRow row;
    find_row(bodies, c, known, frames, row);
    return row;
}

void find_row(const std::vector<BodyRef>& bodies, const Coupling& c, double known,
              JointFrames& frames, CouplingRow& row)
{
    if (frames.input != c.input) find_frames(bodies, c, frames);
    row.poses = frames.poses;
    if (c.square) {
        const Vec3 a = frames.a.R * c.axis, b = frames.b.R * c.axis_b;
        row.turns = true;
        row.point_a = row.point_b = Vec3::Zero();
        row.axis_a = a;
        row.axis_b = b;
        row.direction = c.arm * a.cross(b);
        row.value = c.arm * a.dot(b);
        return;
    }
    if (c.turns) { // of the turn of a against b what is about the axis
        const Eigen::Quaterniond turned = frames.b.turn.conjugate() * frames.a.turn * c.turn;
        row.turns = true;
        row.point_a = row.point_b = Vec3::Zero();
        row.direction = frames.a.R * c.axis;
        // Along the axis as b has it: where a hinge holds the two, both have the same.
        const Vec3 axis = c.turn.conjugate() * c.axis;
        row.value = 2 * std::atan2(turned.vec().dot(axis), turned.w()) - c.rest;
        constexpr double kWhole = 2 * std::numbers::pi;
        row.value += kWhole * std::round((known - row.value) / kWhole);
        return;
    }
    row.point_a = frames.a.shift + frames.a.R * c.a.local;
    row.point_b = frames.b.shift + frames.b.R * c.b.local;
    const Vec3 between = row.point_a - row.point_b;
    row.direction = frames.a.R * c.axis;
    if (c.along_line) {
        row.length = between.norm();
        if (row.length > 0) row.direction = between / row.length;
    }
    row.value = row.direction.dot(between) - c.rest;
    // A direction that turns with a, of a place that slides along it: the row's derivative by a's
    // turn is that of a's place at b. Two places would make a couple of the row's two forces.
    if (!c.along_line) row.point_a = row.point_b;
    find_arms(c, row);
}

void row_between(const Coupling& c, const CouplingRow& start, CouplingRow& row)
{
    if (c.square) // a'.b' - a.b = (a' + a)/2 . (b' - b) + (b' + b)/2 . (a' - a)
        row.direction = 0.25 * c.arm * (start.axis_a + row.axis_a).cross(start.axis_b + row.axis_b);
    const double lengths = start.length + row.length;
    if (!c.along_line && !c.square)
        row.direction = (start.direction + row.direction).normalized();
    else if (c.along_line && lengths > 0) // |x'|^2 - |x|^2 = (x' + x) . (x' - x)
        row.direction = (start.length * start.direction + row.length * row.direction) / lengths;
    row.point_a = 0.5 * (start.point_a + row.point_a);
    row.point_b = 0.5 * (start.point_b + row.point_b);
    for (std::size_t i = 0; i < row.poses.size(); ++i)
        row.poses[i] = pose_between(start.poses[i], row.poses[i]);
    find_arms(c, row);
}

SpringRow spring_row(const Coupling& c, const TimeRule& rule, double h,
                     const CouplingMemory& before, double value)
{
    const double k = 1 / c.softness, own = k * rule.end + c.damping / h;
    const double past = rule.past(before.value, before.filtered);
    return {value + (k * past - c.damping / h * before.value) / own, 1 / (h * own)};
}

double spring_energy(const std::vector<Coupling>& couplings,
                     const std::vector<CouplingMemory>& memory)
{
    double sum = 0;
    for (std::size_t c = 0; c < couplings.size(); ++c)
        if (couplings[c].softness > 0)
            sum += 0.5 * memory[c].value * memory[c].value / couplings[c].softness;
    return sum;
}

std::vector<CouplingMemory> begin_memory(const std::vector<BodyRef>& bodies,
                                         const std::vector<Coupling>& couplings)
{
    std::vector<CouplingMemory> memory;
    for (const Coupling& c : couplings) {
        const double value = coupling_row(bodies, c).value;
        memory.push_back({value, value});
    }
    return memory;
}

namespace {

/// The patches of a scene's couplings, each made once.
struct Patches {
    const Scene& scene;
    const std::vector<BodyRef>& bodies;
    std::vector<std::unique_ptr<Patch>>& all;
    std::vector<Issue>& issues;

    /// @param side  of the coupling: 0 or 1
    /// @param x     where the joint is [m]
    const Patch* find(std::size_t k, std::size_t side, const BodyRef& body, const Vec3& x)
    {
        const CouplingInput& c = scene.couplings[k];
        const VolumeMesh& mesh = body.solid->mesh();
        const Placement frame = body.solid->frame();
        const Vec3 at = frame.turn.conjugate() * (x - frame.shift); // at rest
        const std::string name = std::string(side == 1 && c.to ? "to" : "at");
        const auto refuse = [&](const std::string& field, std::string found, std::string allowed) {
            issues.push_back({scene.file, fmt::format("/couplings/{}/{}", k, field),
                              std::move(found), std::move(allowed)});
        };
        const ExternalSurface outside = extract_surface(mesh);
        const double away = distance_to_faces(mesh, outside.faces, at);
        const std::string far = fmt::format("a place {:.3g} m from \"{}\"", away, body.name);
        const bool second = side == 1 && body_named(scene.solids, c.between[0]);
        const std::string &set = second ? c.to_set : c.set, field = second ? "to_set" : "set";
        if (set.empty()) {
            if (!(away <= c.radius)) {
                refuse(
                    name, far,
                    fmt::format("a place no farther than the radius of {:.3g} m from its outside",
                                c.radius));
                return nullptr;
            }
            return keep(body, patch_within(mesh, outside, at, c.radius));
        }
        const FaceSet* faces = find_set(mesh.face_sets, set);
        if (!faces || faces->members.empty()) {
            std::vector<std::string> names;
            for (const FaceSet& f : mesh.face_sets)
                names.push_back(f.name);
            std::string list;
            for (const std::string& n : names)
                list += (list.empty() ? "one of " : ", ") + quoted_text(n);
            const std::string near = nearest_name(set, names);
            const bool nodes = find_set(mesh.node_sets, set) != nullptr;
            refuse(field,
                   quoted_text(set) + (nodes   ? ", a set of nodes"
                                       : faces ? ", an empty set"
                                               : ""),
                   names.empty()           ? "\"radius\": the mesh has no set of faces"
                   : near.empty() || nodes ? "a set of faces of the mesh: " + list
                                           : quoted_text(near) + " (nearest name)");
            return nullptr;
        }
        if (away > 0.5 * body.body->size()) {
            refuse(name, far, "a place on or in the body");
            return nullptr;
        }
        return keep(body, patch_of_faces(mesh, faces->members));
    }
    const Patch* keep(const BodyRef& body, Patch patch)
    {
        all.push_back(std::make_unique<Patch>(std::move(patch)));
        body.solid->also_touch(*all.back());
        return all.back().get();
    }
};

/// The node of a rod that a coupling holds; -1: the place is none of the rod's.
int node_of_rod(const Scene& scene, std::size_t k, const char* field, const BodyRef& body,
                const Vec3& x, std::vector<Issue>& issues)
{
    constexpr double kMore = 1e-6; // of the radius: rounding of what a user has computed
    const RodBody& rod = *body.rod;
    const RodBody::Nearest near = rod.nearest(x);
    const auto refuse = [&](std::string found, std::string allowed) {
        issues.push_back({scene.file, fmt::format("/couplings/{}/{}", k, field), std::move(found),
                          std::move(allowed)});
        return -1;
    };
    if (!(near.distance <= near.radius * (1 + kMore))) {
        const Vec3 node = rod.first_nodes()[std::size_t(near.node)].position();
        return refuse(
            fmt::format("a place {:.3g} m from the middle line of \"{}\"", near.distance,
                        body.name),
            fmt::format("a place on the rod, no farther from its middle line than its radius of "
                        "{:.3g} m: its nearest node is at ({:.6g}, {:.6g}, {:.6g})",
                        near.radius, node.x(), node.y(), node.z()));
    }
    if (rod.starts_in_sheath(near.node))
        return refuse(
            fmt::format("a place of \"{}\" that its sheath holds at some time, {:.4g} m from its "
                        "start and {:.4g} m from its tip",
                        body.name, near.s, rod.model().length - near.s),
            "a place of the rod that stays out of its sheath, by half an element");
    return near.node;
}

} // namespace

std::vector<Coupling> make_couplings(const Scene& scene, const std::vector<BodyRef>& bodies,
                                     std::vector<std::unique_ptr<Patch>>& patches)
{
    std::vector<Coupling> rows;
    std::vector<Issue> issues;
    Patches find_patch{scene, bodies, patches, issues};

    // ---- Both sides of every coupling
    struct Sides {
        std::array<int, 2> body{-1, -1};
        std::array<const Patch*, 2> patch{nullptr, nullptr};
        std::array<int, 2> node{-1, -1};
    };
    std::vector<Sides> all(scene.couplings.size());
    for (std::size_t k = 0; k < all.size(); ++k) { // all before a row: they specify where pins are
        const CouplingInput& c = scene.couplings[k];
        for (std::size_t s = 0; s < 2; ++s) {
            for (std::size_t b = 0; b < bodies.size(); ++b)
                if (bodies[b].name == c.between[s]) all[k].body[s] = int(b);
            if (all[k].body[s] < 0) continue;
            const BodyRef& body = bodies[std::size_t(all[k].body[s])];
            const Vec3 x = s == 1 && c.to ? *c.to : c.at;
            if (body.solid) all[k].patch[s] = find_patch.find(k, s, body, x);
            if (body.rod)
                all[k].node[s] =
                    node_of_rod(scene, k, s == 1 && c.to ? "to" : "at", body, x, issues);
        }
    }
    if (!issues.empty()) throw InputError(std::move(issues));

    // ---- Rows of each coupling by its kind
    for (std::size_t k = 0; k < scene.couplings.size(); ++k) {
        const CouplingInput& c = scene.couplings[k];
        const bool slides = c.kind == "slider";
        double size = 1;
        for (const int b : all[k].body)
            if (b >= 0) size = bodies[std::size_t(b)].body->size();
        std::array<std::optional<PatchPose>, 2> pose;
        for (std::size_t s = 0; s < 2; ++s)
            if (all[k].patch[s])
                pose[s] = pose_at_anchor(bodies, {all[k].body[s], Vec3::Zero(), all[k].patch[s]});
        const auto pose_at = [&](std::size_t s) { return pose[s] ? &*pose[s] : nullptr; };
        const auto anchor = [&](std::size_t s, const Vec3& x) {
            CoupledPlace a{all[k].body[s], x, all[k].patch[s], all[k].node[s], {}};
            if (a.body < 0) return a;
            if (const RodBody* rod = bodies[std::size_t(a.body)].rod) {
                a.on_rod = rod->place_of_node(a.node);
                const Placement p = rod->node_pose(a.node);
                a.local = p.turn.conjugate() * (x - p.shift);
                return a;
            }
            if (pose[s]) {
                a.local = pose[s]->turn.transpose() * (x - pose[s]->centre);
                return a;
            }
            const Placement p = bodies[std::size_t(a.body)].rigid->placement();
            a.local = p.turn.conjugate() * (x - p.shift);
            return a;
        };
        const auto row_at = [&](const Vec3& a, const Vec3& b, const Vec3& axis) {
            Coupling row;
            row.a = anchor(0, a);
            row.b = anchor(1, b);
            row.axis = turn_of(bodies, row.a, pose_at(0)).conjugate() * axis;
            row.slides = slides;
            row.input = int(k);
            return row;
        };
        const auto add = [&](const Vec3& x, const Vec3& axis) {
            rows.push_back(row_at(x, x, axis));
        };
        const Vec3 n = c.axis.normalized();
        const Vec3 s = n.unitOrthogonal(), t = n.cross(s);
        const double arm = 0.25 * size; // between the points that stop turns
        if (c.kind == "turn_spring") {
            Coupling row = row_at(c.at, c.at, n);
            row.turns = true;
            row.turn =
                turn_of(bodies, row.a, pose_at(0)).conjugate() * turn_of(bodies, row.b, pose_at(1));
            row.axis = turn_of(bodies, row.a, pose_at(0)).conjugate() * n;
            row.softness = 1 / c.stiffness;
            row.damping = c.damping;
            rows.push_back(row);
            continue;
        }
        if (c.kind == "spring" || c.kind == "distance") {
            const double length = (c.at - *c.to).norm();
            Coupling row = row_at(c.at, *c.to, length > 0 ? Vec3((c.at - *c.to).normalized()) : n);
            row.along_line = true;
            row.rest = c.length.value_or(length);
            if (c.kind == "spring") {
                row.softness = 1 / c.stiffness;
                row.damping = c.damping;
            }
            rows.push_back(row);
            continue;
        }
        const bool turns = c.kind == "ball";
        add(c.at, s);
        add(c.at, t);
        if (!slides) add(c.at, n);
        if (turns) continue;
        if (all[k].node[0] >= 0 || all[k].node[1] >= 0) {
            const auto square = [&](const Vec3& of_a, const Vec3& of_b) {
                Coupling row = row_at(c.at, c.at, of_a);
                row.turns = row.square = true;
                row.axis_b = turn_of(bodies, row.b, pose_at(1)).conjugate() * of_b;
                row.arm = arm;
                rows.push_back(row);
            };
            square(s, n); // no turn about t and s
            square(t, n);
            if (c.kind != "hinge") square(s, t); // nor about the axis
            continue;
        }
        add(c.at + arm * n, s); // no turn about t and s
        add(c.at + arm * n, t);
        if (c.kind != "hinge") add(c.at + arm * s, t); // nor about the axis
    }
    return rows;
}

std::vector<Issue> jolts(const Scene& scene, const std::vector<BodyRef>& bodies,
                         const std::vector<Coupling>& couplings)
{
    constexpr double kAlike = 1e-9; // of the velocities
    std::vector<double> worst(scene.couplings.size(), 0);
    for (const Coupling& c : couplings) {
        if (c.softness > 0) continue;
        const CouplingRow row = coupling_row(bodies, c);
        const auto velocity = [&](int body, const BodyPlace& at) {
            return body < 0 ? Vec3::Zero().eval()
                            : bodies[std::size_t(body)].body->velocity(at, VelocityAt::start);
        };
        const Vec3 a = velocity(c.a.body, row.place_a(c)), b = velocity(c.b.body, row.place_b(c));
        const double apart = std::abs(row.direction.dot(a - b));
        double& of_all = worst[std::size_t(c.input)];
        if (apart > kAlike * (a.norm() + b.norm())) of_all = std::max(of_all, apart);
    }
    std::vector<Issue> found;
    for (std::size_t k = 0; k < worst.size(); ++k)
        if (worst[k] > 0)
            found.push_back(
                {scene.file, fmt::format("/couplings/{}", k),
                 fmt::format("bodies that start {:.3g} m/s apart where they are joined: "
                             "with this rule they oscillate",
                             worst[k]),
                 "equal velocities, or a dissipative rule (theta 1)"});
    return found;
}

} // namespace amontons
