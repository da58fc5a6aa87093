// B05, B06, B08, B14, B15, B16, G01: balance of rigid bodies, many, one or none.

#include "contact/solvers/solve.hpp"
#include "mesh/base/file.hpp"
#include "solver/step/recorded_problem.hpp"
#include "validation/families/rigid_bodies/rigid_bodies.hpp"
#include "validation/families/rigid_bodies/shapes.hpp"
#include "validation/solid_run.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace amontons::validation {
namespace {

/// Halves [falls, stands] until it is narrower than `width`; what is between.
template <class Stands> double limit(double falls, double stands, double width, Stands holds)
{
    while (std::abs(stands - falls) > width) {
        const double middle = 0.5 * (falls + stands);
        (holds(middle) ? stands : falls) = middle;
    }
    return 0.5 * (falls + stands);
}

/// Whether a half circle of n voussoirs stands. Their sides are straight; a torque takes their
/// weights to where those of pieces of a ring attack.
bool arch_stands(int n, double thickness, double mu)
{
    SolidScene s("an arch");
    const double low = 1 - thickness / 2, high = 1 + thickness / 2, half = 0.1;
    constexpr int kFaces[6][4] = {{0, 1, 3, 2}, {4, 6, 7, 5}, {0, 4, 5, 1},
                                  {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 5, 7, 3}};
    for (int k = 0; k < n; ++k) {
        std::string obj;
        for (const double y : {-half, half})
            for (const int end : {k, k + 1})
                for (const double r : {low, high})
                    obj += fmt::format("v {:.17g} {:.17g} {:.17g}\n", r * std::cos(kPi * end / n),
                                       y, r * std::sin(kPi * end / n));
        for (const auto& f : kFaces)
            obj += fmt::format("f {} {} {}\nf {} {} {}\n", f[0] + 1, f[1] + 1, f[2] + 1, f[0] + 1,
                               f[2] + 1, f[3] + 1);
        const std::string file = s.path(fmt::format("v{}.obj", k));
        write_file(file, obj, Flush::to_system);
        ShapeInput shape;
        shape.file = file;
        RigidInput& b = s.rigid(fmt::format("v{}", k), shape);
        const double h = 0.5 * kPi / n, middle = (2 * k + 1) * h;
        const double further = 2.0 / 3 * (std::pow(high, 3) - std::pow(low, 3)) /
                               (high * high - low * low) * (std::sin(h) / h - std::cos(h));
        b.mass = 1;
        b.torque = {0, kG * further * std::cos(middle), 0};
    }
    s.plane("ground", Vec3::Zero(), Vec3::UnitZ());
    for (int k = 0; k < n; ++k) {
        if (k + 1 < n) s.touch(fmt::format("v{}", k), fmt::format("v{}", k + 1), mu).reach = 1e-4;
        if (k == 0 || k + 1 == n) s.touch(fmt::format("v{}", k), "ground", mu).reach = 1e-4;
    }
    for (ContactLaw& law : s.scene.contact)
        law.sliding = "finite";
    s.scene.gravity = {0, 0, -kG};
    s.scene.time.step = s.scene.time.end = 1;
    return try_run(s.scene).summary.status == "done";
}

} // namespace

std::vector<Measured> masonry_arch()
{
    std::vector<Measured> rows;
    for (const auto& [n, thickness] :
         {std::pair{12, 0.105099}, {24, 0.107179}, {48, 0.107238}, {96, 0.107477}})
        rows.push_back(relative(fmt::format("least thickness over radius, {} blocks, mu 0.7", n),
                                thickness,
                                limit(thickness - 5e-4, thickness + 5e-4, 4e-6,
                                      [n = n](double t) { return arch_stands(n, t, 0.7); }),
                                1e-4));
    rows.push_back(
        at_most("48 blocks, thickness 0.109: falls", arch_stands(48, 0.109, 0.7) ? 0 : 1, 0));
    rows.push_back(
        at_most("48 blocks, thickness 0.105: stands", arch_stands(48, 0.105, 0.7) ? 1 : 0, 0));
    struct Friction {
        int blocks;
        double thickness, mu;
    };
    for (const Friction& f : {Friction{24, 0.1075, 0.39481},
                              {96, 0.11, 0.39245},
                              {96, 0.15, 0.35174},
                              {96, 0.2, 0.30919},
                              {96, 0.3, 0.30919}})
        rows.push_back(relative(
            fmt::format("least friction, {} blocks, thickness {}", f.blocks, f.thickness), f.mu,
            limit(f.mu - 5e-4, f.mu + 5e-4, 3e-5,
                  [&](double m) { return arch_stands(f.blocks, f.thickness, m); }),
            1e-4));
    rows.push_back(
        left_out("B06: angle of the hinge, thrust; least friction at 0.1075 and 0.12, 96 "
                 "blocks",
                 "the question is whether it stands; the five above take most of the time"));
    return rows;
}

