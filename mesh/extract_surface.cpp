#include "mesh/extract_surface.hpp"

#include "mesh/neighbours.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

namespace amontons {
namespace {

const Vec3& node(const VolumeMesh& mesh, std::int32_t i)
{
    return mesh.nodes[static_cast<std::size_t>(i)];
}

// ---- edges -------------------------------------------------------------------------------

struct Side {
    std::int32_t low = 0, high = 0, middle = -1, face = 0;
};

std::vector<Side> sorted_sides(const ExternalSurface& surface)
{
    std::vector<Side> sides;
    sides.reserve(4 * surface.faces.size());
    for (std::size_t f = 0; f < surface.faces.size(); ++f) {
        const auto nodes = surface.face(f);
        const std::size_t n = surface.corners[f];
        for (std::size_t i = 0; i < n; ++i) {
            const auto [low, high] = std::minmax(nodes[i], nodes[(i + 1) % n]);
            sides.push_back(
                {low, high, nodes.size() > n ? nodes[n + i] : -1, static_cast<std::int32_t>(f)});
        }
    }
    std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
        return std::tie(a.low, a.high, a.face) < std::tie(b.low, b.high, b.face);
    });
    return sides;
}

const Vec3& place_at(std::span<const Vec3> places, std::int32_t node)
{
    return places[static_cast<std::size_t>(node)];
}

/// Twice the area of the polygon of the corners, along its mean normal.
Vec3 normal_of(const ExternalSurface& surface, std::span<const Vec3> places, std::int32_t face)
{
    const auto n = surface.face(static_cast<std::size_t>(face));
    if (surface.corners[static_cast<std::size_t>(face)] == 3)
        return (place_at(places, n[1]) - place_at(places, n[0]))
            .cross(place_at(places, n[2]) - place_at(places, n[0]));
    return (place_at(places, n[2]) - place_at(places, n[0]))
        .cross(place_at(places, n[3]) - place_at(places, n[1]));
}

Vec3 centre_of(const ExternalSurface& surface, std::span<const Vec3> places, std::int32_t face)
{
    const auto nodes = surface.face(static_cast<std::size_t>(face));
    const int n = surface.corners[static_cast<std::size_t>(face)];
    Vec3 sum = Vec3::Zero();
    for (int i = 0; i < n; ++i)
        sum += place_at(places, nodes[static_cast<std::size_t>(i)]);
    return sum / n;
}

double inner_angle(const ExternalSurface& surface, std::span<const Vec3> places,
                   const SurfaceEdge& edge)
{
    const Vec3 a = normal_of(surface, places, edge.faces[0]).normalized(),
               b = normal_of(surface, places, edge.faces[1]).normalized();
    const double turn = std::atan2(a.cross(b).norm(), a.dot(b));
    // Convex if the other face lies behind the plane of this one.
    const Vec3 across = centre_of(surface, places, edge.faces[1]) - place_at(places, edge.nodes[0]);
    return across.dot(a) <= 0 ? std::numbers::pi - turn : std::numbers::pi + turn;
}

/// Which things hang together.
class Parts {
public:
    explicit Parts(std::size_t n) : parent_(n) { std::iota(parent_.begin(), parent_.end(), 0); }
    std::size_t root(std::size_t i)
    {
        while (parent_[i] != i)
            i = parent_[i] = parent_[parent_[i]];
        return i;
    }
    void join(std::int32_t i, std::int32_t j)
    {
        parent_[root(static_cast<std::size_t>(i))] = root(static_cast<std::size_t>(j));
    }
    int count()
    {
        int roots = 0;
        for (std::size_t i = 0; i < parent_.size(); ++i)
            roots += parent_[i] == i ? 1 : 0;
        return roots;
    }

private:
    std::vector<std::size_t> parent_;
};

// ---- integrals ---------------------------------------------------------------------------

struct FacePoint {
    double weight = 0;
    std::array<double, kMostFaceNodes> value{}, du{}, dv{};
};

