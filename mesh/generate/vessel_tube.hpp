#pragma once

#include "mesh/centreline.hpp"

#include <limits>
#include <vector>

namespace amontons {

/// Value, gradient and Hessian of an implicit function; > 0 in the free space.
struct ImplicitSample {
    double value = 0;             ///< [m]
    Vec3 gradient = Vec3::Zero(); ///< [-]
    Mat3 hessian = Mat3::Zero();  ///< [1/m]
};

/// The pieces of a tube among which are those nearest to the points of a ball.
struct TubePart {
    int first = 0, last = std::numeric_limits<int>::max(); ///< all, if nothing is known
    /// It is one piece, and no nearest point is one of its ends: evaluations are then about ten
    /// times as fast.
    bool inside = false;
};

/// The free space inside a tube of straight pieces and arcs that half balls close: the function of
/// SweptTube, without its search among many pieces and its derivatives of any curve. A vessel's
/// samples are mostly that function.
class VesselTube {
public:
    /// @param line  of straight pieces and arcs
    explicit VesselTube(const Centreline& line);

    /// The part that a ball's points are nearest to.
    /// @param radius  of the ball [m]
    TubePart part_around(const Vec3& centre, double radius) const;

    /// Signed distance at x [m].
    /// @param part  of a ball around x; what is returned depends on it by rounding alone
    double distance(const Vec3& x, const TubePart& part = {}) const
    {
        return part.inside ? inside_(pieces_[std::size_t(part.first)], x) : any_(x, part);
    }
    /// Its unit normal at x, into the free space.
    /// @param part  as of distance()
    Vec3 normal(const Vec3& x, const TubePart& part) const
    {
        return part.inside ? normal_inside_(pieces_[std::size_t(part.first)], x)
                           : any_normal_(x, part);
    }
    /// Distance, unit normal and Hessian.
    /// @param part  as of distance()
    ImplicitSample sample(const Vec3& x, const TubePart& part = {}) const;

private:
    /// c(u) = a0 + u a1, or on an arc around a0 (u / bend from a2 towards a1).
    struct Piece {
        Vec3 a0, a1, a2 = Vec3::Zero();
        double bend = 0;             ///< radius of the arc [m]; 0: straight
        double sine = 0, cosine = 1; ///< of the arc's angle
        double range = 0, radius = 0, slope = 0;
        double steepness = 1; ///< of a straight piece: sqrt(1 + slope^2)
    };
    struct Foot {
        const Piece* piece = nullptr;
        double u = 0, squared = 0;
        bool closed = false; ///< on a ball that closes the tube
    };
    struct Across {
        Vec3 e, tangent, bent; ///< from the foot to x; of the middle line there: c', c''
        double d = 0, gap = 0; ///< size of e, distance along it
    };
    static double nearest_(const Piece& p, const Vec3& x, double beyond, double& u);
    static double along_arc_(const Piece& p, const Vec3& x);
    Foot foot_(const Vec3& x, const TubePart& part) const;
    double any_(const Vec3& x, const TubePart& part) const;
    static Across across_(const Foot& f, const Vec3& x, bool inside);
    Vec3 any_normal_(const Vec3& x, const TubePart& part) const;
    static Foot foot_inside_(const Piece& p, const Vec3& x);
    static double focal_(const Piece& p, const Vec3& x);
    static double inside_(const Piece& p, const Vec3& x);
    Vec3 normal_inside_(const Piece& p, const Vec3& x) const;

    std::vector<Piece> pieces_;
};

} // namespace amontons
