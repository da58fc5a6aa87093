#include "validation/solid_meshes.hpp"

#include "mesh/split_elements.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <random>
#include <stdexcept>

namespace amontons::validation {
namespace {

void move_nodes(VolumeMesh& mesh, const PlaceMap& place)
{
    if (place)
        for (Vec3& x : mesh.nodes)
            x = place(x);
}

} // namespace

std::vector<double> graded(double length, int n, double last_over_first)
{
    std::vector<double> at{0};
    const double factor = n > 1 ? std::pow(last_over_first, 1.0 / (n - 1)) : 1;
    double cell = 1;
    for (int i = 0; i < n; ++i, cell *= factor)
        at.push_back(at.back() + cell);
    const double sum = at.back();
    for (double& x : at)
        x *= length / sum;
    return at;
}

VolumeMesh lattice_mesh(const std::array<std::vector<double>, 3>& at, ElementKind kind,
                        const PlaceMap& place)
{
    VolumeMesh mesh;
    for (const double z : at[2])
        for (const double y : at[1])
            for (const double x : at[0])
                mesh.nodes.emplace_back(x, y, z);
    const auto n = [&](std::size_t i) { return std::int32_t(at[i].size()) - 1; };
    const std::int32_t row = n(0) + 1, layer = row * (n(1) + 1);
    ElementBlock block{ElementKind::H8, {}};
    mesh.face_sets = {{"x_min", {}}, {"x_max", {}}, {"y_min", {}},
                      {"y_max", {}}, {"z_min", {}}, {"z_max", {}}};
    std::int32_t e = 0;
    for (std::int32_t k = 0; k < n(2); ++k)
        for (std::int32_t j = 0; j < n(1); ++j)
            for (std::int32_t i = 0; i < n(0); ++i, ++e) {
                const std::int32_t a = i + j * row + k * layer, b = a + layer;
                block.nodes.insert(block.nodes.end(), {a, a + 1, a + 1 + row, a + row, //
                                                       b, b + 1, b + 1 + row, b + row});
                const bool outside[] = {i == 0,        i == n(0) - 1, j == 0,
                                        j == n(1) - 1, k == 0,        k == n(2) - 1};
                for (std::int32_t f = 0; f < 6; ++f) // H8's faces have this order
                    if (outside[f]) mesh.face_sets[std::size_t(f)].members.push_back({e, f});
            }
    mesh.blocks.push_back(std::move(block));
    mesh = as_kind(std::move(mesh), kind);
    move_nodes(mesh, place);
    return mesh;
}

VolumeMesh round_stack(const RoundStack& o, const PlaceMap& place)
{
    // The core's border lies between a square and a circle, within the first ring.
    constexpr double kSquare = 0.6, kCircle = 0.75;
    const int n = o.core, first = o.half ? -n : 0, width = n - first + 1;
    const int border = o.half ? 4 * n : 2 * n, rings = int(o.rings.size());
    const int core_nodes = width * (n + 1), layer_nodes = core_nodes + rings * (border + 1);
    const double whole = o.half ? std::numbers::pi : std::numbers::pi / 2;

    const auto core_node = [&](int i, int j) { return (i - first) + j * width; };
    const auto node = [&](int ring, int b) { // ring -1: the core's border
        if (ring >= 0) return core_nodes + ring * (border + 1) + b;
        if (b <= n) return core_node(n, b);
        if (b <= (o.half ? 3 * n : 2 * n)) return core_node(2 * n - b, n);
        return core_node(-n, 4 * n - b);
    };
    // ---- Nodes of one layer
    std::vector<Vec3> plan(std::size_t(layer_nodes), Vec3::Zero());
    for (int j = 0; j <= n; ++j)
        for (int i = first; i <= n; ++i) {
            const double x = double(i) / n, y = double(j) / n, m = std::max(std::abs(x), y);
            if (m == 0) continue;
            const double angle = std::abs(x) >= y ? y / x * std::numbers::pi / 4
                                                  : (2 - x / y) * std::numbers::pi / 4;
            const double turn = angle < 0 || (x < 0 && y == 0) ? angle + std::numbers::pi : angle;
            const Vec3 d(std::cos(turn), std::sin(turn), 0);
            plan[std::size_t(core_node(i, j))] =
                0.5 * o.rings[0] * (kSquare * Vec3(x, y, 0) + kCircle * m * d);
        }
    for (int r = 0; r < rings; ++r)
        for (int b = 0; b <= border; ++b) {
            const double angle = whole * b / border;
            Vec3 x(std::cos(angle), std::sin(angle), 0);
            if (b == border) x = o.half ? Vec3(-1, 0, 0) : Vec3(0, 1, 0);
            plan[std::size_t(node(r, b))] = o.rings[std::size_t(r)] * x;
        }

    // ---- Layers of H8 with their face sets
    VolumeMesh mesh;
    for (const double z : o.height)
        for (const Vec3& x : plan)
            mesh.nodes.emplace_back(x.x(), x.y(), z);
    const auto layers = std::int32_t(o.height.size()) - 1;
    ElementBlock block{ElementKind::H8, {}};
    mesh.face_sets = {{"y_min", {}}, {"low", {}}, {"high", {}}, {"outer", {}}};
    if (!o.half) mesh.face_sets.push_back({"x_min", {}});
    if (o.patch > 0) {
        mesh.face_sets.push_back({"low_patch", {}});
        mesh.face_sets.push_back({"high_patch", {}});
    }
    const auto set = [&](const char* name) -> std::vector<FaceRef>& {
        for (FaceSet& s : mesh.face_sets)
            if (s.name == name) return s.members;
        throw std::logic_error("no such set");
    };
    std::int32_t e = 0;
    for (std::int32_t k = 0; k < layers; ++k) {
        const auto cell = [&](int a, int b, int c, int d) {
            double far = 0;
            for (const int x : {a, b, c, d})
                far = std::max(far, plan[std::size_t(x)].norm());
            const std::int32_t low = k * layer_nodes, high = low + layer_nodes;
            for (const std::int32_t level : {low, high})
                for (const int x : {a, b, c, d})
                    block.nodes.push_back(level + x);
            if (k == 0) set("low").push_back({e, 4});
            if (k == layers - 1) set("high").push_back({e, 5});
            if (o.patch > 0 && far <= o.patch * (1 + 1e-9)) {
                if (k == 0) set("low_patch").push_back({e, 4});
                if (k == layers - 1) set("high_patch").push_back({e, 5});
            }
        };
        for (int j = 0; j < n; ++j)
            for (int i = first; i < n; ++i, ++e) {
                cell(core_node(i, j), core_node(i + 1, j), core_node(i + 1, j + 1),
                     core_node(i, j + 1));
                if (j == 0) set("y_min").push_back({e, 2});
                if (i == 0 && !o.half) set("x_min").push_back({e, 0});
            }
        for (int r = -1; r + 1 < rings; ++r)
            for (int b = 0; b < border; ++b, ++e) {
                cell(node(r, b), node(r + 1, b), node(r + 1, b + 1), node(r, b + 1));
                if (b == 0) set("y_min").push_back({e, 2});
                if (b == border - 1) set(o.half ? "y_min" : "x_min").push_back({e, 3});
                if (r + 2 == rings) set("outer").push_back({e, 1});
            }
    }
    mesh.blocks.push_back(std::move(block));
    for (FaceSet& s : mesh.face_sets)
        std::sort(s.members.begin(), s.members.end());
    // ---- Other elements, and the place
    const std::vector<Vec3> nodes = mesh.nodes;
    mesh = as_kind(std::move(mesh), o.kind, [&](std::int32_t a, std::int32_t b) {
        const Vec3 &x = nodes[std::size_t(a)], &y = nodes[std::size_t(b)];
        Vec3 m = 0.5 * (x + y);
        // In polar coordinates: a wide cell of a thin ring is not turned inside out.
        if (a % layer_nodes < core_nodes || b % layer_nodes < core_nodes) return m;
        m.head<2>() *= 0.5 * (x.head<2>().norm() + y.head<2>().norm()) / m.head<2>().norm();
        return m;
    });
    move_nodes(mesh, place);
    return mesh;
}

VolumeMesh hemisphere(double R, double contact, double cell, bool half, bool upside_down)
{
    RoundStack o;
    o.half = half;
    double r = 3 * cell;
    for (; r < contact * 1.15; r += cell)
        o.rings.push_back(r);
    double size = cell;
    while (r < kRimOfHemisphere * R) {
        o.rings.push_back(r);
        size *= 1.45;
        r += size;
    }
    if (kRimOfHemisphere * R - o.rings.back() < 0.5 * size) o.rings.pop_back();
    o.rings.push_back(kRimOfHemisphere * R);
    o.core = std::max(2, int(std::lround(std::numbers::pi / 4 * contact / cell / 1.6)));
    // Heights as shares of the way from the sphere to the equator.
    std::vector<double> t{0};
    double step = cell / R;
    while (t.back() < 1) {
        t.push_back(t.back() + step);
        step *= 1.4;
    }
    for (double& x : t)
        x /= t.back();
    if (upside_down) {
        std::vector<double> back;
        for (auto i = t.rbegin(); i != t.rend(); ++i)
            back.push_back(1 - *i);
        t = back;
    }
    o.height = t;
    return round_stack(o, [&](const Vec3& x) {
        const double rr = std::min(x.head<2>().squaredNorm(), R * R);
        const double sphere = R - std::sqrt(R * R - rr);
        const double s = upside_down ? 1 - x.z() : x.z();
        const double z = s * R + (1 - s) * sphere;
        return Vec3(x.x(), x.y(), upside_down ? -z : z);
    });
}

VolumeMesh shuffled(const VolumeMesh& mesh, unsigned seed)
{
    std::mt19937 rng{seed};
    VolumeMesh out = mesh;
    std::vector<std::int32_t> to(mesh.nodes.size());
    std::iota(to.begin(), to.end(), 0);
    std::shuffle(to.begin(), to.end(), rng);
    for (std::size_t i = 0; i < to.size(); ++i)
        out.nodes[std::size_t(to[i])] = mesh.nodes[i];
    std::vector<std::int32_t> element_to(element_count(mesh));
    std::size_t base = 0;
    for (ElementBlock& block : out.blocks) {
        const std::size_t size = block.size(), count = std::size_t(shape_of(block.kind).nodes);
        std::vector<std::int32_t> order(size);
        std::iota(order.begin(), order.end(), 0);
        std::shuffle(order.begin(), order.end(), rng);
        std::vector<std::int32_t> nodes(block.nodes.size());
        for (std::size_t i = 0; i < size; ++i) {
            element_to[base + i] = std::int32_t(base) + order[i];
            for (std::size_t k = 0; k < count; ++k)
                nodes[std::size_t(order[i]) * count + k] =
                    to[std::size_t(block.nodes[i * count + k])];
        }
        block.nodes = std::move(nodes);
        base += size;
    }
    for (NodeSet& s : out.node_sets) {
        for (std::int32_t& i : s.members)
            i = to[std::size_t(i)];
        std::sort(s.members.begin(), s.members.end());
    }
    for (ElementSet& s : out.element_sets) {
        for (std::int32_t& i : s.members)
            i = element_to[std::size_t(i)];
        std::sort(s.members.begin(), s.members.end());
    }
    for (FaceSet& s : out.face_sets) {
        for (FaceRef& f : s.members)
            f.element = element_to[std::size_t(f.element)];
        std::sort(s.members.begin(), s.members.end());
    }
    return out;
}

} // namespace amontons::validation
