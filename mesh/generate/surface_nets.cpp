#include "mesh/generate/surface_nets.hpp"

#include "mesh/base/index.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <unordered_map>

namespace amontons {

namespace {

constexpr int kNetBlock = 4; // cells along an edge of a block that is skipped or searched whole
constexpr int kNetNodes = kNetBlock + 1;
constexpr int kNetSweeps = 2;   // of relaxation; more gain little
constexpr double kMargin = 1.1; // functions that change a little faster than distance
constexpr double kRelax = 0.6;

struct Crossing { // of a grid edge, from node (x, y, z) along an axis
    std::int32_t x, y, z;
    std::int8_t axis;
    bool rising; // the function grows along the axis
};

std::uint64_t cell_key(std::int64_t x, std::int64_t y, std::int64_t z)
{
    constexpr std::int64_t shift = 1 << 20;
    return static_cast<std::uint64_t>(x + shift) << 42 |
           static_cast<std::uint64_t>(y + shift) << 21 | static_cast<std::uint64_t>(z + shift);
}

int node_index(int i, int j, int k)
{
    return kNetNodes * (kNetNodes * i + j) + k;
}

} // namespace

SurfaceMesh surface_nets(const ImplicitSurface& surface, const Vec3& low, const Vec3& high,
                         double edge)
{
    SurfaceMesh mesh;
    std::unordered_map<std::uint64_t, std::int32_t> vertex_of;
    std::vector<Crossing> crossings;
    // A grid that does not pass through the corners and planes a user thinks in.
    const Vec3 origin = low - edge * Vec3{1.3137, 1.4241, 1.2713};
    std::int32_t blocks[3];
    for (int a = 0; a < 3; ++a)
        blocks[a] =
            static_cast<std::int32_t>(std::ceil((high[a] - origin[a]) / (kNetBlock * edge) + 0.2));
    std::vector<double> f(kNetNodes * kNetNodes * kNetNodes);
    const double reach = kMargin * 0.5 * std::sqrt(3.0) * kNetBlock * edge;
    for (std::int32_t bx = 0; bx < blocks[0]; ++bx)
        for (std::int32_t by = 0; by < blocks[1]; ++by)
            for (std::int32_t bz = 0; bz < blocks[2]; ++bz) {
                const Vec3 corner = origin + kNetBlock * edge * Vec3{1.0 * bx, 1.0 * by, 1.0 * bz};
                const double middle =
                    surface.value(corner + Vec3::Constant(0.5 * kNetBlock * edge));
                if (std::abs(middle) > reach) continue;
                for (int i = 0; i < kNetNodes; ++i)
                    for (int j = 0; j < kNetNodes; ++j)
                        for (int k = 0; k < kNetNodes; ++k)
                            f[at(node_index(i, j, k))] =
                                surface.value(corner + edge * Vec3{1.0 * i, 1.0 * j, 1.0 * k});
                constexpr int stride[3] = {kNetNodes * kNetNodes, kNetNodes, 1};
                for (int i = 0; i < kNetBlock; ++i)
                    for (int j = 0; j < kNetBlock; ++j)
                        for (int k = 0; k < kNetBlock; ++k) {
                            const int node = node_index(i, j, k);
                            const std::int32_t x = kNetBlock * bx + i, y = kNetBlock * by + j,
                                               z = kNetBlock * bz + k;
                            // Crossings of the 12 edges of this cell; the three at its first
                            // node are recorded, each edge is so by one cell.
                            Vec3 sum = Vec3::Zero();
                            int count = 0;
                            for (int a = 0; a < 3; ++a)
                                for (int side = 0; side < 4; ++side) {
                                    const int b = (a + 1) % 3, c = (a + 2) % 3;
                                    const int n0 =
                                        node + (side & 1) * stride[b] + (side >> 1) * stride[c];
                                    const double f0 = f[at(n0)], f1 = f[at(n0 + stride[a])];
                                    if ((f0 > 0) == (f1 > 0)) continue;
                                    Vec3 p = Vec3::Zero();
                                    p[a] = f0 / (f0 - f1);
                                    p[b] = side & 1;
                                    p[c] = side >> 1;
                                    sum += p;
                                    ++count;
                                    if (side == 0)
                                        crossings.push_back(
                                            {x, y, z, static_cast<std::int8_t>(a), f1 > 0});
                                }
                            if (count == 0) continue;
                            vertex_of.emplace(cell_key(x, y, z),
                                              static_cast<std::int32_t>(mesh.points.size()));
                            mesh.points.push_back(
                                corner + edge * (Vec3{1.0 * i, 1.0 * j, 1.0 * k} + sum / count));
                        }
            }
    for (Vec3& p : mesh.points)
        p = surface.project(p);

    mesh.triangles.reserve(2 * crossings.size());
    for (const Crossing& c : crossings) {
        std::int32_t quad[4];
        bool whole = true;
        for (int corner = 0; corner < 4; ++corner) {
            constexpr int back[4][2] = {{1, 1}, {0, 1}, {0, 0}, {1, 0}}; // turns about the axis
            std::int32_t cell[3] = {c.x, c.y, c.z};
            cell[(c.axis + 1) % 3] -= back[corner][0];
            cell[(c.axis + 2) % 3] -= back[corner][1];
            const auto found = vertex_of.find(cell_key(cell[0], cell[1], cell[2]));
            whole = whole && found != vertex_of.end();
            if (whole) quad[corner] = found->second;
        }
        if (!whole) continue; // at the border of the box
        if (!c.rising) std::swap(quad[1], quad[3]);
        const auto length = [&](int i, int j) {
            return (mesh.points[at(quad[i])] - mesh.points[at(quad[j])]).squaredNorm();
        };
        if (length(0, 2) <= length(1, 3)) {
            mesh.triangles.push_back({quad[0], quad[1], quad[2]});
            mesh.triangles.push_back({quad[0], quad[2], quad[3]});
        } else {
            mesh.triangles.push_back({quad[0], quad[1], quad[3]});
            mesh.triangles.push_back({quad[1], quad[2], quad[3]});
        }
    }
    relax_on_surface(mesh, surface, std::vector<char>(mesh.points.size(), 0), kNetSweeps);
    return mesh;
}

void relax_on_surface(SurfaceMesh& mesh, const ImplicitSurface& surface,
                      const std::vector<char>& fixed, int sweeps)
{
    std::vector<Vec3> sum(mesh.points.size()), normal(mesh.points.size());
    std::vector<int> count(mesh.points.size());
    for (int sweep = 0; sweep < sweeps; ++sweep) {
        std::fill(sum.begin(), sum.end(), Vec3::Zero());
        std::fill(normal.begin(), normal.end(), Vec3::Zero());
        std::fill(count.begin(), count.end(), 0);
        for (const auto& t : mesh.triangles) {
            const Vec3 &a = mesh.points[at(t[0])], &b = mesh.points[at(t[1])],
                       &c = mesh.points[at(t[2])];
            const Vec3 area = (b - a).cross(c - a), all = a + b + c;
            for (std::int32_t v : t) {
                sum[at(v)] += all - mesh.points[at(v)];
                normal[at(v)] += area;
                count[at(v)] += 2;
            }
        }
        for (std::size_t v = 0; v < mesh.points.size(); ++v) {
            const double size = normal[v].norm();
            if (fixed[v] || !(size > 0)) continue;
            Vec3 move = sum[v] / count[v] - mesh.points[v];
            move -= normal[v] * (normal[v].dot(move) / (size * size));
            mesh.points[v] = surface.project(mesh.points[v] + kRelax * move);
        }
    }
}

} // namespace amontons
