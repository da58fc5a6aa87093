// Laws of rods that couplings join.

#include "mesh/tests/relative.hpp"
#include "solver/step/tests/body_runs.hpp"

#include "mesh/base/error.hpp"

#include <Eigen/Dense>
#include <cmath>
#include <doctest/doctest.h>
#include <fmt/format.h>
#include <numbers>

using namespace amontons;
using test::relative;

namespace {

constexpr double kEI = 0.01, kGJ = 0.008, kEA = 1e4;

std::string text(const Vec3& v)
{
    return fmt::format("[{:.17g}, {:.17g}, {:.17g}]", v.x(), v.y(), v.z());
}

/// A straight rod of a section without shear from one place to another.
/// @param more  members beside
std::string rod(const std::string& name, const Vec3& from, const Vec3& to,
                const std::string& more = "", int elements = 8, double density = 8000)
{
    const Vec3 way = to - from;
    return fmt::format(R"("{}": {{"kind": "rod", "segments": [{{"length": {:.17g}, "radius": 0.001,
        "EI": {}, "GJ": {}, "EA": {}, "element": {:.17g}, "density": {}}}],
        "shape": {{"start": {}, "direction": {}}}{}}})",
                       name, way.norm(), kEI, kGJ, kEA, way.norm() / elements, density, text(from),
                       text(way), more);
}

std::string coupling(const std::string& kind, const std::string& a, const std::string& b,
                     const Vec3& at, const std::string& more = "")
{
    return fmt::format(R"({{"kind": "{}", "between": ["{}", "{}"], "at": {}{}}})", kind, a, b,
                       text(at), more);
}

std::string axis(const Vec3& n)
{
    return fmt::format(R"(, "axis": {})", text(n));
}

const std::string kOneStep = R"(, "time": {"step": 1, "end": 1})";
const std::string kClamped = R"(, "hold": [{"set": "start"}])";

std::string pull(const Vec3& force)
{
    return fmt::format(R"(, "loads": [{{"set": "end", "force": {}}}])", text(force));
}

/// A rod of 0.2 m from the origin along x that is bent far by a force at its end, whole or of two.
std::string bent(bool whole, const std::string& kind, const Vec3& force)
{
    const Vec3 middle(0.1, 0, 0), end(0.2, 0, 0);
    const std::string load = fmt::format(
        R"(, "loads": [{{"set": "end", "force": {}, "over": [[0, 0], [1, 1]]}}])", text(force));
    const std::string time = R"(, "time": {"step": 0.1, "end": 1})";
    if (whole)
        return R"("bodies": {)" + rod("b", Vec3::Zero(), end, kClamped + load, 16) + "}" + time;
    return R"("bodies": {)" + rod("a", Vec3::Zero(), middle, kClamped) + ", " +
           rod("b", middle, end, load) + R"(}, "couplings": [)" + coupling(kind, "a", "b", middle) +
           "]" + time;
}

/// A beam element in space, of the same section: stiffness by (place, turn) of both ends.
Eigen::Matrix<double, 12, 12> beam_stiffness(const Vec3& from, const Vec3& to)
{
    const double L = (to - from).norm();
    const double a = 12 * kEI / (L * L * L), b = 6 * kEI / (L * L), c = 4 * kEI / L;
    Eigen::Matrix<double, 12, 12> k = Eigen::Matrix<double, 12, 12>::Zero();
    const auto both = [&](int i, int j, double v) { k(i, j) = k(j, i) = v; };
    for (int i : {0, 3}) { // along and about x
        const double s = (i == 0 ? kEA : kGJ) / L;
        k(i, i) = k(i + 6, i + 6) = s;
        both(i, i + 6, -s);
    }
    for (int plane = 0; plane < 2; ++plane) {
        const int v = plane == 0 ? 1 : 2, t = plane == 0 ? 5 : 4;
        const double sign = plane == 0 ? 1 : -1;
        k(v, v) = k(v + 6, v + 6) = a;
        both(v, v + 6, -a);
        both(v, t, sign * b);
        both(v, t + 6, sign * b);
        both(v + 6, t, -sign * b);
        both(v + 6, t + 6, -sign * b);
        k(t, t) = k(t + 6, t + 6) = c;
        both(t, t + 6, c / 2);
    }
    Mat3 R;
    R.col(0) = (to - from) / L;
    R.col(1) = R.col(0).unitOrthogonal();
    R.col(2) = R.col(0).cross(Vec3(R.col(1)));
    Eigen::Matrix<double, 12, 12> T = Eigen::Matrix<double, 12, 12>::Zero();
    for (int i = 0; i < 4; ++i)
        T.block<3, 3>(3 * i, 3 * i) = R;
    return T * k * T.transpose();
}

