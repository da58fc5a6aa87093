#include "mesh/surface_check.hpp"

#include "mesh/base/text.hpp"
#include "mesh/check_limits.hpp"
#include "mesh/near_points.hpp"
#include "mesh/orient_surface.hpp"
#include "mesh/self_intersection.hpp"
#include "mesh/surface_edges.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <unordered_map>

namespace amontons {
namespace {

constexpr std::size_t kMostPairs = 10; // of triangles that intersect, kept in a report

void check_indices(const SurfaceMesh& mesh)
{
    const auto n = static_cast<std::int32_t>(mesh.points.size());
    for (const auto& triangle : mesh.triangles)
        for (const std::int32_t corner : triangle)
            AMONTONS_ASSERT(corner >= 0 && corner < n);
}

bool is_degenerate(const SurfaceMesh& mesh, const std::array<std::int32_t, 3>& t, double diagonal)
{
    const Vec3 a = point_of(mesh, t[1]) - point_of(mesh, t[0]),
               b = point_of(mesh, t[2]) - point_of(mesh, t[1]),
               c = point_of(mesh, t[0]) - point_of(mesh, t[2]);
    const double longest = std::max({a.norm(), b.norm(), c.norm()});
    return a.cross(b).norm() <= kFlatTriangle * diagonal * longest;
}

// ---- boundaries --------------------------------------------------------------------------

/// Walks along edges of one triangle until no unused one is left. Where two holes touch at a
/// vertex, any way to continue gives closed loops.
class BoundaryWalk {
public:
    BoundaryWalk(const SurfaceMesh& mesh, const std::vector<HalfEdge>& edges)
        : mesh_(mesh)
        , edges_(edges)
        , used_(edges.size())
    {
        for (std::size_t i = 0; i < edges_.size(); ++i)
            for (const std::int32_t v : {edges_[i].begin, edges_[i].end})
                at_vertex_[v].push_back(i);
    }

    std::vector<BoundaryLoop> loops()
    {
        std::vector<BoundaryLoop> all;
        for (std::size_t i = 0; i < edges_.size(); ++i)
            if (!used_[i]) all.push_back(loop_from(i));
        std::stable_sort(all.begin(), all.end(),
                         [](const auto& a, const auto& b) { return a.length > b.length; });
        return all;
    }

private:
    BoundaryLoop loop_from(std::size_t i)
    {
        BoundaryLoop loop;
        const std::int32_t start = edges_[i].begin;
        std::int32_t here = start;
        for (constexpr std::size_t kNone = ~std::size_t{0}; i != kNone;) {
            used_[i] = true;
            loop.vertices.push_back(here);
            const std::int32_t next = edges_[i].begin == here ? edges_[i].end : edges_[i].begin;
            const Vec3 &a = point_of(mesh_, here), &b = point_of(mesh_, next);
            const double length = (b - a).norm();
            loop.length += length;
            loop.centre += 0.5 * length * (a + b);
            here = next;
            i = kNone;
            if (here == start) break;
            std::vector<std::size_t>& edges_here = at_vertex_[here];
            while (!edges_here.empty() && used_[edges_here.back()])
                edges_here.pop_back(); // never examined again: many edges may touch here
            if (!edges_here.empty()) i = edges_here.back();
        }
        if (here != start) loop.vertices.push_back(here); // ends at an edge of many triangles
        if (loop.length > 0)
            loop.centre /= loop.length;
        else
            loop.centre = point_of(mesh_, start);
        return loop;
    }

