#include "contact/surface/faceted_surface.hpp"

#include <algorithm>
#include <tuple>

namespace amontons {
FlatParts flat_parts(std::size_t nodes)
{
    static const std::array<std::array<int, 3>, 4> quarters{
        {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}, {3, 4, 5}}};
    static const std::array<std::array<int, 3>, 2> halves{{{0, 1, 2}, {0, 2, 3}}};
    static const std::array<Vec2, 6> triangle{
        Vec2{0, 0}, Vec2{1, 0}, Vec2{0, 1}, Vec2{0.5, 0}, Vec2{0.5, 0.5}, Vec2{0, 0.5}};
    static const std::array<Vec2, 4> square{Vec2{-1, -1}, Vec2{1, -1}, Vec2{1, 1}, Vec2{-1, 1}};
    static const std::array<std::array<int, 2>, 6> of_six{
        {{0, 3}, {3, 1}, {1, 4}, {4, 2}, {2, 5}, {5, 0}}};
    static const std::array<std::array<int, 2>, 4> of_four{{{0, 1}, {1, 2}, {2, 3}, {3, 0}}};
    static const std::array<std::array<int, 2>, 3> of_three{{{0, 1}, {1, 2}, {2, 0}}};
    if (nodes == 6) return {quarters, triangle, of_six};
    if (nodes == 4) return {halves, square, of_four};
    static const std::array<std::array<int, 3>, 1> whole{{{0, 1, 2}}};
    return {whole, triangle, of_three};
}

FacetedSurface::FacetedSurface(const ExternalSurface& surface) : surface_(&surface)
{
    struct Side {
        std::array<std::int32_t, 2> nodes; // ascending
        std::int32_t triangle, edge;
    };
    std::vector<Side> sides;
    std::int32_t most = -1;
    for (std::size_t f = 0; f < surface.faces.size(); ++f) {
        const std::span<const std::int32_t> nodes = surface.face(f);
        const FlatParts parts = flat_parts(nodes.size());
        first_.push_back(triangles_.size());
        for (const std::array<int, 3>& local : parts.triangles) {
            Triangle t;
            t.face = std::int32_t(f);
            for (std::size_t k = 0; k < 3; ++k) {
                t.nodes[k] = nodes[std::size_t(local[k])];
                t.xi[k] = parts.xi[std::size_t(local[k])];
                most = std::max(most, t.nodes[k]);
            }
            for (std::size_t k = 0; k < 3; ++k)
                sides.push_back({std::minmax({t.nodes[k], t.nodes[(k + 1) % 3]}).first ==
                                         t.nodes[k]
                                     ? std::array{t.nodes[k], t.nodes[(k + 1) % 3]}
                                     : std::array{t.nodes[(k + 1) % 3], t.nodes[k]},
                                 std::int32_t(triangles_.size()), std::int32_t(k)});
            triangles_.push_back(t);
        }
        for (const std::array<int, 2>& e : parts.edges) {
            const std::int32_t a = nodes[std::size_t(e[0])], b = nodes[std::size_t(e[1])];
            edges_.push_back({{std::min(a, b), std::max(a, b)}, std::int32_t(f)});
        }
    }
    first_.push_back(triangles_.size());
    std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
        return std::tie(a.nodes, a.triangle) < std::tie(b.nodes, b.triangle);
    });
    for (std::size_t i = 0; i + 1 < sides.size(); ++i) {
        if (sides[i].nodes != sides[i + 1].nodes) continue;
        triangles_[std::size_t(sides[i].triangle)].beside[std::size_t(sides[i].edge)] =
            sides[i + 1].triangle;
        triangles_[std::size_t(sides[i + 1].triangle)].beside[std::size_t(sides[i + 1].edge)] =
            sides[i].triangle;
        ++i;
    }
    std::sort(edges_.begin(), edges_.end(), [](const Edge& a, const Edge& b) {
        return std::tie(a.nodes, a.face) < std::tie(b.nodes, b.face);
    });
    edges_.erase(std::unique(edges_.begin(), edges_.end(),
                             [](const Edge& a, const Edge& b) { return a.nodes == b.nodes; }),
                 edges_.end());
    begin_.assign(std::size_t(most + 2), 0);
    for (const Triangle& t : triangles_)
        for (const std::int32_t n : t.nodes)
            ++begin_[std::size_t(n) + 1];
    for (std::size_t n = 1; n < begin_.size(); ++n)
        begin_[n] += begin_[n - 1];
    around_.resize(3 * triangles_.size());
    std::vector<std::size_t> next(begin_.begin(), begin_.end());
    for (std::size_t t = 0; t < triangles_.size(); ++t)
        for (const std::int32_t n : triangles_[t].nodes)
            around_[next[std::size_t(n)]++] = std::int32_t(t);
}

std::span<const std::int32_t> FacetedSurface::around(std::int32_t node) const
{
    const auto n = std::size_t(node);
    return std::span(around_).subspan(begin_[n], begin_[n + 1] - begin_[n]);
}

} // namespace amontons
