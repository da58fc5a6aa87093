#pragma once

#include "mesh/base/text.hpp"
#include "mesh/base/types.hpp"
#include "mesh/surface_mesh.hpp"

#include <cstddef>
#include <cstdint>
#include <string>

// What the checks and repairs of meshes have in common; for .cpp files alone.

namespace amontons {

/// Vertices nearer than this part of the mesh's diagonal differ by the rounding of a file (ratio).
constexpr double kCoincident = 1e-9;
/// The normal of a triangle lower than this part of the diagonal is round-off (ratio).
constexpr double kFlatTriangle = 1e-12;
/// Faults of one kind that a message names; others are counted.
constexpr std::size_t kMostNamed = 3;

/// A vertex of a mesh.
inline const Vec3& point_of(const SurfaceMesh& mesh, std::int32_t i)
{
    return mesh.points[static_cast<std::size_t>(i)];
}

/// "(1, 2, 3)".
inline std::string place_text(const Vec3& x)
{
    std::string text = "(";
    for (int i = 0; i < 3; ++i) {
        append_number(text, x[i]);
        text += i < 2 ? ", " : ")";
    }
    return text;
}

} // namespace amontons
