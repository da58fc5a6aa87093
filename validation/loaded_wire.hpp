#pragma once

#include "solver/step/wire_newton.hpp"

namespace amontons::validation {

/// A clamped uniform wire without walls, under dead loads on its tip.
struct LoadedWire {
    double length = 1;
    double EI = 1, GJ = 1, EA = 1, GA = 0; ///< GA 0: no shear deformation
    double curvature = 0;                  ///< natural [1/m]
    int elements = 10;
    bool planar = false;           ///< held in the plane of the first two section axes
    Mat3 frame = Mat3::Identity(); ///< tangent and section axes at the clamp
    Vec3 force = Vec3::Zero();     ///< on the tip, fixed in space [N]
    Vec3 moment = Vec3::Zero();    ///< [N m]
};

/// Its equilibrium, reached in steps of the load that adapt themselves.
/// @param start  out, if not null: position of the tip without load [m]
/// @throws std::runtime_error  if the load cannot be reached
Wire solve(const LoadedWire& w, Vec3* start = nullptr);

} // namespace amontons::validation
