#include "mesh/tests/relative.hpp"
#include "solver/scene/tests/issues_of.hpp"
#include "solver/step/tests/body_runs.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <numbers>
#include <utility>

// Instruments that touch more than walls: rods fed from a sheath in one problem with all bodies.

using namespace amontons;
using test::relative;

namespace {

constexpr double kMass = 2e-4, kFriction = 0.3, kSide = 0.004;

/// A wire at the middle height of a free body of 4 mm on a floor, fed by 35 mm.
std::string pushed(const char* shape, int steps, const char* extra = "")
{
    return fmt::format(R"("gravity": [0, 0, -9.81], "bodies": {{
        "floor": {{"kind": "obstacle", "surface": {{"generate": "plane"}}}},
        "body": {{"kind": "rigid", "shape": {{{0}}}, "mass": {1}, "start": {{"place": [0.022, 0, {2}]}}}},
        "wire": {{"kind": "beam", "segments": [{{"length": 0.1, "radius": 2e-4, "EI": 1e-3,
            "element": 2.5e-3}}], "introducer": {{"at": [0, 0, {2}], "direction": [1, 0, 0]}},
            "drive": {{"insertion": [[0, 0.005], [1, 0.04]]}}}}{5}}},
        "contact": [{{"between": ["body", "floor"], "friction": {3}}},
                    {{"between": ["wire", "body"]}}],
        "time": {{"step": {4}, "end": 1}})",
                       shape, kMass, kSide / 2, kFriction, 1.0 / steps, extra);
}

/// What is wrong with a scene of these members beside "schema".
std::string wrong_in(const std::string& rest, const std::vector<std::string>& overrides = {})
{
    return issues_of("{\"schema\": 1, " + rest + "}", overrides);
}

/// Two wires, side by side in a tube that bends by 90 degrees over `radius`, pressed on its end.
std::string side_by_side(double radius, double fed, double friction)
{
    const double straight = 0.02, bend = 0.5 * std::numbers::pi * radius;
    const double out = straight + bend + straight - 0.002;
    std::string wires, pairs;
    for (int w = 0; w < 2; ++w) {
        wires +=
            fmt::format(R"("w{0}": {{"kind": "beam", "segments": [{{"length": 0.3,
            "radius": 4e-4, "EI": {1}, "element": 2e-3}}], "contact_spacing": 1e-3,
            "introducer": {{"at": [0.001, 0, {2}], "direction": [1, 0, 0]}},
            "drive": {{"insertion": [[0, 0.01], [1, {3}], [2, {4}]]}}}},)",
                        w, w == 0 ? 2e-4 : 1e-4, w == 0 ? 5e-4 : -5e-4, out - 0.002, out + fed);
        for (const char* wall : {"tube", "end"})
            pairs +=
                fmt::format(R"({{"between": ["w{}", "{}"], "friction": {}}},)", w, wall, friction);
    }
    return fmt::format(R"("bodies": {{{0}
        "end": {{"kind": "obstacle", "surface": {{"generate": "plane", "centre": [{1}, {2}, 0],
            "axis": [0, -1, 0]}}}},
        "tube": {{"kind": "obstacle", "surface": {{"generate": "tube", "radius": 0.0011,
            "centreline": {{"normal": [0, 1, 0], "pieces": [{{"length": {3}}},
                {{"radius": {4}, "angle": {5}}}, {{"length": 0.03}}]}}}}}}}},
        "contact": [{6} {{"between": ["w0", "w1"], "friction": {7}}}],
        "time": {{"step": 0.05, "end": 2}})",
                       wires, straight + radius, radius + straight, straight, radius,
                       0.5 * std::numbers::pi, pairs, friction);
}

/// A prism on three feet, which a tip that does not slip on it pushes beside its middle at a
/// height: at rest the floor's friction, against the motion of each foot, has no moment about the
/// tip, and what the feet carry is determined.
struct Prism {
    double side = 0.006, height = 0.003, mass = 2e-4, friction = 0.3;
    double tip_radius = 2e-4, tip_height = 0.001, aside = 6e-4;

    std::array<Eigen::Vector2d, 3> feet() const
    {
        return {{{-side / 3, -side / 2}, {-side / 3, side / 2}, {2 * side / 3, 0}}};
    }
};

