#pragma once

#include "mesh/surface_mesh.hpp"

#include <cstdint>
#include <vector>

namespace amontons {

/// How often a surface winds around places: 1 inside a closed surface whose normals point outwards,
/// 0 outside, whole numbers also where the surface passes through itself (2 where two such parts
/// overlap, -1 where a part is turned inside out).
///
/// The sum of the solid angles of all triangles over 4 pi; far groups of triangles count as one
/// with their vector area.
/// Source: Barill, Dickson, Schmidt, Levin & Jacobson, Fast winding numbers for soups and clouds,
/// ACM TOG 37 (2018), the expansion's first order; Van Oosterom & Strackee, IEEE TBME 30 (1983),
/// the solid angle.
class WindingNumber {
public:
    /// @param mesh  at least one triangle; its corners are copied
    explicit WindingNumber(const SurfaceMesh& mesh);

    /// The number at x, within 0.1 of the exact one; half-way on the surface itself.
    /// Cost: logarithmic in the number of triangles, a few us.
    double at(const Vec3& x) const;

private:
    struct Node { // a group of triangles seen from afar
        Vec3 centre = Vec3::Zero();
        Vec3 area = Vec3::Zero(); ///< sum of normals times areas
        double radius = 0;        ///< of a ball around `centre` with all of them
        std::int32_t first = 0;   ///< leaf: in corners_; else the left child, the right is next
        std::int32_t count = 0;   ///< triangles of a leaf; 0: inner node
    };
    struct Corners {
        Vec3 a, b, c;
    };

    void split_(std::int32_t node, std::int32_t first, std::int32_t count);

    std::vector<Node> nodes_;
    std::vector<Corners> corners_;
};

} // namespace amontons
