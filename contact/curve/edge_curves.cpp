#include "contact/curve/edge_curves.hpp"

#include "mesh/base/index.hpp"

#include <Eigen/Geometry>
#include <map>

namespace amontons {
namespace {

Vec3 face_normal(const ExternalSurface& surface, std::span<const Vec3> places, std::int32_t face)
{
    const std::span<const std::int32_t> n = surface.face(at(face));
    const std::size_t last = surface.corners[at(face)] == 4 ? 3 : 2;
    // Diagonals of a quadrilateral.
    const Vec3 a = places[at(n[last - 1])] - places[at(n[0])],
               b = places[at(n[last])] - places[at(n[last == 3 ? 1 : 0])];
    return a.cross(b).normalized();
}

/// The pieces of each chain in their order along it.
std::vector<std::vector<std::size_t>> chains_of(const SharpFeatures& f)
{
    std::vector<std::map<std::int32_t, std::size_t>> by_start(std::size_t(f.chains));
    for (std::size_t i = 0; i < f.sharp; ++i)
        by_start[at(f.pieces[i].chain)].emplace(f.pieces[i].nodes[0], i);
    std::vector<std::vector<std::size_t>> chains;
    for (const auto& start : by_start) {
        if (start.empty()) continue;
        std::size_t i = start.begin()->second;
        for (const auto& [node, piece] : start)
            if (f.pieces[piece].ends[0]) i = piece;
        std::vector<std::size_t>& chain = chains.emplace_back();
        while (chain.size() < start.size()) {
            chain.push_back(i);
            const auto next = start.find(f.pieces[i].nodes[1]);
            if (f.pieces[i].ends[1] || next == start.end()) break;
            i = next->second;
        }
    }
    return chains;
}

} // namespace

std::vector<EdgeCurve> edge_curves(const SharpSurface& s)
{
    std::vector<EdgeCurve> out;
    for (const std::vector<std::size_t>& chain : chains_of(s.features)) {
        const std::size_t n = chain.size();
        const auto piece = [&](std::size_t i) -> const SharpFeatures::Piece& {
            return s.features.pieces[chain[i % n]];
        };
        const auto x = [&](std::size_t i, std::size_t end) -> const Vec3& {
            return s.places[at(piece(i).nodes[end])];
        };
        const auto length = [&](std::size_t i) { return (x(i, 1) - x(i, 0)).norm(); };
        EdgeCurve e;
        e.curve.closed = n > 2 && !piece(0).ends[0] && piece(n - 1).nodes[1] == piece(0).nodes[0];
        e.curve.start.push_back(0);
        for (std::size_t i = 0; i < n; ++i) {
            const bool first = i == 0 && !e.curve.closed, last = i + 1 == n && !e.curve.closed;
            const std::size_t before = first ? i : i + n - 1, after = last ? i : i + 1;
            const double L = length(i);
            const std::array<double, 2> share{first ? 1 : L / (L + length(before)),
                                              last ? 1 : L / (L + length(after))};
            const std::array<std::int32_t, 4> nodes{piece(before).nodes[0], piece(i).nodes[0],
                                                    piece(i).nodes[1], piece(after).nodes[1]};
            e.nodes.push_back(nodes);
            e.slope.push_back(share);
            e.curve.pieces.push_back({x(i, 0), x(i, 1), share[0] * (x(i, 1) - x(before, 0)),
                                      share[1] * (x(after, 1) - x(i, 0)), 0});
            e.curve.start.push_back(e.curve.start.back() + L);
            Vec3 outwards = Vec3::Zero();
            for (const std::int32_t face : piece(i).faces)
                outwards += face_normal(s.surface, s.places, face);
            e.outwards.push_back(outwards);
        }
        out.push_back(std::move(e));
    }
    return out;
}

std::array<StencilEntry, 4> EdgeCurve::at(const CurvePlace& place) const
{
    const auto i = std::size_t(place.piece);
    const double t = place.t, u = t * t * (3 - 2 * t);
    const double d0 = slope[i][0] * t * (1 - t) * (1 - t), d1 = -slope[i][1] * t * t * (1 - t);
    // x = (1 - u) x0 + u x1 + d0 (x1 - before) + d1 (after - x0)
    return {
        {{nodes[i][0], -d0}, {nodes[i][1], 1 - u - d1}, {nodes[i][2], u + d0}, {nodes[i][3], d1}}};
}

std::int32_t EdgeCurve::end_at(const CurvePlace& place) const
{
    if (curve.closed) return -1;
    if (place.piece == 0 && place.t == 0) return nodes.front()[1];
    if (std::size_t(place.piece) + 1 == nodes.size() && place.t == 1) return nodes.back()[2];
    return -1;
}

} // namespace amontons
