#pragma once

#include "mesh/wall.hpp"

#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <vector>

// Where round curves touch: rods as chains of cubic pieces with a radius.
//
// Two kinds of contact. Stations, places that are fixed to a curve, are in contact with the nearest
// place of the other body: suited to two curves that run along each other, or a curve along a wall.
// Crossings, pairs of places whose distance is least, move with the geometry: suited to curves that
// cross, or a curve that bends over an edge between two of its stations. Beside a crossing of two
// curves stations are left out.

namespace amontons {

/// A cubic piece of a middle line by its ends and its slopes there (by t from 0 to 1), with the
/// radius of its round surface [m].
struct CurvePiece {
    /// Ends [m], and derivatives by t there [m].
    Vec3 x0, x1, d0, d1;
    /// Of the round surface [m].
    double radius = 0;

    /// The point at t in [0, 1] [m].
    Vec3 at(double t) const;
    Vec3 slope(double t) const; ///< derivative by t [m]
    Vec3 bend(double t) const;  ///< second derivative by t [m]
};

/// A curve: pieces one after another.
struct Curve {
    std::vector<CurvePiece> pieces;
    bool closed = false;       ///< the last piece leads to the first
    std::vector<double> start; ///< arc length at each piece's start, and the end's [m]
};

/// A place on a curve.
struct CurvePlace {
    /// Number of the piece in its curve.
    int piece = 0;
    double t = 0; ///< 0 to 1: parameter
};

/// Length of the curve up to a place [m].
inline double arc_at(const Curve& c, const CurvePlace& p)
{
    const double s0 = c.start[std::size_t(p.piece)], s1 = c.start[std::size_t(p.piece) + 1];
    return s0 + p.t * (s1 - s0);
}

/// The point of a piece at which its distance from x is a local minimum.
/// @return  t, also a little outside [0, 1]; nothing where the minimum is farther outside
std::optional<double> foot(const CurvePiece& piece, const Vec3& x);

/// A contact of a curve with another one, or with a surface (b.piece -1).
struct CurveContact {
    /// The places on the two curves; b is unused against a surface.
    CurvePlace a, b;
    Vec3 point = Vec3::Zero();  ///< between the two surfaces [m]
    Vec3 normal = Vec3::Zero(); ///< unit, from b into a
    double gap = 0;             ///< [m], < 0: overlap
    /// Derivative of the normal by the place on a, of a surface that does not move [1/m].
    Mat3 curvature = Mat3::Zero();
    std::int64_t id = 0; ///< the same while the contact stays near the same places
    /// The place is where the distance is least along this curve: it moves along it as curves move.
    bool slides_a = false, slides_b = false;
};

/// Stations of a curve: the starts of its pieces, its end, and others between them so that none is
/// farther from the next than `spacing` along its piece (0: none between).
/// @param spacing  along the piece [m], >= 0
std::vector<CurvePlace> stations(const Curve& curve, double spacing);

/// The last evaluation of a surface for a station.
struct SeenDistance {
    Vec3 at = Vec3::Zero();                                     ///< where it was [m]
    double distance = -std::numeric_limits<double>::infinity(); ///< [m]; none yet
};

/// Appends contacts of a curve with a surface of gap <= reach: at its stations, and between them
/// where the surface bulges into the curve and is curved more than twice as much (edges, small
/// balls), or more than the curve if the contact is `known`. Of smooth walls stations are enough.
/// @param known  ids that were found before, ascending
/// @param first  stations before it are left out
/// @param seen   of a surface that stands still and is no steeper than a wall: what is known of it
///               from earlier calls. The result is the same without.
/// @param clearance  a lower bound of the distance that costs less, or none [m]; it may be
/// -infinity.
///               The result is the same without.
/// @param reach  largest gap of a contact [m]
void touch_surface(const Curve& a, std::span<const CurvePlace> stations,
                   const std::function<WallSample(const Vec3&)>& surface, double reach,
                   std::span<const std::int64_t> known, std::vector<CurveContact>& out,
                   std::size_t first = 0, std::vector<SeenDistance>* seen = nullptr,
                   const std::function<double(const Vec3&)>& clearance = {});

/// Appends contacts of two curves, or of one with itself (&a == &b), of gap <= reach. A curve
/// touches itself where its arc between is longer than three radii. What lies between stations
/// along each other and a crossing is both in part: their gaps contain an overlap that is allowed,
/// at most 0.01125 of the two radii.
/// @param reach  largest gap of a contact [m]
void touch_curve(const Curve& a, std::span<const CurvePlace> stations, const Curve& b, double reach,
                 std::vector<CurveContact>& out);

/// The ids that a contact of two curves may have next, where its places move on along them; those
/// that have moved least first.
std::vector<std::int64_t> neighbours(std::int64_t id);

/// Whether a contact of that id is of two curves that cross, and follows them.
bool is_crossing(std::int64_t id);

/// True if two curves (or one and itself: &a == &b) pass through each other between `before` and
/// `now`, all places moving in straight lines: their middle lines come nearer than half the sum of
/// the radii. Exact for chords of the pieces, within an eighth of the radii.
bool pass_through(const Curve& a_before, const Curve& a, const Curve& b_before, const Curve& b);

} // namespace amontons
