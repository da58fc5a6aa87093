#include "solver/beam/wire_place.hpp"

namespace amontons {

std::optional<WirePlace> place_of(const Wire& wire, const WireState& state, double s, int element,
                                  double xi)
{
    const std::vector<double>& node = wire.material.node;
    if (element > state.first || !wire.sheath) {
        if (element < state.first) return {};
        return WirePlace{element, xi, node[std::size_t(element) + 1] - node[std::size_t(element)]};
    }
    if (!wire.outside()) return {};
    const double end = wire.material.length - state.inserted; // of the sheath
    if (s <= end) return {};
    const double next = node[std::size_t(state.first) + 1];
    return WirePlace{state.first, 1 - (next - s) / (next - end), next - end};
}

Vec3 centreline_point(const WireState& state, const WirePlace& p)
{
    const BeamNode &a = state.nodes[std::size_t(p.element)],
                   &b = state.nodes[std::size_t(p.element) + 1];
    const Hermite h = hermite(p.xi, p.length);
    return h.h0 * a.position() + h.h1 * b.position() + h.h2 * first_axis(a.q) +
           h.h3 * first_axis(b.q);
}

Eigen::Matrix<double, 3, 12> point_jacobian(const Wire& wire, const WirePlace& p)
{
    const WireState& s = wire.state;
    const BeamNode &a = s.nodes[std::size_t(p.element)], &b = s.nodes[std::size_t(p.element) + 1];
    const Hermite h = hermite(p.xi, p.length);
    const Mat3 A = rotation_matrix(a.q), B = rotation_matrix(b.q);
    Eigen::Matrix<double, 3, 12> J;
    // d(R e1) = R (theta x e1) = theta_3 R e2 - theta_2 R e3
    J << h.h0 * Mat3::Identity(), Vec3::Zero(), -h.h2 * A.col(2), h.h2 * A.col(1),
        h.h1 * Mat3::Identity(), Vec3::Zero(), -h.h3 * B.col(2), h.h3 * B.col(1);
    if (p.element == s.first) {
        J.leftCols<6>().setZero();
        if (wire.sheath) {
            // The distance to the element's far end is the material's, so xi moves with length.
            const double x = p.xi, L = p.length, slope = 6 * x * (1 - x);
            const Vec3 by_xi = slope * (b.position() - a.position()) +
                               L * (1 - x) * (1 - 3 * x) * A.col(0) -
                               L * x * (2 - 3 * x) * B.col(0);
            J.col(0) = (1 - x) / L * by_xi + (h.h2 * A.col(0) + h.h3 * B.col(0)) / L;
        }
    }
    return J;
}

} // namespace amontons