struct PrismState {
    Vec3 pose;   ///< x, y, turn
    double push; ///< along the wire [N]
};

/// The prism's velocity by the tip's way, and the push.
PrismState slide(const Prism& prism, const Vec3& pose, double tip)
{
    const Eigen::Rotation2Dd turned(pose.z());
    const Eigen::Vector2d middle = pose.head<2>();
    const Eigen::Vector2d touched =
        Eigen::Vector2d(tip, 0) + prism.tip_radius * (turned * Eigen::Vector2d::UnitX());
    const auto across = [](const Eigen::Vector2d& x) { return Eigen::Vector2d(-x.y(), x.x()); };
    Eigen::Vector2d force;
    const auto moment = [&](double spin) { // about the tip
        Mat3 balance;
        std::array<Eigen::Vector2d, 3> foot, against;
        for (int k = 0; k < 3; ++k) {
            foot[k] = middle + turned * prism.feet()[k];
            against[k] =
                -(Eigen::Vector2d::UnitX() + spin * across(foot[k] - touched)).normalized();
            balance.col(k) = Vec3(1, foot[k].y(), foot[k].x());
        }
        const double weight = prism.mass * kGravity;
        Vec3 carried = Vec3::Constant(weight / 3);
        for (int i = 0; i < 60; ++i) { // the tip's height moves loads to the feet before it
            force.setZero();
            for (int k = 0; k < 3; ++k)
                force -= prism.friction * carried[k] * against[k];
            carried =
                balance.inverse() * Vec3(weight, weight * middle.y() + prism.tip_height * force.y(),
                                         weight * middle.x() + prism.tip_height * force.x());
        }
        double sum = 0;
        for (int k = 0; k < 3; ++k)
            sum += prism.friction * carried[k] * across(foot[k] - touched).dot(against[k]);
        return sum;
    };
    double low = -2000, high = 2000; // [rad/m]
    const bool sign = moment(low) > 0;
    for (int i = 0; i < 60; ++i)
        ((moment(0.5 * (low + high)) > 0) == sign ? low : high) = 0.5 * (low + high);
    moment(low);
    const Eigen::Vector2d v = Eigen::Vector2d::UnitX() + low * across(middle - touched);
    return {{v.x(), v.y(), low}, force.x()};
}

} // namespace

TEST_CASE("a wire pushes a free box with what its friction holds, in any number of steps")
{
    const double held = kFriction * kMass * kGravity;
    for (const int steps : {7, 20, 50}) {
        CAPTURE(steps);
        const Result r = done(pushed(R"("generate": "box", "size": [0.004, 0.004, 0.004])", steps));
        CHECK(r.value("wire_push_force") == relative(held).epsilon(1e-5));
        CHECK(r.value("body_x") == relative(0.0422).epsilon(1e-6)); // its tip is round
        CHECK(r.value("wire_tip_x") == relative(0.04).epsilon(1e-6));
        // Less what the push takes of 60 mm in the introducer, EA 1e5 N.
        CHECK(r.value("wire_depth") == relative(0.04 - held * 0.06 / 1e5).epsilon(1e-11));
        CHECK(r.value("wire_clustered_force") == relative(held).epsilon(1e-5));
        CHECK(r.summary.uncertified_steps == 0);
        // Names of contacts: floor, then the scene's bodies in its order.
        const auto& contacts = r.records.back().contacts;
        CHECK(std::ranges::any_of(contacts, [](const ContactRecord& c) {
            return std::max(c.body_a, c.body_b) == 2 && std::min(c.body_a, c.body_b) == 1;
        }));
    }
}