std::vector<Measured> leaning_planks()
{
    // Two planks rest on each other, each by 15 or 30 degrees from upright.
    std::vector<Measured> rows;
    for (const double degrees : {15.0, 30.0}) {
        const double a = degrees * kPi / 180, thin = 1e-6;
        const auto run = [&](double mu) {
            SolidScene s("leaning planks");
            for (const double side : {-1.0, 1.0}) {
                // Its inner top edge is at x = 0; its inner face is inclined by a.
                RigidInput& b = s.rigid(side < 0 ? "left" : "right", box({thin, 0.3, 1}));
                b.mass = 1;
                b.start.turn = {0, -side * a, 0};
                const Vec3 up(-side * std::sin(a), 0, std::cos(a)),
                    out(side * std::cos(a), 0, std::sin(a));
                const Vec3 top(0, 0, std::cos(a));
                b.start.place = top - 0.5 * up + 0.5 * thin * out;
                s.touch(b.name, "floor", mu).reach = 1e-3;
            }
            s.plane("floor", Vec3::Zero(), Vec3::UnitZ());
            s.touch("left", "right", 0.5).reach = 1e-3;
            for (ContactLaw& law : s.scene.contact)
                law.sliding = "finite";
            s.scene.gravity = {0, 0, -kG};
            s.scene.time.step = s.scene.time.end = 1;
            return try_run(s.scene);
        };
        const auto stands = [&](double mu) { return run(mu).summary.status == "done"; };
        const double mu = 0.5 * std::tan(a);
        rows.push_back(absolute(fmt::format("least friction of the floor at {} degrees", degrees),
                                mu, limit(mu - 0.01, mu + 0.01, 1e-7, stands), 1e-6));
        const SolidRun just = run(mu + 1e-6);
        if (just.summary.status != "done") throw std::runtime_error(just.summary.message);
        rows.push_back(absolute(fmt::format("force of the planks on each other over the weight of "
                                            "one, {} degrees",
                                            degrees),
                                mu, just.vector("right_on_left_force").norm() / kG, 1e-6));
    }
    return rows;
}

