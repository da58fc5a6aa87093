#pragma once

#include "contact/surface/polygon.hpp"
#include "mesh/box_tree.hpp"
#include "mesh/extract_surface.hpp"
#include "mesh/face_shape.hpp"

#include <optional>

// Faces seen along a direction. For finding where two of them face each other, a face T3, Q4 or
// straight T6 is one flat facet, any other T6 four through its middle nodes; values and integrals
// are those of the true face, by its shape functions. Reference coordinates are those of
// mesh/face_shape.hpp.

namespace amontons {

/// Faces are directed at each other, or the same way, if the cosine of their normals is no smaller:
/// a pair at 78 degrees and more has no meaningful common normal.
constexpr double kFacing = 0.2;

/// A flat triangle or quadrilateral that stands for a face or a quarter of it.
struct Facet {
    /// Number of the face of the surface.
    std::int32_t face = 0;
    /// Corners of the facet, 3 or 4.
    int corners = 3;
    std::array<Vec3, 4> corner; ///< [m]
    std::array<Vec2, 4> xi;     ///< of the corners on the reference face
    Vec3 middle = Vec3::Zero(); ///< mean of the corners [m]
    Vec3 normal = Vec3::Zero(); ///< unit, outwards; of the mean plane [-]
    double size = 0;            ///< longest side or diagonal [m]
};

/// Facets face by face; those without area are left out.
/// @param places  of all nodes of the mesh, finite [m]
std::vector<Facet> facets_of(const ExternalSurface& surface, std::span<const Vec3> places);
/// The same, without faces that do not touch a box: all facets of a face, or none.
/// @param reach  around each face, beside half of its own size [m]; 0: the face itself
std::vector<Facet> facets_near(const ExternalSurface& surface, std::span<const Vec3> places,
                               const BoundingBox& near, double reach);

/// The box around a surface.
BoundingBox box_of(const ExternalSurface& surface, std::span<const Vec3> places);
/// The box of a facet, and of it moved by `along` and by -`along`.
BoundingBox box_of(const Facet& facet, const Vec3& along = Vec3::Zero());
/// The boxes of facets.
std::vector<BoundingBox> boxes_of(std::span<const Facet> facets);

/// Facets with a tree over their boxes.
struct FacetTree {
    std::vector<Facet> facets;
    BoxTree tree;

    explicit FacetTree(std::vector<Facet> of) : facets(std::move(of)), tree(boxes_of(facets)) {}
};

/// Coordinates in the plane of a facet; the third is the height along its normal. They move and
/// turn with the facet.
struct FacetPlane {
    /// A point of the plane [m].
    Vec3 origin;
    Mat3 axes; ///< rows: along the first side, normal x that, normal

    explicit FacetPlane(const Facet& facet);
    Vec3 operator()(const Vec3& x) const { return axes * (x - origin); }
};

/// The affine map that takes three points of a plane to three others.
struct AffineMap {
    /// Derivative of the map.
    Eigen::Matrix2d slope;
    /// Value at the origin.
    Vec2 offset;

    AffineMap(const Vec2* from, const Vec2* to);
    Vec2 operator()(const Vec2& x) const { return slope * x + offset; }
};

/// The nodes of a face in the coordinates of a plane, or in space.
struct FaceInPlane {
    /// Nodes of the face.
    int nodes = 3;
    /// Their places in the plane's frame: two coordinates and the height [m].
    std::array<Vec3, kMostSolidFaceNodes> node;

    FaceInPlane(std::span<const std::int32_t> face, std::span<const Vec3> places,
                const FacetPlane& plane);
    FaceInPlane(std::span<const std::int32_t> face, std::span<const Vec3> places);
};

/// One number for each node of a face, 0 beyond its last.
using PerNode = Eigen::Matrix<double, kMostSolidFaceNodes, 1>;

/// Shape functions of a face of 3, 4 or 6 nodes.
PerNode shape_values(int nodes, const Vec2& xi);

/// Shape functions, place and tangents at a point of a face.
struct FaceSpot {
    PerNode values;            ///< [-]
    Vec3 place = Vec3::Zero(); ///< [m]
    Vec3 along[2];             ///< derivatives with respect to xi [m]
};
/// Place and derivatives of a face at xi.
FaceSpot spot(const FaceInPlane& face, const Vec2& xi);

/// The point of the face over z: in closed form for quadrilaterals, by Newton's method for others.
/// @param start  near it on the reference face
/// @return  nothing if there is none on the reference face or close to it
std::optional<FaceSpot> locate(const FaceInPlane& face, const Vec2& z, const Vec2& start);

/// The point of the face nearest to x, or a little beyond its border.
/// @param start  near it on the reference face; returned where Gauss-Newton finds nothing better
Vec2 nearest_xi(const FaceInPlane& face, const Vec3& x, const Vec2& start);

} // namespace amontons
