// A02, A03, A04, A06: curved bodies in contact.

#include "validation/families/solids/solids.hpp"
#include "validation/solid_meshes.hpp"
#include "validation/solid_run.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <numbers>

namespace amontons::validation {
namespace {

constexpr double kRim = kRimOfHemisphere;

struct Profile {
    double force = 0, a = 0, p0 = 0, largest = 0;
};

/// Radius from the second moment of the pressure and peak from its square, both exact for Hertz.
/// @param line  a strip instead of a disc
Profile profile_of(const StepRecord& step, bool line)
{
    Profile p;
    double moment = 0, square = 0;
    for (const ContactRecord& c : step.contacts) {
        const double rr = line ? c.point.x() * c.point.x() : c.point.head<2>().squaredNorm();
        p.force += c.normal_force;
        moment += c.normal_force * rr;
        square += c.normal_force * c.pressure;
        raise_to(p.largest, c.pressure);
    }
    p.a = std::sqrt((line ? 4 : 2.5) * moment / p.force);
    p.p0 = (line ? 3 * std::numbers::pi / 8 : 4.0 / 3) * square / p.force;
    return p;
}

/// Pressure by the contacts' distance from the middle beside Hertz's.
ReferenceCurve pressures(const StepRecord& step, double a, double p0, bool line)
{
    ReferenceCurve curve{line ? "x [m]" : "r [m]", "pressure [Pa]", {}, {}, {}};
    for (const ContactRecord& c : step.contacts) {
        const double r = line ? std::abs(c.point.x()) : c.point.head<2>().norm();
        if (r < 1.5 * a)
            curve.add(r, p0 * std::sqrt(std::max(0.0, 1 - r * r / (a * a))), c.pressure);
    }
    return by_x(std::move(curve));
}

double mean_z(const BodyRecord& b, double at)
{
    const std::vector<Vec3> u = displacements(b), x = first_places(b);
    double sum = 0;
    int count = 0;
    for (std::size_t i = 0; i < u.size(); ++i)
        if (std::abs(x[i].z() - at) < 1e-9) {
            sum += u[i].z();
            ++count;
        }
    return sum / count;
}

} // namespace

std::vector<Measured> hertz_sphere()
{
    const double R = 0.008, E = 1e9, nu = 0.3, F = 188.495559, a = 0.00100963544;
    SolidScene s("an elastic sphere on a rigid plane");
    const double cell = a / 4; // of T10: multipliers every a / 8
    SolidInput& b = s.solid("ball", E, nu, hemisphere(R, a, cell, false, false));
    b.hold = {hold("x_min", still(), {}, {}), hold("y_min", {}, still(), {})};
    LoadInput push = traction("high", {0, 0, -F / (std::numbers::pi * kRim * kRim * R * R)});
    push.over = {{0, 1.0 / 64}, {1, 1.0 / 8}, {2, 1}};
    b.loads = {push};
    s.plane("plane", Vec3::Zero(), Vec3::UnitZ());
    s.touch("ball", "plane", 0, "low");
    s.scene.time.end = 2;
    const SolidRun run = run_solids(s.scene, true);
    std::vector<Measured> rows;
    const Profile p = profile_of(run.steps[2], false), lower = profile_of(run.steps[1], false),
                  lowest = profile_of(run.steps[0], false);
    rows.push_back(relative("force [N]", F, 4 * p.force, 5e-3));
    rows.back().note = "a round side of straight edges: the load's area";
    rows.push_back(absolute("contact radius [mm]", 1e3 * a, 1e3 * p.a, 0.5e3 * cell / 2));
    rows.back().note = fmt::format("half a multiplier's spacing; relative {:.2e}", p.a / a - 1);
    rows.push_back(relative("peak pressure", 88290369.1, p.p0, 3e-2));
    rows.back().note = fmt::format("by the mean square; largest {:.4e}", p.largest);
    rows.back().curve = pressures(run.steps[2], a, 88290369.1, false);
    rows.push_back(relative("largest pressure", 88290369.1, p.largest, 3e-2));
    rows.push_back(absolute("a(F) / a(F/8)", 2, p.a / lower.a, 0.5 * cell / lower.a));
    rows.push_back(absolute("a(F/8) / a(F/64)", 2, lower.a / lowest.a, 0.5 * cell / lowest.a));
    // The bulk's compliance is linear in F, the approach is as F^(2/3).
    const double now = -mean_z(run.bodies[2][0], R), before = -mean_z(run.bodies[1][0], R);
    rows.push_back(relative("approach without the bulk's", 0.000127420466, 8 * before - now, 1e-2));
    rows.back().note = fmt::format("8 d(F/8) - d(F); d(F) = {:.4e} m of the equator", now);
    add_certificates(rows, run);
    return rows;
}

std::vector<Measured> hertz_approach()
{
    const double R = 0.05, a = 0.01, cell = a / 4;
    SolidScene s("two equal spheres: one on the plane between them");
    SolidInput& b = s.solid("ball", 2e10, 0.3, hemisphere(R, a, cell, false, false));
    b.hold = {hold("x_min", still(), {}, {}), hold("y_min", {}, still(), {}),
              hold("high", {}, {}, {{0, -1e-5}, {1, -0.002}})};
    s.plane("plane", Vec3::Zero(), Vec3::UnitZ());
    s.touch("ball", "plane", 0, "low");
    const SolidRun run = run_solids(s.scene, true);
    const Profile p = profile_of(run.last(), false);
    std::vector<Measured> rows;
    rows.push_back(relative("peak pressure", 2.79832867e9, p.p0, 5e-2));
    rows.back().note =
        fmt::format("largest {:.4e}; force {:.5e} N, half-space 5.86081e5", p.largest, 4 * p.force);
    rows.back().curve = pressures(run.last(), a, 2.79832867e9, false);
    rows.push_back(absolute("contact radius [mm]", 10, 1e3 * p.a, 0.5e3 * cell));
    rows.push_back(left_out("A03: force against the half-space's law",
                            "no tolerance is known: at a / R = 0.2 a ball pressed flat is 11 % "
                            "stiffer; both are reported beside the peak pressure"));
    add_certificates(rows, run);
    return rows;
}

std::vector<Measured> roller()
{
    // Half of it, one layer in plane strain; N and m for a metre of length.
    const double R = 0.05, F = 3.5e7, a = 0.00621462787, thick = 2e-4, width = kRim * R;
    std::vector<Measured> rows;
    for (const ElementKind kind : {ElementKind::H8, ElementKind::T10})
        for (const double mu : {0.0, 0.1}) {
            const double cell = kind == ElementKind::H8 ? 2e-4 : 4e-4;
            const auto fine_then_coarse = [&](double size, double fine, double end) {
                std::vector<double> at;
                double x = 0, h = size;
                for (; x < fine; x += h)
                    at.push_back(x);
                for (; x < end - h; h *= 1.3, x += h)
                    at.push_back(x);
                at.push_back(end);
                return at;
            };
            SolidScene s("NAFEMS roller");
            std::vector<double> share = fine_then_coarse(cell / R, 6 * cell / R, 1);
            SolidInput* b =
                &s.solid("roller", 2.1e11, 0.3,
                         lattice_mesh({fine_then_coarse(cell, 1.3 * a, width), {0, thick}, share},
                                      kind, [&](const Vec3& x) {
                                          const double low = R - std::sqrt(R * R - x.x() * x.x());
                                          return Vec3(x.x(), x.y(), x.z() * R + (1 - x.z()) * low);
                                      }));
            b->hold = {hold("x_min", still(), {}, {}), hold("all", {}, still(), {})};
            LoadInput push = traction("z_max", {0, 0, -F / (2 * width)});
            push.over = {{0, 0.02}, {1, 1}};
            b->loads = {push};
            std::vector<double> depth = fine_then_coarse(0.8 * cell, 6 * cell, 0.2);
            std::vector<double> z;
            for (auto i = depth.rbegin(); i != depth.rend(); ++i)
                z.push_back(-*i);
            b = &s.solid(
                "block", 7e10, 0.3,
                lattice_mesh({fine_then_coarse(0.8 * cell, 1.3 * a, 0.1), {0, thick}, z}, kind));
            b->hold = {hold("x_min", still(), {}, {}), hold("all", {}, still(), {}),
                       hold("z_min", still(), {}, still())};
            s.touch("roller", "block", mu, "z_min", "z_max");
            s.scene.time.step = mu > 0 ? 0.25 : 1;
            const SolidRun run = run_solids(s.scene);
            const Profile p = profile_of(run.last(), true);
            const std::string of =
                fmt::format(", mu {}, {}", mu, kind == ElementKind::H8 ? "H8" : "T10");
            double up = 0;
            for (const ContactRecord& c : run.last().contacts)
                up += std::abs(c.force.z());
            rows.push_back(relative("force [N/m]" + of, F, 2 * up / thick, 1e-6));
            rows.push_back(absolute("half width [mm]" + of, 1e3 * a, 1e3 * p.a, 1e3 * cell));
            rows.push_back(relative("peak pressure" + of, 3.58536223e9, p.p0, 2e-2));
            rows.back().curve = pressures(run.last(), a, 3.58536223e9, true);
            rows.push_back(relative("largest pressure" + of, 3.58536223e9, p.largest, 2e-2));
            rows.push_back(
                at_most("steps without certificate" + of, run.summary.uncertified_steps, 0));
        }
    return rows;
}

namespace {

/// Two equal half balls, pressed and then sheared by their equators.
struct Sheared {
    double P = 0, a = 0;                 ///< pressed only [N], [m]
    std::vector<double> share, shift, c; ///< Q / mu P, shift [m], c / a of every later step
    int uncertified = 0;
    ReferenceCurve traction; ///< where Q is nearest to half of what slips
};

/// Tractions along the shear by the distance from the middle beside Cattaneo's and Mindlin's for
/// the pressed force and the shear that were reached.
ReferenceCurve tractions(const StepRecord& step, double mu, double a, double P, double share)
{
    ReferenceCurve curve{"r [m]", fmt::format("traction [Pa], Q = {:.2f} mu P", share), {}, {}, {}};
    const double p0 = 1.5 * P / (std::numbers::pi * a * a),
                 c = a * std::cbrt(1 - std::min(share, 1.0));
    const auto dome = [](double r, double of) {
        return of > r ? std::sqrt(1 - r * r / (of * of)) : 0;
    };
    for (const ContactRecord& k : step.contacts) {
        const double r = k.point.head<2>().norm();
        if (r < 1.5 * a && k.area > 0)
            curve.add(r, mu * p0 * (dome(r, a) - c / a * dome(r, c)),
                      std::abs(k.force.x()) / k.area);
    }
    return by_x(std::move(curve));
}

Sheared sheared(double R, double E, double nu, double mu, double a, double cell, double end)
{
    SolidScene s("two equal spheres, pressed and sheared");
    SolidInput* b = &s.solid("lower", E, nu, hemisphere(R, a, cell, true, true));
    b->hold = {hold("y_min", {}, still(), {}), hold("low", still(), still(), still())};
    b = &s.solid("upper", E, nu, hemisphere(R, a, cell, true, false));
    const int steps = 8;
    b->hold = {hold("y_min", {}, still(), {}), hold("high", {{1, 0}, {1.0 + steps, end}}, still(),
                                                    {{0, -1e-3 * a * a / R}, {1, -2 * a * a / R}})};
    s.touch("upper", "lower", mu, "low", "high");
    s.scene.time.end = 1 + steps;
    const SolidRun run = run_solids(s.scene);
    Sheared out;
    out.uncertified = run.summary.uncertified_steps;
    for (std::size_t k = 0; k < run.steps.size(); ++k) {
        if (run.steps[k].time < 1 - 1e-9) continue; // pressed, in one step or more
        const Profile p = profile_of(run.steps[k], false);
        Vec3 f = Vec3::Zero();
        double stick = 0;
        for (const ContactRecord& c : run.steps[k].contacts) {
            f += 2 * c.force;
            if (c.status == ContactStatus::stick) stick += c.area;
        }
        if (run.steps[k].time < 1 + 1e-9) {
            out.P = std::abs(f.z());
            out.a = p.a;
            continue;
        }
        out.share.push_back(std::abs(f.x()) / (mu * std::abs(f.z())));
        const auto nearest =
            std::min_element(out.share.begin(), out.share.end(), [](double x, double y) {
                return std::abs(x - 0.5) < std::abs(y - 0.5);
            });
        if (nearest + 1 == out.share.end())
            out.traction = tractions(run.steps[k], mu, p.a, std::abs(f.z()), out.share.back());
        out.shift.push_back(end * (run.steps[k].time - 1) / steps);
        out.c.push_back(std::sqrt(2 * stick / std::numbers::pi) / p.a);
    }
    return out;
}

/// y at a place between three known points nearest to it, by their parabola.
double parabola(const std::vector<double>& x, const std::vector<double>& y, double at)
{
    std::size_t k = 0;
    while (k + 1 < x.size() && x[k] < at)
        ++k;
    k = std::clamp<std::size_t>(k, 1, x.size() - 2);
    double sum = 0;
    for (std::size_t i = k - 1; i <= k + 1; ++i) {
        double w = 1;
        for (std::size_t j = k - 1; j <= k + 1; ++j)
            if (j != i) w *= (at - x[j]) / (x[i] - x[j]);
        sum += w * y[i];
    }
    return sum;
}

} // namespace

std::vector<Measured> cattaneo_mindlin()
{
    const double R = 0.008, E = 1e9, mu = 0.3, P = 188.495559;
    std::vector<Measured> rows;
    for (const double nu : {0.0, 0.3}) {
        const double a = nu == 0 ? 0.00104187942 : 0.00100963544, G = E / (2 * (1 + nu));
        // Relative shift of far points: D (1 - (1 - Q / mu P)^(2/3)).
        const double D = 3 * mu * P * (2 - nu) / (8 * a * G);
        // Up to about 0.85 mu P: the contact's share of the shift is as a^2, the bulk's as a^3.
        const auto with_radius = [&](double share) {
            const double local = D * (1 - std::pow(0.15, 2.0 / 3));
            return sheared(R, E, nu, mu, share * a, share * a / 5,
                           local * share * share * (1 + 0.55 * share));
        };
        const Sheared full = with_radius(1), small = with_radius(0.25),
                      smaller = with_radius(0.125);
        const std::string material = fmt::format(", nu {}", nu);
        const double own_a = a * std::cbrt(full.P / P);
        rows.push_back(absolute("contact radius at its force [mm]" + material, 1e3 * own_a,
                                1e3 * full.a, 0.5e3 * a / 5));
        rows.back().note =
            fmt::format("P = {:.2f} N, then {:.3f} and {:.4f} N", full.P, small.P, smaller.P);
        rows.back().curve = full.traction;
        for (const double q : {0.25, 0.5, 0.75}) {
            const std::string of = fmt::format(", Q {} mu P, nu {}", q, nu);
            rows.push_back(
                absolute("c / a" + of, std::cbrt(1 - q), parabola(full.share, full.c, q), 0.2));
            // The law holds as a / R tends to 0. The contact's shift is as P^(2/3), the bulk's as
            // P; what curvature adds lies between them, by the logarithm of a: seen from small
            // loads.
            const auto shift = [&](const Sheared& s) {
                const auto law = [](double share) { return 1 - std::pow(1 - share, 2.0 / 3); };
                std::vector<double> y;
                for (const double share : s.share)
                    y.push_back(law(std::min(share, 1.0)));
                return parabola(y, s.shift, law(q)) / (s.P / P);
            };
            const double local = (shift(smaller) - shift(small)) /
                                 (std::cbrt(P / smaller.P) - std::cbrt(P / small.P));
            rows.push_back(relative("shift without the bulk's" + of,
                                    D * (1 - std::pow(1 - q, 2.0 / 3)), local,
                                    nu == 0 ? 2e-2 : 3e-2));
            rows.back().note = fmt::format("from P/64 and P/512; at P, with the bulk's, {:.3e} m",
                                           shift(full) * full.P / P);
        }
        rows.push_back(at_most("steps without certificate" + material,
                               full.uncertified + small.uncertified + smaller.uncertified, 0));
    }
    return rows;
}

} // namespace amontons::validation
