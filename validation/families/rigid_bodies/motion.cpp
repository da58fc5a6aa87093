// B01, B03, B04, B09, B10, B11, B13, B17, B19: rigid bodies that slide, roll, spin and bounce.

#include "validation/families/rigid_bodies/rigid_bodies.hpp"
#include "validation/families/rigid_bodies/shapes.hpp"
#include "validation/solid_run.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace amontons::validation {
namespace {

/// A scene of one body on a plane, dynamic, its gravity that of an incline towards x.
struct OnPlane {
    SolidScene scene;
    RigidInput* body = nullptr;

    OnPlane(const ShapeInput& shape, double mass, double height, double degrees, double friction,
            double step, double end)
        : scene("a body on a plane")
    {
        body = &scene.rigid("body", shape);
        body->mass = mass;
        body->start.place = {0, 0, height};
        scene.plane("plane", Vec3::Zero(), Vec3::UnitZ());
        scene.touch("body", "plane", friction).sliding = "finite";
        const double a = degrees * kPi / 180;
        scene.scene.gravity = {kG * std::sin(a), 0, -kG * std::cos(a)};
        scene.scene.time.kind = "dynamic";
        scene.scene.time.step = step;
        scene.scene.time.end = end;
    }
    SolidRun run() const { return run_solids(scene.scene); }
};

} // namespace

std::vector<Measured> incline()
{
    std::vector<Measured> rows;
    {
        OnPlane s(box({0.2, 0.2, 0.1}), 1, 0.05, 16.6, 0.3, 0.01, 10);
        s.scene.scene.accuracy.contact = 1e-12;
        const SolidRun r = s.run();
        rows.push_back(at_most("creep in 10 s at 16.6 degrees, mu 0.3 [m]",
                               std::abs(r.quantity("body_x")), 1e-12));
    }
    // The threshold atan(mu): just below it no speed, just above it some.
    const double limit = std::atan(0.3) * 180 / kPi, near = 1e-6 * 180 / kPi;
    for (const double side : {-1.0, 1.0}) {
        OnPlane s(box({0.2, 0.2, 0.1}), 1, 0.05, limit + side * near, 0.3, 0.01, 0.5);
        s.scene.scene.accuracy.contact = 1e-12;
        const double speed = s.run().quantity("body_velocity_x");
        const double free = side > 0 ? kG * 1e-6 * 0.5 / std::cos(std::atan(0.3)) : 0;
        rows.push_back(absolute(
            fmt::format("speed 1e-6 rad {} the threshold [m/s]", side < 0 ? "below" : "above"),
            free, speed, 1e-9));
    }
    OnPlane s(box({0.2, 0.2, 0.1}), 1, 0.05, 30, 0.3, 0.01, 1);
    const SolidRun r = s.run();
    const double a = kG * (0.5 - 0.3 * std::sqrt(0.75));
    rows.push_back(
        relative("speed after 1 s at 30 degrees", a, r.quantity("body_velocity_x"), 1e-8));
    rows.push_back(relative("way after 1 s: a t (t + h) / 2, the rule's own", a * 1.01 / 2,
                            r.quantity("body_x"), 1e-10));
    rows.push_back(relative(
        "way after 1 s, midpoint rule", a / 2,
        [&] {
            OnPlane m(box({0.2, 0.2, 0.1}), 1, 0.05, 30, 0.3, 0.01, 1);
            m.scene.scene.time.theta = 0.5;
            return m.run().quantity("body_x");
        }(),
        1e-6));
    return rows;
}

std::vector<Measured> sliding_block()
{
    const double h = 1e-3;
    OnPlane s(box({0.2, 0.2, 0.02}), 1, 0.01, 0, 0.25, h, 1);
    s.body->start.velocity = {2, 0, 0};
    const SolidRun r = s.run();
    double stop = 0;
    for (std::size_t i = 0; i < r.steps.size(); ++i)
        if (r.quantity("body_velocity_x", int(i)) > 1e-6) stop = r.steps[i].time;
    OnPlane ice(box({0.2, 0.2, 0.02}), 1, 0.01, 0, 0, h, 1);
    ice.body->start.velocity = {2, 0, 0};
    return {absolute("time until it stops [s], within a step", 0.815494393, stop, h),
            absolute("way until it stops [m], within v0 h / 2", 0.815494393, r.quantity("body_x"),
                     2 * h / 2 * 1.01),
            at_most("speed that a block without friction loses in 1 s [m/s]",
                    std::abs(ice.run().quantity("body_velocity_x") - 2), 1e-12)};
}

