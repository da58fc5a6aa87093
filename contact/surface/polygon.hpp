#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

// Convex polygons in a plane: what remains of faces where they face each other.

namespace amontons {

using Vec2 = Eigen::Vector2d;

/// Corners in counter-clockwise order.
struct ConvexPolygon {
    /// Most corners of a polygon.
    static constexpr int kMost = 16;
    /// Its corners, counter-clockwise.
    std::array<Vec2, kMost> corner;
    /// Number of corners.
    int count = 0;

    const Vec2& operator[](int i) const { return corner[static_cast<std::size_t>(i)]; }
    /// Appends a corner.
    void add(const Vec2& x) { corner[static_cast<std::size_t>(count++)] = x; }
};

/// Twice the area of (a, b, c), > 0 if counter-clockwise [unit of the corners, squared].
inline double twice_area(const Vec2& a, const Vec2& b, const Vec2& c)
{
    return (b.x() - a.x()) * (c.y() - a.y()) - (c.x() - a.x()) * (b.y() - a.y());
}

/// Area of a convex polygon [unit of the corners, squared].
double area(const ConvexPolygon& p);

/// The mean of the corners.
Vec2 middle(const ConvexPolygon& p);

/// The centroid of the outline, sides weighted by their length: an additional side without length
/// changes nothing.
Vec2 middle_of_outline(const ConvexPolygon& p);

/// The part of p on the left of the line from a to b. At most one corner more than p has; a
/// polygon that is full already loses a corner.
void keep_left(const ConvexPolygon& p, const Vec2& a, const Vec2& b, ConvexPolygon& out);

/// What a polygon shares with another.
enum class Shared { nothing, part, all };
/// Of p with q, by the sides of q alone: `part` may turn out to be nothing.
Shared shared_with(const ConvexPolygon& q, const ConvexPolygon& p);

/// Replaces p by what it shares with q, cut by those sides alone that it crosses.
/// @return  false if there is nothing; p is then of no meaning
bool cut_to(const ConvexPolygon& q, ConvexPolygon& p);

/// What p and q share, empty if they share no area.
void intersect(const ConvexPolygon& p, const ConvexPolygon& q, ConvexPolygon& out);

/// The difference p \ q as convex pieces, appended to `pieces`.
/// @param least  pieces up to this area are left out [unit of the corners squared]
void subtract(const ConvexPolygon& p, const ConvexPolygon& q, double least,
              std::vector<ConvexPolygon>& pieces);

} // namespace amontons
