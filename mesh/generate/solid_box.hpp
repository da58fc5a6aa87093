#pragma once

#include "mesh/volume_mesh.hpp"

namespace amontons {

/// A block between two corners.
struct SolidBoxOptions {
    Vec3 lowest = Vec3::Zero(), highest = Vec3::Ones(); ///< corners [m]
    std::array<std::int32_t, 3> cells{1, 1, 1};         ///< along x, y, z, each >= 1
    std::array<double, 3> grading{1, 1, 1};             ///< last cell / first cell, > 0
    ElementKind kind = ElementKind::H8;
};

/// Face sets x_min, x_max, y_min, y_max, z_min, z_max; element set "volume". Cell sizes along an
/// axis are a geometric progression. Tetrahedra: six in each cell, see tetrahedra_of.
/// @throws InputError  if a number is out of range
VolumeMesh make_solid_box(const SolidBoxOptions& options);

/// No generator makes more elements.
constexpr std::int64_t kMostElements = 50'000'000;

} // namespace amontons