std::vector<Measured> thrown_block()
{
    // Uphill is -x: thrown sideways (y) where mu = tan(alpha).
    struct Thrown {
        double way, down, speed, speed_down, invariant;
    };
    const auto thrown = [](double step, double theta) {
        OnPlane s(box({0.02, 0.02, 1e-5}), 1, 5e-6, 20, std::tan(20 * kPi / 180), step, 0.5);
        s.scene.scene.time.theta = theta;
        s.body->start.velocity = {0, 1, 0};
        const SolidRun r = s.run();
        const double vx = r.quantity("body_velocity_y"), vy = r.quantity("body_velocity_x");
        return Thrown{r.quantity("body_y"), r.quantity("body_x"), vx, vy, std::hypot(vx, vy) + vy};
    };
    const Thrown middle = thrown(1e-3, 0.5), end = thrown(1e-3, 1), half = thrown(5e-4, 1);
    // On the level the friction cone is round: the same way towards any side.
    double uneven = 0;
    for (int degrees = 0; degrees <= 90; degrees += 15) {
        const double a = degrees * kPi / 180, mu = std::tan(20 * kPi / 180), t = 0.2;
        OnPlane s(box({0.02, 0.02, 1e-5}), 1, 5e-6, 0, mu, 1e-3, t);
        s.body->start.velocity = {std::cos(a), std::sin(a), 0};
        const SolidRun level = s.run();
        const Vec3 v(level.quantity("body_velocity_x"), level.quantity("body_velocity_y"), 0);
        raise_to(uneven, (v - (1 - mu * kG * t) * s.body->start.velocity).norm());
    }
    std::vector<Measured> rows{at_most(
        "on the level, thrown by 0 to 90 degrees: off the speed v0 - mu g t [m/s]", uneven, 1e-8)};
    struct Row {
        const char* what;
        double reference;
        double Thrown::*value;
    };
    for (const Row& row : {Row{"sideways way at 0.5 s [m]", 0.190125, &Thrown::way},
                           {"downhill way at 0.5 s [m]", 0.19424, &Thrown::down},
                           {"sideways speed at 0.5 s [m/s]", 0.0574484, &Thrown::speed},
                           {"downhill speed at 0.5 s [m/s]", 0.4983498, &Thrown::speed_down},
                           {"|v| + v downhill, at all times v0", 1, &Thrown::invariant}}) {
        // Of the throw's 1 m/s where it is a speed that dies away.
        const auto measured = [&](const char* step, double value) {
            const std::string what = std::string(row.what) + step;
            return row.value == &Thrown::speed || row.value == &Thrown::speed_down
                       ? absolute(what, row.reference, value, 1e-3)
                       : relative(what, row.reference, value, 1e-3);
        };
        rows.push_back(measured(", midpoint rule, step 1 ms", middle.*row.value));
        // Friction along the velocity at the step's end is of first order.
        rows.push_back(measured(", implicit Euler, step 0.5 ms", half.*row.value));
        // What is left beyond first order.
        rows.push_back(measured(", implicit Euler, extrapolated from 1 and 0.5 ms",
                                2 * half.*row.value - end.*row.value));
        rows.back().tolerance = 1e-5;
    }
    return rows;
}

std::vector<Measured> bowling_ball()
{
    const double h = 1e-3;
    OnPlane s(ball(0.108), 7, 0.108, 0, 0.2, h, 1);
    s.body->start.velocity = {5, 0, 0};
    const SolidRun r = s.run();
    double rolls = 0, way = 0;
    ReferenceCurve speed{"time [s]", "speed [m/s]", {}, {}, {}};
    for (std::size_t i = 0; i < r.steps.size(); ++i) {
        const double v = r.quantity("body_velocity_x", int(i)), t = r.steps[i].time;
        if (v - 0.108 * r.quantity("body_spin_y", int(i)) > 1e-6) {
            rolls = t;
            way = r.quantity("body_x", int(i));
        }
        if (i % 20 == 0) speed.add(t, std::max(5 - 0.2 * kG * t, 25.0 / 7), v);
    }
    std::vector<Measured> rows{
        relative("final speed", 25.0 / 7, r.quantity("body_velocity_x"), 1e-6),
        absolute("time when it rolls [s], within a step", 0.728119994, rolls, h),
        absolute("way until it rolls [m], within v0 h", 3.12051426, way, 5 * h),
        at_most("friction once it rolls [N]", std::abs(r.quantity("plane_on_body_force_x")), 1e-6)};
    rows.front().curve = std::move(speed);
    return rows;
}