TEST_CASE("a wire that does not slip on a body turns it where it pushes beside its middle")
{
    const Prism prism;
    const double way = 0.004;
    constexpr int kWays = 100;
    Vec3 pose(prism.tip_radius + prism.side / 3, prism.aside, 0);
    for (int i = 0; i < kWays; ++i) { // midpoint rule
        const double d = way / kWays, tip = i * d;
        const Vec3 half = pose + 0.5 * d * slide(prism, pose, tip).pose;
        pose += d * slide(prism, half, tip + 0.5 * d).pose;
    }
    const double push = slide(prism, pose, way).push;
    std::string feet;
    for (const Eigen::Vector2d& f : prism.feet())
        feet += fmt::format("{}[{}, {}]", feet.empty() ? "" : ", ", f.x(), f.y());
    for (const int steps : {10, 40}) { // of first order
        CAPTURE(steps);
        const Result r = done(fmt::format(
            R"("gravity": [0, 0, -9.81], "bodies": {{
            "floor": {{"kind": "obstacle", "surface": {{"generate": "plane"}}}},
            "body": {{"kind": "rigid", "shape": {{"generate": "wedge", "points": [{0}], "length": {1}}},
                "mass": {2}, "start": {{"place": [{3}, {4}, {5}]}}}},
            "wire": {{"kind": "beam", "segments": [{{"length": 0.1, "radius": {6}, "EI": 1e-3,
                "element": 2.5e-3}}], "introducer": {{"at": [-0.01, 0, {7}], "direction": [1, 0, 0]}},
                "drive": {{"insertion": [[0, 0.01], [1, {8}]]}}}}}},
            "contact": [{{"between": ["body", "floor"], "friction": {9}}},
                        {{"between": ["wire", "body"], "friction": 0.6}}],
            "time": {{"step": {10}, "end": 1}})",
            feet, prism.height, prism.mass, prism.tip_radius + prism.side / 3, prism.aside,
            prism.height / 2, prism.tip_radius, prism.tip_height, 0.01 + way, prism.friction,
            1.0 / steps));
        CHECK(r.summary.steps == steps);
        CHECK(r.value("body_turn_z") == relative(pose.z()).epsilon(0.4 / steps));
        CHECK(r.value("body_y") - prism.aside ==
              relative(pose.y() - prism.aside).epsilon(0.4 / steps));
        CHECK(r.value("wire_push_force") == relative(push).epsilon(0.02 / steps));
    }
}

TEST_CASE(
    "a wire that pushes a cylinder beside its middle cuts no step, and its turn is of first order")
{
    // Only the direction of the floor's friction holds the cylinder: multipliers of the size that
    // the wire's compliance has would move it by a thousandth of its way each.
    const double radius = 0.002, tip = 2.5e-4, aside = 3e-4, place = 0.01;
    const double touch = place - std::sqrt((radius + tip) * (radius + tip) - aside * aside);
    std::array<double, 3> turn{};
    for (std::size_t i = 0; i < turn.size(); ++i) {
        const int steps = 5 << i;
        CAPTURE(steps);
        const Result r = done(fmt::format(
            R"("gravity": [0, 0, -9.81], "bodies": {{
            "floor": {{"kind": "obstacle", "surface": {{"generate": "plane"}}}},
            "body": {{"kind": "rigid", "shape": {{"generate": "cylinder", "radius": {0},
                "length": {1}}}, "density": 1584, "start": {{"place": [{2}, {3}, {0}]}}}},
            "wire": {{"kind": "beam", "segments": [{{"length": 0.035, "radius": {4}, "EI": 4e-4,
                "element": 2.5e-3}}], "introducer": {{"at": [0, 0, {0}], "direction": [1, 0, 0]}},
                "drive": {{"insertion": [[0, {5}], [1, {6}]]}}}}}},
            "contact": [{{"between": ["body", "floor"], "friction": 0.2}},
                        {{"between": ["wire", "body"], "friction": 0.25}}],
            "time": {{"step": {7}, "end": 1}})",
            radius, 2 * radius, place, -aside, tip, touch - 1e-7, touch + 0.004, 1.0 / steps));
        CHECK(r.summary.steps <= steps + 2); // 58 with multipliers of that size
        turn[i] = r.value("body_turn_z");
    }
    CHECK(turn[0] - turn[1] == relative(2 * (turn[1] - turn[2])).epsilon(0.25));
}

