#pragma once

#include "contact/surface/polygon.hpp"

namespace amontons {

/// The sides of a convex polygon of three or four corners, which many polygons are compared with:
/// all sides at once.
struct PolygonSides {
    /// A number for each side. A triangle's fourth side is one that nothing lies beyond.
    using PerSide = Eigen::Array4d;
    PerSide from_x, from_y;   ///< where each begins
    PerSide along_x, along_y; ///< from there to its end
    PerSide beyond;           ///< added to what is inside: 1 for a side that does not exist

    PolygonSides() = default;
    /// @param q  of at most four corners, counter-clockwise
    explicit PolygonSides(const ConvexPolygon& q);
    /// twice_area() of each side with x: > 0 inside.
    PerSide operator()(const Vec2& x) const
    {
        return along_x * (x.y() - from_y) - along_y * (x.x() - from_x) + beyond;
    }
};

/// Copies the corners that a polygon has: most have few of those that there is room for.
inline void copy_corners(const ConvexPolygon& from, ConvexPolygon& to)
{
    to.count = from.count;
    for (std::size_t i = 0; i < static_cast<std::size_t>(from.count); ++i)
        to.corner[i] = from.corner[i];
}

/// What p shares with the polygon of these sides, by its sides alone: `part` may turn out to be
/// nothing.
Shared shared_with(const PolygonSides& q, const ConvexPolygon& p);

/// Replaces p by what it shares with the polygon of these sides.
/// @return  false if there is nothing; p is then of no meaning
bool cut_to(const PolygonSides& q, ConvexPolygon& p);

} // namespace amontons
