#pragma once

#include "mesh/bounding_tree.hpp"

#include <array>
#include <span>
#include <vector>

namespace amontons {

/// The triangles near a small region, laid out for many queries within it.
class RegionTriangles {
public:
    /// Gathers what can be nearest to any point within `radius` of `centre`.
    /// @param mesh, tree  outlive it; the tree is the mesh's
    /// @param near        a triangle that is probably near the centre, or -1
    /// @return  distance of the centre from the surface [m]
    double gather(const SurfaceMesh& mesh, const BoundingTree& tree, const Vec3& centre,
                  double radius, std::int32_t near = -1);
    /// Restricts queries to a part of the region, until the next call: to within `radius` of
    /// `centre`.
    /// @param centre, radius  [m]
    void select(const Vec3& centre, double radius);
    /// Number of triangles.
    std::size_t count() const { return triangles_.size(); }

    /// As BoundingTree::nearest, for a point of the region or of the part that was selected.
    NearestTriangle nearest(const Vec3& x) const;

private:
    static constexpr int kAtOnce = 8;
    using Many = Eigen::Array<float, kAtOnce, 1>;
    /// A disc around each of eight triangles, in its plane: from the origin, in parts of the scale.
    struct Discs {
        Many x, y, z, radius, nx, ny, nz;
    };
    /// Their corner a, and the ways from there to b and c.
    struct Corners {
        Many a[3], ab[3], ac[3];
    };
    void add_(std::int32_t triangle, const std::array<float, 7>& disc, const Vec3& a,
              const Vec3& ab, const Vec3& ac);
    NearestTriangle nearest_(const Vec3& x, std::span<const std::int32_t> blocks) const;
    float limit_(double squared) const;

    std::array<const Vec3*, 3> corners_at_(std::int32_t triangle) const;

    const SurfaceMesh* mesh_ = nullptr;
    const BoundingTree* tree_ = nullptr;
    Vec3 origin_ = Vec3::Zero();
    double scale_ = 1; // [m]
    float margin_ = 0; // of squared distances, for round-off
    std::vector<std::int32_t> near_, triangles_;
    std::vector<Discs, Eigen::aligned_allocator<Discs>> discs_;
    std::vector<Corners, Eigen::aligned_allocator<Corners>> corners_;
    std::vector<std::int32_t> all_, selected_; // of discs_
    mutable std::vector<Many, Eigen::aligned_allocator<Many>> bounds_;
};

} // namespace amontons
