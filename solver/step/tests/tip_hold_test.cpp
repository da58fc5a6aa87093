// Wires whose tip is held, against closed forms: Euler's loads, the elastica, the force with which
// a sleeve pushes a bent wire out (Bigoni, Dal Corso, Bosi and Misseroni 2015), clamped beams.

#include "solver/step/tests/body_runs.hpp"

#include "mesh/base/error.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <cstring>
#include <doctest/doctest.h>
#include <fmt/format.h>
#include <numbers>

using namespace amontons;

namespace {

constexpr double kBending = 5.2e-4, kOut = 0.1; // [N m^2]; of the wire, at the start [m]

/// A wire that is 0.1 m out of an introducer along x. @param more  members of the wire
std::string wire(const std::string& drive, const std::string& hold, const std::string& more = "",
                 double EA = 5e4)
{
    return fmt::format(R"("bodies": {{"wire": {{"kind": "beam", "drive": {{{}}}, "hold": {{{}}}{},
        "segments": [{{"length": 0.25, "radius": 4.445e-4, "EI": {}, "EA": {}, "GJ": 4e-4,
        "element": 2e-3}}]}}}}, "contact": [], )",
                       drive, hold, more, kBending, EA);
}

constexpr const char* kInPlane = R"(, "plane": [0, 0, 1])";

/// Force on the tip of an inextensible beam that is clamped along x at 0 and comes to (reach, 0)
/// without a moment there: EI theta' = (tip - x) x F, by Runge and Kutta's rule and Newton's
/// method.
/// @param near  which of its shapes: the force of one that is near
Eigen::Vector2d elastica(double length, double reach, const Eigen::Vector2d& near)
{
    const auto end = [&](const Eigen::Vector2d& F) {
        constexpr int kSteps = 2000;
        const double h = length / kSteps;
        Eigen::Vector3d s = Eigen::Vector3d::Zero(); // x, y, theta
        const auto rate = [&](const Eigen::Vector3d& a) {
            return Eigen::Vector3d(std::cos(a[2]), std::sin(a[2]),
                                   ((reach - a[0]) * F[1] + a[1] * F[0]) / kBending);
        };
        for (int i = 0; i < kSteps; ++i) {
            const Eigen::Vector3d k1 = rate(s), k2 = rate(s + h / 2 * k1),
                                  k3 = rate(s + h / 2 * k2), k4 = rate(s + h * k3);
            s += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
        }
        return Eigen::Vector2d(s[0] - reach, s[1]);
    };
    const double P = near.norm();
    Eigen::Vector2d F = near;
    for (int i = 0; i < 100; ++i) {
        const Eigen::Vector2d miss = end(F);
        Eigen::Matrix2d J;
        for (int k = 0; k < 2; ++k) {
            Eigen::Vector2d moved = F;
            moved[k] += 1e-6 * P;
            J.col(k) = (end(moved) - miss) / (1e-6 * P);
        }
        const Eigen::Vector2d change = -J.inverse() * miss;
        F += std::min(1.0, 0.1 * P / change.norm()) * change;
        if (change.norm() < 1e-12 * P) break;
    }
    return F;
}

/// The sleeve's end carries a moment M, and the wire there an energy per length of M^2 / (2 EI):
/// with so much force it is pushed out, and the base by that less than by the wire's axial force.
void check_sleeve(const Result& r, std::size_t step, double tolerance)
{
    const Vec3 F = r.vector("tip_hold_force", step);
    const Vec3 tip(r.value("tip_x", step), r.value("tip_y", step), r.value("tip_z", step));
    const Vec3 M = tip.cross(F);
    const double pushed_out = M.squaredNorm() / (2 * kBending);
    CHECK(r.value("push_force", step) == doctest::Approx(-F.x() - pushed_out).epsilon(tolerance));
}

} // namespace