std::vector<Measured> jammed_ball()
{
    const auto run = [](double closer) {
        SolidScene s("a ball between plates");
        ShapeInput ball;
        ball.generate = "ball";
        ball.radius = 0.05;
        s.rigid("ball", ball).mass = 1;
        s.plane("low", {0, 0, -0.05}, Vec3::UnitZ());
        s.plane("high", {0, 0, 0.05 - closer}, -Vec3::UnitZ());
        s.touch("ball", "low", 0.3).sliding = "finite";
        s.touch("ball", "high", 0.3).sliding = "finite";
        s.scene.gravity = {0, 0, -kG};
        s.scene.time.step = s.scene.time.end = 1;
        return try_run(s.scene);
    };
    const SolidRun jam = run(1e-4), touching = run(0);
    const bool named =
        jam.summary.status == "failed" &&
        jam.summary.message.find("no motion avoids penetration") != std::string::npos;
    std::vector<Measured> rows{
        at_most("plates 0.1 mm too close: refusals that are not named", named ? 0 : 1, 0),
        at_most("plates that just touch: refusals", touching.summary.status == "done" ? 0 : 1, 0)};
    rows[0].note = jam.summary.message;

    // Pulled into a groove with walls as steep as a wedge's, past where it touches both: friction
    // or not, there is no way on.
    for (const double mu : {0.0, 0.3}) {
        const double a = 10 * kPi / 180, deep = 0.05 / std::sin(a);
        SolidScene s("a ball in a groove");
        ShapeInput shape;
        shape.generate = "ball";
        shape.radius = 0.05;
        RigidInput& ball = s.rigid("ball", shape);
        ball.mass = 1;
        ball.drive.given = true;
        ball.drive.z = {{0, 1e-5}, {1, -1e-4}};
        for (const double side : {1.0, -1.0}) {
            const std::string name = side > 0 ? "left" : "right";
            s.plane(name, {0, 0, -deep}, {side * std::cos(a), 0, std::sin(a)});
            s.touch("ball", name, mu).sliding = "finite";
        }
        s.scene.time.step = 0.1;
        const SolidRun pulled = try_run(s.scene);
        rows.push_back(absolute(
            fmt::format("pulled into a groove, mu {}: last step [s]", mu), 1 / 11.0,
            pulled.summary.message.find("no motion avoids penetration") != std::string::npos
                ? pulled.last().time
                : std::nan(""),
            1e-3));
        rows.back().note = pulled.summary.message;
    }
    return rows;
}

std::vector<Measured> table_legs()
{
    std::vector<Measured> rows;
    for (const Vec3& at : {Vec3(0, 0, 0), Vec3(0.1, 0.2, 0)}) {
        SolidScene s("a table");
        RigidInput& b = s.rigid("table", box({1, 1, 0.1}));
        b.mass = 1;
        b.start.place = {0, 0, 0.05};
        b.force = {0, 0, -100};
        b.torque = at.cross(b.force);
        s.plane("floor", Vec3::Zero(), Vec3::UnitZ());
        s.touch("table", "floor", 0.3).sliding = "finite";
        s.scene.time.step = s.scene.time.end = 1;
        const SolidRun r = run_solids(s.scene);
        Vec3 force = Vec3::Zero(), moment = Vec3::Zero();
        double least = 1e9;
        for (const ContactRecord& c : r.last().contacts) {
            force += c.force;
            moment += c.point.cross(c.force);
            least = std::min(least, c.normal_force);
        }
        const std::string where = at.isZero() ? "load at the centre" : "load at (0.1, 0.2)";
        rows.push_back(relative(where + ": sum of the legs", 100, force.z(), 1e-10));
        rows.push_back(absolute(where + ": moment about x [N m]", 100 * at.y(), moment.x(), 1e-10));
        rows.push_back(
            absolute(where + ": moment about y [N m]", -100 * at.x(), moment.y(), 1e-10));
        rows.push_back(at_most(where + ": legs that pull [N]", std::max(0.0, -least), 0));
    }
    return rows;
}

