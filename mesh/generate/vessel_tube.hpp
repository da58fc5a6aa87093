#pragma once

#include "mesh/centreline.hpp"

#include <vector>

namespace amontons {

/// Value, gradient and Hessian of an implicit function; > 0 in the free space.
struct ImplicitSample {
    double value = 0;             ///< [m]
    Vec3 gradient = Vec3::Zero(); ///< [-]
    Mat3 hessian = Mat3::Zero();  ///< [1/m]
};

/// The free space inside a tube of straight pieces and arcs that half balls close: the function of
/// SweptTube, without its search among many pieces and its derivatives of any curve. A vessel's
/// samples are mostly that function.
class VesselTube {
public:
    /// @param line  of straight pieces and arcs
    explicit VesselTube(const Centreline& line);

    /// Signed distance at x [m].
    double distance(const Vec3& x) const;
    /// The same with its unit normal and Hessian.
    ImplicitSample sample(const Vec3& x) const;

private:
    /// c(u) = a0 + u a1, or on an arc around a0 (u / bend from a2 towards a1).
    struct Piece {
        Vec3 a0, a1, a2 = Vec3::Zero();
        double bend = 0; ///< radius of the arc [m]; 0: straight
        double range = 0, radius = 0, slope = 0;
    };
    struct Foot {
        const Piece* piece = nullptr;
        double u = 0, squared = 0;
        bool closed = false; ///< on a ball that closes the tube
    };
    Foot foot_(const Vec3& x) const;
    static double focal_(const Piece& p, const Vec3& x);

    std::vector<Piece> pieces_;
};

} // namespace amontons