TEST_CASE("a wire that is fed against its held tip buckles at Euler's load")
{
    // Fed by a ten thousandth of its length: the load is a few thousandths above Euler's.
    const std::string drive = R"("insertion": [[0, 0.1], [1, 0.10003]])";
    for (const bool clamped : {false, true})
        for (const char* plane : {"", kInPlane}) {
            CAPTURE(clamped);
            CAPTURE(plane);
            const Result r = done(wire(drive, clamped ? R"("turns": "held")" : "", plane) +
                                  R"("time": {"step": 0.25, "end": 1})");
            REQUIRE(r.summary.status == "done");
            const double euler = (clamped ? 4 * std::numbers::pi * std::numbers::pi : 20.1907) *
                                 kBending / (kOut * kOut);
            CHECK(-r.value("tip_hold_force_x") == doctest::Approx(euler).epsilon(3e-3));
            CHECK(r.value("tip_x") == doctest::Approx(kOut).epsilon(1e-12));
            CHECK(std::hypot(r.value("tip_y"), r.value("tip_z")) < 1e-15);
        }
}

TEST_CASE(
    "a wire that is fed on is the elastica between sleeve and tip, and the sleeve pushes it out" *
    doctest::test_suite("slow"))
{
    const Result r = done(wire(R"("insertion": [[0, 0.1], [1, 0.12]])", "", kInPlane, 5e5) +
                          R"("time": {"step": 0.02, "end": 1})");
    REQUIRE(r.summary.status == "done");
    int compared = 0;
    for (std::size_t i = 5; i < r.records.size(); i += 15) {
        const double out = r.value("insertion", i);
        CAPTURE(out);
        const Eigen::Vector2d exact =
            elastica(out, kOut, {r.value("tip_hold_force_x", i), r.value("tip_hold_force_y", i)});
        const double size = exact.norm();
        // Elements of 1/50 to 1/60 of the length; the wire's own stretch is 1e-5 of it.
        CHECK(std::abs(r.value("tip_hold_force_x", i) - exact[0]) <= 5e-3 * size);
        CHECK(std::abs(r.value("tip_hold_force_y", i) - exact[1]) <= 5e-3 * size);
        CHECK(exact[0] < 0);
        check_sleeve(r, i, 0.01);
        ++compared;
    }
    CHECK(compared >= 3);
    // What the base gave is stored.
    CHECK(std::abs(r.summary.energy.error()) <= 5e-3 * r.summary.energy.work);
}

TEST_CASE("a tip that is moved aside takes a clamped beam's forces and work")
{
    const double y = 1e-4, L3 = kOut * kOut * kOut;
    for (const bool clamped : {false, true}) {
        CAPTURE(clamped);
        const Result r = done(wire(R"("insertion": [[0, 0.1]])",
                                   std::string(R"("y": [[0, 0], [1, 1e-4]])") +
                                       (clamped ? R"(, "turns": "held")" : ""),
                                   "", 50) + // soft along itself: no catenary
                              R"("time": {"step": 0.25, "end": 1})");
        const double force = (clamped ? 12 : 3) * kBending / L3 * y;
        CHECK(r.value("tip_hold_force_y") == doctest::Approx(force).epsilon(2e-3));
        CHECK(r.value("tip_y") == doctest::Approx(y).epsilon(1e-12));
        if (clamped)
            CHECK(r.value("tip_hold_moment_z") ==
                  doctest::Approx(-0.5 * force * kOut).epsilon(2e-3));
        CHECK(r.summary.energy.work == doctest::Approx(0.5 * force * y).epsilon(5e-3));
        CHECK(r.summary.energy.elastic == doctest::Approx(r.summary.energy.work).epsilon(1e-3));
    }
}