std::vector<Issue> issues_of_run(const std::string& rest)
{
    try {
        run(rest);
    } catch (const InputError& error) {
        return error.issues();
    }
    return {};
}

} // namespace

TEST_CASE("two rods that are welded end to end are one rod, bent far too")
{
    const Vec3 force(0.3, 0.8, 2);
    const Result whole = done(bent(true, "", force)), parts = done(bent(false, "weld", force));
    const Vec3 end = whole.vector("b_end");
    CHECK(end.z() > 0.1);
    CHECK((parts.vector("b_end") - end).norm() < 1e-9 * end.norm());
    CHECK((parts.vector("b_end_tangent") - whole.vector("b_end_tangent")).norm() < 1e-8);
    CHECK((parts.vector("a_start_moment") - whole.vector("b_start_moment")).norm() <
          1e-8 * whole.vector("b_start_moment").norm());
    CHECK(parts.summary.energy.elastic == relative(whole.summary.energy.elastic).epsilon(1e-8));
    // What passes through the weld is the load, and its moment about the weld.
    CHECK((parts.vector("a_on_b_coupling_0_force") + force).norm() < 1e-8 * force.norm());
}

TEST_CASE("a tripod of rods on hinges yields as its stiffness matrix states")
{
    // Feet on a circle of 0.1 m, hinges along its tangent; the apex is a ball for all three.
    const Vec3 apex(0, 0, 0.15), force(2e-4, -1e-4, 5e-3);
    std::string bodies, couplings;
    Eigen::Matrix<double, 3, 3> K = Eigen::Matrix3d::Zero();
    for (int k = 0; k < 3; ++k) {
        const double angle = 2 * std::numbers::pi * k / 3 + 0.2;
        const Vec3 foot(0.1 * std::cos(angle), 0.1 * std::sin(angle), 0),
            tangent(-std::sin(angle), std::cos(angle), 0);
        const std::string name = fmt::format("leg{}", k);
        bodies += (k ? ", " : "") + rod(name, foot, apex, k == 0 ? pull(force) : "");
        couplings += (k ? ", " : "") + coupling("hinge", name, "world", foot, axis(tangent));
        if (k > 0) couplings += ", " + coupling("ball", "leg0", name, apex);
        // A rod that a hinge holds at its foot and a ball at its head: the turns of the head and
        // the turn about the hinge are free of moments.
        const Eigen::Matrix<double, 12, 12> whole = beam_stiffness(foot, apex);
        Eigen::Matrix<double, 12, 7> keep = Eigen::Matrix<double, 12, 7>::Zero();
        keep.block<3, 3>(6, 0).setIdentity();
        keep.block<3, 3>(9, 3).setIdentity();
        keep.block<3, 1>(3, 6) = tangent;
        const Eigen::Matrix<double, 7, 7> own = keep.transpose() * whole * keep;
        const Eigen::Matrix<double, 3, 4> mixed = own.topRightCorner<3, 4>();
        const Eigen::Matrix4d inner = own.bottomRightCorner<4, 4>();
        K += own.topLeftCorner<3, 3>() - mixed * inner.inverse() * mixed.transpose();
    }
    const Result r =
        done(R"("bodies": {)" + bodies + R"(}, "couplings": [)" + couplings + "]" + kOneStep);
    const Vec3 moved = r.vector("leg0_end") - apex, expected = K.inverse() * force;
    CHECK((moved - expected).norm() < 1e-4 * expected.norm());
}

