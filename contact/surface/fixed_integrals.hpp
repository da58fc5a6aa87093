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
    struct Point { // of the slave, over a place in the plane
        PerNode N = PerNode::Zero();
        Vec2 z;             ///< its place in the plane
        double stretch = 1; ///< area of the face per area of the plane
    };
    /// int N N^T, int N n^T, int N y^T, int N, with the master's unit normal n and place y; where
    /// a function is 1, without N.
    struct Moments {
        Eigen::Matrix<double, 6, 6> NN;
        Eigen::Matrix<double, 6, 3> Nn, Ny;
        PerNode N;
    };
    struct Constant {
        PerNode N;
        Vec3 n, y;
        double area;
    };
    bool locate_(const Vec2& z, Point& at);
    void find_on_quadrilateral_(const Vec2& z);
    void begin_polygon_(const Vec2& z, double part);
    /// What is integrated at all points of a polygon.
    struct MasterPlane {
        Vec2 corner;             ///< the first of its facet
        Eigen::Matrix2d inverse; ///< to shares of the other two
        Vec3 n[3];               ///< normal there, and its differences to the other two
        bool smooth = false;     ///< that is no unit vector in between
        double height = 0;       ///< of the corner over the plane [m]
        Vec2 slope;
    };
    template <int kNodes> struct Sums;
    void add_block_(const MasterPlane& master, const double* x, const double* y, const double* w,
                    Sums<4>& sums) const;
    template <int kNodes>
    void add_points_(const Facet& master, const ConvexPolygon& polygon, int only, double share);

    const FixedShape& master_;
    const ExternalSurface& surface_;
    std::span<const Vec3> places_;
    const FaceMultipliers* multipliers_ = nullptr;
    FaceSums* sums_ = nullptr;

    // Of the present facet.
    const Facet* facet_ = nullptr;
    std::optional<FacetPlane> plane_;
    FaceInPlane face_{{}, {}};
    Vec3 middle_, along_[2], twist_; ///< of a quadrilateral, in the plane
    double bend_ = 0;                ///< of a quadrilateral: see the .cpp
    double warp_ = 0;                ///< of its corners out of the plane [m]
    Vec2 last_ = Vec2::Zero();       ///< on its reference face
    Eigen::Matrix2d near_slope_;     ///< of its map back, near the present polygon
    double contraction_ = 1;         ///< of the bend over the polygon; 1: too large
    Vec2 polygon_corner_, polygon_xi_;
    int steps_ = 0;                ///< with that slope
    Eigen::Matrix2d slope_, back_; ///< of a triangle: to its reference coordinates, and back
    Vec2 offset_, origin_;
    Moments dual_;
    std::array<Constant, 4> only_;
    bool has_dual_ = false, has_only_ = false;
};

} // namespace amontons
