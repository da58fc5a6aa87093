#include "contact/surface/feet_on_faces.hpp"

#include "mesh/base/dense.hpp"
#include "mesh/base/index.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

namespace amontons {
namespace {

constexpr double kOn = 1e-7;       // of a reference face: a foot beyond its border is still on it
constexpr double kSameFoot = 1e-9; // of a facet's size: two places that are one
constexpr double kSharp = std::numbers::pi / 6; // between normals, at rest
// A foot along a smooth normal may be so many times farther than the nearest point: in a dent, and
// where that is on a sharp edge.
constexpr double kDent = 2, kEdge = 1.05;

std::array<std::int32_t, 2> edge(std::int32_t a, std::int32_t b)
{
    return {std::min(a, b), std::max(a, b)};
}

/// Of a T3 or Q4, unit.
Vec3 normal_of_nodes(std::span<const std::int32_t> nodes, std::span<const Vec3> places)
{
    const auto x = [&](std::size_t k) -> const Vec3& { return places[at(nodes[k])]; };
    const bool four = nodes.size() == 4;
    return (x(four ? 2 : 1) - x(0)).cross(four ? x(3) - x(1) : x(2) - x(0)).normalized();
}

/// The faces that a box touches, and those that share a node with them, as T3 and Q4.
/// @param near_faces  gets how many of the result are the former
ExternalSurface part_near(const ExternalSurface& surface, std::span<const Vec3> places,
                          const BoundingBox& near, std::size_t& near_faces)
{
    constexpr int kQuarters[4][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}, {3, 4, 5}};
    ExternalSurface out;
    out.used_nodes = surface.used_nodes;
    out.surface_nodes = surface.surface_nodes;
    out.starts.push_back(0);
    const auto add = [&](std::span<const std::int32_t> nodes, std::size_t f) {
        out.nodes.insert(out.nodes.end(), nodes.begin(), nodes.end());
        out.starts.push_back(std::int64_t(out.nodes.size()));
        out.corners.push_back(std::uint8_t(nodes.size()));
        out.faces.push_back(surface.faces[f]);
    };
    const auto add_parts = [&](std::size_t f) {
        const std::span<const std::int32_t> n = surface.face(f);
        if (n.size() != 6) return add(n, f);
        for (const auto& q : kQuarters)
            add(std::array{n[at(q[0])], n[at(q[1])], n[at(q[2])]}, f);
    };
    std::vector<char> is_near(surface.faces.size(), 0), node_near(surface.used_nodes.size(), 0);
    for (std::size_t f = 0; f < surface.faces.size(); ++f) {
        BoundingBox box;
        for (const std::int32_t node : surface.face(f))
            box.add(places[at(node)]);
        if (!near.touches(box)) continue;
        is_near[f] = 1;
        for (const std::int32_t node : surface.face(f))
            node_near[at(surface.surface_nodes[at(node)])] = 1;
        add_parts(f);
    }
    near_faces = out.faces.size();
    for (std::size_t f = 0; f < surface.faces.size() && near_faces > 0; ++f) {
        const std::span<const std::int32_t> nodes = surface.face(f);
        if (is_near[f] == 0 && std::any_of(nodes.begin(), nodes.end(), [&](std::int32_t node) {
                return node_near[at(surface.surface_nodes[at(node)])] != 0;
            }))
            add_parts(f);
    }
    return out;
}

} // namespace