TEST_CASE("a square frame of welded rods yields as its stiffness matrix states")
{
    const double L = 0.1;
    const Vec3 corner[4] = {{0, 0, 0}, {L, 0, 0}, {L, L, 0}, {0, L, 0}};
    const Vec3 force(1e-4, -2e-4, 1e-4);
    std::string bodies, couplings;
    Eigen::Matrix<double, 24, 24> K = Eigen::Matrix<double, 24, 24>::Zero();
    for (int k = 0; k < 4; ++k) {
        const int next = (k + 1) % 4;
        bodies += (k ? ", " : "") +
                  rod(fmt::format("side{}", k), corner[k], corner[next], k == 1 ? pull(force) : "");
        couplings += (k ? ", " : "") + coupling("weld", fmt::format("side{}", k),
                                                fmt::format("side{}", next), corner[next]);
        const Eigen::Matrix<double, 12, 12> own = beam_stiffness(corner[k], corner[next]);
        for (int i = 0; i < 2; ++i)
            for (int j = 0; j < 2; ++j)
                K.block<6, 6>(6 * (i ? next : k), 6 * (j ? next : k)) +=
                    own.block<6, 6>(6 * i, 6 * j);
    }
    couplings += ", " + coupling("weld", "side0", "world", corner[0]);
    Eigen::VectorXd load = Eigen::VectorXd::Zero(18);
    load.segment<3>(6) = force; // on the corner opposite
    const Eigen::VectorXd moved =
        K.bottomRightCorner<18, 18>().ldlt().solve(load); // without the first corner
    const Result r =
        done(R"("bodies": {)" + bodies + R"(}, "couplings": [)" + couplings + "]" + kOneStep);
    const Vec3 expected = moved.segment<3>(6);
    CHECK((r.vector("side1_end") - corner[2] - expected).norm() < 1e-4 * expected.norm());
    CHECK((r.vector("side3_on_side0_coupling_3_force")).norm() > 0);
    CHECK((r.vector("side0_on_world_coupling_4_force") - force).norm() < 1e-7 * force.norm());
}

TEST_CASE("a hinge carries no moment about its axis, and all others")
{
    const Vec3 end(0.1, 0, 0), n = Vec3(0.2, 1, 0.5).normalized();
    for (const std::string motion : {kOneStep, std::string(R"(, "time": {"kind": "dynamic",
             "step": 1e-3, "end": 0.01, "theta": 0.5})")}) {
        CAPTURE(motion);
        // A spring at the end keeps it from swinging.
        const Result r = done(
            R"("bodies": {)" + rod("b", Vec3::Zero(), end, pull({0.02, 0.01, 0.05})) +
            R"(}, "couplings": [)" + coupling("hinge", "b", "world", Vec3::Zero(), axis(n)) + ", " +
            coupling("spring", "b", "world", end, R"(, "to": [0.1, 0.02, -0.3], "stiffness": 5)") +
            "]" + motion);
        const Vec3 moment = r.vector("b_on_world_coupling_0_moment");
        CHECK(moment.norm() > 1e-5);
        CHECK(std::abs(moment.dot(n)) < 1e-7 * moment.norm());
        // The hinge's turn is large; the two axes stay one.
        CHECK(r.vector("b_end").z() > 0.001);
    }
}

TEST_CASE("a ring of rods without a load stays where it is, in one step")
{
    // Places that were computed apart differ by rounding, and a node of each that is held along z
    // leaves almost nothing of the rows there.
    std::string bodies, couplings;
    const int n = 12;
    const auto corner = [&](int k) {
        const double a = 2 * std::numbers::pi * k / n;
        return Vec3(0.004 * std::cos(a), 0.004 * std::sin(a), k % 2 ? 0.006 : 0);
    };
    for (int k = 0; k < n; ++k) {
        const std::string hold = k == 0       ? kClamped
                                 : k % 2 == 0 ? R"(, "hold": [{"set": "start", "z": 0, "turns":
                                                  "free"}])"
                                              : "";
        bodies += (k ? ", " : "") + rod(fmt::format("r{}", k), corner(k), corner(k + 1), hold);
        couplings += (k ? ", " : "") + coupling("weld", fmt::format("r{}", k),
                                                fmt::format("r{}", (k + 1) % n), corner(k + 1));
    }
    const Result r =
        done(R"("bodies": {)" + bodies + R"(}, "couplings": [)" + couplings + "]" + kOneStep);
    CHECK((r.vector("r5_end") - corner(6)).norm() < 1e-14);
}

