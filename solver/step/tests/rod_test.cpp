#include "solver/body/rod_body.hpp"

#include "mesh/base/error.hpp"
#include "solver/scene/tapers.hpp"

#include <array>
#include <cmath>
#include <doctest/doctest.h>
#include <numbers>

using namespace amontons;

namespace {

RodInput straight(int elements)
{
    RodInput rod;
    rod.name = "rod";
    BeamSegment g;
    g.length = 1;
    g.radius = 0.01;
    g.EI = {1, 1};
    g.GJ = {0.8, 0.8};
    g.EA = {1e5, 1e5};
    g.element = 1.0 / elements;
    g.density = 1000;
    rod.segments.push_back(g);
    return rod;
}

RodHold clamp(const char* set)
{
    RodHold h;
    h.set = set;
    return h;
}

BodyEnergy advance(RodBody& rod, const StepInput& step)
{
    const Eigen::VectorXd none;
    rod.begin(step);
    for (int i = 0; i < 30; ++i) {
        rod.linearise();
        rod.update(rod.free_change(), none, none);
        if (rod.imbalance(none) <= 1e-11) return rod.accept(none);
    }
    FAIL("no balance");
    return {};
}

StepInput quasi_static(double start, double h)
{
    StepInput s;
    s.start = start;
    s.h = h;
    return s;
}

} // namespace

TEST_CASE("a cone bends and twists and stretches and weighs as a solid cone does")
{
    // Of modulus E, from radius r0 to r1: its end moves by F L^3 / (3 EI0) r0 / r1 under a force
    // across, (Gere & Goodno, Mechanics of Materials), by F L / (pi E r0 r1) under one along, and
    // turns by T L / (3 GJ0) (r0 / r1) (1 + r0 / r1 + (r0 / r1)^2) under a torque.
    const double r0 = 0.01, r1 = 0.004, q = r0 / r1, density = 1000, weight = 10, F = 1e-6;
    double before = 0;
    for (const int elements : {20, 40}) {
        CAPTURE(elements);
        RodInput input = straight(elements);
        BeamSegment& g = input.segments[0];
        g.end_radius = r1;
        g.EI = {1, std::pow(q, -4)};
        g.GJ = {0.8, 0.8 * std::pow(q, -4)};
        g.EA = {1e5, 1e5 * std::pow(q, -2)};
        input.segments = without_tapers(input.segments);
        input.hold = {clamp("start")};
        RodLoad l;
        l.set = "end";
        l.force = Vec3(0, F, 0);
        l.moment = Vec3(F, 0, 0);
        input.loads.push_back(l);
        RodBody rod(input, nullptr, 0);
        advance(rod, quasi_static(0, 1));
        const BeamNode& end = rod.nodes().back();
        const double across = F / 3 * q, turn = F / (3 * 0.8) * q * (1 + q + q * q);
        const double error = std::abs(end.position().y() / across - 1);
        CHECK(error < 3e-3);
        CHECK(2 * end.q[1] == doctest::Approx(turn).epsilon(3e-3));
        if (elements == 40) CHECK(error < 0.3 * before); // of second order
        before = error;

        input.loads[0].moment.reset();
        input.loads[0].force = Vec3(1, 0, 0);
        RodBody drawn(input, nullptr, 0);
        advance(drawn, quasi_static(0, 1));
        CHECK(drawn.nodes().back().position().x() - 1 == doctest::Approx(q / 1e5).epsilon(3e-3));

        input.loads.clear();
        RodBody heavy(input, nullptr, 0);
        StepInput step = quasi_static(0, 1);
        step.gravity = Vec3(0, 0, -weight);
        advance(heavy, step);
        CHECK(heavy.reactions()[0][0].z() == doctest::Approx(weight * density * std::numbers::pi /
                                                             3 * (r0 * r0 + r0 * r1 + r1 * r1))
                                                 .epsilon(1e-3));
    }
}

