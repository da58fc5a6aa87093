#pragma once

#include "mesh/extract_surface.hpp"

#include <functional>

// Parts of a solid by where they lie, for meshes whose files name none.

namespace amontons {

/// A part of space: true for places inside it.
using Region = std::function<bool(const Vec3&)>;

/// Length below which places of a mesh count as the same: 1e-6 of its diagonal, which numbers of
/// single precision in files keep to [m].
double place_tolerance(const VolumeMesh& mesh);

/// @param slack  how far outside still counts [m]
Region inside_box(const Vec3& from, const Vec3& to, double slack);
/// Places within a ball; slack is added to the radius [m].
Region inside_ball(const Vec3& centre, double radius, double slack);
/// @param within  distance from the plane on both sides [m]
Region near_plane(const Vec3& at, const Vec3& normal, double within);

/// Faces of the outside all of whose nodes lie in a region, ascending. O(n).
std::vector<FaceRef> faces_in(const ExternalSurface& outside, const VolumeMesh& mesh,
                              const Region& region);
/// All nodes in a region, also those inside the solid, ascending. O(n).
std::vector<std::int32_t> nodes_in(const VolumeMesh& mesh, const Region& region);

/// The faces that edges without a corner connect with the one nearest to a point.
struct AlikeFaces {
    std::vector<FaceRef> faces; ///< ascending
    Vec3 seed = Vec3::Zero();   ///< the point of the outside that is nearest to the one given [m]
    double away = 0;            ///< from it [m]
    double size = 0;            ///< of the face there: its longest side [m]
};

/// @param angle  between the planes of two faces, up to which they count as alike [rad]
/// O(n log n).
AlikeFaces faces_alike(const ExternalSurface& outside, const VolumeMesh& mesh, const Vec3& at,
                       double angle);

} // namespace amontons
