#include "mesh/generate/tube.hpp"

#include "mesh/generate/ball.hpp"
#include "mesh/generate/cylinder.hpp"
#include "mesh/generate/plane.hpp"
#include "mesh/swept_tube.hpp"
#include "mesh/tests/wall_checks.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <doctest/doctest.h>
#include <limits>
#include <numbers>
#include <random>

using namespace amontons;

namespace {

struct Case {
    const char* name;
    Centreline line;
    bool exact; // off the surface too
};

std::vector<Case> cases(double unit)
{
    std::vector<Case> all;
    Centreline bent{Vec3{0.01, 0, 0} * unit, Vec3{1, 0.2, 0}, Vec3::UnitY(), 0.004 * unit};
    bent.append_line(0.02 * unit, 0.004 * unit);
    bent.append_arc(0.03 * unit, 2.5, 0.4, 0.004 * unit);
    bent.append_arc(0.02 * unit, 1.5, 3, 0.004 * unit);
    all.push_back({"constant radius", bent, true});
    Centreline cone{Vec3::Zero(), Vec3::UnitZ(), Vec3::UnitX(), 0.004 * unit};
    cone.append_line(0.03 * unit, 0.009 * unit);
    all.push_back({"cone", cone, true});
    Centreline horn{Vec3::Zero(), Vec3::UnitZ(), Vec3::UnitX(), 0.004 * unit};
    horn.append_arc(0.03 * unit, 1.6, 0, 0.006 * unit);
    all.push_back({"horn", horn, false});
    std::vector<Vec3> points;
    std::vector<double> radii;
    for (int i = 0; i <= 12; ++i) {
        const double t = 0.5 * i;
        points.emplace_back(Vec3{0.03 * std::cos(t), 0.03 * std::sin(t), 0.008 * t} * unit);
        radii.push_back(unit * (0.004 + 0.0005 * std::sin(t)));
    }
    all.push_back({"spline", make_spline(points, radii), false});
    return all;
}

} // namespace

TEST_CASE("normal and Hessian of a swept tube are the derivatives of its distance")
{
    std::mt19937 rng{2};
    std::uniform_real_distribution<double> uniform{0, 1};
    for (double unit : {1.0, 1000.0})
        for (const Case& c : cases(unit)) {
            CAPTURE(c.name);
            CAPTURE(unit);
            const SweptTube tube{c.line};
            double normal_error = 0, hessian_error = 0, unit_error = 0;
            for (int k = 0; k < 400; ++k) {
                // On the surface of varying tubes (exact there), anywhere for the exact ones.
                const CurvePoint p = c.line.at(c.line.length() * (0.02 + 0.96 * uniform(rng)));
                const double phi = 2 * std::numbers::pi * uniform(rng);
                const Vec3 a = p.tangent.unitOrthogonal(), b = p.tangent.cross(a);
                const double part = c.exact ? 0.2 + uniform(rng) : 1.0;
                const Vec3 x =
                    p.position + part * p.radius * (std::cos(phi) * a + std::sin(phi) * b);
                const DerivativeErrors e = derivative_errors(tube, x, 1e-4 * p.radius, p.radius);
                normal_error = std::max(normal_error, e.normal);
                hessian_error = std::max(hessian_error, e.hessian);
                unit_error = std::max(unit_error, e.unit);
            }
            CHECK(unit_error < 1e-14);
            CHECK(normal_error < 1e-6);
            // At a joint of line and arc the Hessian jumps: few samples straddle one.
            CHECK(hessian_error < 2e-4); // [regression] our own run
        }
}

