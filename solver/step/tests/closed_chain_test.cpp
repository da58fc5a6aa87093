// Chains of joints that close: rows that repeat others, and the moments that joints carry.

#include "solver/step/closed_rows.hpp"
#include "solver/step/tests/body_runs.hpp"

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <numbers>

using namespace amontons;

namespace {

constexpr double kDensity = 1000, kSection = 0.01;

/// A linkage of four bars in the plane y = 0: a crank from the origin, a coupler, a rocker to
/// (ground, 0, 0). Bars are square in section; each has its centre between its ends.
struct Linkage {
    static constexpr double kNear = 1e-3; ///< for differences of fourth order [rad]
    template <class F> static auto slope(F of, double a)
    {
        using Value = decltype(of(a));
        return Value(
            (8 * (of(a + kNear) - of(a - kNear)) - (of(a + 2 * kNear) - of(a - 2 * kNear))) /
            (12 * kNear));
    }
    double crank = 0.05, coupler = 0.15, rocker = 0.1, ground = 0.15; ///< [m]

    struct Pose {
        std::array<Vec3, 3> from, to; ///< of the ends of the bars
        std::array<double, 3> angle;  ///< above x
    };
    /// @param a  the crank's angle; the coupler's joint with the rocker is above the line between
    Pose pose(double a) const
    {
        const Vec3 A(crank * std::cos(a), 0, crank * std::sin(a)), D(ground, 0, 0);
        const Vec3 way = D - A;
        const double l = way.norm(), x = (coupler * coupler - rocker * rocker + l * l) / (2 * l),
                     y = std::sqrt(coupler * coupler - x * x);
        const Vec3 C = A + x / l * way + y / l * Vec3(-way.z(), 0, way.x());
        Pose p{{Vec3::Zero(), A, D}, {A, C, C}, {}};
        for (std::size_t i = 0; i < 3; ++i)
            p.angle[i] = std::atan2(p.to[i].z() - p.from[i].z(), p.to[i].x() - p.from[i].x());
        return p;
    }
    Vec3 centre(double a, std::size_t bar) const
    {
        const Pose p = pose(a);
        return 0.5 * (p.from[bar] + p.to[bar]);
    }
    double mass(std::size_t bar) const
    {
        return kDensity * kSection * kSection * std::array{crank, coupler, rocker}[bar];
    }
    /// Of centre and angle of a bar by the crank's angle.
    std::pair<Vec3, double> rate(double a, std::size_t bar) const
    {
        const auto turned = [&](double d) {
            return std::remainder(pose(a + d).angle[bar] - pose(a - d).angle[bar],
                                  2 * std::numbers::pi);
        };
        return {slope([&](double x) { return centre(x, bar); }, a),
                (8 * turned(kNear) - turned(2 * kNear)) / (12 * kNear)};
    }
    double inertia(double a) const
    {
        double sum = 0;
        for (std::size_t i = 0; i < 3; ++i) {
            const double l = std::array{crank, coupler, rocker}[i];
            const auto [v, w] = rate(a, i);
            sum += mass(i) * (v.squaredNorm() + (l * l + kSection * kSection) / 12 * w * w);
        }
        return sum;
    }
    double height(double a) const // times the mass
    {
        double sum = 0;
        for (std::size_t i = 0; i < 3; ++i)
            sum += mass(i) * centre(a, i).z();
        return sum;
    }
    /// The crank's angle after some time, by Runge and Kutta's rule.
    double follow(double a, double w, double end) const
    {
        constexpr int kSteps = 2000;
        const auto acceleration = [&](double angle, double spin) {
            const double dI = slope([&](double x) { return inertia(x); }, angle),
                         dV = kGravity * slope([&](double x) { return height(x); }, angle);
            return -(0.5 * dI * spin * spin + dV) / inertia(angle);
        };
        const double h = end / kSteps;
        for (int k = 0; k < kSteps; ++k) {
            const double w1 = w, b1 = acceleration(a, w), w2 = w + h / 2 * b1,
                         b2 = acceleration(a + h / 2 * w1, w2), w3 = w + h / 2 * b2,
                         b3 = acceleration(a + h / 2 * w2, w3), w4 = w + h * b3,
                         b4 = acceleration(a + h * w3, w4);
            a += h / 6 * (w1 + 2 * w2 + 2 * w3 + w4);
            w += h / 6 * (b1 + 2 * b2 + 2 * b3 + b4);
        }
        return a;
    }
};

std::string listed(const Vec3& v)
{
    return fmt::format("[{:.17g}, {:.17g}, {:.17g}]", v.x(), v.y(), v.z());
}

/// @param a, w  angle and spin of the crank at the start
std::string linkage_scene(const Linkage& l, double a, double w)
{
    const char* names[] = {"crank", "coupler", "rocker"};
    const Linkage::Pose p = l.pose(a);
    std::string bodies, couplings;
    const auto hinge = [&](const char* one, const char* other, const Vec3& at) {
        couplings += fmt::format(R"({}{{"kind": "hinge", "between": ["{}", "{}"], "at": {},
            "axis": [0, 1, 0]}})",
                                 couplings.empty() ? "" : ", ", one, other, listed(at));
    };
    for (std::size_t i = 0; i < 3; ++i) {
        const auto [v, turn] = l.rate(a, i);
        bodies += fmt::format(R"({}"{}": {{"kind": "rigid", "density": {}, "shape": {{
            "generate": "box", "size": [{:.17g}, {}, {}]}}, "start": {{"place": {},
            "turn": [0, {:.17g}, 0], "velocity": {}, "spin": [0, {:.17g}, 0]}}}})",
                              i > 0 ? ", " : "", names[i], kDensity, (p.to[i] - p.from[i]).norm(),
                              kSection, kSection, listed(l.centre(a, i)), -p.angle[i],
                              listed(w * v), -w * turn);
    }
    hinge("crank", "world", p.from[0]);
    hinge("coupler", "crank", p.to[0]);
    hinge("rocker", "coupler", p.to[1]);
    hinge("rocker", "world", p.from[2]);
    return fmt::format(R"("bodies": {{{}}}, "couplings": [{}], "gravity": [0, 0, -{}])", bodies,
                       couplings, kGravity);
}

