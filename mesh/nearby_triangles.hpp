#pragma once

#include "mesh/bounding_tree.hpp"

#include <array>
#include <span>
#include <vector>

namespace amontons {

/// The triangles near a small region, laid out for many queries within it.
class NearbyTriangles {
public:
    /// Gathers what can be nearest to any point within `radius` of `centre`.
    /// @param near  a triangle that is probably near the centre, or -1
    /// @return  distance of the centre from the surface [m]
    double gather(const BoundingTree& tree, const Vec3& centre, double radius,
                  std::int32_t near = -1);
    /// Restricts queries to a part of the region, until the next call: to within `radius` of
    /// `centre`.
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
    void add_(std::int32_t triangle, const std::array<float, 7>& disc);
    NearestTriangle nearest_(const Vec3& x, std::span<const std::int32_t> blocks) const;
    float limit_(double squared) const;

    const BoundingTree* tree_ = nullptr;
    Vec3 origin_ = Vec3::Zero();
    double scale_ = 1; // [m]
    float margin_ = 0; // of squared distances, for round-off
    std::vector<std::int32_t> near_, triangles_;
    std::vector<Discs, Eigen::aligned_allocator<Discs>> discs_;
    std::vector<std::int32_t> all_, selected_; // of discs_
    mutable std::vector<Many, Eigen::aligned_allocator<Many>> bounds_;
};

} // namespace amontons
