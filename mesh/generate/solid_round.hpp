#pragma once

#include "mesh/volume_mesh.hpp"

namespace amontons {

/// A full ball.
struct SolidBallOptions {
    Vec3 centre = Vec3::Zero(); ///< [m]
    double radius = 0;          ///< [m], > 0
    std::int32_t cells = 8;     ///< about this many elements (pairs of T4) along a diameter, >= 2
    ElementKind kind = ElementKind::H8;
};

/// A core that is nearly a cube within layers that become round. Corner nodes of the surface lie
/// on the sphere, and a T10's middle nodes too. Face set "outer", element set "volume".
/// @throws InputError  if a number is out of range
VolumeMesh make_solid_ball(const SolidBallOptions& options);

/// A full round cylinder.
struct SolidCylinderOptions {
    Vec3 start = Vec3::Zero(); ///< centre of one end [m]
    Vec3 axis = Vec3::UnitZ(); ///< any length > 0
    double radius = 0;         ///< [m], > 0
    double length = 0;         ///< [m], > 0
    std::int32_t cells = 8;    ///< about this many along a diameter, >= 2
    std::int32_t along = 8;    ///< elements along the axis, >= 1
    ElementKind kind = ElementKind::H8;
};

/// The same with a square core. Face sets "start", "end", "outer"; element set "volume".
/// @throws InputError  if a number is out of range
VolumeMesh make_solid_cylinder(const SolidCylinderOptions& options);

} // namespace amontons
