#include "haptics/device/recorded.hpp"
#include "haptics/link/body_link.hpp"
#include "haptics/link/settings.hpp"
#include "haptics/loop/haptic_loop.hpp"
#include "haptics/time/summary.hpp"
#include "haptics/time/virtual_time.hpp"
#include "mesh/tests/relative.hpp"
#include "solver/obstacle/build.hpp"
#include "solver/scene/read.hpp"
#include "solver/scene/tests/issues_of.hpp"

#include <algorithm>
#include <cmath>
#include <doctest/doctest.h>
#include <string>

using namespace amontons;

namespace {

/// An elastic tool on a clamped bed, coarse.
const char* const kBed = R"({
  "schema": 1,
  "bodies": {
    "bed": {"kind": "solid", "youngs_modulus": 1e5, "poisson_ratio": 0.3,
            "mesh": {"generate": "box", "size": [0.08, 0.04, 0.02], "cells": [8, 4, 2], "element": "H8"},
            "hold": [{"set": "z_min"}]},
    "tool": {"kind": "solid", "youngs_modulus": 1e5, "poisson_ratio": 0.3,
             "mesh": {"generate": "box", "size": [0.02, 0.02, 0.02], "cells": [3, 3, 3], "element": "H8"},
             "start": {"place": [0, 0, 0.0205]},
             "hold": [{"set": "z_max"}],
             "drive": {"z": [[0, 0], [0.6, 0], [1, -0.004]], "x": [[1, 0], [2, 0.01]]}}
  },
  "contact": [{"between": ["tool", "bed"], "friction": 0.3}],
  "haptic": {"handle": "tool", "device": "touch"},
  "time": {"step": 0.05, "end": 2}
})";

/// A rigid ball over a rigid floor.
const char* const kBall = R"({
  "schema": 1,
  "bodies": {
    "floor": {"kind": "obstacle", "surface": {"generate": "plane"}},
    "ball": {"kind": "rigid", "shape": {"generate": "ball", "radius": 0.01},
             "start": {"place": [0, 0, 0.011]}}
  },
  "contact": [{"between": ["ball", "floor"], "friction": 0.3}],
  "haptic": {"handle": "ball", "device": "touch"},
  "time": {"step": 0.05, "end": 2}
})";

/// A rigid ball over the middle of a rod that is clamped at both ends, in the way of a wire.
const char* const kBar = R"({
  "schema": 1,
  "bodies": {
    "bar": {"kind": "rod", "segments": [{"length": 0.1, "radius": 5e-4, "EI": 1e-3, "element": 5e-3,
                                         "density": 1000}],
            "shape": {"start": [0, -0.05, 0], "direction": [0, 1, 0]},
            "hold": [{"set": "start"}, {"set": "end"}]},
    "wire": {"kind": "beam", "segments": [{"length": 0.1, "radius": 2e-4, "EI": 1e-3, "element": 5e-3,
                                           "density": 1000}],
             "introducer": {"at": [0.05, 0, 0.0106], "direction": [-1, 0, 0]},
             "drive": {"insertion": [[0, 0.03], [10, 0.03]]}},
    "ball": {"kind": "rigid", "shape": {"generate": "ball", "radius": 0.01}, "mass": 0.01,
             "start": {"place": [0, 0, 0.0106]}}
  },
  "contact": [{"between": ["ball", "bar"], "friction": 0.3}, {"between": ["ball", "wire"]}],
  "haptic": {"handle": "ball", "device": "touch"},
  "time": {"step": 0.05, "end": 2}
})";

/// An elastic pad over the same rod.
const char* const kPad = R"({
  "schema": 1,
  "bodies": {
    "bar": {"kind": "rod", "segments": [{"length": 0.1, "radius": 5e-4, "EI": 1e-3, "element": 5e-3}],
            "shape": {"start": [0, -0.05, 0], "direction": [0, 1, 0]},
            "hold": [{"set": "start"}, {"set": "end"}]},
    "pad": {"kind": "solid", "youngs_modulus": 1e6, "poisson_ratio": 0.3,
            "mesh": {"generate": "box", "size": [0.01, 0.01, 0.01], "cells": [2, 2, 2], "element": "H8"},
            "start": {"place": [0, 0, 0.0056]}, "hold": [{"set": "z_max"}], "drive": {"z": 0}}
  },
  "contact": [{"between": ["pad", "bar"], "friction": 0.3}],
  "haptic": {"handle": "pad", "device": "touch"},
  "time": {"step": 0.05, "end": 2}
})";

