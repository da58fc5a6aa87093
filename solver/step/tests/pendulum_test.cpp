// Rigid bodies that hang on joints and springs, at rest.

#include "solver/step/tests/body_runs.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <fmt/format.h>
#include <numbers>

using namespace amontons;

namespace {

constexpr double kHungMass = 1e-4; // [kg]
constexpr double kHungWeight = kHungMass * kGravity;

std::string vector_text(const Vec3& v)
{
    return fmt::format("[{:.17g}, {:.17g}, {:.17g}]", v.x(), v.y(), v.z());
}

/// A free ball. @param more  members beside
std::string hung_ball(const std::string& name, const Vec3& place, const std::string& more = "")
{
    return fmt::format(R"("{}": {{"kind": "rigid", "shape": {{"generate": "ball",
        "radius": 0.002}}, "mass": {:.17g}, "start": {{"place": {}}}{}}})",
                       name, kHungMass, vector_text(place), more);
}

std::string rest_of_scene(const std::string& bodies, const std::string& couplings,
                          const Vec3& gravity = Vec3(0, 0, -kGravity))
{
    return fmt::format(R"("bodies": {{{}}}, "couplings": [{}], "contact": [], "gravity": {},
        "time": {{"step": 0.5, "end": 1}}, "output": {{"picture": false, "plots": false}})",
                       bodies, couplings, vector_text(gravity));
}

} // namespace

TEST_CASE("a body on a joint, led aside by a force, hangs at tan(angle) = F / (m g)")
{
    constexpr double kLength = 0.005, kForce = 0.4 * kHungWeight;
    const Vec3 joint(0.01, 0.002, -0.001);
    // Of the start against the vertical, about y and about z.
    for (const double start : {0.0, 0.3, -1.0, 1.5, -1.5, 2.5, std::numbers::pi})
        for (const char* kind : {"ball", "hinge"})
            for (const bool turned : {false, true}) {
                CAPTURE(start);
                CAPTURE(kind);
                CAPTURE(turned);
                const Mat3 R =
                    turned
                        ? Eigen::AngleAxisd(1.1, Vec3(1, -2, 0.5).normalized()).toRotationMatrix()
                        : Mat3(Mat3::Identity());
                const Vec3 place = joint + kLength * Vec3(std::sin(start), 0, -std::cos(start));
                const std::string force =
                    fmt::format(R"(, "force": {})", vector_text(R * Vec3(kForce, 0, 0)));
                const Result r = done(rest_of_scene(
                    hung_ball("b", R * place, force),
                    fmt::format(R"({{"kind": "{}", "between": ["b", "world"], "at": {},
                        "axis": {}}})",
                                kind, vector_text(R * joint), vector_text(R * Vec3(0, 1, 0))),
                    R * Vec3(0, 0, -kGravity)));
                const Vec3 now = R.transpose() * r.vector("b") - joint;
                CHECK(std::abs(now.norm() - kLength) <= 1e-9 * kLength);
                CHECK(std::abs(std::atan2(now.x(), -now.z()) - std::atan2(kForce, kHungWeight)) <=
                      1e-8);
                CHECK(std::abs(now.y()) <= 1e-9 * kLength);
            }
}

TEST_CASE("two bodies hang in a chain as statics requires, from a start that is stretched out")
{
    constexpr double kLength = 0.01, kForce = 0.7 * kHungWeight;
    const std::string bodies = hung_ball("a", Vec3(0.5 * kLength, 0, 0)) + ", " +
                               hung_ball("b", Vec3(1.5 * kLength, 0, 0),
                                         fmt::format(R"(, "force": [{:.17g}, 0, 0])", kForce));
    const Result r = done(rest_of_scene(
        bodies, fmt::format(R"({{"kind": "ball", "between": ["a", "world"], "at": [0, 0, 0]}},
                       {{"kind": "ball", "between": ["a", "b"], "at": [{}, 0, 0]}})",
                            kLength)));
    // Moments about the lower joint, of b: F and m g at its middle. About the upper one, of a: both
    // forces of b at its end, m g at its middle.
    const double lower = std::atan2(kForce, kHungWeight),
                 upper = std::atan2(kForce, 1.5 * kHungWeight);
    const Vec3 a = r.vector("a"), b = r.vector("b");
    const Vec3 along_a(std::sin(upper), 0, -std::cos(upper)),
        along_b(std::sin(lower), 0, -std::cos(lower));
    CHECK((a - 0.5 * kLength * along_a).norm() <= 1e-8 * kLength);
    CHECK((b - kLength * along_a - 0.5 * kLength * along_b).norm() <= 1e-8 * kLength);
}

TEST_CASE("a body on a spring at its side hangs below the spring's other end")
{
    constexpr double kStiffness = 2, kArm = 0.003; // [N/m], [m]
    const Vec3 place(0.01, 0, 0);
    const Result r = done(rest_of_scene(
        hung_ball("b", place),
        fmt::format(R"({{"kind": "spring", "between": ["b", "world"], "at": [{:.17g}, 0, 0],
                        "to": [0, 0, 0], "stiffness": {}}})",
                    place.x() - kArm, kStiffness)));
    const double length = place.x() - kArm + kHungWeight / kStiffness;
    CHECK((r.vector("b") - Vec3(0, 0, -length - kArm)).norm() <= 1e-8 * length);
}

TEST_CASE("a body on a joint at a rod's end bends the rod by its weight, wherever it starts")
{
    constexpr double kLength = 0.01, kEI = 5e-4, kArm = 0.002;
    for (const double angle : {0.0, 1.0, -1.5}) {
        CAPTURE(angle);
        const Vec3 end(kLength, 0, 0);
        const Result r = done(rest_of_scene(
            R"("r": {"kind": "rod", "segments": [{"length": 0.01, "radius": 0.0003, "EI": 0.0005,
                "element": 0.001}], "shape": {"start": [0, 0, 0], "direction": [1, 0, 0]},
                "hold": [{"set": "start"}]}, )" +
                hung_ball("b", end + kArm * Vec3(std::sin(angle), 0, -std::cos(angle))),
            R"({"kind": "ball", "between": ["r", "b"], "at": [0.01, 0, 0]})"));
        const Vec3 now = r.vector("b");
        const double down = kHungWeight * std::pow(kLength, 3) / (3 * kEI);
        CHECK(std::abs(now.z() + kArm + down) <= 1e-3 * down); // of finite turns
        CHECK(std::abs(now.x() - kLength) <= 1e-2 * down);
    }
}
