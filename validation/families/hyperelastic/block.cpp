// E03: a block that is stretched and pressed, free to yield sideways.

#include "mesh/split_elements.hpp"
#include "validation/families/hyperelastic/hyperelastic.hpp"
#include "validation/families/hyperelastic/newton.hpp"
#include "validation/solid_meshes.hpp"

#include <functional>
#include <random>

namespace amontons::validation {
namespace {

/// A cube whose nodes inside are shaken; of one H8 there is none inside.
VolumeMesh block(ElementKind kind, int n)
{
    std::mt19937 rng{5};
    std::uniform_real_distribution<double> number(-0.12, 0.12);
    VolumeMesh mesh = lattice_mesh({graded(1, n, 1), graded(1, n, 1), graded(1, n, 1)}, kind);
    for (Vec3& x : mesh.nodes)
        if (kind == ElementKind::T4 && x.minCoeff() > 1e-9 && x.maxCoeff() < 1 - 1e-9)
            x += Vec3(number(rng), number(rng), number(rng));
    return mesh;
}

struct Stretched {
    double P = 0, lateral = 0;
    std::string remark;
    SolidRun run;
};

Stretched stretch(const MaterialInput& m, double l, ElementKind kind, int n, double step = 0.1)
{
    SolidScene s("a block that is stretched");
    SolidInput& b = s.solid("block", 1, 0, block(kind, n));
    set_material(b, m);
    b.hold = {hold("x_min", still(), {}, {}), hold("y_min", {}, still(), {}),
              hold("z_min", {}, {}, still()), hold("x_max", {{0, 0}, {1, l - 1}}, {}, {})};
    s.scene.time.step = step;
    s.scene.accuracy.contact = 1e-9;
    Stretched r;
    r.run = run_solids(s.scene, true);
    r.P = r.run.quantity("block_x_max_force_x");
    const BodyRecord& body = r.run.bodies.back()[0];
    r.lateral = 1 + displacements(body)[nearest_node(body, {1, 1, 1})].y();
    for (const StepRecord& step_record : r.run.steps)
        if (!step_record.remark.empty()) r.remark = step_record.remark;
    return r;
}

} // namespace

std::vector<Measured> stretched_block()
{
    std::vector<Measured> rows;
    struct Row {
        double nu, l, lateral, P;
    };
    const std::pair<ElementKind, int> meshes[] = {
        {ElementKind::H8, 1}, {ElementKind::T4, 1}, {ElementKind::T4, 3}, {ElementKind::T10, 2}};
    for (const Row& r :
         {Row{0.3, 0.5, 1.21076739, -935352.057}, Row{0.3, 1.5, 0.880174592, 378280.176},
          Row{0.3, 2, 0.798077545, 646744.66}, Row{0.45, 0.5, 1.35086975, -1086102.81},
          Row{0.45, 1.5, 0.830678981, 358614.352}, Row{0.45, 2, 0.725935006, 598796.27},
          Row{0.499, 0.5, 1.41280287, -1164784.49}, Row{0.499, 1.5, 0.816768973, 351987.646},
          Row{0.499, 2, 0.707460777, 583638.968}}) {
        double P = 0, lateral = 0, worst = 0;
        for (const auto& [kind, n] : meshes) {
            const Stretched s = stretch(material("neo_hooke", {1e6, r.nu}), r.l, kind, n);
            if (std::abs(s.P - r.P) >= worst) {
                worst = std::abs(s.P - r.P);
                P = s.P;
                lateral = s.lateral;
            }
        }
        const std::string of =
            fmt::format("neo-Hooke, nu {}, stretch {}, worst of H8, T4, T10", r.nu, r.l);
        rows.push_back(relative("nominal stress, " + of, r.P, P, 1e-8)); // 9 digits are given
        rows.push_back(relative("lateral stretch, " + of, r.lateral, lateral, 1e-8));
    }
    // Incompressible: what is left of the compressibility is linear in 1 - 2 nu, to its square.
    const auto incompressible = [](auto stress) {
        const double one = 1e-6, half = 0.5 * one;
        return 2 * stress(0.5 * (1 - half)) - stress(0.5 * (1 - one));
    };
    rows.push_back(relative("nominal stress, neo-Hooke incompressible, stretch 2", 1.75e6 / 3,
                            incompressible([](double nu) {
                                return stretch(material("neo_hooke", {2e6 / 3 * (1 + nu), nu}), 2,
                                               ElementKind::H8, 1)
                                    .P;
                            }),
                            1e-8));
    rows.back().note = "extrapolated from 1 - 2 nu = 1e-6 and 5e-7";
    rows.push_back(relative(
        "nominal stress, Mooney-Rivlin incompressible, stretch 2", 1575000,
        incompressible([](double nu) {
            return stretch(material("mooney_rivlin", {0.4e6, 0.1e6, nu}), 2, ElementKind::H8, 1).P;
        }),
        1e-8));
    rows.push_back(relative(
        "least nominal stress, St. Venant-Kirchhoff, stretch 1/sqrt(3)", -1e6 / std::sqrt(27),
        stretch(material("st_venant_kirchhoff", {1e6, 0.3}), 1 / std::sqrt(3), ElementKind::H8, 1)
            .P,
        1e-8));
    for (const double l : {0.7, 1.5}) {
        const Stretched s =
            stretch(material("st_venant_kirchhoff", {1e6, 0.3}), l, ElementKind::T10, 2);
        rows.push_back(relative(fmt::format("nominal stress, St. Venant-Kirchhoff, stretch {}", l),
                                1e6 * l * (l * l - 1) / 2, s.P, 1e-8));
        rows.push_back(relative(fmt::format("lateral stretch, St. Venant-Kirchhoff, stretch {}", l),
                                std::sqrt(1 - 0.3 * (l * l - 1)), s.lateral, 1e-8));
        rows.push_back(at_most(fmt::format("called unstable, St. Venant-Kirchhoff, stretch {}", l),
                               s.remark.find("unstable") != std::string::npos, 0));
    }
    // Just below: further on round-off decides whether the even stretch is followed.
    const Stretched crushed =
        stretch(material("st_venant_kirchhoff", {1e6, 0.3}), 0.57, ElementKind::H8, 1, 0.05);
    rows.push_back(at_most("not called unstable, St. Venant-Kirchhoff, stretch 0.57",
                           crushed.remark.find("unstable") == std::string::npos, 0));
    rows.back().note = crushed.remark;
    rows.push_back(
        newton_row(stretch(material("neo_hooke", {1e6, 0.3}), 0.5, ElementKind::T4, 3, 0.5).run,
                   "neo-Hooke, half the stretch in one step"));
    return rows;
}

} // namespace amontons::validation
