#include "mesh/generate/surface_nets.hpp"

#include "mesh/base/index.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <unordered_map>
#include <unordered_set>

namespace amontons {

namespace {

constexpr int kNetBlock = 4;    // cells along an edge of a block that is skipped or searched whole
constexpr int kNetCube = 16;    // the same, where signs alone are requested; whole blocks
constexpr int kNetSweeps = 2;   // of relaxation; more gain little
constexpr double kMargin = 1.1; // functions that change a little faster than distance
constexpr double kRelax = 0.6;
constexpr double kSignAlone = 1e-300; // stands for a value of which only the sign is known

struct Crossing { // of a grid edge, from node (x, y, z) along an axis
    std::int32_t x, y, z;
    std::int8_t axis;
    bool rising; // the function grows along the axis
};

// The vertices of a cell, one for each sheet of the surface that passes through it. Where the signs
// of a face's corners alternate, its sides in the free space are parted: the wall continues.
struct CellSheets {
    int count = 0;
    std::int8_t sheet_of[12]; // of an edge of the cell that is crossed, else -1
    std::int8_t joined = 0;   // bits of alternating faces of which one sheet has all four edges
};

// Corner 4 x + 2 y + z has the bit of that number; edge 4 a + side, face 2 a + level for axis a.
int corner_of(int a, int on_a, int on_b, int on_c)
{
    int offset[3];
    offset[a] = on_a;
    offset[(a + 1) % 3] = on_b;
    offset[(a + 2) % 3] = on_c;
    return 4 * offset[0] + 2 * offset[1] + offset[2];
}

CellSheets sheets_of(unsigned inside)
{
    const auto is_inside = [&](int corner) { return (inside >> corner & 1) != 0; };
    int sheet[12];
    std::array<int, 2> ends[12];
    for (int a = 0; a < 3; ++a)
        for (int side = 0; side < 4; ++side) {
            const int e = 4 * a + side;
            ends[e] = {corner_of(a, 0, side & 1, side >> 1), corner_of(a, 1, side & 1, side >> 1)};
            sheet[e] = is_inside(ends[e][0]) != is_inside(ends[e][1]) ? e : -1;
        }
    const auto unite = [&](int e, int other) {
        const int from = sheet[e], to = sheet[other];
        std::replace(sheet, sheet + 12, from, to);
    };
    int alternating = 0;
    std::array<int, 4> edges_of[6];
    for (int face = 0; face < 6; ++face) {
        const int a = face / 2, level = face % 2;
        const auto corner = [&](int k) { // around the face
            return corner_of(a, level, k % 4 == 1 || k % 4 == 2, k % 4 >= 2);
        };
        std::array<int, 4>& edges = edges_of[face]; // from corner k to k + 1
        for (int k = 0; k < 4; ++k)
            for (int e = 0; e < 12; ++e)
                if (ends[e] == std::array{corner(k), corner(k + 1)} ||
                    ends[e] == std::array{corner(k + 1), corner(k)})
                    edges[at(k)] = e;
        const auto crossed =
            std::count_if(edges.begin(), edges.end(), [&](int e) { return sheet[e] >= 0; });
        if (crossed == 4) {
            alternating |= 1 << face;
            for (int k = 0; k < 4; ++k)
                if (is_inside(corner(k))) unite(edges[at((k + 3) % 4)], edges[at(k)]);
        } else if (crossed == 2) {
            int first = -1;
            for (int e : edges)
                if (sheet[e] >= 0) first < 0 ? void(first = e) : unite(e, first);
        }
    }
    CellSheets result;
    for (int face = 0; face < 6; ++face)
        if (alternating >> face & 1 && sheet[edges_of[face][0]] == sheet[edges_of[face][1]] &&
            sheet[edges_of[face][0]] == sheet[edges_of[face][2]] &&
            sheet[edges_of[face][0]] == sheet[edges_of[face][3]])
            result.joined |= static_cast<std::int8_t>(1 << face);
    int number_of[12];
    std::fill(number_of, number_of + 12, -1);
    for (int e = 0; e < 12; ++e) {
        result.sheet_of[e] = -1;
        if (sheet[e] < 0) continue;
        int& number = number_of[sheet[e]];
        if (number < 0) number = result.count++;
        result.sheet_of[e] = static_cast<std::int8_t>(number);
    }
    return result;
}

const CellSheets& cell_sheets(unsigned inside)
{
    static const std::vector<CellSheets> all = [] {
        std::vector<CellSheets> made;
        for (unsigned k = 0; k < 256; ++k)
            made.push_back(sheets_of(k));
        return made;
    }();
    return all[inside];
}

std::uint64_t cell_key(std::int64_t x, std::int64_t y, std::int64_t z)
{
    constexpr std::int64_t shift = 1 << 20;
    return static_cast<std::uint64_t>(x + shift) << 42 |
           static_cast<std::uint64_t>(y + shift) << 21 | static_cast<std::uint64_t>(z + shift);
}

// The first node of the grid, so that it does not pass through round coordinates, where corners and
// planes often lie.
Vec3 net_origin(const Vec3& low, double edge)
{
    return low - edge * Vec3{1.3137, 1.4241, 1.2713};
}

// Along an axis.
std::int32_t net_blocks(double length, double edge)
{
    return static_cast<std::int32_t>(std::ceil(length / (kNetBlock * edge) + 0.2));
}

// A function at the nodes of a cube of grid cells. Where all around has one sign, only that is
// searched for.
template <int cells> struct NetNodes { // along an edge, a power of two
    static constexpr int kStride[3] = {(cells + 1) * (cells + 1), cells + 1, 1};
    static constexpr std::size_t kCount = (cells + 1) * (cells + 1) * (cells + 1);
    std::vector<double> f = std::vector<double>(kCount);

    static int index(int i, int j, int k) { return kStride[0] * i + kStride[1] * j + k; }
    static double reach(double edge) { return kMargin * 0.5 * std::sqrt(3.0) * cells * edge; }
    void clear() { std::fill(f.begin(), f.end(), std::numeric_limits<double>::quiet_NaN()); }
};

// Bits of the corners of a cell that are in the free space, given its first node.
template <int cells> unsigned signs_of_cell(const double* first)
{
    constexpr const int* stride = NetNodes<cells>::kStride;
    unsigned inside = 0;
    for (int corner = 0; corner < 8; ++corner)
        if (first[(corner >> 2) * stride[0] + (corner >> 1 & 1) * stride[1] + (corner & 1)] > 0)
            inside |= 1U << corner;
    return inside;
}

// Of the signs in the part of a cube that begins at a node and is `size` cells wide.
// @param reach    as far as that from zero at its middle, they are all the same [m]
// @param value    of a node
// @param crossed  is called with the first node of each part of two cells that may have both signs
template <int size, int cells, class Value, class Crossed>
void find_signs(NetNodes<cells>& nodes, int i, int j, int k, double reach, const Value& value,
                const Crossed& crossed)
{
    constexpr int half = size / 2;
    constexpr const int* stride = NetNodes<cells>::kStride;
    double* const first = &nodes.f[at(nodes.index(i, j, k))];
    double& middle = first[half * (stride[0] + stride[1] + 1)];
    if (std::isnan(middle)) middle = value(i + half, j + half, k + half);
    if (std::abs(middle) > reach) {
        const double sign = std::copysign(kSignAlone, middle);
        for (int a = 0; a <= size; ++a)
            for (int b = 0; b <= size; ++b)
                for (int c = 0; c <= size; ++c)
                    if (double& f = first[stride[0] * a + stride[1] * b + c]; std::isnan(f))
                        f = sign;
        return;
    }
    if constexpr (size > 2) {
        for (int part = 0; part < 8; ++part)
            find_signs<half>(nodes, i + half * (part >> 2), j + half * (part >> 1 & 1),
                             k + half * (part & 1), reach / 2, value, crossed);
    } else {
        const double step = reach / std::sqrt(3.0); // of one edge of the grid
        for (int a = 0; a <= size; ++a)
            for (int b = 0; b <= size; ++b)
                for (int c = 0; c <= size; ++c) {
                    double* const f = first + stride[0] * a + stride[1] * b + c;
                    if (!std::isnan(*f)) continue;
                    const auto is_sure = [&](const double* neighbour) {
                        if (!(std::abs(*neighbour) > step)) return false;
                        *f = std::copysign(kSignAlone, *neighbour);
                        return true;
                    };
                    const bool sure =
                        (a > 0 && is_sure(f - stride[0])) || (a < size && is_sure(f + stride[0])) ||
                        (b > 0 && is_sure(f - stride[1])) || (b < size && is_sure(f + stride[1])) ||
                        (c > 0 && is_sure(f - 1)) || (c < size && is_sure(f + 1));
                    if (!sure) *f = value(i + a, j + b, k + c);
                }
        crossed(i, j, k);
    }
}

} // namespace

SurfaceMesh surface_nets(const ImplicitSurface& surface, const Vec3& low, const Vec3& high,
                         double edge, const std::function<bool(const Vec3&)>& part)
{
    struct Cell { // of the grid, that the surface crosses
        std::int32_t first_vertex;
        const CellSheets* sheets;
    };
    SurfaceMesh mesh;
    std::unordered_map<std::uint64_t, Cell> cell_at;
    std::vector<Crossing> crossings;
    const Vec3 origin = net_origin(low, edge);
    std::int32_t blocks[3];
    for (int a = 0; a < 3; ++a)
        blocks[a] = net_blocks(high[a] - origin[a], edge);
    NetNodes<kNetBlock> nodes;
    std::vector<double>& f = nodes.f;

    // ---- Crossings of the grid's edges, block by block
    const double reach = nodes.reach(edge);
    for (std::int32_t bx = 0; bx < blocks[0]; ++bx)
        for (std::int32_t by = 0; by < blocks[1]; ++by)
            for (std::int32_t bz = 0; bz < blocks[2]; ++bz) {
                const Vec3 corner = origin + kNetBlock * edge * Vec3{1.0 * bx, 1.0 * by, 1.0 * bz};
                const Vec3 centre = corner + Vec3::Constant(0.5 * kNetBlock * edge);
                if (part && !part(centre)) continue;
                const double middle = surface.value(centre);
                if (std::abs(middle) > reach) continue;
                nodes.clear();
                f[at(nodes.index(kNetBlock / 2, kNetBlock / 2, kNetBlock / 2))] = middle;
                const auto value_at = [&](int i, int j, int k) {
                    return surface.value(corner + edge * Vec3{1.0 * i, 1.0 * j, 1.0 * k});
                };
                find_signs<kNetBlock>(nodes, 0, 0, 0, reach, value_at, [](int, int, int) {});
                const auto value = [&](const std::array<int, 3>& n) {
                    double& of_node = f[at(nodes.index(n[0], n[1], n[2]))];
                    if (std::abs(of_node) == kSignAlone) of_node = value_at(n[0], n[1], n[2]);
                    return of_node;
                };
                for (int i = 0; i < kNetBlock; ++i)
                    for (int j = 0; j < kNetBlock; ++j)
                        for (int k = 0; k < kNetBlock; ++k) {
                            const int node = nodes.index(i, j, k);
                            const std::int32_t x = kNetBlock * bx + i, y = kNetBlock * by + j,
                                               z = kNetBlock * bz + k;
                            const unsigned inside = signs_of_cell<kNetBlock>(&f[at(node)]);
                            const CellSheets& sheets = cell_sheets(inside);
                            if (sheets.count == 0) continue;
                            // Crossings of the 12 edges of this cell; the three at its first
                            // node are recorded, each edge is so by one cell.
                            std::array<Vec3, 4> sum;
                            sum.fill(Vec3::Zero());
                            std::array<int, 4> count{};
                            for (int a = 0; a < 3; ++a)
                                for (int side = 0; side < 4; ++side) {
                                    const int sheet = sheets.sheet_of[4 * a + side];
                                    if (sheet < 0) continue;
                                    const int b = (a + 1) % 3, c = (a + 2) % 3;
                                    std::array<int, 3> end{i, j, k};
                                    end[at(b)] += side & 1;
                                    end[at(c)] += side >> 1;
                                    const double f0 = value(end);
                                    ++end[at(a)];
                                    const double f1 = value(end);
                                    Vec3 p = Vec3::Zero();
                                    p[a] = f0 / (f0 - f1);
                                    p[b] = side & 1;
                                    p[c] = side >> 1;
                                    sum[at(sheet)] += p;
                                    ++count[at(sheet)];
                                    if (side == 0)
                                        crossings.push_back({x, y, z, static_cast<std::int8_t>(a),
                                                             (inside & 1) == 0});
                                }
                            cell_at.emplace(
                                cell_key(x, y, z),
                                Cell{static_cast<std::int32_t>(mesh.points.size()), &sheets});
                            for (std::size_t sheet = 0; sheet < at(sheets.count); ++sheet)
                                mesh.points.push_back(corner +
                                                      edge * (Vec3{1.0 * i, 1.0 * j, 1.0 * k} +
                                                              sum[sheet] / count[sheet]));
                        }
            }

    // ---- Points and triangles
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
            const auto found = cell_at.find(cell_key(cell[0], cell[1], cell[2]));
            whole = whole && found != cell_at.end();
            if (!whole) continue;
            const int edge_of_cell = 4 * c.axis + back[corner][0] + 2 * back[corner][1];
            quad[corner] =
                found->second.first_vertex + found->second.sheets->sheet_of[edge_of_cell];
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

// Each edge of the grid that the surface crosses makes two triangles. Sides of these, but for the
// one between them, cross the faces of the grid at that edge: where all four edges of a face are
// crossed, and belong to one sheet in both of its cells, four triangles have a side in common.
NetsPrediction predict_nets(const ImplicitSurface& surface, const Vec3& low, const Vec3& high,
                            double edge)
{
    const Vec3 origin = net_origin(low, edge);
    std::int32_t cubes[3];
    for (int a = 0; a < 3; ++a)
        cubes[a] = (net_blocks(high[a] - origin[a], edge) * kNetBlock + kNetCube - 1) / kNetCube;
    NetNodes<kNetCube> nodes;
    NetsPrediction found;
    std::unordered_set<std::uint64_t> joined[3]; // faces across each axis, by the cell behind them
    std::int32_t cube[3];
    const auto visit_cell = [&](int i, int j, int k) {
        const unsigned inside = signs_of_cell<kNetCube>(&nodes.f[at(nodes.index(i, j, k))]);
        const CellSheets& sheets = cell_sheets(inside);
        found.euler += sheets.count;
        for (int a = 0; a < 3; ++a)
            if (sheets.sheet_of[4 * a] >= 0) {
                found.triangles += 2;
                --found.euler;
            }
        for (int face = 0; sheets.joined >> face != 0; ++face) {
            if ((sheets.joined >> face & 1) == 0) continue;
            std::int32_t cell[3] = {kNetCube * cube[0] + i, kNetCube * cube[1] + j,
                                    kNetCube * cube[2] + k};
            cell[face / 2] += face % 2;
            if (!joined[face / 2].insert(cell_key(cell[0], cell[1], cell[2])).second)
                found.manifold = false;
        }
    };
    const auto visit = [&](int i, int j, int k) {
        for (int part = 0; part < 8; ++part)
            visit_cell(i + (part >> 2), j + (part >> 1 & 1), k + (part & 1));
    };
    for (std::int32_t x = 0; x < cubes[0] && found.manifold; ++x)
        for (std::int32_t y = 0; y < cubes[1] && found.manifold; ++y)
            for (std::int32_t z = 0; z < cubes[2] && found.manifold; ++z) {
                nodes.clear();
                cube[0] = x;
                cube[1] = y;
                cube[2] = z;
                const auto value = [&](int i, int j, int k) { // at a node of surface_nets()
                    const auto block = [](std::int32_t of_cube, int n) {
                        return 1.0 * (kNetCube / kNetBlock * of_cube + n / kNetBlock);
                    };
                    const Vec3 corner =
                        origin + kNetBlock * edge * Vec3{block(x, i), block(y, j), block(z, k)};
                    return surface.value(corner + edge * Vec3{1.0 * (i % kNetBlock),
                                                              1.0 * (j % kNetBlock),
                                                              1.0 * (k % kNetBlock)});
                };
                find_signs<kNetCube>(nodes, 0, 0, 0, nodes.reach(edge), value, visit);
            }
    return found;
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
