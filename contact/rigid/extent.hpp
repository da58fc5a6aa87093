#pragma once

#include "contact/rigid/shape.hpp"

// How far bodies of triangles reach, by their trees.

namespace amontons {

/// The vertex of a body's polyhedron with the least direction . x; of several the first.
std::int32_t lowest_vertex(const TriangleShape& body, const Vec3& direction);
/// Least direction . x of its vertices [m].
double lowest_along(const TriangleShape& body, const Vec3& direction);
/// The largest distance of its vertices from the origin [m]; O(n).
double farthest_vertex(const TriangleShape& body);

/// The vertices of those triangles whose boxes pass a test, as do all boxes around them in the tree;
/// ascending.
/// @param test      of a BoundingBox in the body's frame
/// @param vertices  replaced
template <class Test>
void vertices_where(const TriangleShape& body, Test test, std::vector<std::int32_t>& vertices)
{
    vertices.clear();
    body.tree.visit_where(test, [&](std::int32_t t) {
        for (const std::int32_t p : body.mesh.triangles[static_cast<std::size_t>(t)])
            if (const std::int32_t v = body.polyhedron.corner_of[static_cast<std::size_t>(p)];
                v >= 0)
                vertices.push_back(v);
    });
    std::sort(vertices.begin(), vertices.end());
    vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
}

} // namespace amontons
