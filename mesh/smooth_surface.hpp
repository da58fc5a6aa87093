#pragma once

#include "mesh/surface_mesh.hpp"

#include <vector>

namespace amontons {

/// A place on a smooth surface: barycentric coordinates in one of its curved triangles.
struct PatchPoint {
    /// Number of the patch; -1: none.
    std::int32_t patch = -1;
    Vec3 weights = Vec3::Zero();  ///< sum 1, each >= 0
    Vec3 position = Vec3::Zero(); ///< [m]
    Vec3 normal = Vec3::Zero();   ///< unit, of the curved triangle; on an edge the mean of two
};

/// A nearly smooth surface through the vertices of a coarse one: every triangle becomes a
/// cubic one whose corners have the vertices' normals. Neighbours share their edge curve
/// exactly and their tangent planes nearly. Edges sharper than a crease angle stay straight
/// and sharp.
/// Source: Vlachos, Peters, Boyd & Mitchell, Curved PN triangles, I3D 2001.
class SmoothSurface {
public:
    /// @param coarse  manifold, consistently oriented; triangles without area are left out
    /// @param crease  angle between the normals of neighbours above which an edge is sharp [rad]
    SmoothSurface(SurfaceMesh coarse, double crease);

    /// Every curved triangle divided into n^2 flat ones, without cracks: triangle k of the result
    /// belongs to patch k / n^2.
    SurfaceMesh refined(int n) const;

    /// Barycentric coordinates in its patch of a point in triangle k of refined(n).
    Vec3 weights_in_patch(std::int32_t k, int n, const Vec3& weights) const;

    /// The point of a patch at barycentric coordinates [m].
    Vec3 point(std::int32_t patch, const Vec3& weights) const;

    /// Three coordinates and a zero: one register.
    using Wide = Eigen::Array4d;

    /// A curved triangle's Bezier points b_ijk, weights u^i v^j w^k [m].
    struct Patch {
        /// Number of the patch.
        std::int32_t number = -1;
        /// Control points of the cubic triangle [m].
        Wide b300, b030, b003, b210, b120, b021, b012, b102, b201, b111;
    };

    /// The nearest point to x by Newton's method from a start near it; on that patch or the
    /// one beside it.
    /// @param last  of an earlier call or {}: where it is of the same patch, it is not made anew
    PatchPoint nearest(const Vec3& x, std::int32_t patch, const Vec3& weights, Patch& last) const;
    PatchPoint nearest(const Vec3& x, std::int32_t patch, const Vec3& weights) const
    {
        Patch own;
        return nearest(x, patch, weights, own);
    }

    /// Largest distance of the curved triangles from the flat ones, sampled [m].
    double deviation() const;

    const SurfaceMesh& coarse() const { return coarse_; }
    double crease() const { return crease_; } ///< [rad]

private:
    struct Local { // position and derivatives along the second and third weight
        Wide s, su, sv, suu, suv, svv;

        Vec3 position() const { return s.head<3>().matrix(); }
        Vec3 across() const // not of unit length
        {
            return {su[1] * sv[2] - su[2] * sv[1], su[2] * sv[0] - su[0] * sv[2],
                    su[0] * sv[1] - su[1] * sv[0]};
        }
    };

    Patch patch_(std::int32_t i) const;
    static Local local_(const Patch& p, double u, double v);
    bool inside_(const Patch& p, const Vec3& x, double& u, double& v, Local& at) const;
    static double along_edge_(const Patch& p, const Vec3& x, int edge, double t, Local& at);

    SurfaceMesh coarse_;
    double crease_;
    std::vector<std::array<Vec3, 3>> normals_;            ///< of each triangle's corners
    std::vector<std::array<std::int32_t, 3>> neighbours_; ///< across edge k, or -1
    std::vector<std::array<std::uint8_t, 3>> sharp_;      ///< edge k
};

} // namespace amontons
