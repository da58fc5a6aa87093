#pragma once

#include "mesh/wall.hpp"

#include <numbers>
#include <string>
#include <vector>

namespace amontons {

/// A side vessel on the outer side of the arch, in the arch's plane.
struct VesselBranch {
    std::string name;
    double at = 0;            ///< distance before the end of the arch, along the centreline [m]
    double root_diameter = 0; ///< where it leaves the arch's wall [m]
    double end_diameter = 0;  ///< at its open end [m]
    double length = 0;        ///< from the arch's wall to its open end, on its axis [m]
    double angle = std::numbers::pi / 2; ///< from the arch's tangent towards its start [rad]
};

/// An aorta: a straight descending part with an open inlet at its lower end, an arch, an
/// ascending part closed by a half sphere, and branches with open ends. Diameters vary
/// linearly along the centreline.
struct VesselOptions {
    Vec3 inlet = Vec3::Zero();         ///< centre of the inlet [m]
    Vec3 axis = Vec3::UnitZ();         ///< of the descending part, from the inlet to the arch
    Vec3 arch_towards = Vec3::UnitX(); ///< the arch bends this way
    double descending_length = 0.120;  ///< [m]
    double descending_diameter[2] = {0.020, 0.024}; ///< at the inlet and at the arch [m]
    double arch_radius = 0.038;                     ///< of the centreline [m]
    double arch_angle = std::numbers::pi;           ///< [rad]
    double arch_diameter[2] = {0.024, 0.028};       ///< at its start and end [m]
    double ascending_length = 0.060;                ///< [m]
    double ascending_diameter = 0.028;              ///< at the closed end [m]
    std::vector<VesselBranch> branches;
    double blend = 0.002;  ///< radius of the rounded edges between vessels [m], > 0
    double resolution = 0; ///< edge of the triangles [m]; 0: 0.3 of the smallest radius or less
};

/// Default branches: brachiocephalic, left carotid, left subclavian.
std::vector<VesselBranch> default_branches();

/// The free space inside the vessel. Its openings are "inlet" and one by the name of each
/// branch; beyond an opening the wall (not the triangles) continues straight.
/// @throws InputError  with every field that is out of range
/// Cost: 10 ms for the default; its triangles, 0.1 s more, are made at first use, and
/// the wall is sampled while it is used.
WallModel make_vessel(const VesselOptions& options);

} // namespace amontons
