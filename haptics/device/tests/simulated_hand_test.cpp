#include "haptics/device/simulated_hand.hpp"
#include "mesh/base/error.hpp"

#include <cmath>
#include <doctest/doctest.h>

using namespace amontons;

TEST_CASE("a released hand swings as the closed form states")
{
    HandOptions o;
    o.mass = 0.3;
    o.device_mass = 0.1;
    o.damping = 2;
    o.stiffness = 250;
    o.start << 0.01, 0, 0, 0, 0, 0;
    SimulatedHand hand(o);
    for (int k = 0; k < 200; ++k)
        hand.advance();
    const double m = 0.4, a = 2 / (2 * m), w = std::sqrt(250 / m - a * a), t = 0.2;
    CHECK(hand.position()[0] ==
          doctest::Approx(0.01 * std::exp(-a * t) * (std::cos(w * t) + a / w * std::sin(w * t)))
              .epsilon(1e-10));
}

TEST_CASE("a delayed force acts a tick later and the motors saturate")
{
    HandOptions o;
    o.mass = o.damping = o.stiffness = 0;
    o.device_mass = 1;
    o.max_force = 2;
    o.delay = 1;
    SimulatedHand hand(o);
    hand.write({{10, 0, 0}, {0, 0, 0}}, 0);
    hand.advance();
    CHECK(hand.velocity()[0] == 0);
    hand.write({}, 1e-3);
    hand.advance();
    CHECK(hand.velocity()[0] == doctest::Approx(2e-3));
    hand.write({}, 2e-3);
    hand.advance();
    CHECK(hand.velocity()[0] == doctest::Approx(2e-3));
    CHECK(hand.motor_work() == doctest::Approx(0.5 * 2e-3 * 2e-3));
}

TEST_CASE("friction stops a device and does not pull it back")
{
    HandOptions o;
    o.mass = o.damping = o.stiffness = 0;
    o.device_mass = 0.1;
    o.friction = 0.5;
    o.start_velocity << 0.1, 0, 0, 0, 0, 0;
    o.resolution = 1e-4;
    SimulatedHand hand(o);
    for (int k = 0; k < 100; ++k)
        hand.advance();
    CHECK(hand.velocity()[0] == 0);
    CHECK(hand.position()[0] == doctest::Approx(0.1 * 0.1 * 0.1 / (2 * 0.5)).epsilon(0.01));
    const double x = hand.read(0).pose.position[0] / 1e-4;
    CHECK(std::abs(x - std::round(x)) < 1e-9);
}

TEST_CASE("profiles are found by name, and of an unknown one the nearest is reported")
{
    CHECK(device_profile("omega.3").max_stiffness == 5000);
    CHECK(device_profile("touch").max_force == 3.3);
    CHECK_FALSE(device_profile("catheter-2dof").free[1]);
    try {
        device_profile("falcn");
        FAIL("accepted");
    } catch (const InputError& e) {
        CHECK(e.issues().at(0).allowed == "\"falcon\" (nearest name)");
    }
}