std::vector<Measured> painleve_rod()
{
    // m (W_nn - mu W_nt): normal acceleration by a normal force while it slips; negative in the
    // paradox zone. From the problem of one short step.
    std::vector<Measured> rows;
    // ---- The entries of W
    // The two entries of W, whatever the friction.
    const auto entries = [](double degrees) {
        const double mu = 1;
        SolidScene s("a rod");
        const double a = degrees * kPi / 180, thin = 1e-6;
        RigidInput& b = s.rigid("rod", box({1, thin, thin}));
        b.mass = 1;
        // It touches with a corner, half its thickness aside: that must not turn it about itself.
        b.inertia = Vec3(1e-5, 1.0 / 12, 1.0 / 12);
        b.start.turn = {0, -a, 0};
        b.start.place = {0.5 * std::cos(a), 0, 0.5 * std::sin(a)};
        b.start.velocity = {-1, 0, 0};
        s.plane("floor", Vec3::Zero(), Vec3::UnitZ());
        s.touch("rod", "floor", mu).sliding = "finite";
        s.scene.gravity = {0, 0, -kG};
        s.scene.time.kind = "dynamic";
        s.scene.time.step = s.scene.time.end = 1e-6;
        const SolidRun r = run_solids(s.scene);
        const std::vector<RecordedProblem> problems = r.simulation->contact_problems();
        const Eigen::MatrixXd W = problems.at(0).problem.W.block(0, 3);
        // Slip towards -x: friction pushes along +x, which is t1.
        return std::pair{W(0, 0), W(0, 1)};
    };
    const auto p = [&](double degrees, double mu) {
        const auto [normal, coupled] = entries(degrees);
        return normal + mu * coupled;
    };
    {
        // ---- Least friction with a paradox
        // The least friction with a paradox at any angle, by the golden section.
        const auto least = [&](double degrees) {
            const auto [normal, coupled] = entries(degrees);
            return -normal / coupled;
        };
        double low = 50, high = 75;
        const double part = 0.5 * (std::sqrt(5.0) - 1);
        while (high - low > 1e-3) {
            const double a = high - part * (high - low), b = low + part * (high - low);
            (least(a) < least(b) ? high : low) = least(a) < least(b) ? b : a;
        }
        rows.push_back(
            relative("least friction with a paradox", 1.33333333, least(0.5 * (low + high)), 1e-6));
        rows.back().note = fmt::format("at {:.3f} degrees", 0.5 * (low + high));
    }
    // ---- The paradox zone
    const auto root = [&](double from, double to, double mu) {
        return limit(from, to, 1e-4, [&](double d) { return (p(d, mu) > 0) == (p(to, mu) > 0); });
    };
    for (const auto& [mu, low, high] : {std::tuple{1.4, 55.5858108, 69.951867},
                                        {1.5, 50.6415982, 73.0484694},
                                        {2.0, 37.3773681, 79.187683}}) {
        const double middle = 0.5 * (low + high);
        rows.push_back(absolute(fmt::format("paradox zone from [degrees], mu {}", mu), low,
                                root(low - 5, middle, mu), 0.01));
        rows.push_back(absolute(fmt::format("paradox zone to [degrees], mu {}", mu), high,
                                root(high + 5, middle, mu), 0.01));
    }
    {
        // ---- A step within the zone
        // In the zone forces have no answer, impulses have: a blow without a collision.
        SolidScene s("a rod in the paradox zone");
        const double a = 62 * kPi / 180, thin = 1e-6;
        RigidInput& b = s.rigid("rod", box({1, thin, thin}));
        b.mass = 1;
        b.inertia = Vec3(1e-9, 1.0 / 12, 1.0 / 12);
        b.start.turn = {0, -a, 0};
        b.start.place = {0.5 * std::cos(a), 0, 0.5 * std::sin(a)};
        b.start.velocity = {-1, 0, 0};
        s.plane("floor", Vec3::Zero(), Vec3::UnitZ());
        s.touch("rod", "floor", 1.4).sliding = "finite";
        s.scene.gravity = {0, 0, -kG};
        s.scene.time.kind = "dynamic";
        s.scene.time.step = s.scene.time.end = 1e-4;
        const SolidRun r = run_solids(s.scene);
        double impulse = 0;
        for (const ContactRecord& c : r.last().contacts)
            impulse += c.normal_force * 1e-4;
        rows.push_back(at_most("mu 1.4, 62 degrees: impulse outside (0.01, 1) N s",
                               impulse > 0.01 && impulse < 1 ? 0 : 1, 0));
        rows.back().note = fmt::format("{:.4f} N s in a step of 0.1 ms; certificate {:.1e}",
                                       impulse, r.last().certificate.error);
        rows.push_back(
            at_most("mu 1.4, 62 degrees: energy that the blow makes [J]",
                    std::max(0.0, r.last().energy.kinetic - r.last().energy.kinetic_start -
                                      r.last().energy.work),
                    1e-12));
    }
    rows.push_back(at_most(
        "mu 1.2: angles of 20 with a paradox",
        [&] {
            int count = 0;
            for (int k = 1; k < 20; ++k)
                count += p(4.5 * k, 1.2) < 0;
            return double(count);
        }(),
        0));
    return rows;
}

