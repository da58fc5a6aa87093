#include "contact/surface/choose_slave.hpp"

#include "mesh/bounding_tree.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

namespace amontons {
namespace {

constexpr double kContrast = 30; ///< of stiffness: decides before fineness
constexpr double kAlike = 1e-2;  ///< difference of area per multiplier that does not count
constexpr double kSameDistance = 1e-6;
constexpr double kOnTheOther = 0.05; ///< of a face: its corners are as near as the nearest place
constexpr double kDirectedAt = 0.7;  ///< cosine: faces that are directed at each other
/// Area per multiplier over that of the other side: a finer side follows no more.
constexpr double kMuchFiner = 4;

/// A face by what counts here.
struct FaceSize {
    Vec3 middle;       ///< of its corners [m]
    Vec3 normal;       ///< outward, unit
    double radius = 0; ///< of its corners around that [m]
    double area = 0;   ///< [m^2]
    double share = 0;  ///< of multipliers: a regular mesh has a vertex to two triangles or one
                       ///< quadrilateral, an edge to 2/3
};

std::vector<FaceSize> sizes_of(const ExternalSurface& surface, std::span<const Vec3> places)
{
    std::vector<FaceSize> sizes;
    for (std::size_t f = 0; f < surface.faces.size(); ++f) {
        const std::span<const std::int32_t> face = surface.face(f);
        const auto at = [&](std::size_t i) -> const Vec3& {
            return places[static_cast<std::size_t>(face[i])];
        };
        const bool four = face.size() == 4;
        const std::size_t corners = four ? 4 : 3;
        FaceSize s;
        s.middle.setZero();
        for (std::size_t i = 0; i < corners; ++i)
            s.middle += at(i) / double(corners);
        for (std::size_t i = 0; i < corners; ++i)
            s.radius = std::max(s.radius, (at(i) - s.middle).norm());
        const Vec3 twice = (at(four ? 2 : 1) - at(0)).cross(at(four ? 3 : 2) - at(four ? 1 : 0));
        s.area = twice.norm() / 2;
        s.normal = twice.normalized();
        s.share = four ? 1 : face.size() == 6 ? 1.5 : 0.5;
        sizes.push_back(s);
    }
    return sizes;
}

/// The triangles of a surface, and the face of each.
struct Triangles {
    BoundingTree tree;
    std::vector<std::size_t> face;
};

Triangles corner_triangles(const ExternalSurface& surface, std::span<const Vec3> places)
{
    std::vector<std::size_t> of_face;
    std::vector<BoundingTree::Corners> corners;
    for (std::size_t f = 0; f < surface.faces.size(); ++f) {
        const std::span<const std::int32_t> face = surface.face(f);
        for (std::size_t i = 2; i < (face.size() == 4 ? 4u : 3u); ++i) {
            corners.push_back({places[static_cast<std::size_t>(face[0])],
                               places[static_cast<std::size_t>(face[i - 1])],
                               places[static_cast<std::size_t>(face[i])]});
            of_face.push_back(f);
        }
    }
    return {BoundingTree(std::move(corners)), std::move(of_face)};
}

/// Around all nodes of the faces.
struct Sphere {
    Vec3 centre = Vec3::Zero();
    double radius = 0;
};

Sphere sphere_around(std::span<const FaceSize> faces)
{
    Sphere s;
    for (const FaceSize& f : faces)
        s.centre += f.middle / double(faces.size());
    for (const FaceSize& f : faces)
        s.radius = std::max(s.radius, (f.middle - s.centre).norm() + f.radius);
    return s;
}

/// Area per multiplier of the faces that are no farther from another surface than the nearest and
/// their own size; of all where there is none [m^2]. By distances: turned together it is the same.
double coarseness(std::span<const FaceSize> faces, const BoundingTree* other)
{
    std::vector<double> far(faces.size(), 0);
    std::int32_t hint = -1;
    for (std::size_t f = 0; other && f < faces.size(); ++f) {
        const NearestTriangle found = other->nearest(faces[f].middle, hint);
        hint = found.triangle;
        far[f] = std::sqrt(found.squared);
    }
    const double least = far.empty() ? 0 : *std::min_element(far.begin(), far.end());
    double area = 0, multipliers = 0;
    for (std::size_t f = 0; f < faces.size(); ++f) {
        if (far[f] > least + (1 + kSameDistance) * faces[f].radius) continue;
        area += faces[f].area;
        multipliers += faces[f].share;
    }
    return multipliers > 0 ? area / multipliers : 0;
}

/// Whether the other surface covers all faces that are nearest to it and directed at it, as a flat
/// end that stands within the other side.
bool lies_on(const ExternalSurface& surface, std::span<const Vec3> places,
             std::span<const FaceSize> faces, const Triangles& other,
             std::span<const FaceSize> other_faces)
{
    std::vector<double> far(faces.size(), std::numeric_limits<double>::infinity());
    std::int32_t hint = -1;
    for (std::size_t f = 0; f < faces.size(); ++f) {
        const NearestTriangle found = other.tree.nearest(faces[f].middle, hint);
        hint = found.triangle;
        const FaceSize& opposite = other_faces[other.face[std::size_t(found.triangle)]];
        if (faces[f].normal.dot(opposite.normal) < -kDirectedAt) far[f] = std::sqrt(found.squared);
    }
    const double least = *std::min_element(far.begin(), far.end());
    if (std::isinf(least)) return false;
    for (std::size_t f = 0; f < faces.size(); ++f) {
        if (far[f] > least + faces[f].radius) continue;
        const std::span<const std::int32_t> nodes = surface.face(f);
        for (std::size_t i = 0; i < (nodes.size() == 4 ? 4u : 3u); ++i) {
            const NearestTriangle found =
                other.tree.nearest(places[static_cast<std::size_t>(nodes[i])], hint);
            if (std::sqrt(found.squared) > least + kOnTheOther * faces[f].radius) return false;
        }
    }
    return true;
}

} // namespace

bool first_is_slave(const ExternalSurface& a, std::span<const Vec3> a_places, double a_stiffness,
                    const ExternalSurface& b, std::span<const Vec3> b_places, double b_stiffness,
                    bool covered_first)
{
    if (std::isinf(a_stiffness) != std::isinf(b_stiffness)) return std::isinf(b_stiffness);
    if (a_stiffness >= kContrast * b_stiffness && !std::isinf(a_stiffness)) return false;
    if (b_stiffness >= kContrast * a_stiffness && !std::isinf(b_stiffness)) return true;
    const std::vector<FaceSize> faces_a = sizes_of(a, a_places), faces_b = sizes_of(b, b_places);
    if (faces_a.empty() || faces_b.empty()) return a_stiffness <= b_stiffness;
    const Sphere around_a = sphere_around(faces_a), around_b = sphere_around(faces_b);
    std::optional<Triangles> tree_a, tree_b; // of bodies that are near each other
    if ((around_a.centre - around_b.centre).norm() <=
        (1 + kSameDistance) * (around_a.radius + around_b.radius)) {
        tree_a.emplace(corner_triangles(a, a_places));
        tree_b.emplace(corner_triangles(b, b_places));
    }
    const double of_a = coarseness(faces_a, tree_b ? &tree_b->tree : nullptr),
                 of_b = coarseness(faces_b, tree_a ? &tree_a->tree : nullptr);
    if (covered_first && tree_a && std::max(of_a, of_b) <= kMuchFiner * std::min(of_a, of_b)) {
        const bool a_lies = lies_on(a, a_places, faces_a, *tree_b, faces_b),
                   b_lies = lies_on(b, b_places, faces_b, *tree_a, faces_a);
        if (a_lies != b_lies) return a_lies;
    }
    if (std::abs(of_a - of_b) > kAlike * std::max(of_a, of_b)) return of_a > of_b;
    return a_stiffness <= b_stiffness;
}

} // namespace amontons
