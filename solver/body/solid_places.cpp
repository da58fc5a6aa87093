#include "solver/body/node_index.hpp"
#include "solver/body/solid_body.hpp"

// Places on a solid: how they move with its nodes, and how forces on them act on these.

namespace amontons {
namespace {

bool same_placement(const Placement& a, const Placement& b)
{
    return a.turn.coeffs() == b.turn.coeffs() && a.shift == b.shift;
}

/// Motion of a place by that of the nodes.
template <class Of> Vec3 mean_of_place(const BodyPlace& at, Of motion)
{
    if (at.patch) {
        const PatchMotion m = patch_motion(*at.patch, motion);
        return at.turns ? m.turn : Vec3(m.shift + m.turn.cross(at.arm));
    }
    Vec3 d = Vec3::Zero();
    for (const StencilEntry& e : at.nodes)
        d += e.weight * motion(e.node);
    return d;
}

/// A force on a place, or a moment, as the nodes' forces: what works with mean_of_place().
template <class Act> void spread_on_nodes(const BodyPlace& at, const Vec3& force, Act act)
{
    if (at.patch && at.turns) return spread_on_patch(*at.patch, Vec3::Zero(), force, act);
    if (at.patch) return spread_on_patch(*at.patch, force, at.arm.cross(force), act);
    for (const StencilEntry& e : at.nodes)
        act(e.node, Vec3(e.weight * force));
}

} // namespace

void SolidBody::add_column(const BodyPlace& at, const Vec3& direction, double scale, int column,
                           std::vector<Eigen::Triplet<double>>& out) const
{
    const auto add = [&](std::int32_t node, const Vec3& along) {
        for (int axis = 0; axis < 3; ++axis) {
            const std::int32_t dof = unknowns_.number[std::size_t(3 * node + axis)];
            if (dof >= 0) out.emplace_back(dof, column, along[axis]);
        }
    };
    if (at.patch) {
        const Mat3 back = now_.frame.turn.toRotationMatrix().transpose();
        spread_on_nodes(at, scale * direction,
                        [&](std::int32_t node, const Vec3& f) { add(node, back * f); });
        return;
    }
    const Vec3 d = now_.frame.turn.conjugate() * direction; // once: contacts have many nodes
    for (const StencilEntry& e : at.nodes)
        add(e.node, scale * e.weight * d);
}

Vec3 SolidBody::displacement(const BodyPlace& at) const
{
    if (!step_.dynamic && same_placement(now_.frame, state_.frame)) { // to the digits of u
        const auto moved = [&](std::int32_t node) {
            return Vec3(now_.u.segment<3>(3 * node) - state_.u.segment<3>(3 * node));
        };
        if (!at.patch) return now_.frame.turn * mean_of_place(at, moved);
        return mean_of_place(at, [&](std::int32_t node) { return now_.frame.turn * moved(node); });
    }
    return mean_of_place(at, [&](std::int32_t node) {
        return Vec3(now_.x[std::size_t(node)] - state_.x[std::size_t(node)]);
    });
}

Vec3 SolidBody::moved_from_first(std::span<const StencilEntry> nodes) const
{
    Vec3 d = Vec3::Zero();
    if (!step_.dynamic && same_placement(now_.frame, first_.frame)) {
        for (const StencilEntry& e : nodes)
            d += e.weight * now_.u.segment<3>(3 * e.node);
        return now_.frame.turn * d;
    }
    for (const StencilEntry& e : nodes)
        d += e.weight * (now_.x[std::size_t(e.node)] - first_.x[std::size_t(e.node)]);
    return d;
}

Vec3 SolidBody::velocity(const BodyPlace& at, VelocityAt when) const
{
    const Eigen::VectorXd& v = when == VelocityAt::iterate ? now_.v
                               : when == VelocityAt::start ? state_.v
                                                           : past_.velocity;
    return mean_of_place(at, [&](std::int32_t node) { return Vec3(v.segment<3>(3 * node)); });
}

void SolidBody::add_reaction(const BodyPlace& at, const Vec3& force)
{
    const Eigen::Quaterniond back = now_.frame.turn.conjugate();
    spread_on_nodes(at, force, [&](std::int32_t node, const Vec3& f) {
        for (int axis = 0; axis < 3; ++axis)
            if (unknowns_.number[std::size_t(3 * node + axis)] < 0)
                contact_.held[3 * node + axis] += (back * f)[axis];
    });
}

} // namespace amontons