TEST_CASE("nets do not depend on where they stand, on units, or on which body is named first")
{
    const auto net = [&](const Mat3& R, const Vec3& shift, double unit, bool swapped,
                         const std::string& time) {
        const auto at = [&](double x, double y, double z) {
            return Vec3(unit * (R * Vec3(x, y, z) + shift));
        };
        const auto wire = [&](const std::string& name, const Vec3& from, const Vec3& to,
                              const std::string& more) {
            const Vec3 way = to - from;
            const double u2 = unit * unit;
            return fmt::format(R"("{}": {{"kind": "rod", "segments": [{{"length": {:.17g},
                "radius": {:.17g}, "EI": {:.17g}, "GJ": {:.17g}, "EA": {:.17g},
                "element": {:.17g}, "density": 8000}}],
                "shape": {{"start": {}, "direction": {}, "normal": {}}}{}}})",
                               name, way.norm(), 0.001 * unit, kEI * u2 * u2, kGJ * u2 * u2,
                               kEA * u2, way.norm() / 8, text(from), text(way),
                               text(R * Vec3(0.1, 0.2, 1)), more);
        };
        const Vec3 hub = at(0.1, 0, 0), force = 0.3 * unit * unit * (R * Vec3(0.2, 0.5, 1));
        const std::string a = swapped ? "b" : "a", b = swapped ? "a" : "b";
        return R"("bodies": {)" + wire("a", at(0, 0, 0), hub, kClamped) + ", " +
               wire("b", hub, at(0.15, 0.08, 0), pull(force)) + ", " +
               wire("c", hub, at(0.15, -0.04, 0.06), "") + R"(}, "couplings": [)" +
               coupling("weld", a, b, hub) + ", " +
               coupling("hinge", swapped ? "c" : "a", swapped ? "a" : "c", hub,
                        axis(R * Vec3(0, 0, 1))) +
               ", " +
               coupling("spring", "c", "world", at(0.15, -0.04, 0.06),
                        fmt::format(R"(, "to": {}, "stiffness": {:.17g})", text(at(0.2, -0.1, 0.3)),
                                    2 * unit)) +
               "]" + time;
    };
    const Vec3 tip(0.15, 0.08, 0);
    for (const std::string time :
         {std::string(R"(, "time": {"step": 0.5, "end": 1})"),
          std::string(R"(, "time": {"kind": "dynamic", "step": 1e-3, "end": 0.01})")}) {
        CAPTURE(time);
        const Result first = done(net(Mat3::Identity(), Vec3::Zero(), 1, false, time));
        const Vec3 way = first.vector("b_end") - tip;
        CHECK(way.norm() > 1e-3);
        const Mat3 R = Eigen::AngleAxisd(2.1, Vec3(1, -2, 0.5).normalized()).toRotationMatrix();
        const Vec3 shift(0.3, -0.2, 0.1);
        const Vec3 turned = done(net(R, shift, 1, false, time)).vector("b_end");
        CHECK((R.transpose() * turned - R.transpose() * shift - tip - way).norm() <
              1e-7 * way.norm());
        CHECK((done(net(Mat3::Identity(), Vec3::Zero(), 1, true, time)).vector("b_end") - tip - way)
                  .norm() < 1e-6 * way.norm());
        if (time.find("dynamic") != std::string::npos) continue; // masses follow another power
        const Vec3 large =
            done(net(Mat3::Identity(), Vec3::Zero(), 1000, false, time)).vector("b_end");
        CHECK((large / 1000 - tip - way).norm() < 1e-7 * way.norm());
    }
}

TEST_CASE("a rod that is welded to a rigid body carries its weight, at rest and in motion")
{
    // Closed form: the end of a cantilever under the weight and its moment about the weld.
    const double weight = 1e-3 * kGravity, L = 0.2, arm = 0.01;
    const auto scene = [&](const std::string& time) {
        return R"("gravity": [0, 0, -9.81], "bodies": {)" +
               rod("a", Vec3::Zero(), {L, 0, 0}, kClamped, 8, 1e-3) +
               R"(, "ball": {"kind": "rigid", "shape": {"generate": "ball", "radius": 0.005},
                   "mass": 0.001, "start": {"place": [0.21, 0, 0]}}}, "couplings": [)" +
               coupling("weld", "a", "ball", {L, 0, 0}) + "]" + time;
    };
    const Result r = done(scene(kOneStep));
    const double down = weight * L * L * L / (3 * kEI) + weight * arm * L * L / (2 * kEI);
    CHECK(r.value("a_end_z") == relative(-down).epsilon(1e-3));
    CHECK(r.value("a_on_ball_coupling_0_force_z") == relative(weight).epsilon(1e-6));
    // In motion, energy stays to the second order of the step.
    double error[2];
    int k = 0;
    for (const double step : {1e-3, 5e-4}) {
        const Result moving = done(scene(fmt::format(
            R"(, "time": {{"kind": "dynamic", "step": {}, "end": 0.1, "theta": 0.5}})", step)));
        error[k++] = std::abs(moving.summary.energy.error()) / moving.summary.energy.work;
    }
    MESSAGE(error[0], " ", error[1]);
    CHECK(error[0] < 1e-5);
    CHECK(error[1] < 0.3 * error[0]);
}

