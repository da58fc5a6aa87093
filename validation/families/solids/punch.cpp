// A07, A08, A14: a rigid flat punch, round, on a block that stands for a half-space.

#include "validation/families/solids/solids.hpp"
#include "validation/solid_meshes.hpp"
#include "validation/solid_run.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <numbers>

namespace amontons::validation {
namespace {

struct Punch {
    double force = 0, stick = 0, worst_pressure = 0, centre = 0;
    int uncertified = 0;
    ReferenceCurve pressure;
};

/// Distances from the punch's edge inwards and outwards, and from the top down, each from 0.
struct Grading {
    std::vector<double> in, out, down;
};

Grading graded_to(double a, double H, bool fine)
{
    return {graded(0.7 * a, 7, 10), graded(H - a, fine ? 13 : 9, fine ? 80 * H / a : 4000),
            graded(H, fine ? 13 : 10, fine ? 15 * H / a : 600)};
}

/// Cells that grow by a factor until they reach `length`: a longer one has the same cells, and
/// more.
std::vector<double> grown(double length, double cell, double factor)
{
    std::vector<double> at{0};
    for (; at.back() + 1.5 * cell < length; cell *= factor)
        at.push_back(at.back() + cell);
    at.push_back(length);
    return at;
}

/// A quarter of a cylinder as wide and high as the grading reaches, pressed by a plane over the
/// disc of radius a.
Punch punch(double a, double E, double nu, double depth, double mu, const Grading& g)
{
    RoundStack o;
    o.core = 3;
    o.patch = a;
    // Fine on both sides of the edge, where the pressure is singular.
    for (std::size_t i = g.in.size(); i-- > 0;)
        o.rings.push_back(a - g.in[i]);
    for (std::size_t i = 1; i < g.out.size(); ++i)
        o.rings.push_back(a + g.out[i]);
    for (std::size_t i = g.down.size(); i-- > 0;)
        o.height.push_back(-g.down[i]);
    SolidScene s("flat punch");
    SolidInput& b = s.solid("block", E, nu, round_stack(o));
    b.hold = {hold("x_min", still(), {}, {}), hold("y_min", {}, still(), {}),
              hold("low", still(), still(), {{0, 1e-3 * depth}, {1, depth}})};
    s.plane("punch", Vec3::Zero(), -Vec3::UnitZ());
    s.touch("block", "punch", mu, "high_patch");
    const SolidRun run = run_solids(s.scene);
    Punch p;
    p.uncertified = run.summary.uncertified_steps;
    double stuck = 0, nearest = a;
    for (const ContactRecord& c : run.last().contacts) {
        p.force += 4 * c.normal_force;
        if (c.status == ContactStatus::stick) stuck += c.area;
    }
    p.pressure = {"r [m]", "pressure [Pa]", {}, {}, {}};
    for (const ContactRecord& c : run.last().contacts) {
        const double r = c.point.head<2>().norm();
        if (r > 0.97 * a) continue;
        const double exact = p.force / (2 * std::numbers::pi * a * std::sqrt(a * a - r * r));
        p.pressure.add(r, exact, c.pressure);
        if (r > 0.8 * a) continue;
        raise_to(p.worst_pressure, std::abs(c.pressure / exact - 1));
        if (r < nearest) {
            nearest = r;
            p.centre = c.pressure / (p.force / (std::numbers::pi * a * a)) *
                       std::sqrt(1 - r * r / (a * a));
        }
    }
    p.pressure = by_x(std::move(p.pressure));
    p.stick = std::sqrt(4 * stuck / std::numbers::pi) / a;
    return p;
}

constexpr double kSticksAlways = 1e6; // coefficient of friction

} // namespace

std::vector<Measured> flat_punch()
{
    std::vector<Measured> rows;
    const double a = 0.01, E = 1e8, depth = 1e-4;
    for (const auto& [nu, F] : {std::pair{0.3, 219.78022}, {0.49, 263.192525}}) {
        // The same cells about the punch in both: what they are too stiff by is nearly the same,
        // and the extrapolation does not make it larger. T10 take more of them where hardly
        // compressible.
        const double cell = nu > 0.4 ? 0.01 * a : 0.02 * a, factor = nu > 0.4 ? 1.3 : 1.4;
        const auto to = [&](double H) {
            return Grading{graded(0.7 * a, 11, 10), grown(H - a, cell, factor),
                           grown(H, cell, factor)};
        };
        const Punch near = punch(a, E, nu, depth, 0, to(20 * a)),
                    far = punch(a, E, nu, depth, 0, to(60 * a));
        const std::string of = fmt::format(", nu {}", nu);
        // The block's end has an effect of a / H.
        rows.push_back(relative("force, extrapolated to a half-space" + of, F,
                                1.5 * far.force - 0.5 * near.force, 3e-3));
        rows.back().note = fmt::format("F / F_exact {:.4f} (H = 20 a), {:.4f} (60 a)",
                                       near.force / F, far.force / F);
        rows.push_back(
            at_most("pressure within 0.8 a, largest error" + of, far.worst_pressure, 3e-2));
        rows.back().curve = far.pressure;
        rows.push_back(
            relative("pressure in the middle over the mean" + of, 0.5, far.centre, 3e-2));
        rows.push_back(
            at_most("steps without certificate" + of, near.uncertified + far.uncertified, 0));
    }
    return rows;
}

std::vector<Measured> stuck_punch()
{
    std::vector<Measured> rows;
    const double a = 0.01, E = 1e8, depth = 1e-4;
    for (const auto& [nu, ratio] :
         {std::pair{0.0, 1.09861229}, {0.3, 1.02862666}, {0.49, 1.00012819}}) {
        const Grading g = graded_to(a, 80 * a, true);
        const Punch slides = punch(a, E, nu, depth, 0, g),
                    sticks = punch(a, E, nu, depth, kSticksAlways, g);
        rows.push_back(relative(fmt::format("force that sticks over force that slides, nu {}", nu),
                                ratio, sticks.force / slides.force, 2e-3));
        rows.push_back(at_most(fmt::format("steps without certificate, nu {}", nu),
                               slides.uncertified + sticks.uncertified, 0));
    }
    return rows;
}

std::vector<Measured> rough_punch()
{
    struct Row {
        double nu, mu, force, stick;
    };
    std::vector<Measured> rows;
    const Grading g = graded_to(1, 40, false);
    for (const double nu : {0.0, 0.3}) {
        const Punch free = punch(1, 1, nu, 0.01, 0, g);
        for (const Row& r :
             {Row{0, 0.1, 1.0185, 0}, Row{0, 0.2, 1.037, 0.23}, Row{0, 0.3, 1.0535, 0.50},
              Row{0.3, 0.1, 1.0107, 0.205}, Row{0.3, 0.2, 1.0199, 0.701}}) {
            if (r.nu != nu) continue;
            const Punch p = punch(1, 1, nu, 0.01, r.mu, g);
            const std::string of = fmt::format(", nu {}, mu {}", nu, r.mu);
            rows.push_back(relative("force over that without friction" + of, r.force,
                                    p.force / free.force, 1e-3));
            // One element of the mesh there, and 0.02: a tenth of a in the core and near the edge.
            if (r.stick > 0)
                rows.push_back(absolute("radius that sticks over a" + of, r.stick, p.stick,
                                        0.02 + (r.stick > 0.3 && r.stick < 0.6 ? 0.15 : 0.1)));
            rows.push_back(at_most("steps without certificate" + of, p.uncertified, 0));
        }
    }
    return rows;
}

} // namespace amontons::validation