TEST_CASE("the distance in a bend and in a cone is the closed form")
{
    Centreline ring{Vec3{1, 0, 0}, Vec3::UnitY(), -Vec3::UnitX(), 0.1};
    ring.append_arc(1, 3, 0, 0.1);
    const SweptTube torus{ring};
    WallHint hint;
    for (double rho : {0.92, 1.0, 1.07, 1.09}) {
        const Vec3 x{rho * std::cos(1.0), rho * std::sin(1.0), 0.03};
        const WallSample s = torus.sample(x, hint);
        CHECK(s.distance == doctest::Approx(0.1 - std::hypot(rho - 1, 0.03)).epsilon(1e-13));
        // Along the ring the wall's curvature is that of a circle of radius rho, tilted.
        const Vec3 along{-std::sin(1.0), std::cos(1.0), 0};
        const double tilt = (rho - 1) / std::hypot(rho - 1, 0.03);
        CHECK(along.dot(s.hessian * along) == doctest::Approx(-tilt / rho).epsilon(1e-12));
    }
    Centreline cone{Vec3::Zero(), Vec3::UnitZ(), Vec3::UnitX(), 0.1};
    cone.append_line(1, 0.2);
    const SweptTube funnel{cone};
    const WallSample s = funnel.sample(Vec3{0.08, 0, 0.5}, hint);
    CHECK(s.distance == doctest::Approx(0.07 / std::sqrt(1.01)).epsilon(1e-14));
    CHECK((s.normal - Vec3{-1, 0, 0.1} / std::sqrt(1.01)).norm() < 1e-15);
}

TEST_CASE("a tube continues beyond its ends and nothing is ever not a number")
{
    for (const Case& c : cases(1)) {
        CAPTURE(c.name);
        const SweptTube tube{c.line};
        for (double end : {0.0, c.line.length()}) {
            const CurvePoint p = c.line.at(end);
            const double out = end > 0 ? 1 : -1;
            const Vec3 side = p.tangent.unitOrthogonal();
            WallHint hint;
            const WallSample before = tube.sample(
                p.position + 0.9 * p.radius * side - out * 1e-9 * p.radius * p.tangent, hint);
            const WallSample after = tube.sample(
                p.position + 0.9 * p.radius * side + out * 1e-9 * p.radius * p.tangent, hint);
            CHECK(std::abs(before.distance - after.distance) < 1e-8 * p.radius);
            CHECK((before.normal - after.normal).norm() < 1e-7);
            CHECK(tube.distance(p.position + out * 20 * p.radius * p.tangent, hint) > 0);
        }
        std::mt19937 rng{3};
        std::normal_distribution<double> normal;
        for (double far : {0.0, 1e-12, 0.01, 1.0, 1e6, 1e100}) {
            for (int k = 0; k < 50; ++k) {
                const Vec3 x = c.line.at(c.line.length() * k / 49).position +
                               far * Vec3{normal(rng), normal(rng), normal(rng)};
                WallHint hint;
                const WallSample s = tube.sample(x, hint);
                CHECK(std::isfinite(s.distance));
                CHECK(s.normal.allFinite());
                CHECK(s.hessian.allFinite());
                CHECK(s.distance == doctest::Approx(tube.distance(x, hint)).epsilon(1e-12));
            }
        }
    }
}

TEST_CASE("a generated tube is closed but for its two round rims with normals inwards")
{
    for (const Case& c : cases(1)) {
        CAPTURE(c.name);
        const WallModel model = make_tube({c.line, 0});
        const WallSurfaceReport report = report_surface(model);
        CHECK(report.odd_edges == 0);
        CHECK(report.rims == 2);
        CHECK(report.wrong_way == 0);
        CHECK(report.rim_error < 1e-12);
        CHECK(report.least_quality > 0.05);     // [regression] of our triangles
        CHECK(*model.deviation < 0.02 * 0.004); // [regression] of our triangles
        CHECK(model.openings.size() == 2);
        const Opening& outlet = model.openings[1];
        CHECK(opening_passed(model, outlet.centre - 1e-3 * outlet.outward,
                             outlet.centre + 1e-3 * outlet.outward) == &model.openings[1]);
        CHECK(opening_passed(model, outlet.centre + 1e-3 * outlet.outward,
                             outlet.centre - 1e-3 * outlet.outward) == nullptr);
    }
}

