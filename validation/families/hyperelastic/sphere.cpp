// E02: a thick sphere of rubber that is blown up past its largest pressure.

#include "mesh/split_elements.hpp"
#include "solver/solid/assembly.hpp"
#include "validation/families/hyperelastic/hyperelastic.hpp"
#include "validation/families/hyperelastic/newton.hpp"
#include "validation/solid_meshes.hpp"

#include <array>
#include <map>
#include <numbers>

namespace amontons::validation {
namespace {

/// The octant x, y, z >= 0 between two spheres: three patches of a cube. Sets x_min, y_min, z_min
/// the cuts, inner, outer.
VolumeMesh octant(double inner, double outer, int through, int across, ElementKind kind)
{
    VolumeMesh mesh;
    std::map<std::array<long, 3>, std::int32_t> number;
    const auto node = [&](const Vec3& x) {
        std::array<long, 3> key{};
        for (std::size_t i = 0; i < 3; ++i)
            key[i] = std::lround(x[Eigen::Index(i)] * 1e9);
        const auto [at, fresh] = number.emplace(key, std::int32_t(mesh.nodes.size()));
        if (fresh) mesh.nodes.push_back(x);
        return at->second;
    };
    const auto place = [&](int patch, int i, int j, int k) {
        const double q = std::numbers::pi / 4 / across;
        const double r = inner + (outer - inner) * i / through;
        const Vec3 d = Vec3(1, j == across ? 1 : std::tan(q * j), k == across ? 1 : std::tan(q * k))
                           .normalized();
        Vec3 x;
        for (int c = 0; c < 3; ++c)
            x[(c + patch) % 3] = r * d[c];
        return x;
    };
    ElementBlock block{ElementKind::H8, {}};
    mesh.face_sets = {{"inner", {}}, {"outer", {}}, {"x_min", {}}, {"y_min", {}}, {"z_min", {}}};
    std::int32_t e = 0;
    for (int p = 0; p < 3; ++p)
        for (int k = 0; k < across; ++k)
            for (int j = 0; j < across; ++j)
                for (int i = 0; i < through; ++i, ++e) {
                    for (const int c : {0, 1}) {
                        block.nodes.push_back(node(place(p, i, j, k + c)));
                        block.nodes.push_back(node(place(p, i + 1, j, k + c)));
                        block.nodes.push_back(node(place(p, i + 1, j + 1, k + c)));
                        block.nodes.push_back(node(place(p, i, j + 1, k + c)));
                    }
                    if (i == 0) mesh.face_sets[0].members.push_back({e, 0});
                    if (i == through - 1) mesh.face_sets[1].members.push_back({e, 1});
                    if (j == 0)
                        mesh.face_sets[std::size_t(2 + (1 + p) % 3)].members.push_back({e, 2});
                    if (k == 0)
                        mesh.face_sets[std::size_t(2 + (2 + p) % 3)].members.push_back({e, 4});
                }
    mesh.blocks.push_back(std::move(block));
    for (FaceSet& s : mesh.face_sets)
        std::sort(s.members.begin(), s.members.end());
    const std::vector<Vec3> nodes = mesh.nodes;
    return as_kind(std::move(mesh), kind, [nodes](std::int32_t a, std::int32_t b) {
        const Vec3 &x = nodes[std::size_t(a)], &y = nodes[std::size_t(b)];
        return Vec3(0.5 * (x.norm() + y.norm()) * (x + y).normalized());
    });
}

/// mu/2 (I1 - 3): the integral of dW/dl / (l^3 - 1) through the wall.
double pressure_at(double la, double B)
{
    const double lb = std::cbrt((la * la * la - 1) / (B * B * B) + 1);
    return 2 * (1 / lb - 1 / la + (std::pow(lb, -4) - std::pow(la, -4)) / 4);
}

using Path = std::vector<std::pair<double, double>>; // stretch of the cavity, pressure [Pa]

/// An octant of a sphere of inner radius 1 whose cavity is blown up along the stretches of a path.
SolidRun blown(const VolumeMesh& mesh, const MaterialInput& m, const Path& path, double step)
{
    Eigen::VectorXd f = Eigen::VectorXd::Zero(3 * Eigen::Index(mesh.nodes.size()));
    add_pressure(mesh, find_set(mesh.face_sets, "inner")->members, 1, f);
    double cavity = 0;
    for (std::size_t i = 0; i < mesh.nodes.size(); ++i)
        cavity += mesh.nodes[i].dot(f.segment<3>(3 * Eigen::Index(i))) / 3;
    SolidScene s("a thick sphere that is blown up");
    SolidInput& b = s.solid("sphere", 1, 0, mesh);
    set_material(b, m);
    b.hold = {hold("x_min", still(), {}, {}), hold("y_min", {}, still(), {}),
              hold("z_min", {}, {}, still())};
    LoadInput load;
    load.set = "inner";
    load.volume = {{0, 0}};
    for (std::size_t i = 0; i < path.size(); ++i)
        load.volume.push_back({double(i + 1), cavity * (std::pow(path[i].first, 3) - 1)});
    b.loads = {load};
    s.scene.time.end = double(path.size());
    s.scene.time.step = step;
    return run_solids(s.scene);
}

/// Pressure where the path comes to its point i; NaN where no step ends there.
double pressure_in(const SolidRun& run, std::size_t i)
{
    for (std::size_t k = 0; k < run.steps.size(); ++k)
        if (std::abs(run.steps[k].time - double(i + 1)) < 1e-9)
            return run.quantity("sphere_inner_pressure", int(k));
    return std::nan("");
}

} // namespace

std::vector<Measured> sphere_inflation()
{
    std::vector<Measured> rows;
    const Path path{{1.1, 0.287154846},      {1.25, 0.551868542}, {1.5, 0.755433119},
                    {1.828147, 0.816423648}, {2, 0.806926603},    {3, 0.634506675}};
    const double nu = 0.4999;
    const MaterialInput neo_hooke = material("neo_hooke", {2 * (1 + nu), nu});
    for (const ElementKind kind : {ElementKind::H8, ElementKind::T10}) {
        const char* element = kind == ElementKind::H8 ? "H8" : "T10";
        const int across = kind == ElementKind::H8 ? 6 : 3;
        const VolumeMesh mesh = octant(1, 2, kind == ElementKind::H8 ? 8 : 4, across, kind);
        const SolidRun run = blown(mesh, neo_hooke, path, 0.5);
        bool reported = false;
        for (const StepRecord& r : run.steps)
            reported |= r.remark.find("beyond the largest load") != std::string::npos;
        for (std::size_t i = 0; i < path.size(); ++i) {
            rows.push_back(relative(
                fmt::format("pressure at inner stretch {:.4g}, {}", path[i].first, element),
                path[i].second, pressure_in(run, i), 1e-2));
            rows.back().note = fmt::format("closed form {:.6f}", pressure_at(path[i].first, 2));
        }
        rows.push_back(
            at_most(std::string("not reported to be beyond the largest load, ") + element,
                    reported ? 0 : 1, 0));
        rows.push_back(newton_row(run, element));
    }
    const VolumeMesh thick = octant(1, 2, 6, 4, ElementKind::H8);
    const Path rubber{{1.25, 0.583742718}, {1.5, 0.847426758}, {2, 1.03383018}, {3, 1.11368692}};
    const SolidRun mooney = blown(thick, material("mooney_rivlin", {0.4, 0.1, nu}), rubber, 0.5);
    for (std::size_t i = 0; i < rubber.size(); ++i)
        rows.push_back(relative(
            fmt::format("pressure at inner stretch {:.4g}, Mooney-Rivlin, H8", rubber[i].first),
            rubber[i].second, pressure_in(mooney, i), 1e-2));
    // A wall of a tenth of the radius, at its largest pressure.
    const Path top{{1.2, 0}, {1.426385, 0.118012537}};
    rows.push_back(relative(
        "pressure at inner stretch 1.426, B/A = 1.1, H8", top[1].second,
        pressure_in(blown(octant(1, 1.1, 2, 10, ElementKind::H8), neo_hooke, top, 0.5), 1), 1e-2));
    rows.push_back(left_out("E02: stretch of the largest pressure of a wall without thickness",
                            "a solid has one; B/A = 1.1 stands for it"));
    return rows;
}

} // namespace amontons::validation
