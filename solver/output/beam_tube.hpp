#pragma once

#include "solver/record/step_record.hpp"

#include <array>
#include <vector>

namespace amontons {

/// The round surface of a beam as triangles, the beam's fields copied to its points.
struct TubeSurface {
    std::vector<Vec3> points;                           ///< [m]
    std::vector<std::array<std::int32_t, 3>> triangles; ///< normals outwards
    std::vector<Field> fields;
};

/// @param beam     its field "radius" gives the radius at each point [m]; without it or with
///                 less than two points the surface is empty
/// @param corners  of each ring, >= 3
/// @param surface  filled; its memory is used again
void make_tube_surface(const BeamRecord& beam, int corners, TubeSurface& surface);

} // namespace amontons