FeetOnFaces::FeetOnFaces(const ExternalSurface& surface, std::span<const Vec3> places,
                         std::span<const Vec3> at_rest, const BoundingBox& near)
    : places_(places)
{
    std::size_t near_faces = 0;
    surface_ = part_near(surface, places, near, near_faces);
    if (near_faces == 0) return;
    normals_.emplace(surface_, places, kSharp, at_rest);
    facets_ = facets_of(surface_, places);
    begin_.assign(surface.used_nodes.size() + 1, 0);
    struct Side {
        std::array<std::int32_t, 2> nodes;
        std::int32_t face;
    };
    std::vector<Side> sides;
    for (std::size_t f = 0; f < surface_.faces.size(); ++f) {
        const std::span<const std::int32_t> nodes = surface_.face(f);
        for (std::size_t k = 0; k < nodes.size(); ++k) {
            sides.push_back({edge(nodes[k], nodes[(k + 1) % nodes.size()]), std::int32_t(f)});
            ++begin_[at(surface_.surface_nodes[at(nodes[k])]) + 1];
        }
    }
    std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
    around_.resize(surface_.nodes.size());
    std::vector<std::int32_t> next(begin_.begin(), begin_.end() - 1);
    for (std::size_t f = 0; f < surface_.faces.size(); ++f)
        for (const std::int32_t node : surface_.face(f))
            around_[at(next[at(surface_.surface_nodes[at(node)])]++)] = std::int32_t(f);
    std::sort(sides.begin(), sides.end(),
              [](const Side& a, const Side& b) { return a.nodes < b.nodes; });
    for (Edges* edges : {&border_, &sharp_})
        edges->has.assign(surface.used_nodes.size(), 0);
    for (std::size_t i = 0; i < sides.size();) {
        std::size_t end = i + 1;
        while (end < sides.size() && sides[end].nodes == sides[i].nodes)
            ++end;
        const auto add = [&](Edges& edges) {
            edges.nodes.push_back(sides[i].nodes);
            for (const std::int32_t node : sides[i].nodes)
                edges.has[at(surface_.surface_nodes[at(node)])] = 1;
        };
        if (end == i + 1)
            add(border_);
        else if (normal_of_nodes(surface_.face(at(sides[i].face)), at_rest)
                     .dot(normal_of_nodes(surface_.face(at(sides[i + 1].face)), at_rest)) <
                 std::cos(kSharp))
            add(sharp_);
        i = end;
    }
    std::erase_if(facets_, [&](const Facet& f) { return at(f.face) >= near_faces; });
    tree_.emplace(boxes_of(facets_));
}

/// Whether a foot is on one of these edges, or one of their ends.
bool FeetOnFaces::is_on(const Edges& edges, const FaceFoot& foot) const
{
    std::array<std::int32_t, 4> ends{};
    std::size_t count = 0;
    for (int k = 0; k < foot.nodes; ++k)
        if (foot.node[std::size_t(k)].weight > kSameFoot)
            ends[count++] = foot.node[std::size_t(k)].node;
    if (count == 1) return edges.has[at(surface_.surface_nodes[at(ends[0])])] != 0;
    return count == 2 &&
           std::binary_search(edges.nodes.begin(), edges.nodes.end(), edge(ends[0], ends[1]));
}

double FeetOnFaces::length_along(const FaceFoot& foot, const Vec3& along) const
{
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (int k = 0; k < foot.nodes; ++k) {
        const double s = places_[at(foot.node[std::size_t(k)].node)].dot(along);
        low = std::min(low, s);
        high = std::max(high, s);
    }
    return high - low;
}

double FeetOnFaces::width_at(std::int32_t node, const Vec3& along) const
{
    if (empty()) return 0;
    const std::size_t number = at(surface_.surface_nodes[at(node)]);
    const bool any = along.isZero(0);
    double widest = 0;
    for (std::int32_t i = begin_[number]; i < begin_[number + 1]; ++i) {
        const std::span<const std::int32_t> nodes = surface_.face(at(around_[at(i)]));
        for (std::size_t k = 0; k < nodes.size(); ++k)
            for (std::size_t l = 0; l < k; ++l) {
                const Vec3 d = places_[at(nodes[k])] - places_[at(nodes[l])];
                widest = std::max(widest, any ? d.norm() : std::abs(d.dot(along)));
            }
    }
    return widest;
}

FaceFoot FeetOnFaces::foot_at(const Facet& facet, const Vec2& xi) const
{
    const std::span<const std::int32_t> nodes = surface_.face(at(facet.face));
    const PerNode values = shape_values(int(nodes.size()), xi);
    FaceFoot foot;
    foot.nodes = int(nodes.size());
    for (std::size_t k = 0; k < nodes.size(); ++k) {
        foot.node[k] = {nodes[k], values[Eigen::Index(k)]};
        foot.place += values[Eigen::Index(k)] * places_[at(nodes[k])];
    }
    return foot;
}

