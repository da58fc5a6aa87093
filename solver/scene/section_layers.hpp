#pragma once

#include "solver/scene/scene.hpp"

namespace amontons {

/// What a section of layers resists with: [N m^2], [N m^2], [N].
struct SectionStiffness {
    /// Bending [N m^2], torsional [N m^2] and axial stiffness [N].
    double EI = 0, GJ = 0, EA = 0;
};

/// Of layers that bend, twist and stretch as one. A coil of round wire of mean radius R and pitch
/// p, its turns apart and flat, has per length of the section
///     EI = p / (pi R (1 / EI_w + 1 / GJ_w)),  GJ = p EI_w / (2 pi R),  EA = p GJ_w / (2 pi R^3),
/// from the bending and twisting of its wire.
/// @param share  of the way along the segment, 0 to 1
SectionStiffness stiffness_of(const std::vector<SectionLayer>& layers, double share = 0);

/// Inner and outer radius there [m].
std::array<double, 2> radii_of(const SectionLayer& layer, double share);

} // namespace amontons