TEST_CASE("a wire with a density sinks by its weight, alone and beside a body that is far away")
{
    // A hollow cantilever under its own weight: w L^4 / (8 EI) at its end.
    const double length = 0.06, radius = 4e-4, bore = 3e-4, density = 8000, EI = 5e-4;
    const double weight = density * std::numbers::pi * (radius * radius - bore * bore) * kGravity;
    const std::string far = R"("ball": {"kind": "rigid", "shape": {"generate": "ball",
        "radius": 0.01}, "start": {"place": [5, 5, 5]}, "drive": {"x": 0, "y": 0, "z": 0}},)";
    std::vector<double> sunk;
    for (const std::string& beside : {std::string(), far}) {
        const Result r = done(fmt::format(R"("gravity": [0, 0, -9.81], "bodies": {{{}
            "wire": {{"kind": "beam", "segments": [{{"length": 0.2, "radius": {}, "inner_radius": {},
                "EI": {}, "element": 2.5e-3, "density": {}}}], "introducer": {{"direction": [1, 0, 0]}},
                "drive": {{"insertion": [[0, 0.05], [1, {}]]}}}}}},
            "time": {{"step": 0.1, "end": 1}})",
                                          beside, radius, bore, EI, density, length));
        CHECK(r.summary.uncertified_steps == 0);
        sunk.push_back(r.value("wire_tip_z"));
    }
    CHECK(sunk[0] == relative(-weight * std::pow(length, 4) / (8 * EI)).epsilon(5e-3));
    CHECK(sunk[0] == relative(sunk[1]).epsilon(1e-9));
}

TEST_CASE("a free ball rolls before a wire, which needs no force for it")
{
    for (const int steps : {10, 50}) {
        CAPTURE(steps);
        const Result r = done(pushed(R"("generate": "ball", "radius": 0.002)", steps));
        CHECK(std::abs(r.value("wire_push_force")) < 1e-6 * kMass * kGravity);
        CHECK(r.value("body_x") == relative(0.0422).epsilon(1e-6));
        const double turned = std::remainder(0.0202 / 0.002, 2 * std::numbers::pi);
        CHECK(r.value("body_turn_y") == relative(turned).epsilon(1e-6));
        CHECK(r.summary.steps < 2 * steps);
    }
}

TEST_CASE("a ball that a wire pushes aside without a force does not spin about its normal")
{
    // 0.6 and 1 mm beside its middle, with friction: it rolls out of the tip's way.
    for (const auto& [aside, steps] : {std::pair{6e-4, 20}, std::pair{1e-3, 7}}) {
        const Result r = run(pushed(R"("generate": "ball", "radius": 0.002)", steps),
                             {fmt::format("bodies.body.start.place=[0.022,{},0.002]", aside),
                              "contact.1.friction=0.4"});
        REQUIRE_MESSAGE(r.summary.message == "", r.summary.message);
        const auto turn = [&](std::size_t step) {
            const Vec3 v = r.vector("body_turn", step);
            return Eigen::Quaterniond(Eigen::AngleAxisd(v.norm(), v.stableNormalized()));
        };
        double most = 0;
        for (std::size_t i = 1; i < r.records.size(); ++i) {
            CHECK(std::abs(r.value("wire_push_force", i)) < 1e-8 * kMass * kGravity);
            const Eigen::AngleAxisd of_step(turn(i) * turn(i - 1).conjugate());
            most = std::max(most, std::abs(of_step.angle() * of_step.axis().z()));
        }
        CHECK(most < 1e-9);
        CHECK(std::abs(r.value("body_y")) > aside + 1e-3);
    }
}

TEST_CASE("the wall of a bend holds two wires side by side with their thrusts over its radius" *
          doctest::test_suite("slow"))
{
    const double radius = 0.08;
    const Result r = done(side_by_side(radius, 3e-3, 0));
    const StepRecord& last = r.records.back();
    CHECK(r.summary.uncertified_steps == 0);
    // Between two directions of the bend its wall turns the thrust from one to the other. Contacts
    // are 3 % of such a window apart: the mean over several windows is taken.
    double found = 0, expected = 0;
    for (int k = 0; k < 16; ++k) {
        const double from = 0.25 + 0.004 * k, to = 1.3 - 0.003 * k;
        const auto in_bend = [&](const Vec3& x) {
            const double angle = std::atan2(x.x() - 0.02, radius - x.y());
            return x.x() > 0.02 && angle > from && angle < to;
        };
        double thrust = 0; // of both: the mean of each in the bend
        for (const BeamRecord& beam : last.beams) {
            const auto axial = std::ranges::find(beam.fields, "axial_force", &Field::name);
            double sum = 0;
            int nodes = 0;
            for (std::size_t i = 0; i < beam.points.size(); ++i)
                if (in_bend(beam.points[i])) {
                    sum -= axial->values[i];
                    ++nodes;
                }
            REQUIRE(nodes > 20);
            thrust += sum / nodes;
        }
        CHECK(thrust > 10); // pressed on the wall all along
        Vec3 wall = Vec3::Zero();
        for (const ContactRecord& c : last.contacts)
            if (std::min(c.body_a, c.body_b) == 1 && in_bend(c.point))
                wall += c.body_a >= 2 ? c.force : Vec3(-c.force);
        found += wall.norm();
        expected += thrust * 2 * std::sin(0.5 * (to - from));
    }
    CHECK(found == relative(expected).epsilon(0.01));
}