TEST_CASE("a held tip is the same in a frame that is turned, and continues from a saved state")
{
    const auto scene = [](const char* introducer, const char* hold) {
        return wire(R"("insertion": [[0, 0.1], [1, 0.11]], "twist": [[0, 0], [1, 0.5]])",
                    std::string(hold) + R"(, "turns": "held")", introducer) +
               R"("time": {"step": 0.05, "end": 1})";
    };
    const std::string vertical =
        scene(R"(, "introducer": {"normal": [0, 1, 0]})", R"("y": [[0, 0], [1, 0.01]])");
    const Result a = done(vertical);
    const Result b = done(scene(R"(, "introducer": {"at": [1, 2, 3], "direction": [0, 0, 1],
                                     "normal": [1, 0, 0]})",
                                R"("x": [[0, 0], [1, 0.01]])"));
    const Vec3 f = a.vector("tip_hold_force"), g = b.vector("tip_hold_force");
    // x -> z, y -> x, z -> y
    CHECK((Vec3(g.z(), g.x(), g.y()) - f).norm() <= 1e-6 * f.norm());
    const Vec3 m = a.vector("tip_hold_moment"), n = b.vector("tip_hold_moment");
    CHECK((Vec3(n.z(), n.x(), n.y()) - m).norm() <= 1e-6 * m.norm());

    const Scene whole = parse_scene("{\"schema\": 1, " + vertical + "}", "test.json", {});
    const auto first = make_simulation(whole, build_obstacles(whole));
    Keep keep;
    std::atomic<bool> stop{false};
    keep.stop = &stop;
    keep.stop_at = 9;
    REQUIRE(first->run(keep, stop).status == "interrupted");
    const Result rest = run(vertical, {}, false, first->save());
    REQUIRE(rest.summary.status == "done");
    REQUIRE(keep.records.size() + rest.records.size() == a.records.size());
    for (std::size_t i = 0; i < rest.records.size(); ++i)
        for (std::size_t q = 0; q < rest.records[i].quantities.size(); ++q) {
            const double now = rest.records[i].quantities[q].value,
                         then = a.records[keep.records.size() + i].quantities[q].value;
            CHECK(std::memcmp(&now, &then, sizeof now) == 0);
        }
}

TEST_CASE("a wire with a held tip lies on the walls between, in balance")
{
    // Fed in a tube: it buckles against the wall. Wall, base, sleeve and hold balance it.
    const Result r = done(R"("bodies": {"tube": {"kind": "obstacle", "surface": {"generate": "tube",
            "radius": 0.002, "centreline": {"pieces": [{"length": 0.15}]}}},
        "wire": {"kind": "beam", "plane": [0, 0, 1], "drive": {"insertion": [[0, 0.1], [1, 0.101]]},
        "hold": {}, "segments": [{"length": 0.25, "radius": 4.445e-4, "EI": 5.2e-4, "EA": 5e4,
        "element": 2e-3}]}}, "contact": [{"between": ["wire", "tube"], "friction": 0}],
        "time": {"step": 0.05, "end": 1})");
    REQUIRE(r.summary.status == "done");
    CHECK(r.summary.uncertified_steps == 0);
    CHECK(r.value("normal_force_sum") > 1);
    // Along x the wall does nothing (a straight tube, no friction).
    const Vec3 F = r.vector("tip_hold_force");
    Vec3 wall = Vec3::Zero();
    Vec3 M = Vec3(r.value("tip_x"), r.value("tip_y"), 0).cross(F);
    for (const ContactRecord& c : r.records.back().contacts) {
        wall += c.force;
        M += c.point.cross(c.force);
    }
    CHECK(std::abs(wall.x()) <= 1e-6 * r.value("normal_force_sum"));
    CHECK(r.value("push_force") ==
          doctest::Approx(-F.x() - M.squaredNorm() / (2 * kBending)).epsilon(0.02));
}

TEST_CASE("a tip cannot be held in its introducer, out of its plane or in another instrument")
{
    const auto refused = [](const std::string& rest) {
        try {
            run(rest + R"("time": {"step": 1, "end": 1})");
        } catch (const InputError& error) {
            return std::string(error.what());
        }
        return std::string();
    };
    CHECK(refused(wire(R"("insertion": [[0, 0], [1, 0.1]])", "")).find("out of its introducer") !=
          std::string::npos);
    CHECK(refused(wire(R"("insertion": [[0, 0.1]])", R"("z": [[0, 0], [1, 0.01]])", kInPlane))
              .find("/bodies/wire/hold/z") != std::string::npos);
    CHECK(refused(wire(R"("insertion": [[0, 0.1]])", R"("z": [[0, 0.1], [1, 0.01]])"))
              .find("where the tip begins") != std::string::npos);
    CHECK(refused(R"("bodies": {"wire": {"kind": "beam", "instrument": "guidewire-stiff",
        "drive": {"insertion": [[0, 0.1]]}, "hold": {}}, "catheter": {"kind": "beam",
        "instrument": "catheter-5f", "drive": {"insertion": [[0, 0.05]]}}},
        "contact": [{"between": ["wire", "catheter"], "friction": 0.1}], )")
              .find("/hold") != std::string::npos);
}