// ---- A handle in series with what it presses or pulls

/// A bar of 0.01 x 0.01 x 0.05 m with nu = 0: EA / L = 200 N/m.
const std::string kBarOf = R"({"kind": "solid", "youngs_modulus": 1e5, "poisson_ratio": 0,
    "mesh": {"generate": "box", "size": [0.01, 0.01, 0.05], "cells": [2, 2, 5], "element": "H8"},
    "start": {"place": [0, 0, 0.025]}, )";
constexpr double kOfBar = 200;

std::string in_hand(const std::string& handle, const std::string& bodies, const std::string& more)
{
    return R"({"schema": 1, "bodies": {)" + bodies + "}, " + more + R"(, "haptic": {"handle": ")" +
           handle + R"(", "device": "touch"}, "time": {"step": 0.05, "end": 2}})";
}

struct InSeries {
    std::string what, scene;
    double own; ///< [N/m]
    double way; ///< up [m], of which ...
    double gap; ///< ... this is free
    double tolerance;
};

std::vector<InSeries> handles_in_series()
{
    const auto touch = [](const char* a, const char* b) {
        return std::string(R"("contact": [{"between": [")") + a + R"(", ")" + b +
               R"("], "friction": 0.3}])";
    };
    const auto couple = [](const char* kind, const char* body, const char* place,
                           const char* more = "") {
        return std::string(R"("couplings": [{"kind": ")") + kind + R"(", "between": ["handle", ")" +
               body + R"("], "at": )" + place + more + "}]";
    };
    const std::string floor =
        R"("floor": {"kind": "obstacle", "surface": {"generate": "plane", "centre": [0, 0, -0.0005]}})";
    const std::string small =
        R"("handle": {"kind": "rigid", "shape": {"generate": "ball", "radius": 0.002},
        "start": {"place": )";
    const double EI = 1e-3, L = 0.05;
    const std::string wire =
        R"("wire": {"kind": "beam", "segments": [{"length": 0.1, "radius": 5e-4,
        "EI": 1e-3, "element": 2.5e-3}], "introducer": {"at": [0, 0, 0], "direction": [1, 0, 0]},
        "drive": {"insertion": [[0, 0.05], [10, 0.05]]}})";
    return {
        {"a rigid body on a solid",
         in_hand("handle",
                 R"("bar": )" + kBarOf + R"("hold": [{"set": "z_min"}]}, "handle": {"kind": "rigid",
                 "shape": {"generate": "box", "size": [0.02, 0.02, 0.01]},
                 "start": {"place": [0, 0, 0.0555]}})",
                 touch("handle", "bar")),
         kOfBar, -1e-3, 5e-4, 1e-6},
        {"a solid on an obstacle",
         in_hand("bar",
                 R"("bar": )" + kBarOf + R"("hold": [{"set": "z_max"}], "drive": {"z": 0}}, )" +
                     floor,
                 touch("bar", "floor")),
         kOfBar, -1e-3, 5e-4, 1e-6},
        {"a solid on a weld",
         in_hand("handle",
                 R"("bar": )" + kBarOf + R"("hold": [{"set": "z_min"}]}, )" + small +
                     "[0, 0, 0.05]}}",
                 couple("weld", "bar", "[0, 0, 0.05]", R"(, "set": "z_max")")),
         kOfBar, 1e-3, 0, 1e-6},
        {"a clamped rod on a ball joint",
         in_hand("handle",
                 R"("rod": {"kind": "rod", "segments": [{"length": 0.05, "radius": 5e-4, "EI": 1e-3,
                     "element": 5e-3}], "shape": {"start": [0, 0, 0], "direction": [1, 0, 0]},
                     "hold": [{"set": "start"}]}, )" +
                     small + "[0.05, 0, 0]}}",
                 couple("ball", "rod", "[0.05, 0, 0]")),
         3 * EI / (L * L * L), 2e-4, 0, 1e-3},
        {"the tip of a wire on a ball joint",
         in_hand("handle", wire + ", " + small + "[0.05, 0, 0]}}",
                 couple("ball", "wire", "[0.05, 0, 0]")),
         3 * EI / (L * L * L), 2e-4, 0, 0.01},
        {"a rigid body on the tip of a catheter with a wire in it, which fills its bore nearly",
         in_hand("handle",
                 replaced(wire, "\"radius\": 5e-4", "\"radius\": 4.99e-4") +
                     R"(, "catheter": {"kind": "beam", "segments": [{"length": 0.1, "radius": 8e-4,
                     "inner_radius": 5e-4, "EI": 2e-3, "element": 2.5e-3}],
                     "introducer": {"at": [0, 0, 0], "direction": [1, 0, 0]},
                     "drive": {"insertion": [[0, 0.05], [10, 0.05]]}}, )" +
                     small + "[0.05, 0, 0.0029]}}",
                 R"("contact": [{"between": ["handle", "catheter"]},
                     {"between": ["wire", "catheter"], "friction": 0}])"),
         3 * (EI + 2e-3) / (L * L * L), -3e-4, 1e-4, 0.03},
        {"a stiff solid on a wire, at the edge of the solid",
         in_hand("pad",
                 R"("pad": {"kind": "solid", "youngs_modulus": 1e8, "poisson_ratio": 0.3,
                     "mesh": {"generate": "box", "size": [0.02, 0.01, 0.01], "cells": [2, 2, 2],
                     "element": "H8"}, "start": {"place": [0.055, 0, 0.0056]},
                     "hold": [{"set": "z_max"}], "drive": {"z": 0}}, )" +
                     wire,
                 touch("pad", "wire")),
         3 * EI / (0.045 * 0.045 * 0.045), -4e-4, 1e-4, 0.03}};
}