TEST_CASE("a cantilever carries its load and its weight into the clamp")
{
    for (const char* kind : {"exact", "corotational"}) {
        CAPTURE(kind);
        RodInput input = straight(10);
        input.elements = kind;
        input.hold = {clamp("start")};
        RodLoad l;
        l.at = 0.7;
        l.force = Vec3(0, 0, 1e-3);
        input.loads.push_back(l);
        RodBody rod(input, nullptr, 0);
        StepInput step = quasi_static(0, 1);
        step.gravity = Vec3(0, -1e-4, 0);
        advance(rod, step);
        const double weight = 1000 * std::numbers::pi * 1e-4 * 1e-4;
        const auto [force, moment] = rod.reactions()[0];
        CHECK((force - Vec3(0, weight, -1e-3)).norm() < 1e-9);
        CHECK((moment - Vec3(0, 0.7e-3, 0.5 * weight)).norm() < 1e-8);
        const BeamNode& n = rod.nodes()[std::size_t(rod.model().node_at(0.7))];
        CHECK(std::abs(n.x[2] / (1e-3 * 0.343 / 3) - 1) < 1e-5);
        CHECK(rod.negative() == 0);
    }
}

TEST_CASE("a rod of 1e5 and 1e6 radii bends as any other")
{
    // A dead load across of 12 EI / L^2: the end is at (0.40714723, 0.82859317) L (elastica, by
    // shooting).
    for (const double slenderness : {1e4, 1e5, 1e6}) {
        CAPTURE(slenderness);
        RodInput input = straight(40);
        input.segments[0].radius = 1 / slenderness;
        input.segments[0].EA.fill(4 * slenderness * slenderness);
        input.hold = {clamp("start")};
        RodLoad load;
        load.set = "end";
        load.force = Vec3(0, -12, 0);
        load.over = {{0, 0}, {1, 1}};
        input.loads = {load};
        RodBody rod(input, nullptr, 0);
        for (int i = 0; i < 10; ++i)
            advance(rod, quasi_static(0.1 * i, 0.1));
        const Vec3 end = rod.nodes().back().position();
        CHECK(std::abs(end.x() - 0.40714723) < 1e-6);
        CHECK(std::abs(end.y() + 0.82859317) < 1e-6);
    }
}

TEST_CASE("a taut string's frequencies are those of a string and converge with the fourth power")
{
    // k sqrt(T / rho A) of k = n pi / L, less k^2 r^2 / 8 of it for the sections that turn.
    const double T = 100;
    std::array<double, 2> error{};
    for (const int elements : {10, 20}) {
        const double h = 1.0 / elements;
        RodInput input = straight(elements);
        BeamSegment& g = input.segments[0];
        const double EI = T / (400.0 * 1e6);
        g.radius = 1e-3;
        g.EI = g.GJ = {EI, EI};
        g.EA = {1e7, 1e7};
        input.plane = Vec3::UnitY();
        RodHold start = clamp("start"), end = clamp("end");
        start.turns = end.turns = "free";
        end.x = {{0, 0}, {1, T / 1e7}};
        end.y = end.z = {{0, 0}, {1, 0}};
        input.hold = {start, end};
        RodBody rod(input, nullptr, 0);
        advance(rod, quasi_static(0, 1));
        CHECK(T * h * h / EI > 0.99e6);
        // The mass is that of the length without load, on one that is a little longer.
        const double L = 1 + T / 1e7,
                     per_length = g.density * std::numbers::pi * g.radius * g.radius / L;
        const std::vector<double> omega = rod.frequencies(3);
        CAPTURE(elements);
        for (int n = 1; n <= 3; ++n) {
            const double k = n * std::numbers::pi / L, right = k * std::sqrt(T / per_length);
            const double off = omega[std::size_t(n) - 1] / right - 1 + k * k * 1e-6 / 8;
            CHECK(std::abs(off) < 1e-4);
            if (n == 3) error[elements == 10 ? 0 : 1] = std::abs(off);
        }
    }
    MESSAGE("third frequency off by " << error[0] << " and " << error[1]);
    CHECK((error[1] < 1e-8 || std::log2(error[0] / error[1]) > 3.5));
}