TEST_CASE("a wire bends a bar that is held at both ends by 192 EI / L^3, and is pushed with that")
{
    const double EI = 1e-3, L = 0.1, way = 5e-5, wire = 2e-4, bar = 5e-4;
    const Result r = done(fmt::format(R"("bodies": {{
        "bar": {{"kind": "rod", "segments": [{{"length": {0}, "radius": {1}, "EI": {2}, "element": 5e-3}}],
                 "shape": {{"start": [0.03, -0.05, 0], "direction": [0, 1, 0]}},
                 "hold": [{{"set": "start"}}, {{"set": "end"}}]}},
        "wire": {{"kind": "beam", "segments": [{{"length": 0.1, "radius": {3}, "EI": 1e-3,
            "element": 2.5e-3}}], "drive": {{"insertion": [[0, 0.01], [1, {4}]]}}}}}},
        "contact": [{{"between": ["wire", "bar"], "friction": 0.3}}],
        "time": {{"step": 0.1, "end": 1}})",
                                      L, bar, EI, wire, 0.03 - bar - wire + way));
    CHECK(r.value("wire_push_force") == relative(192 * EI / (L * L * L) * way).epsilon(0.01));
    CHECK(r.summary.uncertified_steps == 0);
}

TEST_CASE("a wire is pushed with what it exerts on a solid")
{
    const Result r = done(R"("bodies": {
        "block": {"kind": "solid", "mesh": {"generate": "box", "size": [0.02, 0.02, 0.02], "cells": [3, 3, 3],
            "element": "T10", "centre": [0.03, 0, 0]}, "youngs_modulus": 1e5, "poisson_ratio": 0.3,
            "hold": [{"set": "x_max"}]},
        "wire": {"kind": "beam", "segments": [{"length": 0.1, "radius": 1e-3, "EI": 1e-3,
            "element": 2.5e-3}], "drive": {"insertion": [[0, 0.01], [1, 0.0195]]}}},
        "contact": [{"between": ["wire", "block"], "friction": 0.3}],
        "time": {"step": 0.1, "end": 1})");
    const double push = r.value("wire_push_force");
    CHECK(push > 0.01);
    // But for M^2 / (2 EI) of its bending where it leaves the introducer.
    CHECK(r.value("block_x_max_force_x") == relative(-push).epsilon(2e-4));
    CHECK(r.summary.uncertified_steps == 0);
}