/// A rigid ball on a spring.
const char* const kSpring = R"({
  "schema": 1,
  "bodies": {
    "ball": {"kind": "rigid", "shape": {"generate": "ball", "radius": 0.01}},
    "floor": {"kind": "obstacle", "surface": {"generate": "plane", "centre": [0, 0, -0.1]}}
  },
  "couplings": [{"kind": "spring", "between": ["ball", "world"], "at": [0, 0, 0], "to": [0, 0, 0.1],
                 "stiffness": 300}],
  "contact": [{"between": ["ball", "floor"], "friction": 0.3}],
  "haptic": {"handle": "ball", "device": "touch"},
  "time": {"step": 0.05, "end": 2}
})";

/// A small rigid ball 20 mm above a plate 1 mm thick that is held still.
const char* const kPlate = R"({
  "schema": 1,
  "bodies": {
    "plate": {"kind": "rigid", "shape": {"generate": "box", "size": [0.2, 0.2, 0.001]},
              "drive": {"z": [[0, 0], [1, 0]]}},
    "ball": {"kind": "rigid", "shape": {"generate": "ball", "radius": 0.002},
             "start": {"place": [0, 0, 0.0225]}}
  },
  "contact": [{"between": ["ball", "plate"], "friction": 0.3}],
  "haptic": {"handle": "ball", "device": "omega.3"},
  "time": {"step": 0.02, "end": 1}
})";

struct BodyWorld {
    Scene scene;
    std::vector<Obstacle> obstacles;
    HapticSettings set;
    BodyLink link;

    explicit BodyWorld(const char* text, double rate = 50)
        : scene(parse_scene(text, "test.json"))
        , obstacles(build_obstacles(scene))
        , set(settings(scene, rate))
        , link(scene, obstacles, set.link)
    {
    }
    static HapticSettings settings(const Scene& scene, double rate)
    {
        HapticInput input = scene.haptic;
        input.simulation_rate = rate;
        return make_settings(input, device_profile(input.device), 0);
    }
};

HandPose at(const HandPose& start, const Vec3& shift)
{
    return {start.position + shift, start.rotation};
}

} // namespace