TEST_CASE("loads that follow and moments fixed in space converge quadratically")
{
    for (const bool follows : {false, true}) {
        RodInput input = straight(8);
        input.hold = {clamp("start")};
        RodLoad l;
        l.set = "end";
        l.force = Vec3(0.1, 0.6, 0.3);
        l.moment = Vec3(0.2, -0.4, 0.5);
        l.follows = follows;
        input.loads.push_back(l);
        RodBody rod(input, nullptr, 0);
        const Eigen::VectorXd none;
        rod.begin(quasi_static(0, 1));
        std::vector<double> motion;
        for (int i = 0; i < 12; ++i) {
            rod.linearise();
            motion.push_back(rod.free_change().norm());
            rod.update(rod.free_change(), none, none);
        }
        bool quadratic = false; // at some iteration before round-off
        for (std::size_t i = 0; i + 1 < motion.size(); ++i)
            quadratic |=
                motion[i] < 1e-2 && motion[i] > 1e-6 && motion[i + 1] < 100 * motion[i] * motion[i];
        CHECK(quadratic);
        CHECK(motion.back() < 1e-10);
    }
}

TEST_CASE("a rod with prescribed ends closes its energy balance on its way there and back")
{
    for (const char* kind : {"exact", "corotational"}) {
        CAPTURE(kind);
        RodInput input = straight(12);
        input.elements = kind;
        input.segments[0].curvature = 1; // a straight one would buckle
        input.hold = {clamp("start"), clamp("end")};
        RodHold& end = input.hold[1];
        end.x = {{0, 0}, {1, -0.3}, {2, 0}};
        end.y = {{0, 0}, {1, 0.2}, {2, 0}};
        end.z = {{0, 0}, {1, 0.1}, {2, 0}};
        end.angle = {{0, 0}, {1, 1}, {2, 0}};
        RodBody rod(input, nullptr, 0);
        double work = 0, size = 0, elastic = 0, top = 0;
        for (int i = 0; i < 200; ++i) {
            const BodyEnergy e = advance(rod, quasi_static(0.01 * i, 0.01));
            work += e.work;
            size += e.work_absolute;
            elastic = e.elastic;
            if (i == 99) {
                top = elastic;
                CHECK(std::abs(work - elastic) < 1e-3 * size);
                CHECK(std::abs(rod.nodes().back().x[0] - std::sin(1) + 0.3) < 1e-9);
            }
        }
        CHECK(top > 0.1);
        CHECK(elastic < 1e-9 * top); // no memory of the path
        CHECK(std::abs(work) < 1e-3 * size);
    }
}

TEST_CASE("a free rod keeps its momentum and by the midpoint rule also nearly its spin and energy")
{
    RodInput input = straight(8);
    input.segments[0].curvature = 1;
    input.velocity = Vec3(0.3, -0.2, 0.1);
    input.spin = Vec3(1, 2, -1.5);
    for (const bool filtered : {false, true}) {
        RodBody rod(input, nullptr, 0);
        const Vec3 p = rod.momentum(), L = rod.angular_momentum();
        const double kinetic = rod.kinetic_energy(), mass = 1000 * std::numbers::pi * 1e-4;
        CHECK((p - mass * input.velocity).norm() < 1e-9 * p.norm());
        BodyEnergy e;
        StepInput step;
        step.dynamic = true;
        step.h = 2e-3;
        step.rule = filtered ? generalised_alpha(0.8) : theta_rule(0.5);
        for (int i = 0; i < 50; ++i) {
            step.start = i * step.h;
            e = advance(rod, step);
        }
        CHECK((rod.momentum() - p).norm() < 1e-9 * p.norm());
        CHECK((rod.angular_momentum() - L).norm() < 1e-3 * L.norm());
        CHECK(std::abs(e.elastic + e.kinetic - kinetic) < 1e-3 * kinetic);
    }
}

