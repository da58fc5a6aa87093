#pragma once

#include "contact/rigid/pair_contacts.hpp"

#include <optional>

// A cylinder in the frame of another body, for the pairs that it is part of.

namespace amontons {

/// A cylinder in the frame of a pair.
struct TurnedCylinder {
    /// Of the cylinder [m].
    double radius, half_length;
    /// Centre [m], unit axis, and two unit directions across it.
    Vec3 centre, axis, x_axis, y_axis;

    TurnedCylinder(const Cylinder& own, const Mat3& turn, const Vec3& shift)
        : radius(own.radius)
        , half_length(own.half_length)
        , centre(shift)
        , axis(turn.col(2))
        , x_axis(turn.col(0))
        , y_axis(turn.col(1))
    {
    }

    /// Side of the centre on which an end lies, along the axis: -1 for end 0, 1 for end 1 [-].
    double side(std::size_t end) const { return end == 0 ? -1 : 1; }
    /// Centre of an end [m].
    Vec3 end_centre(std::size_t end) const { return centre + side(end) * half_length * axis; }
    /// Coordinate of x along the axis, from the centre [m].
    double along(const Vec3& x) const { return axis.dot(x - centre); }
    /// Vector from the axis to x, normal to the axis [m].
    Vec3 across(const Vec3& x) const { return x - centre - along(x) * axis; }
    /// The greatest n . x of its points, n unit [m].
    double highest(const Vec3& n) const
    {
        const double c = n.dot(axis); // not 1 - c^2: it loses half the digits near the axis
        return n.dot(centre) + half_length * std::abs(c) + radius * (n - c * axis).norm();
    }
    /// The least n . x of its points [m].
    double lowest(const Vec3& n) const { return -highest(-n); }
};

/// A point on a rim and one on a line whose connection is normal to both.
struct RimCrossing {
    Vec3 on_rim, on_line; ///< the two points [m]
    Vec3 tangent;         ///< of the rim there, unit
    double t = 0;         ///< distance of on_line from the line's origin [m]
};

/// The one found by Newton's method from a place on the line; nothing if it does not settle.
/// @param from, along  the line, its direction unit
std::optional<RimCrossing> rim_crossing(const TurnedCylinder& cylinder, std::size_t end,
                                        const Vec3& from, const Vec3& along, double start);

/// Starts for rim_crossing: where the line crosses the rim, seen along the axis, or comes nearest
/// to it [m along the line].
/// @returns their number, 1 or 2
int crossing_starts(const TurnedCylinder& cylinder, const Vec3& from, const Vec3& along,
                    double starts[2]);

} // namespace amontons