namespace {

/// Two wires in a tube of 4.6 radii that bends out of their plane: they cross there, and lie along
/// each other. In other axes and units.
/// @param length, force  of the units
std::string wires_in_bend(const Mat3& turn, double length, double force)
{
    const auto place = [&](double x, double y, double z) {
        const Vec3 v = length * (turn * Vec3(x, y, z));
        return fmt::format("[{:.17g}, {:.17g}, {:.17g}]", v.x(), v.y(), v.z());
    };
    const auto direction = [&](double x, double y, double z) {
        const Vec3 v = turn * Vec3(x, y, z);
        return fmt::format("[{:.17g}, {:.17g}, {:.17g}]", v.x(), v.y(), v.z());
    };
    const auto wire = [&](const char* name, double out, double EI, double side, double begins) {
        return fmt::format(
            R"("{}": {{"kind": "beam", "segments": [{{"length": {:.17g}, "radius": {:.17g},
                "EI": {:.17g}, "element": {:.17g}}}], "introducer": {{"at": {}, "direction": {},
                "normal": {}}}, "drive": {{"insertion": [[0, {:.17g}], [{}, {:.17g}], [1, {:.17g}]],
                "twist": [[0, 0], [1, {}]]}}}})",
            name, length * (out + 0.02), length * 0.0004044, length * length * force * EI,
            length * 0.0025, place(0.001, side * 0.0005795, side * 0.0001793), direction(1, 0, 0),
            direction(0, 1, 0), length * 0.005, begins, length * 0.005, length * out, 1.2 * side);
    };
    return fmt::format(
        R"("bodies": {{"tube": {{"kind": "obstacle", "surface": {{"generate": "tube",
            "radius": {:.17g}, "centreline": {{"start": {}, "direction": {}, "normal": {},
            "pieces": [{{"length": {:.17g}}}, {{"radius": {:.17g}, "angle": 0.8188,
            "direction": 1.457}}, {{"length": {:.17g}}}]}}}}}}, {}, {}}},
        "contact": [{{"between": ["tube", "w0"], "friction": 0.08305}},
                    {{"between": ["tube", "w1"], "friction": 0.08305}},
                    {{"between": ["w0", "w1"], "friction": 0.08305}}],
        "time": {{"step": 0.05, "end": 1}})",
        length * 0.001842, place(0, 0, 0), direction(1, 0, 0), direction(0, 1, 0), length * 0.02,
        length * 0.0631, length * 0.1, wire("w0", 0.06247, 1.164e-4, 1, 0.1583),
        wire("w1", 0.07487, 2.433e-4, -1, 0.3447));
}

} // namespace

TEST_CASE("wires that cross in a bend and lie along each other depend on no axes and no units")
{
    const Mat3 turn = Eigen::AngleAxisd(2.1, Vec3(0.3, -0.5, 0.8).normalized()).toRotationMatrix();
    const Mat3 none = Mat3::Identity();
    const Result r = done(wires_in_bend(none, 1, 1)), other = done(wires_in_bend(turn, 1, 1)),
                 small = done(wires_in_bend(none, std::ldexp(1, -10), 8));
    REQUIRE(other.records.size() == r.records.size());
    REQUIRE(small.records.size() == r.records.size());
    double most = 0;
    for (std::size_t i = 0; i < r.records.size(); ++i) {
        const double push = r.value("w0_push_force", i);
        most = std::max(most, push);
        CHECK(std::abs(other.value("w0_push_force", i) - push) <= 1e-6 * most + 1e-12);
        CHECK(std::abs(small.value("w0_push_force", i) / 8 - push) <= 1e-8 * most + 1e-12);
    }
    CHECK(most > 0.02);
    CHECK(other.summary.energy.friction == relative(r.summary.energy.friction).epsilon(1e-6));
}

TEST_CASE("a wire that comes round to its own sheath is pushed with all that acts on it")
{
    const Vec3 at(-0.007328, 0.003227, 0), along = Vec3(1, 0.2139, 0.1813).normalized();
    const double EI = 1.739e-5, radius = 4.499e-4, EA = 4 * EI / (radius * radius);
    const Result r = done(fmt::format(R"("bodies": {{
        "ball": {{"kind": "obstacle", "side": "inside", "surface": {{"generate": "ball",
            "radius": 0.00916}}}},
        "wire": {{"kind": "beam", "segments": [{{"length": 0.06317, "radius": {}, "EI": {},
            "element": 0.001145}}], "introducer": {{"at": [-0.007328, 0.003227, 0],
            "direction": [1, 0.2139, 0.1813]}}, "drive": {{"insertion": [[0, 0.002748],
            [1, 0.05317]]}}}}}},
        "contact": [{{"between": ["wire", "ball"], "friction": 0.2564}},
                    {{"between": ["wire", "wire"], "friction": 0.2564}}],
        "time": {{"step": 0.025, "end": 1}})",
                                      radius, EI));
    int self_contacts = 0;
    for (std::size_t i = 1; i < r.records.size(); ++i) {
        Vec3 force = Vec3::Zero(), moment = Vec3::Zero();
        double inside = 0, size = 0; // of forces along the sheath, on what is in it
        for (const ContactRecord& c : r.records[i].contacts) {
            Vec3 f = c.force;
            if (c.body_a == c.body_b) {
                if ((c.point - at).dot(along) > 0) continue; // nothing in all
                if (c.normal.dot(c.point - at) < 0) f = -f;  // on the part that is out
                inside -= f.dot(along);
                self_contacts += f.norm() > 0;
            }
            force += f;
            moment += (c.point - at).cross(f);
            size += f.norm();
        }
        // The energy that a length brings out: of bending, and of the stretch.
        const double push = r.value("wire_push_force", i), axial = force.dot(along);
        const double bending = (moment - moment.dot(along) * along).norm();
        CHECK(std::abs(push + axial + inside + bending * bending / (2 * EI) +
                       (axial * axial - push * push) / (2 * EA)) <= 2e-5 * size + 1e-9);
    }
    CHECK(self_contacts > 0);
}

