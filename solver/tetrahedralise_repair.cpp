#include "solver/tetrahedralise_repair.hpp"

#include "mesh/base/text.hpp"
#include "mesh/extract_surface.hpp"
#include "mesh/orient_surface.hpp"
#include "mesh/self_intersection.hpp"
#include "mesh/surface_edges.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <numeric>
#include <set>

namespace amontons {
namespace {

constexpr double kSampleBytes = 150;        // in a square of the width; 40 to 110 were measured
constexpr double kFold = 1.5;               // distance / width; a cube's corner moves by 1.1
constexpr double kApart = 4;                // places / width: nearer ones are one
constexpr std::size_t kMostPairs = 1000000; // of triangles that cross
constexpr std::size_t kMostPlaces = 5;      // places that are shown

/// Vertices, then the middles of triangles.
std::vector<Vec3> points_of(const SurfaceMesh& mesh)
{
    std::vector<Vec3> all = mesh.points;
    const std::vector<Vec3> others = middles(mesh);
    all.insert(all.end(), others.begin(), others.end());
    return all;
}

struct Moved {
    Vec3 at = Vec3::Zero();
    double distance = 0;
};

/// The farthest of each heap of points that are far from the other surface.
std::vector<Moved> far_places(const SurfaceMesh& of, const SurfaceMesh& from, double width)
{
    const BoundingTree tree(from);
    std::vector<Moved> far, places;
    std::int32_t near = -1;
    for (const Vec3& x : points_of(of)) {
        const NearestTriangle found = tree.nearest(x, near);
        near = found.triangle;
        if (found.squared > kFold * kFold * width * width)
            far.push_back({x, std::sqrt(found.squared)});
    }
    std::stable_sort(far.begin(), far.end(),
                     [](const Moved& a, const Moved& b) { return a.distance > b.distance; });
    for (const Moved& m : far)
        if (std::none_of(places.begin(), places.end(), [&](const Moved& p) {
                return (p.at - m.at).norm() < std::max(kApart * width, p.distance);
            }))
            places.push_back(m);
    return places;
}

/// Of what was measured: four digits.
std::string short_text(double x)
{
    char text[32];
    std::snprintf(text, sizeof text, "%.4g", x);
    return text;
}

std::string sentence(const std::vector<Moved>& places, const char* what, double width)
{
    std::string text = "repaired: rounded at a width of " + number_text(width) + " m, " + what +
                       " by more than 1.5 times that at " + std::to_string(places.size()) +
                       (places.size() == 1 ? " place:" : " places:");
    for (std::size_t i = 0; i < std::min(places.size(), kMostPlaces); ++i) {
        const Moved& p = places[i];
        text += std::string(i > 0 ? "," : "") + " " + short_text(p.distance) + " m at (" +
                short_text(p.at[0]) + ", " + short_text(p.at[1]) + ", " + short_text(p.at[2]) + ")";
    }
    return text + (places.size() > kMostPlaces ? ", ..." : "");
}

} // namespace

std::vector<Vec3> middles(const SurfaceMesh& mesh)
{
    std::vector<Vec3> all;
    for (const auto& t : mesh.triangles) {
        Vec3 sum = Vec3::Zero();
        for (const std::int32_t corner : t)
            sum += mesh.points[static_cast<std::size_t>(corner)];
        all.push_back(sum / 3);
    }
    return all;
}

std::int64_t turn_crossing_parts(SurfaceMesh& surface)
{
    const std::vector<std::int32_t> part_of = parts_of(surface);
    std::set<std::int32_t> crossing;
    for (const auto& [a, b] : find_self_intersections(surface, kMostPairs).pairs) {
        const std::int32_t p = part_of[static_cast<std::size_t>(a)],
                           q = part_of[static_cast<std::size_t>(b)];
        if (p != q) crossing.insert({p, q});
    }
    std::int64_t turned = 0;
    for (const std::int32_t part : crossing) {
        SurfaceMesh alone{surface.points, {}};
        for (std::size_t t = 0; t < part_of.size(); ++t)
            if (part_of[t] == part) alone.triangles.push_back(surface.triangles[t]);
        if (enclosed_volume(alone) >= 0) continue;
        ++turned;
        for (std::size_t t = 0; t < part_of.size(); ++t)
            if (part_of[t] == part) std::swap(surface.triangles[t][1], surface.triangles[t][2]);
    }
    return turned;
}

double rounded_memory(const SurfaceMesh& surface, double width)
{
    double area = 0;
    for (const auto& t : surface.triangles) {
        const auto at = [&](int k) -> const Vec3& {
            return surface.points[static_cast<std::size_t>(t[static_cast<std::size_t>(k)])];
        };
        area += 0.5 * (at(1) - at(0)).cross(at(2) - at(0)).norm();
    }
    return kSampleBytes * area / (width * width);
}

std::vector<Vec3> places_on(const RoundedSolid& solid, const SurfaceMesh& surface, double spacing)
{
    const std::vector<std::int32_t> part_of = parts_of(surface);
    std::set<std::array<std::int64_t, 4>> taken; // by part: two may pass through one cube
    std::vector<Vec3> places;
    const std::vector<Vec3> points = points_of(surface);
    for (std::size_t t = 0; t < part_of.size(); ++t) {
        Vec3 x = points[surface.points.size() + t];
        std::array<std::int64_t, 4> cube{};
        for (std::size_t k = 0; k < 3; ++k)
            cube[k] =
                static_cast<std::int64_t>(std::floor(x[static_cast<Eigen::Index>(k)] / spacing));
        cube[3] = part_of[t];
        if (taken.contains(cube) || !solid.project(x)) continue;
        taken.insert(cube);
        places.push_back(x);
    }
    return places;
}

void add_face_sets(VolumeMesh& mesh, const SurfaceMesh& surface, double feature_angle)
{
    std::vector<std::int32_t> stands_for(surface.triangles.size());
    std::iota(stands_for.begin(), stands_for.end(), 0);
    const auto root = [&](std::int32_t t) {
        while (stands_for[static_cast<std::size_t>(t)] != t)
            t = stands_for[static_cast<std::size_t>(t)] =
                stands_for[static_cast<std::size_t>(stands_for[static_cast<std::size_t>(t)])];
        return t;
    };
    const auto normal = [&](std::int32_t t) {
        return unit_normal(surface, surface.triangles[static_cast<std::size_t>(t)]);
    };
    for_each_edge(sorted_half_edges(surface), [&](std::span<const HalfEdge> sides) {
        if (sides.size() != 2) return;
        const std::int32_t a = sides[0].triangle, b = sides[1].triangle;
        if (normal(a).dot(normal(b)) < std::cos(feature_angle)) return;
        stands_for[static_cast<std::size_t>(std::max(root(a), root(b)))] =
            std::min(root(a), root(b));
    });
    const BoundingTree tree(surface);
    std::int32_t near = -1;
    std::map<std::int32_t, FaceSet> sets;
    const ExternalSurface outside = extract_surface(mesh);
    for (const FaceRef face : outside.faces) {
        const FaceNodes on = face_nodes(mesh, face);
        Vec3 middle = Vec3::Zero();
        for (int k = 0; k < 3; ++k)
            middle +=
                mesh.nodes[static_cast<std::size_t>(on.node[static_cast<std::size_t>(k)])] / 3;
        near = tree.nearest(middle, near).triangle;
        sets[root(near)].members.push_back(face);
    }
    for (auto& [patch, set] : sets) {
        set.name = "face_" + std::to_string(mesh.face_sets.size());
        mesh.face_sets.push_back(std::move(set));
    }
}

std::vector<std::string> repair_notes(const SurfaceMesh& surface, const SurfaceMesh& outside,
                                      double width)
{
    std::vector<std::string> notes;
    if (const auto left = far_places(surface, outside, width); !left.empty())
        notes.push_back(sentence(left, "the surface given left", width));
    if (const auto added = far_places(outside, surface, width); !added.empty())
        notes.push_back(sentence(added, "gaps filled", width));
    if (notes.empty())
        notes.push_back("repaired: rounded at a width of " + number_text(width) +
                        " m, the surface moved nowhere by more than 1.5 times that");
    return notes;
}

} // namespace amontons
