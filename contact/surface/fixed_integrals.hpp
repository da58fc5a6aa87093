#pragma once

#include "contact/surface/contact_sums.hpp"
#include "contact/surface/fixed_shape.hpp"

namespace amontons {

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
    static constexpr int kBlock = 8;
    using Many = Eigen::Array<double, kBlock, 1>;
    /// The master's facet over the plane z of the slave's facet: at d = z - corner the height is
    /// height[0] + d . height[1..2], and the normal, but for its length, n[0] + d . n[1..2].
    struct MasterPlane {
        const Facet* facet = nullptr;
        Vec2 corner;
        Vec3 n[3];
        Vec3 height;
    };
    /// Points of one facet that wait until there are enough to be integrated at once: their places
    /// in the plane, or for six nodes those of straight sides; on the slave's reference face for
    /// four nodes; weights; and the masters over the plane, each from one of the points on.
    struct Waiting {
        int count = 0;
        int steps = 0; ///< of Newton's method from `xi` on, for four nodes
        Many z[2], xi[2], weight;
        int masters = 0;
        int from[kBlock];
        MasterPlane master[kBlock];
        Many corner[2], n[3][3], height[3]; ///< of each point, from flush_
    };
    /// int N N^T (i <= j, row by row), int N n^T, int N y^T, int N, with the master's unit normal n
    /// and place y, each as sums of every eighth point.
    struct Moments {
        Many NN[21], Nn[6][3], Ny[6][3], N[6];
    };
    /// The same where a function is 1, without N.
    struct Constant {
        Many N[6], n[3], y[3], area;
    };
    void set_master_(const Facet& master);
    void find_on_quadrilateral_(const Vec2& z);
    void begin_polygon_(const Vec2& z, double part);
    void add_point_(const Vec2& z, double weight, Waiting& to, int only);
    void flush_(int only);
    template <int kNodes> void integrate_(const Waiting& points, int only);
    template <int kNodes> Many shape_(const Waiting& points, Many N[kNodes], Many z[2]) const;

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
    Vec3 middle_, along_[2], twist_; ///< of a quadrilateral, in the plane
    double bend_ = 0;                ///< of a quadrilateral: see the .cpp
    double warp_ = 0;                ///< of its corners out of the plane [m]
    Vec2 last_ = Vec2::Zero();       ///< on its reference face
    Eigen::Matrix2d near_slope_;     ///< of its map back, near the present polygon
    double contraction_ = 1;         ///< of the bend over the polygon; 1: too large
    Vec2 polygon_corner_, polygon_xi_;
    Vec2 near_twist_;              ///< the slope's product with the twist
    int steps_ = 0;                ///< with that slope
    Eigen::Matrix2d slope_, back_; ///< of a triangle: to its reference coordinates, and back
    Vec2 offset_, origin_;
    Waiting waiting_[5]; ///< for the dual functions, and for those that are 1
    Moments dual_;
    std::array<Constant, 4> only_;
    bool has_dual_ = false, has_only_ = false;
};

} // namespace amontons