TEST_CASE("a closed ring pulled at the ends of a diameter opens as Castigliano states")
{
    RodInput input = straight(40);
    const double R = 0.1;
    input.segments[0].length = 2 * std::numbers::pi * R;
    input.segments[0].element = input.segments[0].length / 40;
    input.segments[0].EA = {1e7, 1e7};
    input.shape.closed = true;
    input.hold = {clamp("start")};
    RodLoad l;
    l.at = std::numbers::pi * R;
    l.force = Vec3(0, 0.1, 0);
    input.loads.push_back(l);
    Centreline circle(Vec3::Zero(), Vec3::UnitX(), Vec3::UnitY(), 1e-6);
    circle.append_arc(R, 2 * std::numbers::pi, 0, 1e-6);
    RodBody rod(input, &circle, 0);
    CHECK(rod.model().node_count() == 40);
    CHECK(rod.model().element_count() == 40);
    const BodyEnergy e = advance(rod, quasi_static(0, 1));
    const double exact = (std::numbers::pi / 4 - 2 / std::numbers::pi) * 0.1 * R * R * R;
    const double opened =
        rod.nodes()[std::size_t(rod.model().node_at(std::numbers::pi * R))].x[1] - 2 * R;
    CHECK(std::abs(opened / exact - 1) < 0.01);
    CHECK(std::abs(e.elastic / (0.5 * 0.1 * exact) - 1) < 0.01);
    CHECK(rod.negative() == 0);
}

TEST_CASE("a rod continues bit by bit from its state")
{
    RodInput input = straight(6);
    input.hold = {clamp("start")};
    RodLoad l;
    l.set = "end";
    l.force = Vec3(0, 1, 0.2);
    l.over = {{0, 0}, {1, 1}};
    input.loads.push_back(l);
    for (const bool dynamic : {false, true}) {
        StepInput step = quasi_static(0, 0.01);
        step.dynamic = dynamic;
        step.rule = generalised_alpha(0.5);
        RodBody whole(input, nullptr, 0.1), half(input, nullptr, 0.1), rest(input, nullptr, 0.1);
        for (int i = 0; i < 10; ++i) {
            step.start = 0.01 * i;
            advance(whole, step);
            if (i < 5) advance(half, step);
            if (i == 4) rest.set_state(half.state());
            if (i > 4) advance(rest, step);
        }
        CHECK(whole.state() == rest.state());
    }
}

TEST_CASE("a rod states what holds it not and what is wrong with it")
{
    RodInput input = straight(4);
    CHECK(RodBody(input, nullptr, 0).free_motions().size() == 6);
    input.hold = {clamp("start")};
    CHECK(RodBody(input, nullptr, 0).free_motions().empty());
    input.hold[0].turns = "about";
    CHECK(RodBody(input, nullptr, 0).free_motions().size() == 1);
    input.hold[0].turns = "free";
    input.plane = Vec3::UnitZ();
    CHECK(RodBody(input, nullptr, 0).free_motions().size() == 1);

    const auto place_of = [](const RodInput& rod) -> std::string {
        try {
            RodBody body(rod, nullptr, 0);
        } catch (const InputError& error) {
            return error.issues().front().place;
        }
        return "";
    };
    CHECK(place_of(input) == "");
    RodInput leaves = input;
    leaves.plane = Vec3::UnitX();
    CHECK(place_of(leaves) == "/plane");
    RodInput back = straight(4);
    back.shape.points = {{Vec3(0, 0, 0)}, {Vec3(0.5, 0, 0)}, {Vec3(0, 0, 0)}};
    CHECK(place_of(back) == "/shape/points/1");
    RodInput longer = straight(4);
    longer.shape.points = {{Vec3(0, 0, 0)}, {Vec3(2, 0, 0)}};
    CHECK(place_of(longer) == "/segments");
    RodInput beyond = straight(4);
    RodLoad l;
    l.at = 1.5;
    beyond.loads.push_back(l);
    CHECK(place_of(beyond) == "/loads/0/at");
}