TEST_CASE("rods that are joined keep momentum, and angular momentum to second order")
{
    // A tree of rods, free, thrown as one with a spin: a weld, a hinge and a ball.
    const Vec3 hub(0.1, 0, 0), tip(0.15, 0.08, 0), velocity(0.3, -0.2, 0.5), spin(4, 6, -3);
    const auto thrown = [&](const std::string& name, const Vec3& from, const Vec3& to,
                            const std::string& load = "") {
        const Vec3 own = velocity + spin.cross(0.5 * (from + to)) /* of its centre */;
        return rod(name, from, to,
                   fmt::format(R"(, "velocity": {}, "spin": {}{})", text(own), text(spin), load));
    };
    const auto scene = [&](const std::string& rule, double step) {
        return R"("bodies": {)" + thrown("a", Vec3::Zero(), hub) + ", " +
               thrown("b", hub, tip, R"(, "loads": [{"set": "end", "force": [0, 0, 0.2],
                   "over": [[0, 1], [0.002, 1], [0.0025, 0]]}])") +
               ", " + thrown("c", hub, {0.15, -0.04, 0.06}) + ", " +
               thrown("d", tip, {0.2, 0.1, 0.05}) + R"(}, "couplings": [)" +
               coupling("weld", "a", "b", hub) + ", " +
               coupling("hinge", "a", "c", hub, axis({0, 0, 1})) + ", " +
               coupling("ball", "b", "d", tip) + "]" +
               fmt::format(R"(, "accuracy": {{"contact": 1e-11}},
                   "time": {{"kind": "dynamic", "step": {}, "end": 0.03, {}}})",
                           step, rule);
    };
    for (const char* rule : {R"("theta": 0.5)", R"("rule": "generalised_alpha")"}) {
        CAPTURE(rule);
        double error[2];
        int k = 0;
        for (const double step : {2.5e-4, 1.25e-4}) {
            const Result r = done(scene(rule, step));
            // Once the load and the rule's history of it have vanished.
            const std::size_t from = std::size_t(std::lround(0.02 / step));
            const Vec3 p = r.vector("momentum", from), L = r.vector("angular_momentum", from);
            error[k] = 0;
            for (std::size_t i = from; i < r.records.size(); ++i) {
                CHECK((r.vector("momentum", i) - p).norm() < 1e-10 * p.norm());
                error[k] =
                    std::max(error[k], (r.vector("angular_momentum", i) - L).norm() / L.norm());
            }
            ++k;
        }
        MESSAGE(error[0], " ", error[1], " order ", std::log2(error[0] / error[1]));
        if (std::string(rule).find("theta") != std::string::npos)
            CHECK(std::log2(error[0] / error[1]) > 1.8);
        else // what the rule's means change is restored
            CHECK(error[0] < 1e-10);
    }
}

