#include "mesh/repair_surface.hpp"

#include "mesh/check_limits.hpp"
#include "mesh/near_points.hpp"
#include "mesh/orient_surface.hpp"
#include "mesh/surface_check.hpp"
#include "mesh/surface_edges.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <map>
#include <set>

namespace amontons {
namespace {

using RepairedTriangle = std::array<std::int32_t, 3>;

constexpr int kMostRounds = 20; // of dividing neighbours: chains of flat triangles

double diagonal_of(const SurfaceMesh& mesh)
{
    Eigen::AlignedBox3d box;
    for (const RepairedTriangle& t : mesh.triangles)
        for (const std::int32_t corner : t)
            box.extend(point_of(mesh, corner));
    return box.isEmpty() ? 0 : box.diagonal().norm();
}

std::int64_t merge_near(SurfaceMesh& mesh)
{
    const auto pairs = near_points(mesh.points, kCoincident * diagonal_of(mesh));
    std::vector<std::int32_t> stands_for(mesh.points.size());
    for (std::size_t i = 0; i < stands_for.size(); ++i)
        stands_for[i] = static_cast<std::int32_t>(i);
    for (const auto& [earlier, later] : pairs) // by the later: the earlier one is settled
        stands_for[static_cast<std::size_t>(later)] = stands_for[static_cast<std::size_t>(earlier)];
    for (RepairedTriangle& t : mesh.triangles)
        for (std::int32_t& corner : t)
            corner = stands_for[static_cast<std::size_t>(corner)];
    return static_cast<std::int64_t>(pairs.size());
}

std::int64_t remove_collapsed(SurfaceMesh& mesh)
{
    return static_cast<std::int64_t>(std::erase_if(mesh.triangles, [](const RepairedTriangle& t) {
        return t[0] == t[1] || t[1] == t[2] || t[2] == t[0];
    }));
}

RepairedTriangle sorted(RepairedTriangle t)
{
    std::sort(t.begin(), t.end());
    return t;
}

/// Whether a triangle runs through its vertices as `sorted` does, or the other way around.
bool ascending(const RepairedTriangle& t)
{
    const auto least = static_cast<std::size_t>(std::min_element(t.begin(), t.end()) - t.begin());
    return t[(least + 1) % 3] < t[(least + 2) % 3];
}

/// The same three vertices, in either orientation: the later ones are removed. If they lie back to
/// back and an even number of other triangles is at each edge, the first one passes as well: they
/// enclose nothing, and the others are closed without them.
std::int64_t remove_repeated(SurfaceMesh& mesh)
{
    struct Copies {
        std::int64_t up = 0, down = 0;
    };
    std::map<RepairedTriangle, Copies> copies;
    for (const RepairedTriangle& t : mesh.triangles) {
        Copies& c = copies[sorted(t)];
        ++(ascending(t) ? c.up : c.down);
    }
    const auto edge = [](const RepairedTriangle& t, std::size_t k) {
        return std::array{std::min(t[k], t[(k + 1) % 3]), std::max(t[k], t[(k + 1) % 3])};
    };
    std::map<std::array<std::int32_t, 2>, int> others; // those of one side only
    for (const auto& [t, c] : copies)
        for (std::size_t k = 0; k < 3; ++k)
            others[edge(t, k)] += c.up == 0 || c.down == 0;
    std::set<RepairedTriangle> seen;
    for (const auto& [t, c] : copies) {
        if (c.up == 0 || c.down == 0) continue;
        bool alone = true;
        for (std::size_t k = 0; k < 3; ++k)
            alone = alone && others.at(edge(t, k)) % 2 == 0;
        if (alone) seen.insert(t); // as if an earlier one stayed
    }
    return static_cast<std::int64_t>(std::erase_if(
        mesh.triangles, [&](const RepairedTriangle& t) { return !seen.insert(sorted(t)).second; }));
}

// A flat triangle has a vertex b on its longest side a c. Left out, it would leave b on the side of
// its neighbour a c d. So the neighbour is divided at b:
//
//        d                d
//       / \              /|\       .
//      a---c     ->     a-b-c
//       \b/  (flat)

/// One round; flat triangles whose neighbour was changed in this round wait for the next.
std::int64_t divide_beside_flat(SurfaceMesh& mesh, double diagonal)
{
    std::vector<HalfEdge> sides = sorted_half_edges(mesh);
    std::map<std::array<std::int32_t, 2>, std::vector<std::int32_t>> triangles_at;
    for (const HalfEdge& e : sides)
        triangles_at[{std::min(e.begin, e.end), std::max(e.begin, e.end)}].push_back(e.triangle);
    std::vector<char> changed(mesh.triangles.size());
    std::vector<RepairedTriangle> added;
    std::vector<std::size_t> removed;
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        const RepairedTriangle t = mesh.triangles[i];
        if (changed[i]) continue;
        std::array<double, 3> length{};
        for (std::size_t k = 0; k < 3; ++k)
            length[k] = (point_of(mesh, t[(k + 1) % 3]) - point_of(mesh, t[k])).norm();
        const auto k = static_cast<std::size_t>(std::max_element(length.begin(), length.end()) -
                                                length.begin());
        const std::int32_t a = t[k], c = t[(k + 1) % 3], b = t[(k + 2) % 3];
        const Vec3 along = point_of(mesh, c) - point_of(mesh, a);
        if (along.cross(point_of(mesh, b) - point_of(mesh, a)).norm() >
            kFlatTriangle * diagonal * length[k])
            continue;
        const std::vector<std::int32_t>& both = triangles_at.at({std::min(a, c), std::max(a, c)});
        if (both.size() == 1) { // at a border nothing is left open: b lies on it
            changed[i] = true;
            removed.push_back(i);
            continue;
        }
        if (both.size() != 2) continue; // a crowded edge: stays, and is reported
        const auto other =
            static_cast<std::size_t>(both[0] == static_cast<std::int32_t>(i) ? both[1] : both[0]);
        if (changed[other]) continue;
        RepairedTriangle left = mesh.triangles[other], right = left;
        std::replace(left.begin(), left.end(), c, b);
        std::replace(right.begin(), right.end(), a, b);
        if (std::find(mesh.triangles[other].begin(), mesh.triangles[other].end(), b) !=
            mesh.triangles[other].end())
            continue; // a fold of two flat ones: remove_repeated's
        mesh.triangles[other] = left;
        added.push_back(right);
        changed[other] = changed[i] = true;
        removed.push_back(i);
    }
    for (std::size_t n = removed.size(); n-- > 0;)
        mesh.triangles.erase(mesh.triangles.begin() + static_cast<std::ptrdiff_t>(removed[n]));
    mesh.triangles.insert(mesh.triangles.end(), added.begin(), added.end());
    return static_cast<std::int64_t>(removed.size());
}

std::int64_t remove_unused(SurfaceMesh& mesh)
{
    std::vector<std::int32_t> number(mesh.points.size(), -1);
    for (const RepairedTriangle& t : mesh.triangles)
        for (const std::int32_t corner : t)
            number[static_cast<std::size_t>(corner)] = 0;
    std::vector<Vec3> kept;
    for (std::size_t i = 0; i < number.size(); ++i)
        if (number[i] == 0) {
            number[i] = static_cast<std::int32_t>(kept.size());
            kept.push_back(mesh.points[i]);
        }
    for (RepairedTriangle& t : mesh.triangles)
        for (std::int32_t& corner : t)
            corner = number[static_cast<std::size_t>(corner)];
    const auto removed = static_cast<std::int64_t>(mesh.points.size() - kept.size());
    mesh.points = std::move(kept);
    return removed;
}

bool is_closed_and_consistent(const SurfaceMesh& mesh)
{
    bool good = !mesh.triangles.empty();
    for_each_edge(sorted_half_edges(mesh), [&](std::span<const HalfEdge> sides) {
        good = good && sides.size() == 2 && sides[0].begin != sides[1].begin;
    });
    return good;
}

void count_turned(const std::vector<RepairedTriangle>& before, const SurfaceMesh& mesh,
                  SurfaceRepair& done)
{
    struct TurnedPart {
        std::int64_t triangles = 0, turned = 0;
    };
    std::vector<TurnedPart> parts;
    const std::vector<std::int32_t> part_of = parts_of(mesh);
    for (std::size_t t = 0; t < before.size(); ++t) {
        const auto i = static_cast<std::size_t>(part_of[t]);
        if (i >= parts.size()) parts.resize(i + 1);
        ++parts[i].triangles;
        parts[i].turned += before[t] != mesh.triangles[t];
    }
    for (const TurnedPart& part : parts)
        if (part.turned == part.triangles)
            ++done.turned_parts;
        else
            done.turned += part.turned;
    done.turned_around =
        !parts.empty() && done.turned_parts == static_cast<std::int64_t>(parts.size());
}

std::string counted(std::int64_t n, const char* one, const char* many)
{
    return std::to_string(n) + " " + (n == 1 ? one : many);
}

} // namespace