TEST_CASE(
    "ball and cylinder and plane: unit normals, exact distances and the free side as specified")
{
    WallHint hint;
    const Vec3 x{0.3, -0.2, 0.5};
    for (bool inside : {false, true}) {
        const double sign = inside ? -1 : 1;
        const WallModel ball = make_ball({Vec3{0.1, 0, 0}, 0.25, inside, 0});
        const WallModel cylinder = make_cylinder({Vec3{0.1, 0, 0}, Vec3{0, 0, 2}, 0.25, inside, 0});
        CHECK(ball.wall.distance(x, hint) ==
              doctest::Approx(sign * (std::sqrt(0.04 + 0.04 + 0.25) - 0.25)).epsilon(1e-14));
        CHECK(cylinder.wall.distance(x, hint) ==
              doctest::Approx(sign * (std::sqrt(0.08) - 0.25)).epsilon(1e-14));
        CHECK(report_surface(ball).wrong_way == 0);
        CHECK(report_surface(ball).rims == 0);
        CHECK(report_surface(ball).odd_edges == 0);
        CHECK(report_surface(cylinder).wrong_way == 0);
        for (const WallModel* model : {&ball, &cylinder}) {
            const DerivativeErrors e = derivative_errors(model->wall, x, 1e-4, 0.25);
            CHECK(e.normal < 1e-7);
            CHECK(e.hessian < 1e-5);
        }
        CHECK(ball.wall.sample(Vec3{0.1, 0, 0}, hint).hessian.allFinite());
    }
    const WallModel plane = make_plane({Vec3{0, 0, 1}, Vec3{0, 0, -2}, 0.5});
    CHECK(plane.wall.distance(x, hint) == doctest::Approx(0.5));
    CHECK(report_surface(plane).wrong_way == 0);
    CHECK_THROWS(make_ball({Vec3::Zero(), -1, false, 0}));
    CHECK_THROWS(make_cylinder({Vec3::Zero(), Vec3::Zero(), 1, false, 0}));
}

TEST_CASE("the cheap bound of a distance to a tube of one radius is no more than the distance")
{
    std::mt19937 rng{5};
    std::uniform_real_distribution<double> uniform{-1, 1};
    for (const TubeEnd end : {TubeEnd::straight, TubeEnd::ball})
        for (double angle : {0.3, 3.1, 3.2, 5.5}) { // less and more than half a turn
            Centreline line{Vec3{0.1, 0, 0}, Vec3{1, 0.2, 0}, Vec3::UnitY(), 0.004};
            line.append_line(0.02, 0.004);
            line.append_arc(0.03, angle, 0.4, 0.004);
            line.append_line(0.02, 0.004);
            const SweptTube tube{line, end, end};
            int found = 0;
            for (int k = 0; k < 3000; ++k) {
                const Vec3 x = line.at((0.5 + 0.6 * uniform(rng)) * line.length()).position +
                               0.004 * Vec3{uniform(rng), uniform(rng), uniform(rng)};
                WallHint hint;
                const double distance = tube.distance(x, hint);
                for (std::int32_t piece = -1; piece <= line.piece_count(); ++piece) {
                    WallHint at;
                    at.piece = piece;
                    CHECK(tube.clearance(x, at) <= distance);
                }
                // By the nearest piece it is the distance, but for ends of pieces.
                if (tube.clearance(x, hint) > distance - 1e-8 * 0.004) ++found;
            }
            CHECK(found > 2000);
        }
    Centreline cone{Vec3::Zero(), Vec3::UnitZ(), Vec3::UnitX(), 0.004};
    cone.append_line(0.03, 0.009);
    WallHint hint;
    const SweptTube tube{cone};
    tube.distance({0, 0, 0.01}, hint);
    CHECK(tube.clearance({0, 0, 0.01}, hint) == -std::numeric_limits<double>::infinity());
}