TEST_CASE(
    "pairs of helices of opposite hand, their ends held from turning, follow the law of helices")
{
    // Inextensible helices of pitch angle b whose ends cannot turn stay helices; their energy per
    // length EI (k - k0)^2 / 2 + GJ (t - t0)^2 / 2 with k = 2 cos b / K, t = 2 sin b / K, K = D0 /
    // cos b0, gives, of two wires,
    //     F = 2 (2 / K) (GJ (t - t0) - EI tan b (k - k0))
    // (derivation; of the form that Jedwab & Clerc 1993 give for braids). The law of close-coiled
    // springs is its limit. Ends are clamped: what they cost is the same of any number of turns.
    const double d = 2e-4, D = 0.02, E = 2e11, R = D / 2;
    const double EI = E * std::numbers::pi * std::pow(d / 2, 4) / 4, GJ = EI / 1.3,
                 EA = E * std::numbers::pi * d * d / 4;
    for (const double b0 : {2.0, 35.0}) {
        CAPTURE(b0);
        const double b = b0 * std::numbers::pi / 180, c = std::cos(b), s = std::sin(b);
        const double k0 = c * c / R, t0 = s * c / R, K = D / c;
        const double turn = 2 * std::numbers::pi * R / c;                    // length of one
        const double F = 0.05 * D * GJ / (2 * std::numbers::pi * R * R * R); // of each wire
        const auto law = [&](double at) {
            return 2 / K *
                   (GJ * (2 * std::sin(at) / K - t0) -
                    EI * std::tan(at) * (2 * std::cos(at) / K - k0));
        };
        double low = b, high = b + 0.3;
        for (int i = 0; i < 100; ++i)
            (law(0.5 * (low + high)) < F ? low : high) = 0.5 * (low + high);
        const double expected = turn * (std::sin(low) - s); // of one turn
        double longer[2];
        int k = 0;
        for (const int turns : {6, 12}) {
            const double H = turns * turn * s;
            const auto coil = [&](const std::string& name, double hand, const std::string& load) {
                return fmt::format(R"("{}": {{"kind": "rod", "segments": [{{"length": {:.17g},
                    "radius": {}, "EI": {:.17g}, "GJ": {:.17g}, "EA": {:.17g}, "element": {:.17g},
                    "curvature": {:.17g}, "twist": {:.17g}}}], "shape": {{"start": [{}, 0, 0],
                    "direction": [0, {:.17g}, {:.17g}], "normal": [-1, 0, 0]}}{}}})",
                                   name, turns * turn, d / 2, EI, GJ, EA, turn / 32, k0, hand * t0,
                                   R, hand * c, s, load);
            };
            const Vec3 foot(R, 0, 0), head(R, 0, H);
            const Result r =
                done(R"("bodies": {)" +
                     coil("right", 1,
                          fmt::format(R"(, "loads": [{{"set": "end", "force": [0, 0, {}],
                    "over": [[0, 0], [1, 1]]}}])",
                                      2 * F)) +
                     ", " + coil("left", -1, "") + R"(}, "couplings": [)" +
                     coupling("weld", "right", "world", foot) + ", " +
                     coupling("weld", "left", "world", foot) + ", " +
                     coupling("weld", "right", "left", head) + ", " +
                     coupling("slider", "right", "world", head, axis({0, 0, 1})) +
                     R"(], "time": {"step": 0.25, "end": 1})");
            longer[k++] = r.value("right_end_z") - H;
            CHECK(r.value("left_end_z") == relative(r.value("right_end_z")).epsilon(1e-9));
        }
        const double measured = (longer[1] - longer[0]) / 6;
        MESSAGE("of the law: ", measured / expected - 1);
        CHECK(measured == relative(expected).epsilon(0.01));
        if (b0 < 5)
            CHECK(measured == relative(F * 2 * std::numbers::pi * R * R * R / GJ).epsilon(0.01));
    }
}