TEST_CASE("a wire that is pressed on a solid buckles at Euler's load, whichever way it is turned")
{
    const double EI = 1.793e-5, out = 0.12;
    const double euler = 20.19 * EI / (out * out); // clamped, its end stays where it sticks
    for (const bool tilted : {false, true}) {
        CAPTURE(tilted);
        const char* place = tilted ? "[0.0003, -0.12, 0.0009]" : "[-0.12, 0.0003, 0.0009]";
        const char* direction = tilted ? "[0.01, 1, 0]" : "[1, 0.01, 0]";
        const Result r = done(fmt::format(R"("bodies": {{
            "block": {{"kind": "solid", "mesh": {{"generate": "box", "size": [0.03, 0.03, 0.03],
                "cells": [3, 3, 3], "element": "H8", "centre": {}}}, "youngs_modulus": 1e6,
                "poisson_ratio": 0.25, "hold": [{{"set": "{}_max"}}]}},
            "wire": {{"kind": "beam", "segments": [{{"length": 0.2, "radius": 9e-4, "EI": {},
                "element": 0.006}}], "introducer": {{"at": {}, "direction": {}}},
                "drive": {{"insertion": [[0, 0.1165], [1, 0.121]]}}}}}},
            "contact": [{{"between": ["wire", "block"], "friction": 0.45}}],
            "time": {{"step": 0.1, "end": 1}})",
                                          tilted ? "[0, 0.015, 0]" : "[0.015, 0, 0]",
                                          tilted ? "y" : "x", EI, place, direction));
        double most = 0;
        for (std::size_t i = 0; i < r.records.size(); ++i)
            most = std::max(most, r.value("wire_push_force", i));
        CHECK(most > 0.8 * euler);
        CHECK(most < 1.2 * euler);
    }
}

TEST_CASE("what instruments cannot do beside other bodies is reported with its place")
{
    const std::string good = pushed(R"("generate": "ball", "radius": 0.002)", 10);
    CHECK(wrong_in(good) == "");
    CHECK(wrong_in(good, {"time.kind=\"dynamic\"", "bodies.wire.segments.0.density=8000"}) == "");
    CHECK(has(wrong_in(good, {"bodies.wire.introducer.fade=0.005"}), "/introducer/fade"));
    CHECK(has(wrong_in(good, {"bodies.wire.segments.0.EI=0", "bodies.wire.segments.0.EA=100"}),
              "a cable"));
    CHECK(wrong_in(good, {"bodies.wire.drive.twist=[[0,0],[1,1]]"}) == "");
    CHECK(wrong_in(good, {"bodies.wire.segments.0.friction=0.2"}) == "");
    CHECK(has(wrong_in(good, {"contact.1.surfaces=[\"middle\",\"\"]"}), "/contact/1/surfaces/0"));
    CHECK(has(wrong_in(good, {"time.balance=\"course\""}), "/time/balance"));
    const std::string two = side_by_side(0.04, 0, 0);
    CHECK(wrong_in(two) == "");
    CHECK(has(wrong_in(two, {"bodies.w1.introducer.at=[0.001,0,0.0001]"}), "come out of one"));
    CHECK(has(wrong_in(two, {"contact.0.foundation=100"}), "/contact/0/foundation"));
}
