#pragma once

#include "contact/curve/curve_contact.hpp"
#include "contact/surface/sharp_contacts.hpp"

#include <array>

namespace amontons {

/// Sharp edges of a solid that follow one another without a corner, as a smooth line through their
/// nodes: what crosses it finds no corner where one edge ends and the next begins.
struct EdgeCurve {
    Curve curve;                                    ///< radius 0
    std::vector<std::array<std::int32_t, 4>> nodes; ///< of each piece: before it, its two, after it
    /// Of each piece: its length over that of itself and the piece before it, and after it; 1 where
    /// there is none. The slope at an end is this times the vector over both pieces [-].
    std::vector<std::array<double, 2>> slope;
    std::vector<Vec3> outwards; ///< of each piece: sum of the normals of the faces beside it

    /// Nodes that a place is the mean of, with weights that sum to 1.
    std::array<StencilEntry, 4> at(const CurvePlace& place) const;
    /// The node where the line ends that is no ring, if the place is there; else -1.
    std::int32_t end_at(const CurvePlace& place) const;
};

/// The smooth curves through the sharp edges of a surface, one for each chain of edges.
std::vector<EdgeCurve> edge_curves(const SharpSurface& surface);

} // namespace amontons
