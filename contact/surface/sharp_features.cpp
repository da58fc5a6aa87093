#include "contact/surface/sharp_contacts.hpp"

#include <algorithm>
#include <map>
#include <numeric>

namespace amontons {
namespace {

/// Pieces that turn by less at a node are one chain (cosine).
constexpr double kStraightOn = 0.75;

/// Joins sharp pieces that follow one another, and turns them the same way.
void make_chains(SharpFeatures& f, std::span<const Vec3> places)
{
    std::map<std::int32_t, std::vector<std::size_t>> at_node;
    for (std::size_t i = 0; i < f.sharp; ++i)
        for (const std::int32_t node : f.pieces[i].nodes)
            at_node[node].push_back(i);
    // The piece that continues from this one beyond a node, or itself.
    const auto next = [&](std::size_t i, std::int32_t node) {
        const std::vector<std::size_t>& here = at_node[node];
        if (here.size() != 2) return i;
        const std::size_t other = here[0] == i ? here[1] : here[0];
        const auto away = [&](std::size_t k) {
            const auto& n = f.pieces[k].nodes;
            const std::int32_t end = n[0] == node ? n[1] : n[0];
            return Vec3((places[std::size_t(end)] - places[std::size_t(node)]).normalized());
        };
        return away(i).dot(away(other)) < -kStraightOn ? other : i;
    };
    for (std::size_t start = 0; start < f.sharp; ++start) {
        if (f.pieces[start].chain >= 0) continue;
        f.pieces[start].chain = f.chains;
        for (const std::size_t end : {1u, 0u}) { // forwards, then backwards
            std::size_t i = start;
            for (;;) {
                const std::int32_t node = f.pieces[i].nodes[end];
                const std::size_t k = next(i, node);
                f.pieces[i].ends[end] = k == i;
                if (k == i || f.pieces[k].chain >= 0) break;
                SharpFeatures::Piece& p = f.pieces[k];
                if (p.nodes[1 - end] != node) std::swap(p.nodes[0], p.nodes[1]);
                p.chain = f.chains;
                i = k;
            }
        }
        ++f.chains;
    }
}

} // namespace

SharpFeatures sharp_features(const ExternalSurface& surface, std::span<const Vec3> places,
                             double sharp)
{
    SharpFeatures f;
    f.smooth = SmoothGroups(surface, places);
    std::vector<SharpFeatures::Piece> others;
    for (const SurfaceEdge& e : find_edges(surface, places).edges) {
        if (e.faces[1] < 0) continue;
        const bool is_sharp = e.angle < std::numbers::pi - sharp;
        auto& pieces = is_sharp ? f.pieces : others;
        const std::array<bool, 2> ends{!is_sharp, !is_sharp};
        if (e.middle < 0) {
            pieces.push_back({e.nodes, e.faces, -1, ends});
        } else {
            pieces.push_back({{e.nodes[0], e.middle}, e.faces, -1, ends});
            pieces.push_back({{e.middle, e.nodes[1]}, e.faces, -1, ends});
        }
    }
    f.sharp = f.pieces.size();
    make_chains(f, places);
    f.pieces.insert(f.pieces.end(), others.begin(), others.end());

    for (std::size_t i = 0; i < f.sharp; ++i)
        f.nodes.insert(f.nodes.end(), f.pieces[i].nodes.begin(), f.pieces[i].nodes.end());
    std::sort(f.nodes.begin(), f.nodes.end());
    f.nodes.erase(std::unique(f.nodes.begin(), f.nodes.end()), f.nodes.end());
    std::vector<std::vector<std::int32_t>> around(f.nodes.size());
    for (std::size_t face = 0; face < surface.faces.size(); ++face)
        for (const std::int32_t node : surface.face(face)) {
            const auto at = std::lower_bound(f.nodes.begin(), f.nodes.end(), node);
            if (at != f.nodes.end() && *at == node)
                around[std::size_t(at - f.nodes.begin())].push_back(std::int32_t(face));
        }
    f.begin.push_back(0);
    for (const std::vector<std::int32_t>& faces : around) {
        f.faces.insert(f.faces.end(), faces.begin(), faces.end());
        f.begin.push_back(f.faces.size());
    }
    return f;
}

} // namespace amontons