TEST_CASE("a rod that bends by a table is bent by an end moment as the table states in any plane")
{
    // 2 N m over 1/m up to 1/m, then 0.5: a moment of 2.4 N m bends to 1.8 /m, whatever its axis.
    for (const double angle : {0.0, 0.6, 2.1}) {
        RodInput input = straight(10);
        input.segments[0].EI = {2, 2};
        input.segments[0].bending = {{0, 0}, {1, 2}, {3, 3}};
        input.hold = {clamp("start")};
        RodLoad load;
        load.set = "end";
        load.moment = 2.4 * Vec3(0, std::cos(angle), std::sin(angle));
        load.over = {{0, 0}, {1, 1}};
        input.loads = {load};
        RodBody rod(input, nullptr, 0);
        double stored = 0, work = 0;
        for (int i = 0; i < 8; ++i) {
            const BodyEnergy e = advance(rod, quasi_static(i / 8.0, 1 / 8.0));
            stored = e.elastic;
            work += e.work;
        }
        CAPTURE(angle);
        const double k = 1.8;
        const Vec3 end = rod.nodes().back().position();
        CHECK(end.x() == doctest::Approx(std::sin(k) / k).epsilon(1e-9));
        CHECK(std::hypot(end.y(), end.z()) == doctest::Approx((1 - std::cos(k)) / k).epsilon(1e-9));
        // The area below the table, but for its rounded corner.
        CHECK(std::hypot(rod.strain(4)[4], rod.strain(4)[5]) == doctest::Approx(k).epsilon(1e-9));
        CHECK(std::hypot(rod.resultants(4)[4], rod.resultants(4)[5]) ==
              doctest::Approx(2.4).epsilon(1e-9));
        CHECK(stored == doctest::Approx(1 + 0.5 * (2 + 2.4) * 0.8).epsilon(1e-3));
    }
}

TEST_CASE(
    "a rod that stretches by a table is as long as it specifies in tension and in compression")
{
    for (const double pull : {300.0, 1500.0, -1100.0}) {
        RodInput input = straight(4);
        input.segments[0].EA = {1e5, 1e5};
        input.segments[0].stretching = {
            {-0.02, -1200}, {-0.01, -1000}, {0, 0}, {0.01, 1000}, {0.03, 2000}};
        input.hold = {clamp("start")};
        RodLoad load;
        load.set = "end";
        load.force = Vec3(pull, 0, 0);
        input.loads = {load};
        input.plane = Vec3::UnitZ();
        input.segments[0].EI = {100, 100};
        RodBody rod(input, nullptr, 0);
        advance(rod, quasi_static(0, 1));
        const double strain = pull == 300 ? 0.003 : pull > 0 ? 0.02 : -0.015;
        CAPTURE(pull);
        CHECK(rod.nodes().back().position().x() == doctest::Approx(1 + strain).epsilon(1e-10));
    }
}

TEST_CASE("a rod of natural curvature and twist is a helix")
{
    const double k = 6, t = 4, square = k * k + t * t;
    RodInput input = straight(12);
    input.segments[0].curvature = k;
    input.segments[0].twist = t;
    input.hold = {clamp("start")};
    RodBody rod(input, nullptr, 0);
    advance(rod, quasi_static(0, 1)); // free of load: it stays
    // Nodes lie on a helix of radius k / (k^2 + t^2) and pitch 2 pi t / (k^2 + t^2): chords of
    // s have the length sqrt(4 r^2 sin^2(w s / 2) + (t s / w)^2), w^2 = k^2 + t^2.
    const double w = std::sqrt(square), r = k / square;
    for (const int n : {1, 5, 12}) {
        const double s = n / 12.0, around = 2 * r * std::sin(w * s / 2), along = t * s / w;
        CHECK((rod.nodes()[std::size_t(n)].position() - rod.nodes()[0].position()).norm() ==
              doctest::Approx(std::hypot(around, along)).epsilon(1e-10));
    }
}
