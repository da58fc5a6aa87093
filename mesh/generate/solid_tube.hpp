#pragma once

#include "mesh/centreline.hpp"
#include "mesh/volume_mesh.hpp"

namespace amontons {

/// The wall of a vessel: what lies between the radius of a centreline and a thickness more.
struct SolidTubeOptions {
    Centreline centreline;    ///< its radius is the inner one
    double thickness = 0;     ///< [m], > 0
    std::int32_t around = 24; ///< elements along the circumference, >= 3
    std::int32_t through = 2; ///< through the wall, >= 1
    std::int32_t along = 20;  ///< along the centreline, of equal arc length, >= 1
    ElementKind kind = ElementKind::H8;
};

/// Face sets "inner", "outer", "start", "end"; element set "volume". Cross-sections are planes
/// normal to the centreline and do not turn about it. A T10's middle nodes lie on the true wall.
/// @throws InputError  if a number is out of range, or a bend is tighter than the outer radius
VolumeMesh make_solid_tube(const SolidTubeOptions& options);

} // namespace amontons
