// E01, E08: Cook's membrane, linear in plane stress and at finite strains in plane strain.

#include "validation/families/hyperelastic/hyperelastic.hpp"
#include "validation/families/hyperelastic/newton.hpp"
#include "validation/solid_meshes.hpp"

namespace amontons::validation {
namespace {

constexpr double kSide = 16; // the loaded one's height, at x = 48

/// @param finer  the last cell along the membrane is this many times as long as the first
VolumeMesh membrane(int n, double thick, ElementKind kind, double finer = 1)
{
    return lattice_mesh({graded(1, n, finer), graded(1, n, 1), graded(thick, 1, 1)}, kind,
                        [](const Vec3& x) {
                            const double low = 44 * x.x(), high = 44 + 16 * x.x();
                            return Vec3(48 * x.x(), low + x.y() * (high - low), x.z());
                        });
}

const char* cook_element_name(ElementKind kind)
{
    return kind == ElementKind::H8 ? "H8" : kind == ElementKind::T10 ? "T10" : "T4";
}

} // namespace

std::vector<Measured> cook_plane_stress()
{
    constexpr double kReference = 23.9678;
    std::vector<Measured> rows;
    for (const ElementKind kind : {ElementKind::H8, ElementKind::T10}) {
        std::vector<double> values;
        const std::vector<int> meshes{8, 16, 32};
        for (const int n : meshes) {
            const double thick = 0.05; // thin: no stress across it
            SolidScene s("Cook's membrane in plane stress");
            SolidInput& b = s.solid("plate", 1, 1.0 / 3, membrane(n, thick, kind));
            b.hold = {hold("x_min", still(), still(), {}), hold("z_min", {}, {}, still())};
            b.loads = {traction("x_max", {0, 1 / kSide, 0})};
            const SolidRun run = run_solids(s.scene, true);
            const BodyRecord& plate = run.bodies.back()[0];
            values.push_back(displacements(plate)[nearest_node(plate, {48, 52, 0})].y());
        }
        rows.push_back(relative(fmt::format("u_y at (48, 52), {} {} x {}", cook_element_name(kind),
                                            meshes.back(), meshes.back()),
                                kReference, values.back(), 5e-3));
        rows.back().note = orders(values, kReference);
        if (kind == ElementKind::T10) {
            rows.push_back(relative("u_y at (48, 52), T10 32 x 32, at the bar of Q2 16 x 16",
                                    kReference, values.back(), 8e-4));
            rows.back().note = fmt::format("16 x 16: {:.6g}, {:.1e} off; squares of two layers of "
                                           "tetrahedra are stiffer than biquadratic ones",
                                           values[1], 1 - values[1] / kReference);
        }
    }
    return rows;
}

std::vector<Measured> cook_finite_strain()
{
    std::vector<Measured> rows;
    struct Row {
        const char* what;
        double E, nu, reference, tolerance;
        bool hyperelastic;
    };
    // mu 80.1938, lambda 400889.806
    constexpr double kNearly = 0.4999;
    constexpr double kFiner = 5; // the clamped edge ends in corners where stress has no bound
    for (const Row& row : {Row{"linear, nu 0.4999", 240.565, 0.4999, 7.69, 5e-3, false},
                           Row{"neo-Hooke, nu 0.3", 250, 0.3, 7.6366, 5e-3, true},
                           Row{"neo-Hooke, nu 0.4999", 240.565, kNearly, 6.95, 1e-2, true}})
        for (const ElementKind kind : {ElementKind::H8, ElementKind::T10}) {
            std::vector<double> values;
            const std::vector<int> meshes = kind == ElementKind::H8 || !row.hyperelastic
                                                ? std::vector{8, 16, 32}
                                                : std::vector{4, 8, 16};
            Measured tail;
            for (const int n : meshes) {
                SolidScene s("Cook's membrane in plane strain");
                SolidInput& b =
                    s.solid("plate", row.E, row.nu, membrane(n, 48.0 / n, kind, kFiner));
                if (row.hyperelastic) b.motion = "hyperelastic";
                b.hold = {hold("x_min", still(), still(), still()), hold("z_min", {}, {}, still()),
                          hold("z_max", {}, {}, still())};
                b.loads = {traction("x_max", {0, 6.25, 0})};
                b.loads[0].over = {{0, 0}, {1, 1}};
                s.scene.time.step = row.hyperelastic ? 0.5 : 1;
                const SolidRun run = run_solids(s.scene, true);
                const BodyRecord& plate = run.bodies.back()[0];
                values.push_back(displacements(plate)[nearest_node(plate, {48, 52, 0})].y());
                if (row.hyperelastic)
                    tail =
                        newton_row(run, fmt::format("{}, {}", row.what, cook_element_name(kind)));
            }
            rows.push_back(
                relative(fmt::format("u_y at (48, 52), {}, {} {} x {}", row.what,
                                     cook_element_name(kind), meshes.back(), meshes.back()),
                         row.reference, values.back(), row.tolerance));
            rows.back().note = orders(values, row.reference);
            if (row.hyperelastic) rows.push_back(tail);
        }
    return rows;
}

} // namespace amontons::validation
