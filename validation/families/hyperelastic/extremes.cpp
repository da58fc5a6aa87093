// Hyperelastic solids at the limits of double precision: each run converges to its tolerance or
// gives the reason it does not.

#include "validation/families/hyperelastic/hyperelastic.hpp"
#include "validation/families/hyperelastic/newton.hpp"
#include "validation/solid_meshes.hpp"

namespace amontons::validation {
namespace {

constexpr double kPoisson = 0.3, kYoung = 1e6;

/// Nominal stress of neo-Hooke's material at the stretch l, held sideways.
double confined_stress(double E, double l)
{
    const double mu = E / (2 * (1 + kPoisson)), lambda = 2 * mu * kPoisson / (1 - 2 * kPoisson);
    return mu * (l - 1 / l) + lambda * std::log(l) / l;
}

/// A cube on [0, 1] x [0, 1] x [low, low + 1], held sideways.
SolidInput& confined(SolidScene& s, const std::string& name, double E, const VolumeMesh& mesh)
{
    SolidInput& b = s.solid(name, 1, 0, mesh);
    set_material(b, material("neo_hooke", {E, kPoisson}));
    b.hold = {hold("x_min", still(), {}, {}), hold("x_max", still(), {}, {}),
              hold("y_min", {}, still(), {}), hold("y_max", {}, still(), {})};
    return b;
}

VolumeMesh cube(ElementKind kind, int n, double low, std::vector<double> heights = {})
{
    if (heights.empty()) heights = graded(1, n, 1);
    for (double& z : heights)
        z += low;
    return lattice_mesh({graded(1, n, 1), graded(1, n, 1), heights}, kind);
}

/// Results of some runs.
struct Tally {
    int runs = 0, done = 0, silent = 0;
    double worst = 0, certificate = 0;
    std::string why;

    /// @param reference  of the quantity, of a run that converges
    void add(const Scene& scene, const std::string& what, const std::string& quantity,
             double reference)
    {
        ++runs;
        try {
            const SolidRun r = try_run(scene);
            if (r.summary.status != "done") {
                silent += r.summary.message.empty();
                why += "; " + what + ": " + r.summary.message;
                return;
            }
            ++done;
            raise_to(worst, std::abs(r.quantity(quantity) / reference - 1));
            for (const StepRecord& s : r.steps)
                raise_to(certificate, s.certificate.error);
        } catch (const InputError& error) { // refused before it runs, with its place
            why += "; " + what + ": " + error.what();
        }
    }

    void add_rows(std::vector<Measured>& rows, const std::string& of, double tolerance = 1e-8) const
    {
        rows.push_back(
            at_most("runs that neither converge nor give the reason not, " + of, silent, 0));
        rows.push_back(at_most("runs that do not converge, " + of, runs - done, 0));
        rows.back().note = fmt::format("{} of {}{}", runs - done, runs, why);
        rows.push_back(at_most("worst certificate, " + of, certificate, 1e-8));
        rows.push_back(at_most("force against the closed form, relative, " + of, worst, tolerance));
    }
};

} // namespace

std::vector<Measured> hyperelastic_extremes()
{
    std::vector<Measured> rows;

    // Two cubes on each other, meshes that do not match, pressed by 0.4 together.
    Tally contrast;
    for (int decade = -9; decade <= 9; decade += 3) {
        const double upper = kYoung * std::pow(10.0, decade);
        double low = 0.55, high = 1; // stretch of the lower one: the same stress in both
        for (int k = 0; k < 200; ++k) {
            const double l = 0.5 * (low + high);
            (confined_stress(kYoung, l) < confined_stress(upper, 1.6 - l) ? low : high) = l;
        }
        // From the softer one: of the stiffer one rounding leaves little.
        const double stress =
            decade < 0 ? confined_stress(upper, 1.6 - high) : confined_stress(kYoung, low);
        for (const ElementKind kind : {ElementKind::H8, ElementKind::T10}) {
            SolidScene s("two cubes of different stiffness");
            confined(s, "lower", kYoung, cube(kind, 2, 0))
                .hold.push_back(hold("z_min", {}, {}, still()));
            confined(s, "upper", upper, cube(kind, 3, 1))
                .hold.push_back(hold("z_max", {}, {}, {{0, 0}, {1, -0.4}}));
            s.touch("lower", "upper", 0.3, "z_max", "z_min").sliding = "finite";
            s.scene.time.step = 0.25;
            contrast.add(s.scene, fmt::format("1e{}", decade), "upper_z_max_force_z", stress);
        }
    }
    // Places to 1e-16 are strains of 1e-9 to 1e-7.
    contrast.add_rows(rows, "stiffness contrast 1e-9 to 1e9", 1e-6);

    // A cube that stands on a plane, pressed at one speed in steps of all lengths.
    Tally steps;
    for (int decade = -6; decade <= 0; ++decade)
        for (const ElementKind kind : {ElementKind::H8, ElementKind::T10}) {
            const double h = std::pow(10.0, decade), end = std::min(1.0, 3 * h);
            SolidScene s("steps of all lengths");
            confined(s, "cube", kYoung, cube(kind, 2, 0))
                .hold.push_back(hold("z_max", {}, {}, {{0, 0}, {1, -0.4}}));
            s.plane("plane", Vec3::Zero(), Vec3::UnitZ());
            s.touch("cube", "plane", 0.3, "z_min").sliding = "finite";
            s.scene.time.step = h;
            s.scene.time.end = end;
            steps.add(s.scene, fmt::format("step 1e{} s", decade), "cube_z_max_force_z",
                      confined_stress(kYoung, 1 - 0.4 * end));
        }
    steps.add_rows(rows, "steps of 1e-6 to 1 s");

    // One of its layers is thin: cut into tetrahedra it is slivers, four nodes nearly in a plane.
    // On a plane, and on a cube of the same stiffness without such a layer: half of the way for
    // each.
    Tally slivers;
    for (int decade = -6; decade <= -1; ++decade)
        for (const ElementKind kind : {ElementKind::H8, ElementKind::T10, ElementKind::T4})
            for (const bool solid : {false, true}) {
                SolidScene s("slivers");
                const double thin = std::pow(10.0, decade);
                confined(s, "cube", kYoung, cube(kind, 2, 0, {0, 0.4, 0.4 + thin, 1}))
                    .hold.push_back(hold("z_max", {}, {}, {{0, 0}, {1, solid ? -0.6 : -0.4}}));
                if (solid)
                    confined(s, "under", kYoung, cube(kind, 3, -1))
                        .hold.push_back(hold("z_min", {}, {}, still()));
                else
                    s.plane("under", Vec3::Zero(), Vec3::UnitZ());
                s.touch("cube", "under", 0.3, "z_min", solid ? "z_max" : "").sliding = "finite";
                s.scene.time.step = 0.25;
                slivers.add(s.scene,
                            fmt::format("thickness 1e{}{}", decade, solid ? " on a solid" : ""),
                            "cube_z_max_force_z", confined_stress(kYoung, solid ? 0.7 : 0.6));
            }
    slivers.add_rows(rows, "layers of 0.1 to 1e-6 of a cube");
    return rows;
}

} // namespace amontons::validation
