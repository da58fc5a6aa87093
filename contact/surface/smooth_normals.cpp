#include "contact/surface/smooth_normals.hpp"

#include "mesh/base/index.hpp"
#include "mesh/face_shape.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <tuple>
#include <utility>

namespace amontons {
namespace {

/// A corner of a face, seen from its node.
struct Corner {
    std::int32_t face = 0, corner = 0;
    std::int32_t before = 0, after = 0; ///< its neighbours on the face's border
    Vec3 normal = Vec3::Zero();         ///< of the face there, unit
    double angle = 0;                   ///< [rad]
};

/// Nodes of a face as they follow each other on its border: corners of a T6 and its middle nodes in
/// turns.
std::size_t on_border(std::size_t nodes, std::size_t k)
{
    return nodes != 6 ? k : k / 2 + (k % 2 == 0 ? 0 : 3);
}

/// The other way: where a node is on the border.
std::size_t along_border(std::size_t nodes, std::size_t k)
{
    return nodes != 6 ? k : k < 3 ? 2 * k : 2 * (k - 3) + 1;
}

/// A node of a T6, corner or middle of a side.
Corner corner_of_t6(std::span<const std::int32_t> nodes, std::span<const Vec3> places,
                    std::size_t face, std::size_t k)
{
    constexpr std::array<std::array<double, 2>, 6> kAt = {
        {{0, 0}, {0.5, 0}, {1, 0}, {0.5, 0.5}, {0, 1}, {0, 0.5}}};
    double N[6], dx[6], dy[6];
    evaluate_face(6, kAt[k][0], kAt[k][1], N, dx, dy);
    Vec3 a = Vec3::Zero(), b = Vec3::Zero();
    for (std::size_t i = 0; i < 6; ++i) {
        a += dx[i] * places[at(nodes[i])];
        b += dy[i] * places[at(nodes[i])];
    }
    Corner c;
    c.face = static_cast<std::int32_t>(face);
    c.corner = static_cast<std::int32_t>(on_border(6, k));
    c.after = nodes[on_border(6, (k + 1) % 6)];
    c.before = nodes[on_border(6, (k + 5) % 6)];
    const Vec3 normal = a.cross(b);
    if (!(normal.norm() > 0)) return c;
    c.normal = normal.normalized();
    // Tangents of the two sides at a corner.
    if (k == 2) std::tie(a, b) = std::pair(Vec3(b - a), Vec3(-a));
    if (k == 4) std::tie(a, b) = std::pair(Vec3(-b), Vec3(a - b));
    c.angle = k % 2 == 1 ? std::numbers::pi : std::atan2(a.cross(b).norm(), a.dot(b));
    return c;
}

/// The corner of a face; its angle is 0 if it has no normal.
Corner corner_of(std::span<const std::int32_t> nodes, std::span<const Vec3> places,
                 std::size_t face, std::size_t k)
{
    const std::size_t n = nodes.size();
    if (n == 6) return corner_of_t6(nodes, places, face, k);
    Corner c;
    c.face = static_cast<std::int32_t>(face);
    c.corner = static_cast<std::int32_t>(k);
    c.after = nodes[(k + 1) % n];
    c.before = nodes[(k + n - 1) % n];
    const Vec3& x = places[at(nodes[k])];
    const Vec3 a = places[at(c.after)] - x, b = places[at(c.before)] - x;
    const Vec3 normal = a.cross(b);
    if (!(normal.norm() > 0)) return c;
    c.normal = normal.normalized();
    c.angle = std::atan2(normal.norm(), a.dot(b));
    return c;
}

/// Faces around a node that smooth edges connect: for each the first of its group.
std::vector<std::size_t> groups_of(std::span<const Corner> around, double least_cosine)
{
    std::vector<std::size_t> group(around.size());
    std::iota(group.begin(), group.end(), 0);
    const auto join = [&](std::size_t a, std::size_t b) {
        const std::size_t keep = std::min(group[a], group[b]),
                          merged = std::max(group[a], group[b]);
        for (std::size_t& g : group)
            if (g == merged) g = keep;
    };
    for (std::size_t i = 0; i < around.size(); ++i)
        for (std::size_t j = 0; j < i; ++j) {
            const Corner &a = around[i], &b = around[j];
            if (a.after != b.before && a.before != b.after) continue;
            if (a.normal.dot(b.normal) >= least_cosine) join(i, j);
        }
    return group;
}

} // namespace

SmoothGroups::SmoothGroups(const ExternalSurface& surface, std::span<const Vec3> places,
                           double sharp)
    : group_(surface.nodes.size())
{
    // Corners by their node.
    std::vector<std::size_t> begin(surface.used_nodes.size() + 1, 0);
    for (std::size_t f = 0; f < surface.faces.size(); ++f)
        for (const std::int32_t n : surface.face(f))
            ++begin[at(surface.surface_nodes[at(n)]) + 1];
    std::partial_sum(begin.begin(), begin.end(), begin.begin());
    std::vector<std::size_t> next(begin.begin(), begin.end() - 1);
    std::vector<Corner> corners(begin.back());
    for (std::size_t f = 0; f < surface.faces.size(); ++f) {
        const std::span<const std::int32_t> nodes = surface.face(f);
        for (std::size_t k = 0; k < nodes.size(); ++k) {
            const Corner c = corner_of(nodes, places, f, k);
            corners[next[at(surface.surface_nodes[at(nodes[at(c.corner)])])]++] = c;
        }
    }
    members_.reserve(corners.size());
    for (std::size_t node = 0; node + 1 < begin.size(); ++node) {
        const auto around =
            std::span<const Corner>(corners).subspan(begin[node], begin[node + 1] - begin[node]);
        const std::vector<std::size_t> group = groups_of(around, std::cos(sharp));
        for (std::size_t first = 0; first < around.size(); ++first) {
            if (group[first] != first) continue;
            for (std::size_t j = first; j < around.size(); ++j) {
                if (group[j] != first) continue;
                members_.push_back({around[j].face, around[j].corner});
                group_[at(surface.starts[at(around[j].face)]) + at(around[j].corner)] = groups();
            }
            begin_.push_back(members_.size());
        }
    }
}

SmoothNormals::SmoothNormals(const ExternalSurface& surface, std::span<const Vec3> places,
                             double sharp, std::span<const Vec3> at_rest)
    : corners_(surface.faces.size(), 0)
    , normals_(surface.faces.size())
{
    const SmoothGroups groups(surface, at_rest.empty() ? places : at_rest, sharp);
    std::vector<Vec3> weighted(surface.nodes.size()); // normals of each face's nodes by their angle
    const auto number = [&](std::int32_t face, std::int32_t node) {
        return at(surface.starts[at(face)]) + at(node);
    };
    for (std::size_t f = 0; f < surface.faces.size(); ++f) {
        const std::span<const std::int32_t> nodes = surface.face(f);
        corners_[f] = static_cast<std::uint8_t>(nodes.size());
        for (std::size_t k = 0; k < nodes.size(); ++k) {
            const Corner c = corner_of(nodes, places, f, k);
            if (!(c.angle > 0)) corners_[f] = 0;
            weighted[number(c.face, c.corner)] = c.angle * c.normal;
        }
    }
    for (std::size_t g = 0; g < groups.groups(); ++g) {
        Vec3 sum = Vec3::Zero();
        for (const SmoothGroups::Member& m : groups.members(g))
            sum += weighted[number(m.face, m.node)];
        const Vec3 normal = sum.normalized();
        for (const SmoothGroups::Member& m : groups.members(g))
            normals_[at(m.face)][at(m.node)] = normal;
    }
}

Vec3 SmoothNormals::normal(std::int32_t face, const PerNode& values) const
{
    const std::size_t f = at(face);
    Vec3 sum = Vec3::Zero();
    for (std::size_t k = 0; k < corners_[f]; ++k)
        sum += values[static_cast<Eigen::Index>(k)] * normals_[f][k];
    return sum.normalized();
}

SmoothNormalsOnDemand::SmoothNormalsOnDemand(const ExternalSurface& surface,
                                             std::span<const Vec3> places,
                                             const SmoothGroups& groups)
    : surface_(surface)
    , places_(places)
    , groups_(groups)
    , known_(groups.groups(), 0)
    , normal_(groups.groups())
{
}

bool SmoothNormalsOnDemand::has_(std::int32_t face) const
{
    const std::span<const std::int32_t> nodes = surface_.face(at(face));
    for (std::size_t k = 0; k < nodes.size(); ++k)
        if (!(corner_of(nodes, places_, at(face), k).angle > 0)) return false;
    return true;
}

const Vec3& SmoothNormalsOnDemand::of_group_(std::size_t group)
{
    if (std::exchange(known_[group], std::uint8_t(1))) return normal_[group];
    Vec3 sum = Vec3::Zero();
    for (const SmoothGroups::Member& m : groups_.members(group)) {
        const std::span<const std::int32_t> nodes = surface_.face(at(m.face));
        const Corner c =
            corner_of(nodes, places_, at(m.face), along_border(nodes.size(), at(m.node)));
        sum += c.angle * c.normal;
    }
    return normal_[group] = sum.normalized();
}

std::optional<Vec3> SmoothNormalsOnDemand::normal(std::int32_t face, const PerNode& values)
{
    if (!has_(face)) return {};
    Vec3 sum = Vec3::Zero();
    for (std::size_t k = 0; k < surface_.face(at(face)).size(); ++k)
        sum += values[static_cast<Eigen::Index>(k)] * of_group_(groups_.group(surface_, face, k));
    return sum.normalized();
}

} // namespace amontons