TEST_CASE("a rigid handle on a floor hangs on its spring: F = k depth and slides at mu F")
{
    BodyWorld w(kBall);
    const double k = w.set.link.spring.stiffness;
    CHECK(k == 400); // of the profile
    REQUIRE(w.link.step(w.link.start()));
    CHECK(w.link.held().force().force.norm() == 0);
    REQUIRE(w.link.step(at(w.link.start(), {0, 0, -0.003}))); // 2 mm below the floor
    CHECK(w.link.held().force().force.z() == doctest::Approx(k * 0.002).epsilon(1e-9));
    CHECK(w.link.held().pose().position.z() == doctest::Approx(0.01).epsilon(1e-9));
    REQUIRE(w.link.step(at(w.link.start(), {0.01, 0, -0.003})));
    CHECK(w.link.held().force().force.x() == doctest::Approx(-0.3 * k * 0.002).epsilon(1e-6));
    CHECK(w.link.report().error <= w.link.report().threshold);
}

TEST_CASE("a hand presses a ball on a clamped rod by 192 EI / L^3, and on a wire beside it")
{
    const double own = 192 * 1e-3 / std::pow(0.1, 3); // [N/m]
    for (const bool moving : {false, true}) {
        CAPTURE(moving);
        std::string text = kBar;
        if (moving)
            text.replace(text.find(R"("step": 0.05)"), 12, R"("kind": "dynamic", "step": 0.05)");
        BodyWorld w(text.c_str());
        const double k = w.set.link.spring.stiffness;
        REQUIRE(w.link.step(w.link.start()));
        const HandPose down = at(w.link.start(), {0, 0, -2e-4}); // 0.1 mm below where it touches
        for (int i = 0; i < (moving ? 60 : 2); ++i)
            REQUIRE(w.link.step(down));
        CHECK(w.link.held().force().force.z() ==
              test::relative(k * own / (k + own) * 1e-4).epsilon(0.01));
        CHECK(w.link.beam_records().size() == 2);
        CHECK(w.link.body_records().size() == 1);
        // The operator has the same compliance: a little deeper, before the next step.
        ReducedOperator<double> op(300);
        REQUIRE(w.link.publish(op, 0.1, 1));
        if (moving) continue; // inertia of the rod resists, within a step
        ProxyOptions options;
        options.tolerance = 1e-10;
        options.max_sweeps = 2000;
        ProxyLoop<double> loop(300, options);
        REQUIRE(loop.take(op, 0));
        HandPose deeper = down;
        deeper.position.z() -= 2e-5;
        CHECK(loop.tick(deeper, 1e-3).wrench.force.z() ==
              test::relative(k * own / (k + own) * 1.2e-4).epsilon(0.01));
        // Towards the tip of the wire, which is round and ends 0.2 mm beyond what is out.
        for (int i = 1; i <= 21; ++i)
            REQUIRE(w.link.step(at(w.link.start(), {5e-4 * i, 0, 0})));
        CHECK(w.link.held().force().force.x() == test::relative(-k * 7e-4).epsilon(0.01));
    }
}

TEST_CASE("a hand is in series with what it presses and pulls")
{
    for (const InSeries& c : handles_in_series()) {
        CAPTURE(c.what);
        BodyWorld w(c.scene.c_str());
        const double k = w.set.link.spring.stiffness;
        // Nothing acts yet: a balance, whatever round-off there is.
        REQUIRE_MESSAGE(w.link.step(w.link.start()), w.link.refusal());
        CHECK(w.link.held().force().force.norm() < 1e-9 * k * std::abs(c.way));
        for (const double share : {0.5, 1.0})
            REQUIRE_MESSAGE(w.link.step(at(w.link.start(), {0, 0, share * c.way})),
                            w.link.refusal());
        const double pressed = c.way + (c.way < 0 ? c.gap : -c.gap);
        CHECK(w.link.held().force().force.z() ==
              doctest::Approx(-k * c.own / (k + c.own) * pressed).epsilon(c.tolerance));
    }
}

TEST_CASE("a hand that pulls at a spring feels it beside its own")
{
    BodyWorld w(kSpring);
    const double k = w.set.link.spring.stiffness, own = 300;
    REQUIRE(w.link.step(w.link.start()));
    REQUIRE(w.link.step(at(w.link.start(), {0, 0, -0.002})));
    CHECK(w.link.held().force().force.z() ==
          test::relative(k * own / (k + own) * 0.002).epsilon(1e-6));
}

