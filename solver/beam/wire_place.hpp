#pragma once

#include "solver/beam/wire.hpp"

// Places between the nodes of a wire: points of its smooth centreline.

namespace amontons {

/// A place on the wire's centreline.
struct WirePlace {
    /// Number of the element.
    int element = 0;
    double xi = 0;     ///< 0..1 in it (share)
    double length = 0; ///< rest length of the element [m]
};
/// Where a material point is; nothing if it is still in the sheath.
/// @param s   arc length from the base [m]; xi in the element, 0 to 1 (share)
std::optional<WirePlace> place_of(const Wire& wire, const WireState& state, double s, int element,
                                  double xi);

/// Position on the smooth (cubic Hermite) centreline.
Vec3 centreline_point(const WireState& state, const WirePlace& place);
/// Rotation of the section.
inline Quaternion section_rotation(const WireState& state, const WirePlace& p)
{
    return interpolate(state.nodes[std::size_t(p.element)].q,
                       state.nodes[std::size_t(p.element) + 1].q, p.xi);
}
/// Derivative of centreline_point with respect to the 12 unknowns of the element's nodes, as
/// assemble_wire orders them.
Eigen::Matrix<double, 3, 12> point_jacobian(const Wire& wire, const WirePlace& place);

} // namespace amontons