TEST_CASE("a braid of two layers of wires that touch where they cross is as stiff as its helices")
{
    // The same law, of n wires a hand, for layers that are a wire's thickness apart: with the ends
    // free along the radius and about it every helix stays one, its radius follows from its length
    // and its turns, and pressed together the inner layer grows by more than the outer: crossings
    // touch. A turn more by a quarter: no wire can be displaced as a whole.
    const double D = 0.02, E = 2e11, turns = 1.25, b0 = 35 * std::numbers::pi / 180;
    const int hand_count = 4;
    struct Case {
        double thickness, longer; // diameter of the wires, share of the height
        bool touch;
    };
    for (const Case& c :
         {Case{1e-4, -0.03, true}, {1e-4, -0.05, true}, {2e-4, -0.05, true}, {2e-4, 0.15, false}}) {
        CAPTURE(c.thickness);
        CAPTURE(c.longer);
        const double d = c.thickness, EI = E * std::numbers::pi * std::pow(d / 2, 4) / 4,
                     GJ = EI / 1.3, EA = E * std::numbers::pi * d * d / 4;
        const double height = turns * std::numbers::pi * D * std::tan(b0);
        std::string bodies, pairs;
        for (int i = 0; i < 2 * hand_count; ++i) {
            const double hand = i < hand_count ? 1 : -1, // the inner layer, and the outer
                R = D / 2 - hand * 1.002 * d / 2, around = 2 * std::numbers::pi * R * turns,
                         b = std::atan2(height, around), L = std::hypot(height, around),
                         angle = 0.5 * std::numbers::pi * i;
            const auto radial = [](double at) {
                return Vec3(std::round(std::cos(at)), std::round(std::sin(at)), 0);
            };
            const Vec3 out = radial(angle), along = Vec3::UnitZ().cross(out),
                       end = radial(angle + hand * 2 * std::numbers::pi * turns);
            const auto hold = [&](const char* set, const Vec3& e, double way) {
                return fmt::format(R"({{"set": "{}", "turns": "about", "axis": {}, "{}": 0,
                    "z": [[0, 0], [1, {:.17g}]]}})",
                                   set, text(e), e.x() != 0 ? "y" : "x", way);
            };
            bodies += fmt::format(
                R"({}"w{}": {{"kind": "rod", "segments": [{{"length": {:.17g},
                "radius": {}, "EI": {:.17g}, "GJ": {:.17g}, "EA": {:.17g}, "element": {:.17g},
                "curvature": {:.17g}, "twist": {:.17g}}}], "shape": {{"start": {}, "direction": {},
                "normal": {}}}, "hold": [{}, {}]}})",
                i ? ", " : "", i, L, d / 2, EI, GJ, EA, L / 40, std::cos(b) * std::cos(b) / R,
                hand * std::sin(b) * std::cos(b) / R, text(R * out),
                text(hand * std::cos(b) * along + std::sin(b) * Vec3::UnitZ()), text(-out),
                hold("start", out, 0), hold("end", end, c.longer * height));
            for (int j = hand_count; i < hand_count && j < 2 * hand_count; ++j)
                pairs += fmt::format(R"({}{{"between": ["w{}", "w{}"]}})",
                                     i + j > hand_count ? ", " : "", i, j);
        }
        const Result r = done(R"("bodies": {)" + bodies + R"(}, "contact": [)" + pairs +
                              R"(], "time": {"step": 0.2, "end": 1})");
        const double b = std::asin((1 + c.longer) * std::sin(b0)), K = D / std::cos(b0);
        const double expected =
            2 * hand_count * 2 / K *
            (GJ * (2 * std::sin(b) / K - std::sin(2 * b0) / D) -
             EI * std::tan(b) * (2 * std::cos(b) / K - 2 * std::cos(b0) * std::cos(b0) / D));
        double pull = 0;
        for (int i = 0; i < 2 * hand_count; ++i)
            pull += r.value(fmt::format("w{}_end_force_z", i));
        MESSAGE("of the law: ", pull / expected - 1, ", contacts ",
                r.records.back().contacts.size());
        CHECK(pull == relative(expected).epsilon(0.01));
        CHECK(r.summary.uncertified_steps == 0);
        // Two wires cross twice a turn of both, and at their ends.
        const int crossings = hand_count * hand_count * int(2 * turns);
        CHECK((int(r.records.back().contacts.size()) > crossings / 2) == c.touch);
    }
}

TEST_CASE("a floor carries two rods at their joint alike, in motion")
{
    // Two rods that are mirror images, joined end to end and dropped flat: the ends beside the
    // joint are at one place of the floor, which may carry either.
    for (const char* kind : {"ball", "hinge", "weld"}) {
        CAPTURE(kind);
        const Vec3 middle(0, 0, 0.0012), left(-0.1, 0, 0.0012), right(0.1, 0, 0.0012);
        const Result r = done(
            R"("bodies": {)" + std::string(kFloor) + ", " + rod("a", left, middle) + ", " +
            rod("b", right, middle) + R"(}, "couplings": [)" +
            coupling(kind, "a", "b", middle, axis({0, 1, 0})) +
            R"(], "contact": [{"between": ["floor", "a"]}, {"between": ["floor", "b"]}], "gravity": [0, 0, -9.81],
                 "time": {"kind": "dynamic", "step": 0.002, "end": 0.03})");
        double most = 0;
        for (std::size_t i = 0; i < r.records.size(); ++i) {
            const double a = r.value("floor_on_a_force_z", i), b = r.value("floor_on_b_force_z", i);
            most = std::max(most, a);
            CHECK(std::abs(a - b) < 1e-6 * std::max(most, 1e-3));
        }
        CHECK(most > 0.05);
    }
}