TEST_CASE(
    "a rigid handle whose pairs are written as a wildcard touches what stands still with their law")
{
    // By itself "*" leaves out pairs of what is driven and what stands still.
    std::string every = kBall, both = kBall, own = kPlate;
    const auto replace = [](std::string& text, const std::string& what, const std::string& by) {
        REQUIRE(text.find(what) != std::string::npos);
        text.replace(text.find(what), what.size(), by);
    };
    replace(every, R"("ball", "floor"])", R"("ball", "*"])");
    replace(both, R"("ball", "floor"])", R"("*", "*"])");
    replace(own, R"("contact": [)", R"("contact": [{"between": ["*", "*"], "friction": 0}, )");
    for (const std::string& text : {every, both}) {
        BodyWorld w(text.c_str());
        REQUIRE(w.link.step(w.link.start()));
        REQUIRE(w.link.step(at(w.link.start(), {0, 0, -0.003})));
        CHECK(w.link.held().force().force.z() == doctest::Approx(400 * 0.002).epsilon(1e-9));
        REQUIRE(w.link.step(at(w.link.start(), {0.01, 0, -0.003})));
        CHECK(w.link.held().force().force.x() == doctest::Approx(-0.3 * 400 * 0.002).epsilon(1e-6));
    }
    BodyWorld w(own.c_str()); // the friction of the law that names the pair
    REQUIRE(w.link.step(w.link.start()));
    const double k = w.set.link.spring.stiffness;
    REQUIRE(w.link.step(at(w.link.start(), {0, 0, -0.021})));
    REQUIRE(w.link.step(at(w.link.start(), {0.01, 0, -0.021})));
    CHECK(w.link.held().force().force.z() == doctest::Approx(k * 0.001).epsilon(1e-6));
    CHECK(w.link.held().force().force.x() == doctest::Approx(-0.3 * k * 0.001).epsilon(1e-5));
}

TEST_CASE("the reduced operator gives the force of the full step at its pose")
{
    for (const char* text : {kBed, kBall, kBar, kPad}) {
        BodyWorld w(text);
        REQUIRE(w.link.step(w.link.start()));
        for (int k = 1; k <= 12; ++k) {
            const Vec3 shift(k > 6 ? 2e-4 * (k - 6) : 0, 0, -3e-4 * std::min(k, 8));
            REQUIRE(w.link.step(at(w.link.start(), shift)));
            ReducedOperator<double> op(300);
            REQUIRE(w.link.publish(op, 0.02 * k, std::uint64_t(k)));
            ProxyOptions options;
            options.tolerance = 1e-11;
            options.max_sweeps = 2000;
            ProxyLoop<double> loop(300, options);
            REQUIRE(loop.take(op, 0));
            const ProxyTick tick = loop.tick(op.handle, 0);
            const Vec3 full = w.link.held().force().force;
            CAPTURE(k);
            CAPTURE(full.transpose());
            CHECK((tick.wrench.force - full).norm() <= 1e-6 * std::max(full.norm(), 0.1));
        }
        CHECK(w.link.held().force().force.norm() > 0.1);
    }
}

TEST_CASE("contacts of a hand in motion have their arms under the ball, however far it slides")
{
    std::string text = kBall;
    text.replace(text.find(R"("step": 0.05)"), 12, R"("kind": "dynamic", "step": 0.05)");
    text.insert(text.find(R"("start": {"place": [0, 0, 0.011]})"), R"("mass": 0.1, )");
    BodyWorld w(text.c_str());
    const double radius = 0.01;
    for (int k = 1; k <= 12; ++k) { // down, then aside by 3 mm a step
        REQUIRE(w.link.step(
            at(w.link.start(), {0.003 * std::max(k - 6, 0), 0, -3e-4 * std::min(k, 6)})));
        if (k <= 6) continue;
        ReducedOperator<double> op(300);
        REQUIRE(w.link.publish(op, 0.02 * k, std::uint64_t(k)));
        REQUIRE(op.contacts == 1);
        const CandidateContact& c = op.contact[0];
        const Wrench& full = w.link.held().force();
        CAPTURE(k);
        CHECK(full.force.z() > 0.1);
        CHECK(c.rigid);
        CHECK(c.arm.head<2>().norm() < 1e-9);
        CHECK(c.arm.z() == doctest::Approx(-radius).epsilon(0.02));
        Eigen::Matrix<double, 3, 6> J;
        J.leftCols<3>() = c.frame.transpose();
        for (int i = 0; i < 3; ++i)
            J.block<1, 3>(i, 3) = c.arm.cross(Vec3(c.frame.col(i))).transpose();
        CHECK((c.J - J).norm() < 1e-9);
        CHECK((full.torque - c.arm.cross(full.force)).norm() < 1e-9);
    }
}