std::vector<std::string> sentences(const SurfaceRepair& r)
{
    std::vector<std::string> all;
    const auto note = [&](std::int64_t n, const char* one, const char* many, const char* what) {
        if (n > 0) all.push_back("repaired: " + counted(n, one, many) + " " + what);
    };
    note(r.merged, "vertex", "vertices", "merged with another at the same place");
    note(r.collapsed, "triangle", "triangles", "with a vertex twice left out");
    note(r.flat, "triangle", "triangles", "without area left out, the neighbour divided instead");
    note(r.repeated, "triangle", "triangles", "that were there twice left out");
    note(r.turned, "triangle", "triangles", "turned to face the side of the neighbours");
    if (r.turned_around)
        all.push_back("repaired: all normals pointed inwards, turned outwards");
    else
        note(r.turned_parts, "part", "parts",
             "turned around: outwards, or inwards where it lies within another as a cavity");
    note(r.unused, "vertex", "vertices", "of no triangle left out");
    note(r.closed_holes, "hole", "holes", "closed with triangles to the centre of the border");
    return all;
}

SurfaceRepair repair_surface(SurfaceMesh& mesh)
{
    SurfaceRepair done;
    done.merged = merge_near(mesh);
    done.collapsed = remove_collapsed(mesh);
    const double diagonal = diagonal_of(mesh);
    for (int round = 0; round < kMostRounds; ++round) {
        const std::int64_t flat = divide_beside_flat(mesh, diagonal);
        done.flat += flat;
        if (flat == 0) break;
    }
    done.repeated = remove_repeated(mesh);
    const std::vector<RepairedTriangle> before = mesh.triangles;
    orient_consistently(mesh);
    if (is_closed_and_consistent(mesh)) orient_parts(mesh);
    count_turned(before, mesh, done);
    done.unused = remove_unused(mesh) - done.merged; // a merged vertex is of no triangle any more
    return done;
}

