#include "mesh/surface_wall.hpp"

#include "mesh/base/error.hpp"
#include "mesh/base/index.hpp"
#include "mesh/orient_surface.hpp"
#include "mesh/surface_distance.hpp"
#include "mesh/surface_edges.hpp"
#include "mesh/weld.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

namespace amontons {

namespace {

constexpr double kSmoothCrease = 120 * std::numbers::pi / 180;
constexpr double kSharpCrease = 60 * std::numbers::pi / 180;
constexpr double kVesselHoles = 0.25; // largest part of a vessel's area that its holes are
constexpr int kOpeningExtension = 6;  // radii that a vessel continues beyond an opening
constexpr double kWallSpacing = 0.2;  // spacing over the smallest radius
constexpr double kFinestGrid = 1.0 / 4000, kWidest = 1.0 / 20; // of the box's diagonal
constexpr std::size_t kProbes = 600; // places where the radius is searched for
constexpr double kSmallPart = 0.05;  // of the places may be narrower than the radius taken
constexpr double kWallBand = 12;     // grid spacings from the wall: a spline's reach twice
constexpr int kMostCuts = 4;
constexpr double kMostPieces = 2e5; // of all triangles: 0.4 kB each

struct Rim {
    std::vector<std::int32_t> vertices; // triangles lie to the left of each step
    Vec3 centre = Vec3::Zero();
    Vec3 area = Vec3::Zero(); // of the hole; points away from the side of the normals
    double radius = 0;
};

std::vector<Rim> rims_of(const SurfaceMesh& mesh, std::vector<Issue>& issues)
{
    std::map<std::int32_t, std::int32_t> next;
    for_each_edge(sorted_half_edges(mesh), [&](std::span<const HalfEdge> sides) {
        if (sides.size() > 2 && issues.size() < 10)
            issues.push_back(
                {"", "edge " + std::to_string(sides[0].begin) + " " + std::to_string(sides[0].end),
                 std::to_string(sides.size()) + " triangles", "1 or 2"});
        if (sides.size() == 1 && !next.emplace(sides[0].begin, sides[0].end).second &&
            issues.size() < 10)
            issues.push_back({"", "vertex " + std::to_string(sides[0].begin),
                              "two holes that touch", "holes that are apart"});
    });
    std::vector<Rim> rims;
    while (!next.empty()) {
        Rim rim;
        for (auto step = next.begin(); step != next.end();) {
            rim.vertices.push_back(step->first);
            const std::int32_t to = step->second;
            next.erase(step);
            step = next.find(to);
        }
        double length = 0;
        for (std::size_t i = 0; i < rim.vertices.size(); ++i) {
            const Vec3 &a = mesh.points[at(rim.vertices[i])],
                       &b = mesh.points[at(rim.vertices[(i + 1) % rim.vertices.size()])];
            rim.centre += (b - a).norm() * (a + b) / 2;
            length += (b - a).norm();
        }
        rim.centre /= length;
        for (std::size_t i = 0; i < rim.vertices.size(); ++i) {
            const Vec3 a = mesh.points[at(rim.vertices[i])] - rim.centre,
                       b = mesh.points[at(rim.vertices[(i + 1) % rim.vertices.size()])] -
                           rim.centre;
            rim.area += a.cross(b) / 2;
            rim.radius = std::max(rim.radius, a.norm());
        }
        rims.push_back(std::move(rim));
    }
    return rims;
}

double area_of(const SurfaceMesh& mesh)
{
    double sum = 0;
    for (const auto& [a, b, c] : mesh.triangles)
        sum += (mesh.points[at(b)] - mesh.points[at(a)])
                   .cross(mesh.points[at(c)] - mesh.points[at(a)])
                   .norm() /
               2;
    return sum;
}

// A fan over a loop of vertices, oriented like the triangles around it.
void close_hole(SurfaceMesh& mesh, const std::vector<std::int32_t>& loop)
{
    Vec3 centre = Vec3::Zero();
    for (std::int32_t v : loop)
        centre += mesh.points[at(v)] / static_cast<double>(loop.size());
    const auto middle = static_cast<std::int32_t>(mesh.points.size());
    mesh.points.push_back(centre);
    for (std::size_t i = 0; i < loop.size(); ++i)
        mesh.triangles.push_back({loop[(i + 1) % loop.size()], loop[i], middle});
}

// The surface continued straight beyond a rim, ring by ring, then closed.
void extend(SurfaceMesh& mesh, const Rim& rim, const Vec3& outward, int rings)
{
    std::vector<std::int32_t> loop = rim.vertices;
    for (int ring = 0; ring < rings; ++ring) {
        std::vector<std::int32_t> beyond;
        for (std::int32_t v : loop) {
            beyond.push_back(static_cast<std::int32_t>(mesh.points.size()));
            mesh.points.push_back(mesh.points[at(v)] + rim.radius * outward);
        }
        for (std::size_t i = 0; i < loop.size(); ++i) {
            const std::size_t j = (i + 1) % loop.size();
            mesh.triangles.push_back({loop[j], loop[i], beyond[i]});
            mesh.triangles.push_back({loop[j], beyond[i], beyond[j]});
        }
        loop = std::move(beyond);
    }
    close_hole(mesh, loop);
}

// How many radii a rim's tube may continue without meeting the surface again.
int clear_rings(const BoundingTree& tree, const Rim& rim, const Vec3& outward)
{
    for (int k = 4; k <= 2 * kOpeningExtension; ++k) { // nearer than 2 radii it is the rim itself
        const NearestTriangle n = tree.nearest(rim.centre + 0.5 * k * rim.radius * outward, -1);
        if (std::sqrt(n.squared) < 1.2 * rim.radius) return std::max(1, k / 2 - 2);
    }
    return kOpeningExtension;
}

// Radius of the largest ball in the free space that touches the surface at p.
// Source: Ma, Bae & Choi 2012, 3D medial axis point approximation, the shrinking ball.
double touching_radius(const BoundingTree& tree, const Vec3& p, const Vec3& normal, double widest)
{
    double r = widest;
    for (int k = 0; k < 20; ++k) {
        const Vec3 q = tree.nearest(p + r * normal, -1).at.point;
        const double away = (q - p).norm(), up = (q - p).dot(normal);
        if (away < 1e-6 * widest || up <= 0) break;
        const double smaller = away * away / (2 * up);
        if (smaller > 0.99 * r) break;
        r = smaller;
    }
    return r;
}

double smallest_radius(const SurfaceMesh& mesh, double widest)
{
    const BoundingTree tree{mesh};
    std::vector<double> radii;
    const std::size_t stride = std::max<std::size_t>(1, mesh.triangles.size() / kProbes);
    for (std::size_t i = 0; i < mesh.triangles.size(); i += stride) {
        const auto& [a, b, c] = mesh.triangles[i];
        const Vec3 area = (mesh.points[at(b)] - mesh.points[at(a)])
                              .cross(mesh.points[at(c)] - mesh.points[at(a)]);
        if (!(area.norm() > 0)) continue;
        const Vec3 middle = (mesh.points[at(a)] + mesh.points[at(b)] + mesh.points[at(c)]) / 3;
        radii.push_back(touching_radius(tree, middle, area.normalized(), widest));
    }
    if (radii.empty()) return widest;
    const auto nth =
        radii.begin() + static_cast<std::ptrdiff_t>(kSmallPart * static_cast<double>(radii.size()));
    std::nth_element(radii.begin(), nth, radii.end());
    return *nth;
}

// Turns the surface so that its normals point into the free space; true if that is inside.
bool face_free_side(SurfaceMesh& mesh, const SurfaceWallOptions& options, bool has_rims,
                    bool vessel, std::vector<Issue>& issues)
{
    SurfaceMesh closed = mesh;
    std::vector<Issue> ignored;
    for (const Rim& rim : rims_of(mesh, ignored))
        close_hole(closed, rim.vertices);
    const double volume = enclosed_volume(closed); // > 0: normals point out of it
    bool inside = options.side == "inside";
    if (options.side.empty()) {
        if (has_rims && !vessel)
            issues.push_back({"", "/side", "\"\" on an open surface that is no vessel",
                              "\"inside\" or \"outside\""});
        inside = vessel || volume < 0;
    }
    if (inside == (volume > 0)) turn_around(mesh);
    return inside;
}

} // namespace

WallModel make_wall_from_surface(SurfaceMesh mesh, const SurfaceWallOptions& options)
{
    // ---- Checks and topology
    std::vector<Issue> issues;
    if (options.side != "" && options.side != "inside" && options.side != "outside")
        issues.push_back(
            {"", "/side", '"' + options.side + '"', "\"inside\", \"outside\" or \"\""});
    if (!(options.spacing >= 0) || !std::isfinite(options.spacing))
        issues.push_back({"", "/spacing", std::to_string(options.spacing), ">= 0 and finite [m]"});
    if (mesh.triangles.empty()) issues.push_back({"", "", "no triangles", "a surface"});
    for (std::size_t i = 0; i < mesh.points.size() && issues.size() < 10; ++i)
        if (!mesh.points[i].allFinite())
            issues.push_back({"", "vertex " + std::to_string(i), "not finite", "finite [m]"});
    if (!issues.empty()) throw InputError(std::move(issues));

    weld(mesh);
    std::erase_if(mesh.triangles,
                  [](const auto& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; });
    if (!orient_consistently(mesh).orientable)
        issues.push_back({"", "", "a surface with one side (Moebius strip)", "two sides"});
    std::vector<Rim> rims = rims_of(mesh, issues);
    if (!issues.empty()) throw InputError(std::move(issues));
    double holes = 0;
    for (const Rim& rim : rims)
        holes += rim.area.norm();
    const bool vessel = !rims.empty() && holes < kVesselHoles * area_of(mesh);
    const bool inside = face_free_side(mesh, options, !rims.empty(), vessel, issues);
    if (!issues.empty()) throw InputError(std::move(issues));

    // ---- Axes, radius, spacing
    const double crease = options.crease > 0 ? options.crease
                          : inside           ? kSmoothCrease
                                             : kSharpCrease;

    std::vector<Vec3> corners;
    std::vector<double> edges;
    for (const auto& t : mesh.triangles)
        for (std::size_t k = 0; k < 3; ++k) {
            corners.push_back(mesh.points[at(t[k])]);
            edges.push_back((mesh.points[at(t[(k + 1) % 3])] - corners.back()).norm());
        }
    const Mat3 axes = axes_of(corners);
    Vec3 low = Vec3::Constant(std::numeric_limits<double>::infinity()), high = -low;
    for (const Vec3& p : corners) {
        low = low.cwiseMin(axes.transpose() * p);
        high = high.cwiseMax(axes.transpose() * p);
    }
    const double diagonal = (high - low).norm();
    const double radius = smallest_radius(mesh, kWidest * diagonal);
    const double spacing = options.spacing > 0
                               ? options.spacing
                               : std::max(kWallSpacing * radius, kFinestGrid * diagonal);
    const auto wide = edges.begin() + static_cast<std::ptrdiff_t>(edges.size() * 9 / 10);
    std::nth_element(edges.begin(), wide, edges.end());
    const int fine =
        static_cast<int>(std::sqrt(kMostPieces / static_cast<double>(mesh.triangles.size())));
    const int cuts =
        std::clamp(static_cast<int>(std::ceil(*wide / radius)), 1, std::clamp(fine, 1, kMostCuts));

    const std::size_t own = mesh.triangles.size();
    std::vector<Opening> openings;

    // ---- The distance
    if (vessel) {
        rims = rims_of(mesh, issues); // it may have been turned
        std::sort(rims.begin(), rims.end(), [](const Rim& a, const Rim& b) {
            return a.area.squaredNorm() > b.area.squaredNorm();
        });
        const BoundingTree tree{mesh};
        for (const Rim& rim : rims) {
            const Vec3 outward = rim.area.normalized();
            if (!inside) {
                close_hole(mesh, rim.vertices);
                continue;
            }
            openings.push_back({"opening_" + std::to_string(openings.size() + 1), rim.centre,
                                outward, rim.radius});
            extend(mesh, rim, outward, clear_rings(tree, rim, outward));
        }
    }
    auto source = std::make_unique<SurfaceDistance>(SmoothSurface{std::move(mesh), crease}, cuts,
                                                    kWallBand * spacing);
    SurfaceMesh shown = source->refined();
    shown.triangles.resize(std::min(shown.triangles.size(), own * at(cuts * cuts)));
    // The points of what was added to continue beyond the openings are not needed there.
    std::vector<std::int32_t> number(shown.points.size(), -1);
    std::vector<Vec3> used;
    for (auto& t : shown.triangles)
        for (std::int32_t& v : t) {
            if (number[at(v)] < 0) {
                number[at(v)] = static_cast<std::int32_t>(used.size());
                used.push_back(shown.points[at(v)]);
            }
            v = number[at(v)];
        }
    shown.points = std::move(used);
    const double deviation = source->chord_error(own);
    const Vec3 origin = axes * (low + spacing * Vec3{0.217, 0.331, 0.273});
    return {std::move(shown),
            make_wall(DistanceField{std::move(source), origin, spacing, axes}),
            std::move(openings),
            {},
            deviation};
}

} // namespace amontons