std::vector<Measured> klarbring()
{
    // u = K^-1 (f + r); rows (n, t): K = [1 -0.6; -0.6 1] couples slip and gap.
    std::vector<Measured> rows;
    const auto solved = [](const Eigen::Vector2d& f_tn, double mu, ContactSolver solver) {
        Eigen::Matrix2d K;
        K << 1, -0.6, -0.6, 1; // (t, n)
        const Eigen::Matrix2d inverse = K.inverse();
        ContactProblem problem;
        Eigen::Matrix3d W = Eigen::Matrix3d::Zero();
        W(0, 0) = inverse(1, 1);
        W(0, 1) = W(1, 0) = inverse(0, 1);
        W(1, 1) = inverse(0, 0);
        W(2, 2) = 1;
        problem.W = Eigen::MatrixXd(W);
        const Eigen::Vector2d free = inverse * f_tn;
        problem.q = Eigen::Vector3d(free[1], free[0], 0);
        problem.mu = Eigen::VectorXd::Constant(1, mu);
        SolverOptions options;
        options.solver = solver;
        options.tolerance = 1e-12;
        return solve(problem, options);
    };
    for (const ContactSolver solver : kContactSolvers) {
        const ContactSolution s = solved({1, -0.55}, 2, solver);
        const Eigen::Vector2d u(s.u[1], s.u[0]), r(s.reaction[1], s.reaction[0]); // (t, n)
        const double apart = (u - Eigen::Vector2d(1.046875, 0.078125)).norm() + r.norm();
        const double stick = u.norm() + (r - Eigen::Vector2d(-1, 0.55)).norm();
        const double slip =
            (u - Eigen::Vector2d(0.5, 0)).norm() + (r - Eigen::Vector2d(-0.5, 0.25)).norm();
        const double nearest = std::min({apart, stick, slip});
        rows.push_back(
            at_most(fmt::format("{}: distance from one of the three solutions", name(solver)),
                    nearest, 1e-10));
        rows.back().note = nearest == apart ? "apart" : nearest == stick ? "sticks" : "slips";
    }
    const ContactSolution one = solved({1, -0.7}, 2, ContactSolver::automatic);
    rows.push_back(at_most("f = (1, -0.7): it sticks, the only solution",
                           one.u.norm() + (one.reaction - Eigen::Vector3d(0.7, -1, 0)).norm(),
                           1e-10));
    return rows;
}

std::vector<Measured> heavy_on_light()
{
    std::vector<Measured> rows;
    for (const double top : {1e6, 1e8}) {
        SolidScene s("a tower");
        std::vector<double> above(10, 0);
        for (int k = 0; k < 10; ++k) {
            RigidInput& b = s.rigid(fmt::format("b{}", k), box({1, 1, 1}));
            b.mass = std::pow(top, k / 9.0);
            b.start.place = {0, 0, 0.5 + k};
            for (int below = 0; below <= k; ++below)
                above[std::size_t(below)] += *b.mass * kG;
        }
        s.plane("floor", Vec3::Zero(), Vec3::UnitZ());
        s.touch("b0", "floor", 0.5);
        for (int k = 0; k + 1 < 10; ++k)
            s.touch(fmt::format("b{}", k + 1), fmt::format("b{}", k), 0.5);
        for (ContactLaw& law : s.scene.contact)
            law.sliding = "finite";
        s.scene.gravity = {0, 0, -kG};
        s.scene.time.step = s.scene.time.end = 1;
        const SolidRun r = run_solids(s.scene);
        double worst = std::abs(r.quantity("floor_on_b0_force_z") - above[0]) / above[0];
        for (int k = 1; k < 10; ++k)
            raise_to(worst, std::abs(r.quantity(fmt::format("b{}_on_b{}_force_z", k - 1, k)) -
                                     above[std::size_t(k)]) /
                                above[std::size_t(k)]);
        rows.push_back(at_most(fmt::format("forces between ten cubes, top {:.0e} times the bottom: "
                                           "worst relative error",
                                           top),
                               worst, 1e-8));
    }
    return rows;
}

} // namespace amontons::validation
