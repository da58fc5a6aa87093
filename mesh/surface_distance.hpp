#pragma once

#include "mesh/bounding_tree.hpp"
#include "mesh/distance_field.hpp"
#include "mesh/smooth_surface.hpp"

#include <vector>

namespace amontons {

/// The signed distance to a smooth surface, > 0 where its normals point.
///
/// The nearest point of a finely cut copy is found in a tree of boxes and moved onto the curved
/// triangle. The sign is that of the angle-weighted normal there.
/// Source: Baerentzen & Aanaes, IEEE TVCG 11 (2005), signed distance using the angle weighted
/// pseudonormal.
class SurfaceDistance : public DistanceSource {
public:
    /// @param cuts  number of parts of each edge of a curved triangle
    /// @param band  farther from the surface, distances are interpolated in each brick [m]
    SurfaceDistance(SmoothSurface smooth, int cuts, double band);

    void sample_cube(const Vec3& corner, const Mat3& edges, int n, double* out) const override;
    double clearance(const Vec3& x, std::int32_t& near) const override;
    Hash128 fingerprint() const override;

    /// @param near  a triangle of refined() that is probably near, or -1; that of x on return
    /// @returns  distance [m]
    double distance(const Vec3& x, std::int32_t& near) const;

    const SurfaceMesh& refined() const { return refined_; }
    const BoundingTree& tree() const { return tree_; }

    /// Largest distance between a patch of the first `patches` and its flat pieces, sampled [m].
    double chord_error(std::size_t patches) const;

private:
    double from_place_(const Vec3& x, const NearestTriangle& place,
                       SmoothSurface::Patch& last) const;
    Vec3 pseudo_normal_(const NearestTriangle& place) const;

    SmoothSurface smooth_;
    int cuts_;
    double band_;
    SurfaceMesh refined_;
    BoundingTree tree_;
    std::vector<Vec3> vertex_normals_, face_normals_;
    std::vector<std::array<std::int32_t, 3>> neighbours_;
    double chord_error_ = 0;
};

} // namespace amontons