FacePoint quadratic_triangle(double u, double v, double weight)
{
    const double w = 1 - u - v;
    FacePoint p;
    p.weight = weight;
    p.value = {w * (2 * w - 1), u * (2 * u - 1), v * (2 * v - 1), 4 * w * u, 4 * u * v, 4 * v * w};
    p.du = {1 - 4 * w, 4 * u - 1, 0, 4 * (w - u), 4 * v, -4 * v};
    p.dv = {1 - 4 * w, 0, 4 * v - 1, -4 * u, 4 * u, 4 * (w - v)};
    return p;
}

FacePoint bilinear_square(double u, double v, double weight)
{
    FacePoint p;
    p.weight = weight;
    p.value = {(1 - u) * (1 - v) / 4, (1 + u) * (1 - v) / 4, (1 + u) * (1 + v) / 4,
               (1 - u) * (1 + v) / 4};
    p.du = {-(1 - v) / 4, (1 - v) / 4, (1 + v) / 4, -(1 + v) / 4};
    p.dv = {-(1 - u) / 4, -(1 + u) / 4, (1 + u) / 4, (1 - u) / 4};
    return p;
}

// x . n dA has degree 4 on a quadratic triangle and 2 in each variable on a bilinear square: the
// rules are exact for that. The six points of degree 4 are two orbits of the triangle's symmetry,
// w_1 (a, a, 1 - 2a) and w_2 (b, b, 1 - 2b); the moment equations have this closed form.
std::vector<FacePoint> rule(std::size_t nodes, std::size_t corners)
{
    std::vector<FacePoint> points;
    if (corners == 4) {
        const double g = 1 / std::sqrt(3.0);
        for (const double u : {-g, g})
            for (const double v : {-g, g})
                points.push_back(bilinear_square(u, v, 1));
        return points;
    }
    if (nodes == 3) {
        FacePoint p;
        p.weight = 0.5;
        p.value = {1. / 3, 1. / 3, 1. / 3};
        p.du = {-1, 1, 0};
        p.dv = {-1, 0, 1};
        return {p};
    }
    const double s = std::sqrt(10.0), root = std::sqrt(38 - 44 * std::sqrt(0.4));
    for (const double sign : {1., -1.}) {
        const double a = (8 - s + sign * root) / 18;
        const double weight = (620 + sign * std::sqrt(213125 - 53320 * s)) / 3720 / 2;
        for (const auto& [u, v] : {std::array{a, a}, {a, 1 - 2 * a}, {1 - 2 * a, a}})
            points.push_back(quadratic_triangle(u, v, weight));
    }
    return points;
}

} // namespace

ExternalSurface surface_of(const VolumeMesh& mesh, std::span<const FaceRef> faces)
{
    ExternalSurface out;
    out.faces.assign(faces.begin(), faces.end());
    std::sort(out.faces.begin(), out.faces.end());
    out.starts.push_back(0);
    out.surface_nodes.assign(mesh.nodes.size(), -1);
    for (const FaceRef& face : out.faces) {
        const FaceNodes on = face_nodes(mesh, face);
        out.nodes.insert(out.nodes.end(), on.nodes().begin(), on.nodes().end());
        out.starts.push_back(static_cast<std::int64_t>(out.nodes.size()));
        out.corners.push_back(static_cast<std::uint8_t>(on.corners));
        for (const std::int32_t n : on.nodes())
            out.surface_nodes[static_cast<std::size_t>(n)] = 0;
    }
    for (std::size_t i = 0; i < mesh.nodes.size(); ++i)
        if (out.surface_nodes[i] == 0) {
            out.surface_nodes[i] = static_cast<std::int32_t>(out.used_nodes.size());
            out.used_nodes.push_back(static_cast<std::int32_t>(i));
        }
    return out;
}

ExternalSurface extract_surface(const VolumeMesh& mesh)
{
    std::vector<FaceRef> faces;
    for_each_face(sorted_faces(mesh), [&](std::span<const SortedFace> same) {
        if (same.size() == 1) faces.push_back(same[0].face);
    });
    return surface_of(mesh, faces);
}

