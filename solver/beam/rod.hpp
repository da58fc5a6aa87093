#pragma once

#include "mesh/centreline.hpp"
#include "solver/beam/corotational.hpp"
#include "solver/beam/element.hpp"
#include "solver/beam/material.hpp"
#include "solver/beam/rotation.hpp"
#include "solver/scene/scene.hpp"

#include <span>
#include <string>

// Constant data of a rod and its first shape: nodes along it, laws and masses of its elements.
// Elements join node i to node i + 1; of a closed rod the last joins the last node to the first.

namespace amontons {

/// Mass of an element, spread evenly over its length.
struct ElementMass {
    double per_length = 0;     ///< [kg/m]
    double spin = 0, bend = 0; ///< rotary inertia about the tangent and across it [kg m]
};

/// An element whose end is turned against its node: a rigid corner.
struct RodCorner {
    /// Number of the element that begins at the corner.
    int element = 0;
    int end = 0;     ///< 0: its first node
    Quaternion turn; ///< from the node's frame to the element's
};

/// Constant data of a rod.
struct RodModel {
    std::vector<double> s; ///< of the nodes, from the start [m]
    double length = 0;     ///< [m]
    bool closed = false;
    std::vector<BeamNode> nodes; ///< places and sections at the start
    std::vector<ElementLaw> law;
    std::vector<CorotationalStrain> natural; ///< of each element, free of stress
    std::vector<ElementMass> mass;
    std::vector<double> radius; ///< of each element [m]
    std::vector<RodCorner> corners;
    std::vector<BeamSegment> segments;
    std::vector<double> segment_start; ///< [m]

    /// Number of nodes.
    int node_count() const { return int(s.size()); }
    /// Number of elements.
    int element_count() const { return int(law.size()); }
    /// The second node of an element; node 0 for the last of a closed rod.
    int second(int element) const { return element + 1 < node_count() ? element + 1 : 0; }
    /// The element's tangent at one of its ends, in the frame of the node there.
    Vec3 axis(int element, int end) const;
    /// The node at an arc length [m] that was among `at` of make_rod().
    int node_at(double s) const;
};

/// Axes of the first cross-section: the tangent, the shape's normal (one is chosen if it has none
/// across the tangent), and the third.
Mat3 first_frame(const RodShape& shape, const Vec3& tangent);

/// @param curve  of the shape, if it has one
/// @param at     arc lengths at which there must be nodes
/// @throws InputError  (places relative to the body) if the shape cannot be made
RodModel make_rod(const std::vector<BeamSegment>& segments, const RodShape& shape,
                  const Centreline* curve, std::span<const double> at);

} // namespace amontons