/// Along the smooth normal of one face: x = y(xi) + s N(xi), by Newton's method.
std::optional<FaceFoot> FeetOnFaces::over(const Candidate& c, const Vec3& x) const
{
    const std::int32_t f = c.facet->face;
    if (!normals_->has(f)) return {};
    const FaceInPlane face(surface_.face(at(f)), places_);
    FaceInPlane normal = face;
    for (int k = 0; k < face.nodes; ++k)
        normal.node[std::size_t(k)] = normals_->corner(f, k);
    Vec2 xi = c.point.xi;
    double s = c.facet->normal.dot(x - c.point.place);
    constexpr int kSteps = 30;
    for (int i = 0; i < kSteps; ++i) {
        const FaceSpot y = spot(face, xi), n = spot(normal, xi);
        Mat3 J;
        J << y.along[0] + s * n.along[0], y.along[1] + s * n.along[1], n.place;
        const Vec3 step = solve_small(J, x - y.place - s * n.place);
        if (!step.allFinite() || step.head<2>().cwiseAbs().maxCoeff() > 10) return {};
        xi += step.head<2>();
        s += step.z();
        if (step.head<2>().norm() > 1e-13) continue;
        const bool on = face.nodes == 4 ? xi.cwiseAbs().maxCoeff() <= 1 + kOn
                                        : xi.minCoeff() >= -kOn && xi.sum() <= 1 + kOn;
        if (!on) return {};
        FaceFoot foot = foot_at(*c.facet, xi);
        const Vec3 along = spot(normal, xi).place;
        foot.distance = s * along.norm();
        foot.normal = along.normalized();
        return foot;
    }
    return {};
}

/// Over no face: the nearest point, of an edge or a corner.
/// @param nearest  all facets that have it
std::optional<FaceFoot> FeetOnFaces::beyond(std::span<const Candidate> nearest, const Vec3& x) const
{
    const Candidate& c = nearest.front();
    FaceFoot foot = foot_at(*c.facet, c.point.xi);
    if (is_on(border_, foot)) return {};
    Vec3 outwards = Vec3::Zero();
    for (const Candidate& n : nearest)
        outwards += n.facet->normal;
    const Vec3 d = x - foot.place;
    const double distance = d.norm();
    if (!(distance > 0)) return {};
    const double side = d.dot(outwards) < 0 ? -1 : 1;
    foot.distance = side * distance;
    foot.normal = side / distance * d;
    foot.beyond = true;
    return foot;
}

std::optional<FaceFoot> FeetOnFaces::find(const Vec3& x, double within) const
{
    if (empty()) return {};
    BoundingBox near;
    near.add(x + Vec3::Constant(within));
    near.add(x - Vec3::Constant(within));
    std::vector<Candidate> candidates;
    tree_->visit(near, [&](std::int32_t i) {
        const Facet& facet = facets_[at(i)];
        const FacetPoint p = nearest_on(facet, x);
        candidates.push_back({&facet, p, (x - p.place).norm()});
    });
    if (candidates.empty()) return {};
    std::sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
        return a.distance != b.distance ? a.distance < b.distance : a.facet < b.facet;
    });
    const double nearest = candidates.front().distance;
    const double rounding = kSameFoot * candidates.front().facet->size;
    std::optional<FaceFoot> best;
    const Candidate& first = candidates.front();
    const bool at_edge = is_on(sharp_, foot_at(*first.facet, first.point.xi));
    double least = (at_edge ? kEdge : kDent) * nearest + rounding;
    for (const Candidate& c : candidates) {
        if (c.distance > least) break;
        std::optional<FaceFoot> foot = over(c, x);
        if (!foot || std::abs(foot->distance) > least) continue;
        least = std::abs(foot->distance);
        best = std::move(foot);
    }
    if (!best) {
        std::size_t same = 0;
        while (same < candidates.size() && candidates[same].distance <= nearest + rounding)
            ++same;
        best = beyond(std::span(candidates).first(same), x);
    }
    if (!best || std::abs(best->distance) > within) return {};
    return best;
}

} // namespace amontons
