// C01, C02, C03, G07: large displacements of rods, and rods of very many elements.

#include "validation/families/rods/rods.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <fmt/format.h>
#include <numbers>
#include <stdexcept>

namespace amontons::validation {
namespace {

constexpr double kRodExtension = 1e8; // EA over EI/L^2: as good as none

/// A cantilever under a load across it that grows with time.
RodInput loaded_rod(int elements, double EA = kRodExtension)
{
    RodInput rod = uniform_rod(1, 1, 0.77, EA, 0, elements);
    rod.loads.push_back(end_load({0, 1, 0}));
    return rod;
}

Vec3 end_of(const RodBody& rod)
{
    return rod.nodes().back().position();
}

/// Its end, the load reached in steps of 1/4.
Vec3 bent_end(int elements, double load, double EA = kRodExtension)
{
    RodBody rod(loaded_rod(elements, EA), nullptr, 0);
    double t = 0;
    bring_to(rod, t, load, int(std::lround(4 * load)));
    return end_of(rod);
}

} // namespace

Elastica elastica_of(double alpha)
{
    // k^2 = (1 + sin a)/2 with a the slope of the end; sqrt(alpha) = K(k) - F(f, k)
    double low = 0, high = std::numbers::pi / 2;
    const auto modulus = [](double a) { return std::sqrt(0.5 * (1 + std::sin(a))); };
    const auto start = [&](double a) {
        return std::asin(std::min(1.0, std::sqrt(0.5) / modulus(a)));
    };
    for (int i = 0; i < 200; ++i) {
        const double a = 0.5 * (low + high), k = modulus(a);
        (std::comp_ellint_1(k) - std::ellint_1(k, start(a)) < std::sqrt(alpha) ? low : high) = a;
    }
    const double a = 0.5 * (low + high), k = modulus(a), s = std::sqrt(alpha);
    return {1 - 2 * (std::comp_ellint_2(k) - std::ellint_2(k, start(a))) / s,
            1 - std::sqrt(2 * std::sin(a)) / s};
}

RodInput uniform_rod(double length, double EI, double GJ, double EA, double GA, int elements)
{
    RodInput rod;
    rod.name = "rod";
    BeamSegment g;
    g.length = length;
    g.radius = 1e-3 * length;
    g.EI = {EI, EI};
    g.GJ = {GJ, GJ};
    g.EA = {EA, EA};
    g.GA = {GA, GA};
    g.element = length / elements;
    rod.segments.push_back(g);
    rod.shape.normal = Vec3::UnitY();
    RodHold clamp;
    clamp.set = "start";
    rod.hold.push_back(clamp);
    return rod;
}

RodLoad end_load(const Vec3& force)
{
    RodLoad l;
    l.set = "end";
    l.force = force;
    l.over = {{-1e6, -1e6}, {0, 0}, {1e6, 1e6}};
    return l;
}

void bring_to(RodBody& rod, double& t, double to, int steps)
{
    const double longest = (to - t) / steps;
    double h = longest;
    const Eigen::VectorXd none;
    while (std::abs(to - t) > 1e-9 * std::abs(longest)) {
        h = std::abs(h) < std::abs(to - t) * (1 + 1e-9) ? h : to - t;
        StepInput step;
        step.start = t;
        step.h = std::abs(to - t - h) < 1e-9 * std::abs(h) ? to - t : h;
        rod.begin(step);
        bool done = false;
        for (int i = 0; i < 40 && !done; ++i) {
            rod.linearise();
            rod.update(rod.free_change(), none, none);
            done = rod.imbalance(none) <= 1e-12;
        }
        if (done) {
            rod.accept(none);
            t = step.end();
            h = std::abs(2 * h) < std::abs(longest) ? 2 * h : longest;
            continue;
        }
        h *= 0.5;
        if (std::abs(h) < 1e-4 * std::abs(longest))
            throw std::runtime_error(fmt::format("no balance after {}", t));
    }
}

std::vector<Measured> rod_rollup()
{
    std::vector<Measured> rows;
    const double L = 10, EI = 100, one = 2 * std::numbers::pi * EI / L;
    const Mat3 skew = Eigen::AngleAxisd(0.8, Vec3(1, 2, 3).normalized()).toRotationMatrix();
    for (const double turns : {0.5, 1.0, 2.0})
        for (const int elements : {10, 40})
            for (const int steps : {1, 10})
                for (const bool turned : {false, true}) {
                    if (turned && (steps == 1 || elements == 40)) continue;
                    RodInput rod = uniform_rod(L, EI, EI, 1e4, 5e3, elements);
                    const Mat3 R = turned ? skew : Mat3(Mat3::Identity());
                    rod.shape.direction = R.col(0);
                    rod.shape.normal = R.col(1);
                    RodLoad l;
                    l.set = "end";
                    l.moment = turns * one * R.col(2);
                    l.over = {{0, 0}, {1, 1}};
                    rod.loads.push_back(l);
                    RodBody body(rod, nullptr, 0);
                    double t = 0;
                    bring_to(body, t, 1, steps);
                    const double angle = turns * 2 * std::numbers::pi;
                    const Vec3 tip =
                        R * Vec3(L * std::sin(angle) / angle, L * (1 - std::cos(angle)) / angle, 0);
                    rows.push_back(
                        at_most(fmt::format("place of the end, {} turns, {} elements, {} step{}{}, "
                                            "of the length",
                                            turns, elements, steps, steps > 1 ? "s" : "",
                                            turned ? ", turned in space" : ""),
                                (end_of(body) - tip).norm() / L, 1e-10));
                }
    return rows;
}

std::vector<Measured> rod_elastica()
{
    struct Reference {
        double alpha, w, u, angle;
    };
    constexpr Reference kReferences[] = {{0.25, 0.0827459154, 0.00411781841, 0.124292442},
                                         {0.5, 0.162143576, 0.0159189625, 0.244533647},
                                         {1, 0.301720774, 0.0564332363, 0.46135195},
                                         {2, 0.49345748, 0.160641721, 0.781749832},
                                         {3, 0.603253441, 0.254420185, 0.986016947},
                                         {4, 0.669964181, 0.328941242, 1.12123935},
                                         {5, 0.713791524, 0.387628361, 1.21536812},
                                         {6, 0.744571149, 0.434588829, 1.28369729},
                                         {7, 0.7673691, 0.472927428, 1.33495986},
                                         {8, 0.784982375, 0.504827732, 1.37443151},
                                         {9, 0.799055527, 0.531820563, 1.40546533},
                                         {10, 0.810609025, 0.554995598, 1.43028554},
                                         {15, 0.847715674, 0.63528578, 1.50184015}};
    std::vector<Measured> rows;
    RodBody rod(loaded_rod(20), nullptr, 0);
    double t = 0;
    for (const Reference& r : kReferences) {
        bring_to(rod, t, r.alpha, int(std::ceil(4 * (r.alpha - t))));
        const Vec3 x = end_of(rod);
        rows.push_back(
            relative(fmt::format("deflection, alpha {}, 20 elements", r.alpha), r.w, x.y(), 1e-5));
        rows.push_back(relative(fmt::format("shortening, alpha {}, 20 elements", r.alpha), r.u,
                                1 - x.x(), 2e-5));
        const double* q = rod.nodes().back().q;
        rows.push_back(relative(fmt::format("slope of the end, alpha {}, 20 elements", r.alpha),
                                r.angle, 2 * std::atan2(q[3], q[0]), 2e-5));
    }
    std::vector<double> error;
    std::string note = "errors of the end";
    const Elastica ten = elastica_of(10);
    for (const int n : {5, 10, 20, 40}) {
        const Vec3 x = bent_end(n, 10);
        error.push_back((x - Vec3(1 - ten.u, ten.w, 0)).norm());
        note += fmt::format("{} {}: {:.2e}", n == 5 ? "" : ",", n, error.back());
    }
    rows.push_back(absolute("observed order, alpha 10, 5 to 20 elements", 4,
                            0.5 * std::log2(error[0] / error[2]), 0.5));
    rows.back().note = note;
    return rows;
}

std::vector<Measured> rod_bend()
{
    struct Reference {
        double force;
        Vec3 end;
    };
    const Reference references[] = {{300, {22.24478, 58.77912, 40.19189}},
                                    {450, {18.50818, 52.23856, 48.50293}},
                                    {600, {15.6848, 47.15044, 53.47486}}};
    const double E = 1e7, R = 100;
    std::vector<Measured> rows;
    std::vector<double> error;
    for (const int n : {8, 16, 32, 64}) {
        RodInput rod = uniform_rod(R * std::numbers::pi / 4, E / 12, E / 2 / 6, E, E / 2, n);
        rod.loads.push_back(end_load({0, 0, 1}));
        Centreline curve(Vec3::Zero(), Vec3::UnitY(), Vec3::UnitX(), 1e-6);
        curve.append_arc(R, std::numbers::pi / 4, 0, 1e-6);
        RodBody body(rod, &curve, 0);
        const Vec3 start = end_of(body);
        double t = 0;
        for (const Reference& r : references) {
            bring_to(body, t, r.force, int(std::lround((r.force - t) / 30)));
            const Vec3 end = end_of(body);
            const double size = (r.end - start).norm();
            if (r.force == 600) error.push_back((end - r.end).norm());
            if (n != 8 && n != 64) continue;
            Measured m =
                relative(fmt::format("displacement of the end, {} N, {} elements", r.force, n),
                         size, (end - start).norm(), n == 8 ? 3e-4 : 5e-6);
            m.error = (end - r.end).norm() / size;
            m.note = fmt::format("end ({:.5f}, {:.5f}, {:.5f})", end.x(), end.y(), end.z());
            rows.push_back(m);
        }
    }
    rows.push_back(absolute("observed order, 600 N, 8 to 32 elements", 2,
                            0.5 * std::log2(error[0] / error[2]), 0.2));
    // Other sections: with the shear correction of a rectangle, and with a square's torsion.
    struct Section {
        const char* what;
        double J, shear;
        Vec3 ends[3];
    };
    const Section sections[] = {{"shear correction 5/6",
                                 1.0 / 6,
                                 5.0 / 6,
                                 {{22.24468, 58.7789, 40.19239},
                                  {18.50806, 52.23826, 48.50349},
                                  {15.68469, 47.1501, 53.47548}}},
                                {"J 0.140577",
                                 0.140577,
                                 1,
                                 {{22.11261, 58.53593, 40.48026},
                                  {18.36928, 51.96972, 48.70479},
                                  {15.55779, 46.89192, 53.60737}}}};
    for (const Section& section : sections) {
        RodInput rod = uniform_rod(R * std::numbers::pi / 4, E / 12, E / 2 * section.J, E,
                                   E / 2 * section.shear, 64);
        rod.loads.push_back(end_load({0, 0, 1}));
        Centreline curve(Vec3::Zero(), Vec3::UnitY(), Vec3::UnitX(), 1e-6);
        curve.append_arc(R, std::numbers::pi / 4, 0, 1e-6);
        RodBody body(rod, &curve, 0);
        const Vec3 start = end_of(body);
        double t = 0;
        for (std::size_t k = 0; k < 3; ++k) {
            const double force = references[k].force;
            bring_to(body, t, force, int(std::lround((force - t) / 30)));
            const double size = (section.ends[k] - start).norm();
            rows.push_back(relative(
                fmt::format("displacement of the end, {} N, 64 elements, {}", force, section.what),
                size, (end_of(body) - start).norm(), 2e-4));
            rows.back().error = (end_of(body) - section.ends[k]).norm() / size;
        }
    }
    return rows;
}

std::vector<Measured> rod_refined()
{
    std::vector<Measured> rows;
    const double EA = 1e9; // extension then is 1e-9
    const Elastica one = elastica_of(1);
    for (const int n : {9, 100, 1000, 10000}) {
        const Vec3 x = bent_end(n, 1, EA);
        // 9 elements: of order 4, 4e-6
        const double tolerance = n == 9 ? 1e-4 : 1e-8;
        rows.push_back(relative(fmt::format("deflection of the end, {} elements", n), one.w, x.y(),
                                tolerance));
    }
    rows.push_back(left_out("G07: condition numbers of K and W, 9 to 1000 Hermite elements",
                            "these rods have no Hermite elements; what the numbers warn of, a tip "
                            "that is wrong in silence, is measured instead: below 1e-8 to 10 000"));
    return rows;
}

} // namespace amontons::validation
