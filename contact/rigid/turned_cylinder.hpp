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

    /// Signed distance of an end along the axis [m]: -half_length or half_length.
    double side(std::size_t end) const { return end == 0 ? -1 : 1; }
    /// Centre of an end [m].
    Vec3 end_centre(std::size_t end) const { return centre + side(end) * half_length * axis; }
    /// Along the axis, from the centre [m].
    double along(const Vec3& x) const { return axis.dot(x - centre); }
    /// From the axis to x.
    Vec3 across(const Vec3& x) const { return x - centre - along(x) * axis; }
    /// How far it reaches along a unit vector [m].
    double highest(const Vec3& n) const
    {
        const double c = n.dot(axis); // not 1 - c^2: it loses half the digits near the axis
        return n.dot(centre) + half_length * std::abs(c) + radius * (n - c * axis).norm();
    }
    /// The least n . x of its points [m].
    double lowest(const Vec3& n) const { return -highest(-n); }
};

/// Places on a rim and a line where the way between them is normal to both.
struct RimCrossing {
    Vec3 on_rim, on_line, tangent; ///< of the rim, unit
    double t = 0;                  ///< place on the line [m]
};

/// The one found by Newton's method from a place on the line; nothing if it does not settle.
/// @param from, along  the line, its direction unit
std::optional<RimCrossing> rim_crossing(const TurnedCylinder& cylinder, std::size_t end,
                                        const Vec3& from, const Vec3& along, double start);

/// Where to start: where the line crosses the rim, seen along the axis, or comes nearest to it.
/// @returns how many
int crossing_starts(const TurnedCylinder& cylinder, const Vec3& from, const Vec3& along,
                    double starts[2]);

} // namespace amontons