std::vector<Measured> rolling_down()
{
    // Just above the critical coefficient it rolls, just below it slips.
    const double radius = 0.1;
    std::vector<Measured> rows;
    const auto slip = [&](double mu) {
        OnPlane s(ball(radius), 1, radius, 30, mu, 1e-3, 0.1);
        const SolidRun r = s.run();
        return r.quantity("body_velocity_x") - radius * r.quantity("body_spin_y");
    };
    const double critical = 0.16495722;
    rows.push_back(at_most("slip of a ball 1e-6 above the critical mu [m/s]",
                           std::abs(slip(critical + 1e-6)), 1e-8));
    // Slip grows with g cos(a) (mu_c - mu) (1 + 1/k), k = 2/5.
    rows.push_back(relative("slip of a ball 1e-3 below it",
                            kG * std::cos(kPi / 6) * (critical - (critical - 1e-3)) * 3.5 * 0.1,
                            slip(critical - 1e-3), 1e-4));
    // Only the moment of inertia, k m R^2, distinguishes them.
    struct Round {
        const char* name;
        double k, critical, acceleration;
    };
    for (const Round& b : {Round{"ball", 0.4, 0.16495722, 3.50357143},
                           {"cylinder", 0.5, 0.19245009, 3.27},
                           {"hoop", 1, 0.288675135, 2.4525}}) {
        const auto rolled = [&](double mu, double t) {
            OnPlane s(ball(radius), 1, radius, 30, mu, 1e-3, t);
            s.body->inertia = Vec3::Constant(b.k * radius * radius);
            return s.run();
        };
        rows.push_back(relative(fmt::format("speed after rolling for 1 s: {}", b.name),
                                b.acceleration, rolled(0.5, 1).quantity("body_velocity_x"), 1e-6));
        double low = b.critical - 1e-3, high = b.critical + 1e-3;
        while (high - low > 1e-7) {
            const double mu = 0.5 * (low + high);
            const SolidRun r = rolled(mu, 0.02);
            const double sliding =
                r.quantity("body_velocity_x") - radius * r.quantity("body_spin_y");
            (sliding > 1e-9 ? low : high) = mu;
        }
        rows.push_back(absolute(fmt::format("least friction to roll: {}", b.name), b.critical,
                                0.5 * (low + high), 1e-6));
    }
    return rows;
}

std::vector<Measured> spinning_disc()
{
    ShapeInput disc;
    disc.generate = "cylinder";
    disc.radius = 0.1;
    disc.length = 1e-4;
    disc.points = 144; // of 100, in rings, the ratio itself is 1 % off
    // Started elsewhere, from either side it comes to the ratio that all such motions end with.
    std::vector<Measured> rows;
    for (const double start : {0.83, 0.6}) {
        OnPlane s(disc, 1, 5e-5, 0, 0.3, 2e-3, 0.7);
        s.body->start.velocity = {1, 0, 0};
        s.body->start.spin = {0, 0, 1 / (0.1 * start)};
        const SolidRun r = s.run();
        double ratio = 0;
        for (std::size_t i = 0; i < r.steps.size(); ++i) {
            const double v = r.quantity("body_velocity_x", int(i));
            if (v > 1e-4) ratio = v / (0.1 * r.quantity("body_spin_z", int(i)));
        }
        rows.push_back(relative(fmt::format("v / (R omega) at the last, begun at {}", start),
                                0.6530018, ratio, 1e-2));
    }
    OnPlane s(disc, 1, 5e-5, 0, 0.3, 1e-3, 0.6);
    s.body->start.velocity = {1, 0, 0};
    s.body->start.spin = {0, 0, 1 / (0.1 * 0.6530018)};
    const SolidRun r = s.run();
    // Started at the ratio v / (R omega) that all such motions end with, it stays there.
    double ratio = 0, stop = 0;
    ReferenceCurve speed{"time [s]", "speed [m/s]", {}, {}, {}};
    for (std::size_t i = 0; i < r.steps.size(); ++i) {
        const double v = r.quantity("body_velocity_x", int(i)),
                     w = r.quantity("body_spin_z", int(i));
        if (v > 0.05) ratio = v / (0.1 * w);
        if (v > 1e-4) stop = r.steps[i].time;
        // At one ratio friction is one force.
        if (i % 10 == 0)
            speed.add(r.steps[i].time, std::max(0.0, 1 - r.steps[i].time / 0.551576507), v);
    }
    rows.push_back(relative("v / (R omega) near the stop, begun there", 0.6530018, ratio, 1e-2));
    rows.push_back(relative("time until it stops", 0.551576507, stop, 1e-2));
    rows.back().curve = std::move(speed);
    const auto first_change = [&](const char* of) { return r.quantity(of, 0) - r.quantity(of, 1); };
    const double weight = 0.3 * kG * 1e-3; // mu times it, in one step; I = m R^2/2
    rows.push_back(relative("friction over mu N at that ratio", 0.616033,
                            first_change("body_velocity_x") / weight, 1e-2));
    rows.push_back(relative("torque over mu N R at that ratio", 0.471694,
                            0.5 * 0.1 * first_change("body_spin_z") / weight, 1e-2));
    return rows;
}