    const SurfaceMesh& mesh_;
    const std::vector<HalfEdge>& edges_;
    std::unordered_map<std::int32_t, std::vector<std::size_t>> at_vertex_;
    std::vector<bool> used_;
};

// ---- edges -------------------------------------------------------------------------------

/// Joins triangles into components.
class Components {
public:
    explicit Components(std::size_t triangles) : parent_(triangles)
    {
        std::iota(parent_.begin(), parent_.end(), 0);
    }
    std::int32_t root(std::int32_t t)
    {
        while (at(t) != t)
            t = at(t) = at(at(t));
        return t;
    }
    void join(std::int32_t t, std::int32_t u) { at(root(t)) = root(u); }

private:
    std::int32_t& at(std::int32_t t) { return parent_[static_cast<std::size_t>(t)]; }
    std::vector<std::int32_t> parent_;
};

void check_edges(const SurfaceMesh& mesh, SurfaceReport& report)
{
    const std::vector<HalfEdge> half_edges = sorted_half_edges(mesh);
    Components components(mesh.triangles.size());
    std::vector<HalfEdge> boundary;
    for_each_edge(half_edges, [&](std::span<const HalfEdge> sides) {
        for (const HalfEdge& s : sides)
            components.join(sides[0].triangle, s.triangle);
        if (sides.size() == 1) {
            boundary.push_back(sides[0]);
        } else if (sides.size() > 2 || sides[0].begin == sides[1].begin) {
            EdgeFault fault{{sides[0].begin, sides[0].end}, {}};
            for (const HalfEdge& s : sides)
                fault.triangles.push_back(s.triangle);
            (sides.size() > 2 ? report.non_manifold : report.inconsistent).push_back(fault);
        }
    });
    report.boundaries = BoundaryWalk(mesh, boundary).loops();

    std::vector<bool> is_root(mesh.triangles.size());
    for (const HalfEdge& e : half_edges)
        is_root[static_cast<std::size_t>(components.root(e.triangle))] = true;
    report.components = static_cast<int>(std::count(is_root.begin(), is_root.end(), true));
}

// ---- messages ----------------------------------------------------------------------------

std::string text_of(const SurfaceMesh& mesh, std::int32_t triangle)
{
    const auto& [a, b, c] = mesh.triangles[static_cast<std::size_t>(triangle)];
    return place_text(point_of(mesh, a)) + " " + place_text(point_of(mesh, b)) + " " +
           place_text(point_of(mesh, c));
}

std::string text_of(const SurfaceMesh& mesh, const EdgeFault& edge)
{
    std::string text = std::to_string(edge.triangles.size()) + " triangles (";
    for (std::size_t i = 0; i < edge.triangles.size() && i < 5; ++i)
        text.append(i > 0 ? ", " : "").append(std::to_string(edge.triangles[i]));
    text += edge.triangles.size() > 5 ? ", ...)" : ")";
    return text + " from " + place_text(point_of(mesh, edge.vertices[0])) + " to " +
           place_text(point_of(mesh, edge.vertices[1]));
}

/// Names the first faults of a kind and counts the others.
template <class Faults, class Place, class Found>
void add_issues(std::vector<Issue>& issues, const std::string& file, const Faults& faults,
                std::int64_t count, const char* allowed, Place place, Found found)
{
    const std::size_t named = std::min(faults.size(), kMostNamed);
    for (std::size_t i = 0; i < named; ++i)
        issues.push_back({file, place(faults[i]), found(faults[i]), allowed});
    if (const std::int64_t rest = count - static_cast<std::int64_t>(named); rest > 0)
        issues.push_back({file, "", std::to_string(rest) + " more of this", allowed});
}

} // namespace

SurfaceReport check_surface(const SurfaceMesh& mesh)
{
    check_indices(mesh);
    SurfaceReport report;
    report.vertices = static_cast<std::int64_t>(mesh.points.size());
    report.triangles = static_cast<std::int64_t>(mesh.triangles.size());

    Eigen::AlignedBox3d box;
    std::vector<bool> used(mesh.points.size());
    for (const auto& triangle : mesh.triangles)
        for (const std::int32_t corner : triangle) {
            used[static_cast<std::size_t>(corner)] = true;
            box.extend(point_of(mesh, corner));
        }
    for (std::size_t i = 0; i < used.size(); ++i)
        if (!used[i]) report.unreferenced.push_back(static_cast<std::int32_t>(i));
    report.diagonal = box.isEmpty() ? 0 : box.diagonal().norm();
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        if (is_degenerate(mesh, mesh.triangles[t], report.diagonal))
            report.degenerate.push_back(static_cast<std::int32_t>(t));

    check_edges(mesh, report);
    report.coincident = near_points(mesh.points, kCoincident * report.diagonal);
    SelfIntersections found = find_self_intersections(mesh, kMostPairs);
    report.intersections = std::move(found.pairs);
    report.intersection_count = found.count;
    report.enclosed_volume = enclosed_volume(mesh);
    return report;
}

std::vector<Issue> issues(const SurfaceReport& report, const SurfaceMesh& mesh,
                          const SurfaceRequirements& required, const std::string& file)
{
    std::vector<Issue> all;
    const auto count = [](const auto& faults) { return static_cast<std::int64_t>(faults.size()); };
    const auto edge_place = [](const EdgeFault& e) {
        return "edge " + std::to_string(e.vertices[0]) + "-" + std::to_string(e.vertices[1]);
    };
    const auto edge_found = [&](const EdgeFault& e) { return text_of(mesh, e); };
    if (required.manifold)
        add_issues(all, file, report.non_manifold, count(report.non_manifold),
                   "one or two triangles on an edge", edge_place, edge_found);
    if (required.oriented)
        add_issues(all, file, report.inconsistent, count(report.inconsistent),
                   "neighbours that face the same side", edge_place,
                   [&](const EdgeFault& e) { return "opposite faces of " + text_of(mesh, e); });
    if (required.closed)
        add_issues(
            all, file, report.boundaries, count(report.boundaries), "a closed surface",
            [](const BoundaryLoop& l) { return "hole around " + place_text(l.centre); },
            [](const BoundaryLoop& l) {
                return std::to_string(l.vertices.size()) + " open edges, length " +
                       number_text(l.length);
            });
    if (required.without_degenerate)
        add_issues(
            all, file, report.degenerate, count(report.degenerate), "triangles with an area",
            [](std::int32_t t) { return "triangle " + std::to_string(t); },
            [&](std::int32_t t) { return "no area between " + text_of(mesh, t); });
    if (required.simple)
        add_issues(
            all, file, report.intersections, report.intersection_count,
            "a surface that does not touch itself",
            [](const auto& pair) {
                return "triangles " + std::to_string(pair[0]) + " and " + std::to_string(pair[1]);
            },
            [&](const auto& pair) {
                return "an intersection of " + text_of(mesh, pair[0]) + " with " +
                       text_of(mesh, pair[1]);
            });
    return all;
}

} // namespace amontons
