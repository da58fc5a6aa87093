// E06: a beam of tissue under a pressure that follows it. Elastica: a slender solid under a dead
// load.

#include "validation/families/hyperelastic/hyperelastic.hpp"
#include "validation/families/hyperelastic/newton.hpp"
#include "validation/solid_meshes.hpp"

namespace amontons::validation {
namespace {

const char* beam_element_name(ElementKind kind)
{
    return kind == ElementKind::H8 ? "H8" : "T10";
}

} // namespace

std::vector<Measured> passive_beam()
{
    std::vector<Measured> rows;
    struct Mesh {
        ElementKind kind;
        std::vector<int> across;
    };
    for (const Mesh& m : {Mesh{ElementKind::H8, {2, 4}}, Mesh{ElementKind::T10, {1, 2}}}) {
        std::vector<double> values;
        Measured tail;
        double x = 0;
        for (const int n : m.across) {
            SolidScene s("a beam of tissue");
            SolidInput& b = s.block("beam", 1, 0, {0, 0, 0}, {0.01, 0.001, 0.001},
                                    {10.0 * n, double(n), double(n)}, beam_element_name(m.kind));
            b.mesh.grading = {4, 1, 1}; // stress has no bound at the clamped edges
            set_material(b, material("guccione", {2e3, 8, 2, 4, 1e6}));
            b.hold = {hold("x_min", still(), still(), still())};
            LoadInput load;
            load.set = "z_min";
            load.pressure = {{0, 0}, {1, 4}};
            b.loads = {load};
            s.scene.time.step = 0.25;
            const SolidRun run = run_solids(s.scene, true);
            const BodyRecord& beam = run.bodies.back()[0];
            const Vec3 tip = beam.points[nearest_node(beam, {0.01, 0.0005, 0.001})];
            values.push_back(1e3 * tip.z());
            x = 1e3 * tip.x();
            tail = newton_row(run, beam_element_name(m.kind));
        }
        const int n = m.across.back();
        const std::string of =
            fmt::format("{} {} x {} x {}", beam_element_name(m.kind), 10 * n, n, n);
        rows.push_back(
            relative("z of the tip's upper edge [mm], " + of, 4.163, values.back(), 5e-3));
        rows.back().note = fmt::format("coarser: {:.4f}; published 4.151 to 4.185", values[0]);
        rows.push_back(relative("x of it [mm], " + of, 9.179, x, 5e-3));
        rows.push_back(tail);
    }
    return rows;
}

std::vector<Measured> elastica_solid()
{
    std::vector<Measured> rows;
    constexpr double kW = 3.0213325901766246, kU = -0.5658719711947935;
    for (const ElementKind kind : {ElementKind::H8, ElementKind::T10}) {
        std::vector<double> values;
        SolidRun last;
        double u = 0;
        for (const int n : {1, 2}) {
            SolidScene s("a slender solid under a dead load");
            const double b = 0.5, E = 1e5, P = E * std::pow(b, 4) / 12 / 100;
            SolidInput& body = s.block("prism", 1, 0, {0, 0, 0}, {10, b, b},
                                       {20.0 * n, double(n), double(n)}, beam_element_name(kind));
            set_material(body, material("st_venant_kirchhoff", {E, 0}));
            body.hold = {hold("x_min", still(), still(), still())};
            body.loads = {traction("x_max", {0, 0, P / (b * b)})};
            last = run_solids(s.scene, true);
            const BodyRecord& prism = last.bodies.back()[0];
            double w = 0;
            int count = 0;
            u = 0;
            const std::vector<Vec3> X = first_places(prism), d = displacements(prism);
            for (std::size_t i = 0; i < X.size(); ++i)
                if (X[i].x() > 10 - 1e-9) {
                    w += d[i].z();
                    u += d[i].x();
                    ++count;
                }
            values.push_back(w / count);
            u /= count;
        }
        rows.push_back(relative(
            fmt::format("tip deflection, {} 40 x 2 x 2, load in one step", beam_element_name(kind)),
            kW, values.back(), 1e-3));
        rows.back().note = fmt::format("coarser: {:.1e}", std::abs(values[0] / kW - 1));
        rows.push_back(relative(
            fmt::format("tip shortening, {} 40 x 2 x 2", beam_element_name(kind)), kU, u, 2e-3));
        for (const StepRecord& r : last.steps) // the whole load comes with the initial state
            if (r.step == 0) rows.push_back(newton_row(r, beam_element_name(kind)));
    }
    return rows;
}

} // namespace amontons::validation