TEST_CASE("the reduced operator predicts the next step of the full simulation")
{
    // 1 mm and 10 ms ahead, 0.1 m/s: within 1 % of the full step there. Contacts that close on the
    // way are among the candidates.
    BodyWorld w(kBed, 100);
    REQUIRE(w.link.step(w.link.start()));
    double worst = 0;
    for (int k = 1; k <= 6; ++k) {
        ReducedOperator<double> op(300);
        REQUIRE(w.link.publish(op, 0.01 * k, std::uint64_t(k)));
        ProxyOptions options;
        options.tolerance = 1e-10;
        options.max_sweeps = 2000;
        ProxyLoop<double> loop(300, options);
        REQUIRE(loop.take(op, 0));
        const HandPose next = at(w.link.start(), {0, 0, -1e-3 * k});
        ProxyTick tick;
        for (int i = 1; i <= 10; ++i) { // a tick at a time: slip depends on the way
            HandPose pose = op.handle;
            pose.position += 0.1 * i * (next.position - op.handle.position);
            tick = loop.tick(pose, 1e-3 * i);
        }
        REQUIRE(w.link.step(next));
        const Vec3 full = w.link.held().force().force;
        const double error = (tick.wrench.force - full).norm() / std::max(full.norm(), 0.1);
        MESSAGE("step " << k << ": full " << full.transpose() << " N, reduced "
                        << tick.wrench.force.transpose() << " N, error " << error);
        worst = std::max(worst, error);
    }
    CHECK(w.link.held().force().force.norm() > 0.5);
    CHECK(worst < 0.01);
}

TEST_CASE("a simulated hand presses the tool into the bed and drags it in virtual time" *
          doctest::test_suite("slow"))
{
    const auto play = [] {
        BodyWorld w(kBed);
        HandOptions hand = w.set.hand;
        hand.path = [&](double t) { return w.link.path(t); };
        SimulatedHand simulated(hand);
        HapticLoop<float> loop(300, w.set.loop);
        VirtualOptions v;
        v.duration = 2;
        v.operator_period = w.set.link.condense.period;
        const Publisher<float> publish = [&](ReducedOperator<float>& op, const HandPose& handle,
                                             double time, std::uint64_t sequence) {
            return w.link.step(sequence == 1 ? w.link.start() : handle) &&
                   w.link.publish(op, time, sequence);
        };
        auto records =
            run_in_virtual_time<float>(loop, simulated, 300, publish, w.set.loop.period, v);
        const HapticSummary s = summarise<float>(records, loop, w.set.loop.period, false);
        MESSAGE("largest force " << s.largest_force << " N, hand-over " << s.handover_jump
                                 << " N, energy " << s.energy_injected << " J, contacts "
                                 << s.most_contacts);
        CHECK(s.ticks == 2000);
        CHECK(s.faults == 0);
        CHECK(s.energy_injected == 0);
        CHECK(s.largest_force > 0.2); // sent, not only computed
        CHECK(s.handover_jump < std::max(0.05, 0.02 * s.largest_force));
        CHECK(s.error.p99 < 1e-3);
        CHECK(w.link.not_touched() == 0);
        return records;
    };
    const std::vector<TickRecord> one = play(), two = play();
    const Vec3 f = one.back().computed.force;
    CHECK(f.z() > 0.2);   // [regression] our own run
    CHECK(f.x() < -0.05); // [regression] friction against the drag
    CHECK(std::abs(f.x()) < 0.35 * f.z());
    // The same bits again.
    CHECK(one.size() == two.size());
    for (std::size_t k = 0; k < one.size(); ++k)
        REQUIRE(one[k].sent.force == two[k].sent.force);
}