std::vector<Measured> bouncing_ball()
{
    const double h = 5e-5;
    OnPlane s(ball(0.1), 1, 1.1, 0, 0, h, 1.6);
    s.scene.scene.contact[0].restitution = 0.5;
    const SolidRun r = s.run();
    double first = 0, rest = 0, path = 0;
    for (std::size_t i = 1; i < r.steps.size(); ++i) {
        const double z = r.quantity("body_z", int(i)), before = r.quantity("body_z", int(i) - 1);
        path += std::abs(z - before);
        if (first == 0 && r.quantity("body_velocity_z", int(i)) > 0) first = r.steps[i].time;
        if (std::abs(r.quantity("body_velocity_z", int(i))) > 0.002) rest = r.steps[i].time;
    }
    return {absolute("time of the first bounce [s], within two steps", 0.451523641, first, 2 * h),
            relative("time to rest", 1.35457092, rest, 5e-3),
            relative("path", 1.66666667, path, 5e-3)};
}

std::vector<Measured> balls_in_line()
{
    std::vector<Measured> rows;
    for (const int n : {2, 3, 4, 5})
        for (const double e : {1.0, 0.0}) {
            SolidScene s("balls in a line");
            for (int k = 0; k < n; ++k) {
                RigidInput& b = s.rigid(fmt::format("b{}", k), ball(0.5));
                b.mass = 1;
                b.start.place = {double(k), 0, 0};
                b.start.velocity = {k == 0 ? 1.0 : 0.0, 0, 0};
            }
            for (int k = 0; k + 1 < n; ++k) {
                ContactLaw& law = s.touch(fmt::format("b{}", k), fmt::format("b{}", k + 1), 0);
                law.restitution = e;
                law.sliding = "finite";
            }
            s.scene.time.kind = "dynamic";
            s.scene.time.step = s.scene.time.end = 0.01;
            s.scene.accuracy.contact = 1e-13;
            const SolidRun r = run_solids(s.scene);
            const double first = e == 1 ? 2.0 / n - 1 : 1.0 / n,
                         others = e == 1 ? 2.0 / n : 1.0 / n;
            double worst = std::abs(r.quantity("b0_velocity_x") - first);
            for (int k = 1; k < n; ++k)
                raise_to(worst, std::abs(r.quantity(fmt::format("b{}_velocity_x", k)) - others));
            rows.push_back(at_most(
                fmt::format("speeds of {} balls after a blow, e = {}, off Moreau's law [m/s]", n,
                            e),
                worst, 1e-12));
            if (n != 3 || e != 1) continue;
            double off = 0; // impulses of the two contacts, 4/3 and 2/3
            for (const ContactRecord& c : r.last().contacts)
                raise_to(off,
                         std::abs(c.normal_force * 0.01 - (c.point.x() < 1 ? 4.0 / 3 : 2.0 / 3)));
            rows.push_back(
                at_most("impulses of 3 balls, e = 1, off Moreau's law [N s]", off, 1e-12));
        }
    return rows;
}

