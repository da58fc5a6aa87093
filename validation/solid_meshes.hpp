#pragma once

#include "mesh/volume_mesh.hpp"

#include <functional>
#include <string>
#include <vector>

// Meshes of the published cases that no generator of the program has.

namespace amontons::validation {

/// From a mesh's own coordinates to space; keeps the orientation.
using PlaceMap = std::function<Vec3(const Vec3&)>;

/// 0 and n sizes that grow by a constant factor, scaled to end at `length`.
std::vector<double> graded(double length, int n, double last_over_first);

/// A lattice between ascending places along x, y, z. Sets x_min ... z_max as a box has them.
VolumeMesh lattice_mesh(const std::array<std::vector<double>, 3>& at, ElementKind kind,
                        const PlaceMap& place = {});

/// A quarter (x, y >= 0) or a half (y >= 0) of a round stack: a core that is nearly a square,
/// rings around it, repeated at heights.
struct RoundStack {
    int core = 4;               ///< cells along the core's half edge
    std::vector<double> rings;  ///< radii of the circles around the core, ascending
    std::vector<double> height; ///< of the layers, ascending
    bool half = false;
    double patch = 0; ///< sets low_patch, high_patch: faces within this radius; 0: none
    ElementKind kind = ElementKind::T10;
};

/// Sets x_min (quarter), y_min, low, high, outer, and the patches. Middle nodes between two nodes
/// of a circle lie on it.
VolumeMesh round_stack(const RoundStack& options, const PlaceMap& place = {});

/// A hemisphere on its pole, which is the origin; its rim beyond this share of the radius is cut
/// off along a cylinder.
constexpr double kRimOfHemisphere = 0.8;

/// Sets as those of a round stack: low the sphere and high the equator, or, upside down and below
/// the origin, the other way round.
/// @param contact  radius that is meshed finely, with elements of the size `cell` [m]
/// @param half     half of it instead of a quarter
VolumeMesh hemisphere(double R, double contact, double cell, bool half, bool upside_down);

/// Nodes and elements in another order, the same body.
VolumeMesh shuffled(const VolumeMesh& mesh, unsigned seed);

} // namespace amontons::validation