TEST_CASE("what cannot be held is refused and why")
{
    const auto refusal = [](std::string text, const std::string& from, const std::string& to) {
        const auto at = text.find(from);
        REQUIRE(at != std::string::npos);
        text.replace(at, from.size(), to);
        try {
            BodyWorld w(text.c_str());
        } catch (const InputError& error) {
            return std::string(error.what());
        }
        return std::string();
    };
    const std::string scene = kBed;
    CHECK(
        refusal(scene, R"("haptic": {"handle": "tool", "device": "touch"},)", "").find("/haptic") !=
        std::string::npos);
    CHECK(refusal(scene, R"("handle": "tool")", R"("handle": "toll")").find("\"tool\"") !=
          std::string::npos);
    CHECK(refusal(scene, R"("device": "touch")", R"("device": "tuoch")").find("touch") !=
          std::string::npos);
    CHECK(refusal(scene, R"("hold": [{"set": "z_min"}])", R"("hold": [])").find("bed") !=
          std::string::npos);
    CHECK(refusal(scene, R"("handle": "tool",)", R"("handle": "tool", "kind": "rigid",)")
              .find("elastic") != std::string::npos);
}

TEST_CASE("a device that begins elsewhere moves the handle from where it is")
{
    BodyWorld w(kBall);
    HapticLoop<float> loop(300, w.set.loop);
    HandOptions hand = w.set.hand;
    hand.friction = 0;
    hand.start << 1, 2, 3, 0, 0, 0; // the device's own origin
    hand.path = [](double) { return (Vec6() << 1, 2, 2.998, 0, 0, 0).finished(); };
    SimulatedHand simulated(hand);
    VirtualOptions v;
    v.duration = 1;
    double lowest = 1, farthest = 0;
    const Publisher<float> publish = [&](ReducedOperator<float>& op, const HandPose& handle,
                                         double time, std::uint64_t sequence) {
        const bool done = w.link.step(sequence == 1 ? w.link.start() : handle);
        const Vec3 x = w.link.held().pose().position;
        lowest = std::min(lowest, x.z());
        farthest = std::max(farthest, x.head<2>().norm());
        return done && w.link.publish(op, time, sequence);
    };
    run_in_virtual_time<float>(loop, simulated, 300, publish, w.set.loop.period, v);
    CHECK(lowest == doctest::Approx(0.01).epsilon(1e-6)); // on the floor, never elsewhere
    CHECK(farthest < 1e-6);
}

TEST_CASE("a plate of 1 mm holds a ball of 2 mm from the moment of touch at any speed allowed")
{
    for (const double rate : {25.0, 50.0, 100.0})
        for (const double v : {0.1, 0.5, 0.95}) {
            CAPTURE(rate);
            CAPTURE(v);
            BodyWorld w(kPlate, rate);
            const double k = w.set.link.spring.stiffness, calm = 0.6, down = 0.025;
            RecordedDevice device({{0, calm, calm + down / v, calm + down / v + 0.2},
                                   {{}, {}, at({}, {0, 0, -down}), at({}, {0, 0, -down})}});
            HapticLoop<double> loop(50, w.set.loop);
            VirtualOptions v_options;
            v_options.duration = calm + down / v + 0.2;
            v_options.operator_period = 1 / rate;
            const Publisher<double> publish = [&](ReducedOperator<double>& op,
                                                  const HandPose& handle, double time,
                                                  std::uint64_t sequence) {
                return w.link.step(sequence == 1 ? w.link.start() : handle) &&
                       w.link.publish(op, time, sequence);
            };
            double under = 0; // how far the ball, where the force has it, was in the plate
            const auto records = run_in_virtual_time<double>(loop, device, {}, 50, publish,
                                                             w.set.loop.period, v_options);
            for (const TickRecord& r : records) {
                const double depth = 0.0005 + 0.002 - r.handle.position.z();
                under = std::max(under, depth - std::max(r.computed.force.z(), 0.0) / k);
            }
            CHECK(under < 1e-6);
            CHECK(loop.safety().faults() == 0);
            // What the hand gave on the way down pays for what it is given at rest.
            CHECK(records.back().computed.force.z() == doctest::Approx(k * 0.005).epsilon(1e-3));
            CHECK(records.back().sent.force.z() == doctest::Approx(k * 0.005).epsilon(1e-3));
        }
}