bool is_small_hole(const BoundaryLoop& hole, double longest)
{
    constexpr std::size_t kFewEdges = 4; // of one or two triangles that are not there
    return hole.vertices.size() <= kFewEdges || hole.length <= longest;
}

std::int64_t close_holes(SurfaceMesh& mesh, const std::function<bool(const BoundaryLoop&)>& which)
{
    // Along a border the triangle inside runs one way, the one that is added the other way.
    std::map<std::int32_t, std::vector<std::int32_t>> next; // against the triangle's sense
    for_each_edge(sorted_half_edges(mesh), [&](std::span<const HalfEdge> sides) {
        if (sides.size() == 1) next[sides[0].end].push_back(sides[0].begin);
    });
    std::int64_t holes = 0;
    for (const BoundaryLoop& loop : check_surface(mesh).boundaries) {
        if (which && !which(loop)) continue;
        const auto centre = static_cast<std::int32_t>(mesh.points.size());
        mesh.points.push_back(loop.centre);
        const std::size_t n = loop.vertices.size();
        for (std::size_t i = 0; i < n; ++i) {
            std::int32_t a = loop.vertices[i], b = loop.vertices[(i + 1) % n];
            const auto from_a = next.find(a);
            const bool forward =
                from_a != next.end() &&
                std::find(from_a->second.begin(), from_a->second.end(), b) != from_a->second.end();
            if (!forward) std::swap(a, b);
            mesh.triangles.push_back({a, b, centre});
        }
        ++holes;
    }
    return holes;
}

} // namespace amontons
