// Rigid bodies that roll or slide on curved surfaces, at rest: closed forms.

#include "solver/step/tests/body_runs.hpp"

#include <cmath>
#include <fmt/format.h>
#include <numbers>

using namespace amontons;

namespace {

constexpr double kTubeRadius = 0.01, kRoller = 0.004, kAside = kTubeRadius - kRoller;

/// A tube along x, with a bend in the plane z = 0 from x = 0.05 on.
std::string tube(const char* pieces)
{
    return fmt::format(
        R"("tube": {{"kind": "obstacle", "surface": {{"generate": "tube", "radius": {}, "centreline":
        {{"start": [0, 0, 0], "direction": [1, 0, 0], "normal": [0, 1, 0], "pieces": {}}}}}}})",
        kTubeRadius, pieces);
}

std::string body(const char* shape, double angle)
{
    return fmt::format(R"("b": {{"kind": "rigid", "shape": {}, "density": 1000,
        "start": {{"place": [0.03, {:.17g}, {:.17g}]{}}}}})",
                       shape, kAside * std::sin(angle), -kAside * std::cos(angle),
                       std::string(shape).find("cylinder") == std::string::npos
                           ? ""
                           : R"(, "turn": [0, 1.5707963267948966, 0])");
}

std::string rest(double step, double friction)
{
    return fmt::format(R"("gravity": [0, 0, -10], "contact": [{{"between": ["b", "tube"],
        "friction": {}}}], "time": {{"kind": "quasi_static", "step": {}, "end": 1}})",
                       friction, step);
}

} // namespace

TEST_CASE("a ball and a cylinder come to rest at the bottom of a tube, from any place in it")
{
    for (const char* shape : {R"({"generate": "ball", "radius": 0.004})",
                              R"({"generate": "cylinder", "radius": 0.004, "length": 0.01})"})
        for (const double friction : {0.0, 0.3})
            for (const double angle : {0.05, 0.4, 1.0}) {
                CAPTURE(shape);
                CAPTURE(friction);
                CAPTURE(angle);
                const Result r = run("\"bodies\": {" + tube(R"([{"length": 0.1}])") + ", " +
                                     body(shape, angle) + "}, " + rest(0.5, friction));
                REQUIRE(r.summary.message == "");
                // m g y / gap is 1e-8 of m g
                CHECK(std::abs(r.value("b_y")) < 1e-8 * kAside);
                CHECK(r.value("b_z") == doctest::Approx(-kAside).epsilon(1e-9));
                CHECK(r.value("b_x") == doctest::Approx(0.03).epsilon(1e-9));
            }
}

TEST_CASE("a ball that is driven through a bend stays at its bottom and at what drives it")
{
    // The pusher moves along x; the bend of radius 0.05 begins at 0.05.
    const double reach = 0.003 + kRoller;
    for (const double friction : {0.0, 0.2})
        for (const double step : {0.1, 0.05}) {
            CAPTURE(friction);
            CAPTURE(step);
            const Result r =
                run("\"bodies\": {" +
                    tube(R"([{"length": 0.05}, {"radius": 0.05, "angle": 1, "direction": 0}])") +
                    R"(, "b": {"kind": "rigid", "shape": {"generate": "ball", "radius": 0.004},
                    "density": 1000, "start": {"place": [0.047, 0, -0.006]}},
                    "tool": {"kind": "rigid", "shape": {"generate": "ball", "radius": 0.003},
                    "start": {"place": [0.04, 0, -0.006]}, "drive": {"x": [[0, 0], [1, 0.02]]}}}, )" +
                    fmt::format(R"("gravity": [0, 0, -10], "contact": [
                    {{"between": ["b", "tube"], "friction": {}}}, {{"between": ["b", "tool"]}}],
                    "time": {{"kind": "quasi_static", "step": {}, "end": 1}})",
                                friction, step));
            REQUIRE(r.summary.message == "");
            const double x = r.value("b_x"), y = r.value("b_y"), z = r.value("b_z");
            // On the circle of the bend, level with its bottom: any place on it is a balance, and
            // the ball moves no farther than it is driven.
            CHECK(std::hypot(x - 0.05, y - 0.05) == doctest::Approx(0.05).epsilon(1e-7));
            CHECK(z == doctest::Approx(-kAside).epsilon(1e-7));
            CHECK(std::hypot(x - 0.06, y, z + kAside) == doctest::Approx(reach).epsilon(1e-6));
        }
}

TEST_CASE("a ball that lies aside of the top of another does not stay there")
{
    const Result r = run(R"("bodies": {"low": {"kind": "rigid", "shape": {"generate": "ball",
        "radius": 0.02}, "drive": {"x": 0}}, "b": {"kind": "rigid", "shape": {"generate": "ball",
        "radius": 0.01}, "density": 1000, "start": {"place": [0.0003, 0, 0.029998499962]}}},
        "gravity": [0, 0, -10], "contact": [{"between": ["b", "low"], "friction": 0.3}],
        "time": {"kind": "quasi_static", "step": 1, "end": 1})");
    CHECK(r.summary.message.find("b is not in balance") != std::string::npos);
}