std::string in_motion(const std::string& rule, double h, double end)
{
    return fmt::format(R"(, "time": {{"kind": "dynamic", "step": {:.17g}, "end": {}, {}}})", h, end,
                       rule);
}
const std::string kHalf = R"("theta": 0.5)",
                  kFiltered = R"("rule": "generalised_alpha", "spectral_radius": 0.8)";

} // namespace

TEST_CASE("redundant rows get the smallest forces that satisfy the constraints")
{
    Eigen::MatrixXd H(5, 3); // the fourth row is the sum of two, the fifth one of them again
    H << 1, 2, 0, 0, 1, -1, 3, 0, 1, 4, 2, 1, 1, 2, 0;
    const Eigen::MatrixXd W = H * H.transpose();
    const ClosedRows rows = close_rows(W);
    CHECK(rows.kept.size() == 3);
    CHECK(rows.left.size() == 2);
    const Eigen::VectorXd u = W * Eigen::VectorXd::LinSpaced(5, -1, 2);
    const Eigen::VectorXd r = closing_forces(rows, u);
    CHECK((W * r + u).norm() < 1e-12 * u.norm());
    // Nothing that moves nothing is in it, each row measured by the root of its compliance.
    Eigen::MatrixXd none(5, 2);
    none << 1, -1, 0, 0, 1, 0, -1, 0, 0, 1;
    CHECK((W * none).norm() < 1e-12 * W.norm());
    const Eigen::VectorXd weighed = W.diagonal().cwiseProduct(r);
    CHECK((none.transpose() * weighed).norm() < 1e-12 * weighed.norm());

    const ClosedRows all = close_rows(W.topLeftCorner(3, 3));
    CHECK(all.left.empty());
    CHECK((W.topLeftCorner(3, 3) * closing_forces(all, u.head(3)) + u.head(3)).norm() <
          1e-12 * u.norm());
}

