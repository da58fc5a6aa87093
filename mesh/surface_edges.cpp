#include "mesh/surface_edges.hpp"

#include <algorithm>

namespace amontons {

std::vector<HalfEdge> sorted_half_edges(const SurfaceMesh& mesh)
{
    std::vector<HalfEdge> edges;
    edges.reserve(3 * mesh.triangles.size());
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const auto& [a, b, c] = mesh.triangles[t];
        if (a == b || b == c || c == a) continue;
        const auto triangle = static_cast<std::int32_t>(t);
        edges.push_back({a, b, triangle});
        edges.push_back({b, c, triangle});
        edges.push_back({c, a, triangle});
    }
    const auto key = [](const HalfEdge& e) {
        const auto low = static_cast<std::uint64_t>(std::min(e.begin, e.end));
        return low << 32 | static_cast<std::uint64_t>(std::max(e.begin, e.end));
    };
    std::sort(edges.begin(), edges.end(), [key](const HalfEdge& e, const HalfEdge& f) {
        const std::uint64_t a = key(e), b = key(f);
        return a < b || (a == b && e.triangle < f.triangle);
    });
    return edges;
}

} // namespace amontons
