#pragma once

#include "contact/surface/contact_sums.hpp"
#include "contact/surface/fixed_shape.hpp"

namespace amontons {

/// A slave's quadrilateral in the plane of its facet, and where Newton's method has got to on it.
struct PlaneQuadrilateral {
    /// Middle, half its sides and half their difference, in the plane [m].
    Vec3 middle = Vec3::Zero(), along[2] = {Vec3::Zero(), Vec3::Zero()}, twist = Vec3::Zero();
    double bend = 0;            ///< relative change of area over the face: see the .cpp
    double warp = 0;            ///< of its corners out of the plane [m]
    Vec2 last = Vec2::Zero();   ///< on its reference face
    double contraction = 1;     ///< share of the bend over the polygon; 1: too large
    Eigen::Matrix2d near_slope; ///< of its map back, near the present polygon
    Vec2 near_twist;            ///< the slope's product with the twist
    Vec2 polygon_corner, polygon_xi;
    int steps = 0; ///< with that slope
};

/// A slave's triangle: from the plane of its facet to its reference coordinates, and back.
struct PlaneTriangle {
    /// From the plane to reference coordinates, and back.
    Eigen::Matrix2d slope, back;
    /// Reference coordinates of the plane's origin, and the place of theirs.
    Vec2 offset, origin;
    /// Of six nodes: the place in the plane's frame over 1, a, b, a^2, b^2, a b, with the reference
    /// coordinates a and b [m].
    Vec3 place[6];
    double stretch = 1; ///< area on the reference face per area of the plane [1/m^2]
};

/// The master's facet over the plane z of the slave's facet: at d = z - corner the height is
/// height[0] + d . height[1..2], and the normal, but for its length, n[0] + d . n[1..2].
struct MasterPlane {
    const Facet* facet = nullptr;
    /// Where the height and the normal are [0].
    Vec2 corner;
    /// Normal and its derivatives.
    Vec3 n[3];
    /// Height and its derivatives.
    Vec3 height;
};
/// As many points as are integrated at once, and a number of each.
inline constexpr int kPointBlock = 4;
using PerPoint = Eigen::Array<double, kPointBlock, 1>;
/// Points over one facet of the master: their places in the plane, or for six nodes those of
/// straight sides; for four nodes on the slave's reference face; and their weights.
struct PolygonPoints {
    static constexpr int kMost = 64; ///< then they are integrated
    int count = 0;                   ///< points
    int steps = 0;                   ///< of Newton's method from `xi` on, for four nodes
    /// Places in the plane, or those of straight sides [m].
    alignas(32) double z[2][kMost];
    /// On the reference face.
    alignas(32) double xi[2][kMost];
    /// Area in the plane times the share of the functions [m^2].
    alignas(32) double weight[kMost];
};
/// int N N^T (i <= j, row by row), int N n^T, int N h, with the master's unit normal n and height
/// h, each as sums of every fourth point. As the functions sum to 1 and the place on the slave is
/// that of its nodes with them, int N and int N z follow.
struct DualMoments {
    /// As above, in this order.
    PerPoint NN[21], Nn[6][3], Nh[6];
};
/// The same where a function is 1, without its N.
struct ConstantMoments {
    /// As above.
    PerPoint N[6], n[3], h;
};

/// Integrals of mortar_contacts over what faces of a slave share with a master that does not bend.
/// It needs no stencils, so that places and normals of the master are integrated directly, and
/// what depends on the slave's facet alone is computed once, not for each of its many segments.
class FixedIntegrals {
public:
    /// @param master, surface, places  outlive it; `places` in the master's frame
    FixedIntegrals(const FixedShape& master, const ExternalSurface& surface,
                   std::span<const Vec3> places);

    /// @param sums  of the face, added to; outlives the integrals over it
    void begin_face(const FaceMultipliers& multipliers, FaceSums& sums);
    /// Prepares the integrals over one facet of the current face.
    void begin_facet(const Facet& slave);
    /// @param polygon  in the plane of the slave's facet
    /// @param only     the multiplier whose function is 1 there, or -1: the dual functions
    /// @param share    factor on the functions
    void add(const Facet& master, const ConvexPolygon& polygon, int only, double share);
    /// A point of the slave's reference face, in the plane of the facet.
    Vec2 in_plane(const Vec2& xi) const;
    /// Adds the sums of the facet to those of its face.
    void end_facet();

private:
    void set_master_(const Facet& master);
    void add_points_(const PerPoint& x, const PerPoint& y, const PerPoint& weight, int count);
    void flush_(int only);

    const FixedShape& master_;
    const ExternalSurface& surface_;
    std::span<const Vec3> places_;
    const FaceMultipliers* multipliers_ = nullptr;
    FaceSums* sums_ = nullptr;

    // Of the present facet.
    const Facet* facet_ = nullptr;
    std::optional<FacetPlane> plane_;
    FaceInPlane face_{{}, {}};
    MasterPlane over_;
    PlaneQuadrilateral quadrilateral_;
    PlaneTriangle triangle_;
    PolygonPoints points_;
    DualMoments dual_;
    std::array<ConstantMoments, 4> only_;
    bool has_dual_ = false, has_only_ = false;
};

} // namespace amontons
