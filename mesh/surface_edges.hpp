#pragma once

#include "mesh/surface_mesh.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace amontons {

/// One side of a triangle: from vertex to vertex, counter-clockwise.
struct HalfEdge {
    std::int32_t begin = 0, end = 0; ///< vertices
    std::int32_t triangle = 0;
};

/// All sides of all triangles, those of one edge next to each other. Triangles with a vertex
/// twice (collapsed by weld) are left out, so that their neighbours are adjacent.
/// Edges come in the order of their smaller, then their larger vertex; within one, triangles
/// in ascending order. O(n log n).
std::vector<HalfEdge> sorted_half_edges(const SurfaceMesh& mesh);

/// Calls visit(std::span<const HalfEdge>) for each edge with all its sides.
template <class Visit> void for_each_edge(const std::vector<HalfEdge>& sorted, Visit visit)
{
    const auto same_edge = [](const HalfEdge& a, const HalfEdge& b) {
        return (a.begin == b.begin && a.end == b.end) || (a.begin == b.end && a.end == b.begin);
    };
    for (std::size_t i = 0, j = 0; i < sorted.size(); i = j) {
        while (j < sorted.size() && same_edge(sorted[i], sorted[j]))
            ++j;
        visit(std::span<const HalfEdge>(&sorted[i], j - i));
    }
}

} // namespace amontons