TEST_CASE("a rod that buckles faster than the step follows has shorter steps")
{
    // A cantilever of length L under 4 times Euler's load, and a small force aside. By Rayleigh's
    // quotient with 1 - cos(pi x / 2 L) it grows at least with the rate g; of an implicit step that
    // is longer than 1 / g the deflection is against the force.
    constexpr double kPi = std::numbers::pi, kLength = 0.2, kAside = 1e-5;
    const double euler = kPi * kPi * kEI / (4 * kLength * kLength);
    const double mass = 8000 * kPi * 1e-6; // per length
    const double slope = std::pow(kPi / (2 * kLength), 2) / 2, shift = 1.5 - 4 / kPi;
    const double g = std::sqrt(3 * euler * slope / (mass * shift));
    for (const char* rule : {"", R"(, "theta": 0.5)"}) {
        CAPTURE(rule);
        const double h = 2.5 / g;
        const Result r =
            done(R"("bodies": {)" +
                 rod("a", Vec3::Zero(), {kLength, 0, 0}, kClamped + pull({-4 * euler, kAside, 0})) +
                 fmt::format(R"(}}, "time": {{"kind": "dynamic", "step": {}, "end": {}{}}})", h,
                             2 * h, rule));
        double before = 0;
        for (std::size_t i = 1; i < r.records.size(); ++i) {
            CHECK(r.value("a_end_y", i) > before);
            before = r.value("a_end_y", i);
            CHECK(r.records[i].step_length < (*rule ? 2 : 1) / g);
        }
        const double alone = kAside * std::pow(kLength, 3) / (3 * kEI);
        CHECK(before > alone * std::cosh(4.0)); // after 5 / g
        CHECK(r.value("a_negative") == 0);
    }
}

TEST_CASE("couplings of rods that cannot be are refused with their place")
{
    const Vec3 middle(0.1, 0, 0), end(0.2, 0, 0);
    const auto two = [&](const std::string& couplings) {
        return R"("bodies": {)" + rod("a", Vec3::Zero(), middle, kClamped) + ", " +
               rod("b", middle, end) + R"(}, "couplings": [)" + couplings + "]" + kOneStep;
    };
    std::vector<Issue> found = issues_of_run(two(coupling("weld", "a", "b", {0.1, 0.002, 0})));
    REQUIRE(found.size() == 2);
    CHECK(found[0].place == "/couplings/0/at");
    CHECK(found[0].found.find("0.002 m from the middle line") != std::string::npos);
    CHECK(found[0].allowed.find("(0.1, 0, 0)") != std::string::npos);
    for (const char* kind : {"ball", "hinge", "slider"}) {
        CAPTURE(kind);
        found = issues_of_run(two(coupling(kind, "a", "b", middle, axis({0, 1, 0}))));
        REQUIRE(found.size() == 1);
        CHECK(found[0].place == "/bodies/b");
        CHECK(found[0].found.find("mechanism") != std::string::npos);
    }
    CHECK(issues_of_run(two(coupling("weld", "a", "b", middle))).empty());
    // At a place of an instrument that its sheath holds: when the run begins, or later.
    for (const auto& [at, last] : {std::pair{-0.01, 0.03}, {0.01, 0.005}}) {
        found = issues_of_run(fmt::format(R"("bodies": {{
            "wire": {{"kind": "beam", "segments": [{{"length": 0.1, "radius": 2e-4, "EI": 1e-3,
                "element": 2.5e-3}}], "introducer": {{"direction": [1, 0, 0]}},
                "drive": {{"insertion": [[0, 0.02], [1, {}]]}}}},
            "b": {{"kind": "rigid", "shape": {{"generate": "ball", "radius": 0.001}}, "mass": 1,
                "start": {{"place": [{}, 0, 0.001]}}}}}}, "couplings": [{}])",
                                          last, at, coupling("ball", "wire", "b", {at, 0, 0})) +
                              kOneStep);
        REQUIRE(found.size() == 1);
        CHECK(found[0].place == "/couplings/0/at");
        CHECK(found[0].found.find("its sheath holds") != std::string::npos);
    }
}
