#include "solver/body/node_index.hpp"
#include "solver/body/rod_body.hpp"

#include <algorithm>
#include <limits>

// A viscous medium around a rod: the scene's, or one for the steps that follow a snap.

namespace amontons {
namespace {

constexpr double kStands = 1e6;        // times an element's stiffness: such a drag holds it
constexpr double kAnchor = 1e-6;       // of EI / length^3
constexpr double kAnchorFloor = 1e-13; // of EA / l, whose round-off would be a stiffness

} // namespace

void RodBody::set_viscous_drag(double drag, bool from_rest)
{
    if (from_rest) drag_before_.assign(state_.nodes.size(), Vec6::Zero());
    drag_ = drag;
}

double RodBody::largest_motion() const
{
    double most = 0;
    for (const Vec6& m : moved_)
        most = std::max(most, m.head<3>().norm());
    return most;
}

double RodBody::length_at(int node) const
{
    const int elements = rod_.element_count();
    double length = 0;
    for (const int e : {node - 1, node}) {
        const int own = rod_.closed ? (e + elements) % elements : e;
        if (own >= 0 && own < elements) length += 0.5 * rod_.law[std::size_t(own)].length;
    }
    return length;
}

/// Of a node [N/m], and of its turns [N m].
double RodBody::drag_on(int node, int axis) const
{
    const double length = length_at(node);
    return drag() * length * (axis < 3 ? 1 : length * length);
}

void RodBody::stabilise_with_contacts()
{
    double min_stiffness = std::numeric_limits<double>::infinity(), stiffest = 0, length = 0;
    for (const ElementLaw& law : rod_.law) {
        length += law.length;
        stiffest = std::max(stiffest, law.S[0] / (law.length * law.length));
        for (int k = 3; k < 6; ++k)
            min_stiffness = std::min(min_stiffness, law.S[std::size_t(k)] / law.length);
    }
    const double whole =
        std::max(kAnchor * min_stiffness / (length * length * length), kAnchorFloor * stiffest);
    anchor_ = whole / length;
}

std::array<double, 2> RodBody::anchor_on(int node) const
{
    const double place = anchor_ * length_at(node);
    return {place, place * size_ * size_};
}

void RodBody::add_viscous_pull()
{
    if (anchor_ == 0) return;
    for (int i = 0; i < rod_.node_count(); ++i) {
        Block6& d = K_.chain.diagonal(i);
        const std::array<double, 2> s = anchor_on(i);
        for (int k = 0; k < 6; ++k)
            d(k, k) += s[k < 3 ? 0 : 1];
    }
}

/// Force per length and motion over the step [N/m^2].
double RodBody::drag() const
{
    if (input_.drag == 0) return drag_;
    if (step_.h > 0) return drag_ + input_.drag / step_.h;
    // No time, no motion: the rod stands where it begins.
    double stiffest = 0;
    for (const ElementLaw& law : rod_.law)
        stiffest = std::max(stiffest, std::max(law.S[0], law.S[1]) / (law.length * law.length));
    return kStands * stiffest;
}

void RodBody::add_drag()
{
    if (drag() == 0) return;
    for (int i = nodes_in_sheath(); i < rod_.node_count(); ++i) {
        Block6& d = K_.chain.diagonal(i);
        for (int k = 0; k < 6; ++k) {
            const double c = drag_on(i, k);
            d(k, k) += c;
            residual_[at6(std::size_t(i)) + k] -= c * moved_[std::size_t(i)][k];
        }
    }
}

/// By the trapezoid rule: the force at the start is that of the end of the step before.
double RodBody::taken_by_drag()
{
    double taken = 0;
    if (drag() == 0) return 0;
    drag_before_.resize(moved_.size(), Vec6::Zero());
    for (auto i = std::size_t(nodes_in_sheath()); i < moved_.size(); ++i)
        for (int k = 0; k < 6; ++k) {
            const double now = drag_on(int(i), k) * moved_[i][k];
            taken += 0.5 * (now + drag_before_[i][k]) * moved_[i][k];
            drag_before_[i][k] = now;
        }
    return taken;
}

} // namespace amontons