TEST_CASE("a linkage of four bars on hinges moves with an error of second order" *
          doctest::test_suite("slow"))
{
    // Hinges hold the bars in their plane three times more than once.
    constexpr double kEnd = 0.5;
    const Linkage l;
    for (const double spin : {0.0, 10.0}) {
        const double a = l.follow(1.2, spin, kEnd);
        for (const std::string& rule : {kHalf, kFiltered}) {
            CAPTURE(spin);
            CAPTURE(rule);
            double error[3];
            for (int k = 0; k < 3; ++k) {
                const double h = 1e-3 / (1 << k);
                const Result r = done(linkage_scene(l, 1.2, spin) + in_motion(rule, h, kEnd));
                error[k] = 0;
                const char* names[] = {"crank", "coupler", "rocker"};
                for (std::size_t i = 0; i < 3; ++i)
                    error[k] = std::max(error[k], (r.vector(names[i]) - l.centre(a, i)).norm());
            }
            CAPTURE(error[0]);
            CAPTURE(error[2]);
            CHECK(error[0] < 1e-2 * l.coupler);
            CHECK(std::log2(error[0] / error[1]) > 1.8);
            CHECK(std::log2(error[1] / error[2]) > 1.8);
        }
        const Result r = done(linkage_scene(l, 1.2, spin) + in_motion(kHalf, 1e-3, 5));
        double most = 0;
        for (std::size_t i = 0; i < r.records.size(); ++i)
            most = std::max(most, r.records[i].energy.kinetic);
        const EnergyRecord& e = r.summary.energy;
        CHECK(std::abs(e.kinetic - e.kinetic_start - e.work) < 1e-6 * most);
        // The coupler's end, by its centre and turn, is where the rocker's is.
        const auto end = [&](const std::string& name, double half, const Vec3& start) {
            const Vec3 turn = r.vector(name + "_turn");
            return Vec3(r.vector(name) +
                        half * (Eigen::AngleAxisd(turn.norm(), turn.stableNormalized()) * start));
        };
        const Linkage::Pose p = l.pose(1.2);
        const auto along = [&](std::size_t i) { return Vec3((p.to[i] - p.from[i]).normalized()); };
        CHECK((end("coupler", 0.5 * l.coupler, along(1)) - end("rocker", 0.5 * l.rocker, along(2)))
                  .norm() < 1e-10 * l.coupler);
    }
}

TEST_CASE("a joint's moment is what it stops turns with, about its place")
{
    // A bar of 0.2 m welded at its end: m g L / 2 there, at rest and in motion.
    const double L = 0.2, m = kDensity * L * kSection * kSection;
    const std::string bar =
        fmt::format(R"("bodies": {{"bar": {{"kind": "rigid", "density": {}, "shape": {{
            "generate": "box", "size": [{}, {}, {}]}}, "start": {{"place": [{}, 0.3, 0]}}}}}},
            "gravity": [0, 0, -{}], "couplings": [{{"kind": "weld", "between": ["bar", "world"],
            "at": [0, 0.3, 0], "axis": [0.3, 1, -0.5]}}])",
                    kDensity, L, kSection, kSection, L / 2, kGravity);
    for (const std::string& time :
         {std::string(R"(, "time": {"step": 1, "end": 1})"), in_motion(kHalf, 1e-3, 0.01),
          in_motion(kFiltered, 1e-3, 0.01), in_motion(R"("theta": 1)", 1e-3, 0.01)}) {
        CAPTURE(time);
        const Result r = done(bar + time);
        const Vec3 expected(0, m * kGravity * L / 2, 0); // of the bar on the world
        CHECK((r.vector("bar_on_world_coupling_0_moment") - expected).norm() <
              1e-7 * expected.norm());
        CHECK((r.vector("bar_on_world_coupling_0_force") - Vec3(0, 0, -m * kGravity)).norm() <
              1e-7 * m * kGravity);
    }
    // A ball that turns on a hinge at (0.1, 0, 0.05) from its place: m w^2 times both distances.
    const double w = 10, radius = 0.1, high = 0.05;
    const Result r =
        done(fmt::format(
                 R"("bodies": {{"ball": {{"kind": "rigid", "mass": 2, "shape": {{"generate": "ball",
            "radius": 0.02}}, "start": {{"place": [{}, 0, {}], "velocity": [0, {}, 0],
            "spin": [0, 0, {}]}}}}}}, "couplings": [{{"kind": "hinge", "between": ["ball",
            "world"], "at": [0, 0, 0], "axis": [0, 0, 1]}}])",
                 radius, high, w * radius, w) +
             in_motion(kHalf, 1e-3, 0.05));
    const Vec3 moment = r.vector("ball_on_world_coupling_0_moment");
    CHECK(std::abs(moment.z()) < 1e-8);
    CHECK(moment.norm() == doctest::Approx(2 * w * w * radius * high).epsilon(1e-4));
}