namespace {

/// Spin [1/s] at time t of a block released at the angle theta about its lower edge: Housner's
/// equation, (4/3) R theta'' = -g sin(alpha - theta), by Runge and Kutta's rule.
/// @param half   R, from the edge to the centre [m]
/// @param alpha  theta where the centre is above the edge [rad]
double housner(double half, double alpha, double theta, double t)
{
    double spin = 0;
    const int steps = 200;
    const double h = t / steps;
    const auto rate = [&](double at) { return -0.75 * kG / half * std::sin(alpha - at); };
    for (int i = 0; i < steps; ++i) {
        const double a = rate(theta), b = rate(theta + h / 2 * spin),
                     c = rate(theta + h / 2 * spin + h * h / 4 * a),
                     d = rate(theta + h * spin + h * h / 2 * b);
        theta += h * spin + h * h / 6 * (a + b + c);
        spin += h / 6 * (a + 2 * b + 2 * c + d);
    }
    return spin;
}

/// A block of height 1 turned by theta about its lower edge, which is at the origin.
struct OnEdge : OnPlane {
    OnEdge(double width, double theta, double step, double end)
        : OnPlane(box({width, 0.5, 1}), 1, 0, 0, 1, step, end)
    {
        const double half = std::hypot(0.5, 0.5 * width),
                     angle = std::atan2(0.5, -0.5 * width) - theta; // of the centre, from the edge
        body->start.turn = {0, theta, 0};
        body->start.place = {half * std::cos(angle), 0, half * std::sin(angle)};
        scene.scene.time.theta = 0.5;
        // Next to none, but not 0: one blow where the corner would pass the floor within the
        // step. With the law of gaps it would come down in two.
        scene.scene.contact[0].restitution = 1e-9;
    }
};

/// Spin after the blow over that before it [-], in a step too short for anything else: where within
/// a longer one the blow falls, with how much turn left, moves the ratio by 1e-5.
double blow(double width, double before)
{
    constexpr double kTurn = 1e-9, kStep = 1e-8;
    const OnEdge s(width, kTurn, kStep, kStep);
    s.body->start.spin = {0, before, 0};
    s.body->start.velocity = s.body->start.spin.cross(s.body->start.place);
    return s.run().quantity("body_spin_y") / before;
}

} // namespace

std::vector<Measured> rocking_block()
{
    std::vector<Measured> rows;
    struct Set {
        double width, part, time, before, ratio;
    };
    for (const Set& k : {Set{0.2, 0.5, 0.34709359, -0.64804901, 0.94230769},
                         Set{0.25, 0.8, 0.60714988, -0.90454809, 0.91176471}}) {
        // Turned about its lower edge at x = 0 by theta0, released.
        const double alpha = std::atan(k.width), theta = k.part * alpha;
        const double half = std::hypot(0.5, 0.5 * k.width);
        double impact = 0, before = 0, after = 0;
        ReferenceCurve spin{"time [s]", "spin [1/s]", {}, {}, {}};
        const double h = 2e-4;
        const SolidRun r = OnEdge(k.width, theta, h, k.time + 0.02).run();
        for (std::size_t i = 0; i < r.steps.size() && r.steps[i].time < k.time; i += 40)
            spin.add(r.steps[i].time, housner(half, alpha, theta, r.steps[i].time),
                     r.quantity("body_spin_y", int(i)));
        for (std::size_t i = 1; i < r.steps.size() && impact == 0; ++i) {
            const double w = r.quantity("body_spin_y", int(i)),
                         old = r.quantity("body_spin_y", int(i) - 1);
            if (std::abs(w) < 0.99 * std::abs(old) && std::abs(old) > 0.5 * std::abs(k.before)) {
                impact = r.steps[i].time;
                before = old;
                after = w;
            }
        }
        // Gravity continues within the blow's step, about the new edge and against the spin.
        const double ratio = (after - 0.75 * kG / half * std::sin(alpha) * h) / before;
        rows.push_back(relative(fmt::format("time to the first impact, width {}", k.width), k.time,
                                impact, 2e-3));
        rows.back().curve = std::move(spin);
        rows.push_back(
            relative(fmt::format("spin before it, width {}", k.width), k.before, before, 2e-3));
        rows.push_back(
            relative(fmt::format("spin after over before, width {}, the blow alone", k.width),
                     k.ratio, blow(k.width, k.before), 1e-6));
        rows.push_back(
            relative(fmt::format("spin after over before, width {}, step 0.2 ms", k.width), k.ratio,
                     ratio, 1e-4));
    }
    return rows;
}

} // namespace amontons::validation