SurfaceEdges find_edges(const ExternalSurface& surface, std::span<const Vec3> places)
{
    SurfaceEdges out;
    Parts parts(surface.faces.size());
    std::vector<std::int32_t> corners;
    const std::vector<Side> sides = sorted_sides(surface);
    for (std::size_t i = 0, j = 0; i < sides.size(); i = j) {
        while (j < sides.size() && sides[j].low == sides[i].low && sides[j].high == sides[i].high)
            ++j;
        const Side& first = sides[i];
        --out.euler_characteristic;
        for (std::size_t k = i + 1; k < j; ++k)
            parts.join(first.face, sides[k].face);
        if (j - i > 2) {
            CrowdedEdge edge{{first.low, first.high}, {}};
            for (std::size_t k = i; k < j; ++k)
                edge.faces.push_back(sides[k].face);
            out.crowded.push_back(std::move(edge));
            continue;
        }
        SurfaceEdge edge{{first.low, first.high}, first.middle, {first.face, -1}, 0};
        if (j - i == 2) {
            edge.faces[1] = sides[i + 1].face;
            edge.angle = inner_angle(surface, places, edge);
        } else {
            ++out.borders;
        }
        out.edges.push_back(edge);
    }
    std::vector<bool> is_corner(places.size());
    for (std::size_t f = 0; f < surface.faces.size(); ++f)
        for (std::size_t i = 0; i < surface.corners[f]; ++i)
            is_corner[static_cast<std::size_t>(surface.face(f)[i])] = true;
    out.euler_characteristic += static_cast<std::int64_t>(surface.faces.size()) +
                                std::count(is_corner.begin(), is_corner.end(), true);
    out.parts = parts.count();
    return out;
}

SurfaceIntegrals integrate(const ExternalSurface& surface, const VolumeMesh& mesh)
{
    const std::array<std::vector<FacePoint>, 3> rules{rule(3, 3), rule(6, 3), rule(4, 4)};
    SurfaceIntegrals sum;
    // From the first node: what is far from the origin would lose digits.
    const Vec3 origin = surface.nodes.empty() ? Vec3::Zero() : node(mesh, surface.nodes[0]);
    for (std::size_t f = 0; f < surface.faces.size(); ++f) {
        const auto nodes = surface.face(f);
        for (const FacePoint& p : rules[surface.corners[f] == 4 ? 2U
                                        : nodes.size() == 6     ? 1U
                                                                : 0U]) {
            Vec3 x = Vec3::Zero(), xu = Vec3::Zero(), xv = Vec3::Zero();
            for (std::size_t i = 0; i < nodes.size(); ++i) {
                const Vec3 at = node(mesh, nodes[i]) - origin;
                x += p.value[i] * at;
                xu += p.du[i] * at;
                xv += p.dv[i] * at;
            }
            const Vec3 normal = p.weight * xu.cross(xv);
            sum.area += normal.norm();
            sum.area_vector += normal;
            sum.volume += x.dot(normal) / 3;
        }
    }
    return sum;
}

TriangulatedSurface triangulate(const ExternalSurface& surface, const VolumeMesh& mesh)
{
    TriangulatedSurface out;
    for (const std::int32_t n : surface.used_nodes)
        out.mesh.points.push_back(node(mesh, n));
    for (std::size_t f = 0; f < surface.faces.size(); ++f) {
        const auto nodes = surface.face(f);
        const auto add = [&](std::size_t a, std::size_t b, std::size_t c) {
            const auto number = [&](std::size_t i) {
                return surface.surface_nodes[static_cast<std::size_t>(nodes[i])];
            };
            out.mesh.triangles.push_back({number(a), number(b), number(c)});
            out.faces.push_back(static_cast<std::int32_t>(f));
        };
        if (nodes.size() == 6) {
            add(0, 3, 5);
            add(3, 1, 4);
            add(5, 4, 2);
            add(3, 4, 5);
        } else if (surface.corners[f] == 3) {
            add(0, 1, 2);
        } else if ((node(mesh, nodes[0]) - node(mesh, nodes[2])).norm() <=
                   (node(mesh, nodes[1]) - node(mesh, nodes[3])).norm()) {
            add(0, 1, 2);
            add(0, 2, 3);
        } else {
            add(0, 1, 3);
            add(1, 2, 3);
        }
    }
    return out;
}

} // namespace amontons
