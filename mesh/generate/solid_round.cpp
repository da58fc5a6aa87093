#include "mesh/generate/solid_round.hpp"

#include "mesh/base/error.hpp"
#include "mesh/base/text.hpp"
#include "mesh/generate/solid_box.hpp"
#include "mesh/split_elements.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

// A lattice of n cells an edge fills the core; each lattice point of the core's border has copies
// in `layers` shells outside it. So no node is there twice and none has to be merged.
//
//     +-----------+      c in [-1, 1]^d is a point of the core, m = max |c_i|,
//     |\  shell  /|      d(c) the direction of c after an equal-angle map.
//     | +-------+ |
//     | |  core | |      core:   R (1 - b) h c + R b s m d(c)
//     | +-------+ |      shell:  from there on the border straight to R d(c)
//     |/         \|
//     +-----------+

namespace amontons {
namespace {

constexpr double kCubeShare = 0.4, kRound = 0.55, kBlend = 0.5; // h, s, b above

struct Counts {
    std::int32_t core = 1, layers = 1;
};

Counts counts_of(std::int32_t cells)
{
    return {std::max(1, cells / 2), std::max(1, (cells - cells / 2) / 2)};
}

/// @param c  last coordinates 0 for a disc
Vec3 direction(const Vec3& c)
{
    const double m = c.cwiseAbs().maxCoeff();
    if (m == 0) return Vec3::Zero();
    Vec3 d;
    for (int i = 0; i < 3; ++i)
        d[i] = std::tan(c[i] / m * std::numbers::pi / 4);
    return d.normalized();
}

/// @param shell  0 on the core's border, 1 on the surface
Vec3 round_point(const Vec3& c, double shell)
{
    const Vec3 d = direction(c);
    const Vec3 core = (1 - kBlend) * kCubeShare * c + kBlend * kRound * c.cwiseAbs().maxCoeff() * d;
    return shell <= 0 ? core : Vec3{(1 - shell) * core + shell * d};
}

Vec3 lattice(std::int32_t i, std::int32_t j, std::int32_t k, std::int32_t n)
{
    return {2. * i / n - 1, 2. * j / n - 1, 2. * k / n - 1};
}

void check(double value, const char* name, std::vector<Issue>& issues)
{
    if (!(value > 0) || !std::isfinite(value))
        issues.push_back({"", name, number_text(value), "> 0 and finite [m]"});
}

void check(std::int32_t value, std::int32_t least, const char* name, std::vector<Issue>& issues)
{
    if (value < least || value > 2000)
        issues.push_back({"", name, std::to_string(value), std::to_string(least) + " to 2000"});
}

void check_size(double hexahedra, std::vector<Issue>& issues)
{
    if (hexahedra * 6 > static_cast<double>(kMostElements))
        issues.push_back({"", "/cells", number_text(hexahedra) + " cells",
                          "at most " + std::to_string(kMostElements / 6)});
}

void add_all(VolumeMesh& mesh)
{
    ElementSet all{"volume", {}};
    for (std::size_t e = 0; e < element_count(mesh); ++e)
        all.members.push_back(static_cast<std::int32_t>(e));
    mesh.element_sets.push_back(std::move(all));
}

} // namespace

VolumeMesh make_solid_ball(const SolidBallOptions& o)
{
    std::vector<Issue> issues;
    check(o.radius, "/radius", issues);
    check(o.cells, 2, "/cells", issues);
    if (!o.centre.allFinite()) issues.push_back({"", "/centre", "not finite", "finite [m]"});
    const auto [n, layers] = counts_of(o.cells);
    check_size(1. * n * n * n + 6. * n * n * layers, issues);
    if (!issues.empty()) throw InputError(std::move(issues));

    VolumeMesh mesh;
    const auto add = [&](const Vec3& x) { mesh.nodes.push_back(o.centre + o.radius * x); };
    const std::int32_t row = n + 1, plane = row * row;
    std::vector<std::int32_t> border(static_cast<std::size_t>(plane * row), -1); // number there
    std::vector<Vec3> border_points;
    for (std::int32_t k = 0; k <= n; ++k)
        for (std::int32_t j = 0; j <= n; ++j)
            for (std::int32_t i = 0; i <= n; ++i) {
                const Vec3 c = lattice(i, j, k, n);
                if (c.cwiseAbs().maxCoeff() == 1) {
                    border[mesh.nodes.size()] = static_cast<std::int32_t>(border_points.size());
                    border_points.push_back(c);
                }
                add(round_point(c, 0));
            }
    const auto core = static_cast<std::int32_t>(mesh.nodes.size()),
               shell = static_cast<std::int32_t>(border_points.size());
    for (std::int32_t l = 1; l <= layers; ++l)
        for (const Vec3& c : border_points)
            add(round_point(c, static_cast<double>(l) / layers));

    ElementBlock block{ElementKind::H8, {}};
    FaceSet outer{"outer", {}};
    std::vector<std::array<std::int32_t, 4>> quads; // of the core's border, seen from outside
    for (std::int32_t k = 0; k < n; ++k)
        for (std::int32_t j = 0; j < n; ++j)
            for (std::int32_t i = 0; i < n; ++i) {
                const std::int32_t a = i + j * row + k * plane, b = a + plane;
                const std::array<std::int32_t, 8> hex{a, a + 1, a + 1 + row, a + row,
                                                      b, b + 1, b + 1 + row, b + row};
                block.nodes.insert(block.nodes.end(), hex.begin(), hex.end());
                const bool outside[] = {i == 0, i == n - 1, j == 0, j == n - 1, k == 0, k == n - 1};
                for (int f = 0; f < 6; ++f) {
                    if (!outside[f]) continue;
                    const FaceNodes q = face_nodes({ElementKind::H8, hex}, f);
                    quads.push_back({q.node[0], q.node[1], q.node[2], q.node[3]});
                }
            }
    for (std::int32_t l = 0; l < layers; ++l)
        for (const auto& quad : quads) {
            for (const std::int32_t out : {0, 1})
                for (const std::int32_t v : quad)
                    block.nodes.push_back(l + out == 0 ? v
                                                       : core + (l + out - 1) * shell +
                                                             border[static_cast<std::size_t>(v)]);
            if (l == layers - 1) // local face 5: nodes 4 5 6 7
                outer.members.push_back({static_cast<std::int32_t>(block.size()) - 1, 5});
        }
    mesh.blocks.push_back(std::move(block));
    mesh.face_sets.push_back(std::move(outer));
    add_all(mesh);

    const std::int32_t first_outside = core + (layers - 1) * shell;
    const std::vector<Vec3> nodes = mesh.nodes;
    return as_kind(std::move(mesh), o.kind, [&](std::int32_t a, std::int32_t b) {
        const Vec3 half =
            0.5 * (nodes[static_cast<std::size_t>(a)] + nodes[static_cast<std::size_t>(b)]);
        if (a < first_outside || b < first_outside) return half;
        return Vec3{o.centre + o.radius * (half - o.centre).normalized()};
    });
}

VolumeMesh make_solid_cylinder(const SolidCylinderOptions& o)
{
    std::vector<Issue> issues;
    check(o.radius, "/radius", issues);
    check(o.length, "/length", issues);
    check(o.cells, 2, "/cells", issues);
    if (o.along < 1 || o.along > 1000000)
        issues.push_back({"", "/along", std::to_string(o.along), "1 to 1000000"});
    if (!o.start.allFinite()) issues.push_back({"", "/start", "not finite", "finite [m]"});
    const double axis_length = o.axis.norm();
    if (!(axis_length > 0) || !std::isfinite(axis_length))
        issues.push_back({"", "/axis", number_text(axis_length) + " long", "a length > 0"});
    const auto [n, layers] = counts_of(o.cells);
    check_size((1. * n * n + 4. * n * layers) * o.along, issues);
    if (!issues.empty()) throw InputError(std::move(issues));

    const Vec3 axis = o.axis / axis_length, across = axis.unitOrthogonal(),
               third = axis.cross(across);

    // ---- The disc
    // The disc: its points, and its quadrilaterals counter-clockwise seen from the end.
    std::vector<Vec3> disc;
    std::vector<std::array<std::int32_t, 4>> quads;
    const std::int32_t row = n + 1;
    for (std::int32_t j = 0; j <= n; ++j)
        for (std::int32_t i = 0; i <= n; ++i) {
            Vec3 c = lattice(i, j, 0, n);
            c[2] = 0;
            disc.push_back(round_point(c, 0));
        }
    for (std::int32_t j = 0; j < n; ++j)
        for (std::int32_t i = 0; i < n; ++i) {
            const std::int32_t a = i + j * row;
            quads.push_back({a, a + 1, a + 1 + row, a + row});
        }
    std::vector<std::int32_t> ring; // the core's border, counter-clockwise
    std::vector<Vec3> ring_points;
    for (std::int32_t side = 0; side < 4; ++side)
        for (std::int32_t s = 0; s < n; ++s) {
            const std::int32_t i = side == 0   ? s
                                   : side == 1 ? n
                                   : side == 2 ? n - s
                                               : 0,
                               j = side == 0   ? 0
                                   : side == 1 ? s
                                   : side == 2 ? n
                                               : n - s;
            ring.push_back(i + j * row);
            Vec3 c = lattice(i, j, 0, n);
            c[2] = 0;
            ring_points.push_back(c);
        }
    const auto around = static_cast<std::int32_t>(ring.size());
    std::vector<std::int32_t> inside = ring;
    for (std::int32_t l = 1; l <= layers; ++l) {
        std::vector<std::int32_t> next;
        for (const Vec3& c : ring_points) {
            next.push_back(static_cast<std::int32_t>(disc.size()));
            disc.push_back(round_point(c, static_cast<double>(l) / layers));
        }
        for (std::int32_t s = 0; s < around; ++s) {
            const auto a = static_cast<std::size_t>(s),
                       b = static_cast<std::size_t>((s + 1) % around);
            quads.push_back({inside[b], inside[a], next[a], next[b]});
        }
        inside = std::move(next);
    }

    // ---- Layers of the cylinder
    VolumeMesh mesh;
    const auto plane = static_cast<std::int32_t>(disc.size());
    for (std::int32_t k = 0; k <= o.along; ++k)
        for (const Vec3& x : disc)
            mesh.nodes.push_back(o.start + o.length * k / o.along * axis +
                                 o.radius * (x[0] * across + x[1] * third));
    ElementBlock block{ElementKind::H8, {}};
    FaceSet start{"start", {}}, end{"end", {}}, outer{"outer", {}};
    const std::size_t first_outside = quads.size() - static_cast<std::size_t>(around);
    for (std::int32_t k = 0; k < o.along; ++k)
        for (std::size_t q = 0; q < quads.size(); ++q) {
            const auto e = static_cast<std::int32_t>(block.size());
            for (const std::int32_t level : {k, k + 1})
                for (const std::int32_t v : quads[q])
                    block.nodes.push_back(v + level * plane);
            if (k == 0) start.members.push_back({e, 4});             // nodes 0 3 2 1
            if (k == o.along - 1) end.members.push_back({e, 5});     // nodes 4 5 6 7
            if (q >= first_outside) outer.members.push_back({e, 3}); // nodes 3 7 6 2
        }
    mesh.blocks.push_back(std::move(block));
    mesh.face_sets = {std::move(start), std::move(end), std::move(outer)};
    add_all(mesh);

    const std::int32_t outside = plane - around; // from here on a plane's nodes are on the surface

    // ---- Element kind and round nodes
    const std::vector<Vec3> nodes = mesh.nodes;
    return as_kind(std::move(mesh), o.kind, [&](std::int32_t a, std::int32_t b) {
        const Vec3 half =
            0.5 * (nodes[static_cast<std::size_t>(a)] + nodes[static_cast<std::size_t>(b)]);
        if (a % plane < outside || b % plane < outside) return half;
        const Vec3 foot = o.start + (half - o.start).dot(axis) * axis;
        return Vec3{foot + o.radius * (half - foot).normalized()};
    });
}

} // namespace amontons
