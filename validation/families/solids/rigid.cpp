// A10, G04, G05: rigid bodies in balance, or just no longer.

#include "contact/solvers/solve.hpp"
#include "validation/families/solids/blocks.hpp"
#include "validation/families/solids/solids.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace amontons::validation {
namespace {

ShapeInput box_shape(const Vec3& size)
{
    ShapeInput shape;
    shape.generate = "box";
    shape.size = size;
    return shape;
}

constexpr double kGravity = 9.81;

} // namespace

std::vector<Measured> wedge()
{
    // The push grows until nothing holds the block any more: the last step that is in balance.
    const double slope = std::atan(0.1), from = 0.1, to = 0.6;
    std::vector<Measured> rows;
    for (const bool rigid : {true, false})
        for (const double mu : {0.0, 0.1, 0.2, 0.3}) {
            if (mu == 0) continue; // in balance under one push alone: below
            SolidScene s("a block on a wedge");
            const double mass = 1;
            const Vec3 normal(-std::sin(slope), 0, std::cos(slope)), size(0.4, 0.2, 0.05);
            const CurvePoints over{{0, from}, {1, to}};
            if (rigid) {
                RigidInput& b = s.rigid("block", box_shape(size));
                b.mass = mass;
                b.force = {mass * kGravity, 0, 0};
                b.over = over;
                b.start.turn = {0, -slope, 0};
                b.start.place = 0.5 * size.z() * normal;
            } else {
                SolidInput& b =
                    s.block("block", 1e7, 0.3, {-0.2, -0.1, 0}, {0.2, 0.1, 0.05}, {8, 4, 2}, "H8");
                b.density = mass / (size.x() * size.y() * size.z());
                b.start.turn = {0, -slope, 0};
                // On the whole volume, as the weight: shared by the nodes of the middle layers.
                LoadInput push;
                push.set = "all";
                push.force = Vec3(mass * kGravity, 0, 0);
                push.over = over;
                b.loads = {push};
            }
            s.plane("wedge", Vec3::Zero(), normal);
            ContactLaw& law = s.touch("block", "wedge", mu, rigid ? "" : "z_min");
            if (rigid) law.sliding = "finite";
            s.scene.gravity = {0, 0, -kGravity};
            s.scene.time.step = 0.02;
            s.scene.time.smallest_step = 1e-7;
            const SolidRun run = try_run(s.scene);
            const double reached = run.steps.empty() ? std::nan("") : run.steps.back().time;
            rows.push_back(relative(
                fmt::format("push over weight, mu {}, {}", mu, rigid ? "rigid" : "H8"),
                (0.1 + mu) / (1 - 0.1 * mu), from + (to - from) * reached, rigid ? 1e-6 : 1e-3));
            rows.back().note = run.summary.message;
        }
    // Without friction one push holds the block, a larger one drives it up and with a smaller one
    // it down: its speed is linear in the push, and 0 where it holds.
    const auto speed = [&](double push) {
        SolidScene s("a block on a wedge");
        const Vec3 normal(-std::sin(slope), 0, std::cos(slope)), size(0.4, 0.2, 0.05);
        RigidInput& b = s.rigid("block", box_shape(size));
        b.mass = 1;
        b.force = {push * kGravity, 0, 0};
        b.start.turn = {0, -slope, 0};
        b.start.place = 0.5 * size.z() * normal;
        s.plane("wedge", Vec3::Zero(), normal);
        s.touch("block", "wedge", 0).sliding = "finite";
        s.scene.gravity = {0, 0, -kGravity};
        s.scene.time.kind = "dynamic";
        s.scene.time.step = s.scene.time.end = 0.01;
        return run_solids(s.scene).quantity("block_velocity_x");
    };
    const double down = speed(0), up = speed(0.3);
    rows.push_back(relative("push over weight, mu 0, rigid", 0.1, 0.3 * down / (down - up), 1e-6));
    rows.back().note =
        fmt::format("at 0.01 s {:.6f} m/s without a push, {:.6f} under 0.3", down, up);
    return rows;
}

std::vector<Measured> friction_limits()
{
    std::vector<Measured> rows;
    for (const auto& [mu, degrees] : {std::pair{1.5, 56.3099325}, {5.0, 78.6900675}}) {
        const auto sticks = [mu = mu](double angle) {
            SolidScene s("a block on an incline");
            const double alpha = angle * 3.14159265358979323846 / 180;
            const Vec3 normal(-std::sin(alpha), 0, std::cos(alpha));
            RigidInput& b = s.rigid("block", box_shape({2, 2, 0.1}));
            b.mass = 1;
            b.start.turn = {0, -alpha, 0};
            b.start.place = 0.05 * normal;
            s.plane("incline", Vec3::Zero(), normal);
            s.touch("block", "incline", mu).sliding = "finite";
            s.scene.gravity = {0, 0, -kGravity};
            s.scene.time.smallest_step = 0.5;
            return try_run(s.scene).summary.status == "done";
        };
        double low = 45, high = 89;
        while (high - low > 1e-5)
            (sticks(0.5 * (low + high)) ? low : high) = 0.5 * (low + high);
        rows.push_back(absolute(fmt::format("angle of slip [degrees], mu {}", mu), degrees,
                                0.5 * (low + high), 1e-4));
    }
    RaousOptions o;
    const auto compare = [&](const char* what, double mu, double other, double accuracy,
                             double tolerance) {
        try {
            o.accuracy = accuracy;
            o.mu = mu;
            const Raous a = raous(o);
            o.mu = other;
            const Raous b = raous(o);
            double worst = a.certificates + b.certificates > 0 ? std::nan("") : 0;
            for (std::size_t i = 0; i < a.u.size(); ++i)
                raise_to(worst, (a.u[i] - b.u[i]).norm() / a.u[0].norm());
            rows.push_back(at_most(what, worst, tolerance));
        } catch (const std::runtime_error& error) {
            rows.push_back(at_most(what, std::nan(""), tolerance));
            rows.back().note = error.what();
        }
    };
    compare("u of block A09, mu 1e-12 against 0", 0, 1e-12, 5e-11, 1e-10);
    // What sticks does not slide more for more friction.
    compare("u of block A09, mu 1e3 against 1e2", 1e3, 1e2, 1e-8, 5e-2);
    compare("u of block A09, mu 1e6 against 1e3", 1e6, 1e3, 1e-8, 1e-2);
    rows.push_back(left_out("G04: bipotential projection and NSGS both",
                            "a scene does not choose its solver: auto; solvers one by one are "
                            "compared on recorded problems, contact_profile"));
    return rows;
}

namespace {

/// A rigid plate, 10 kg and 1 m x 1 m, that 100 N press on points below it.
/// @param push  force along it [N]
ContactProblem plate_on(const std::vector<Vec3>& points, double mu, double push)
{
    const int rows = mu > 0 ? 3 : 1;
    const double m = 10;
    const Eigen::Index n = Eigen::Index(points.size());
    // Motions of the points by those of the plate, v + w x p; W = G M^-1 G^T has rank 6 at most.
    Eigen::MatrixXd G(rows * n, 6);
    const Vec3 axes[] = {Vec3::UnitZ(), Vec3::UnitX(), Vec3::UnitY()};
    for (Eigen::Index i = 0; i < n; ++i)
        for (int k = 0; k < rows; ++k)
            G.row(rows * i + k) << axes[k].transpose(),
                points[std::size_t(i)].cross(axes[k]).transpose();
    Eigen::VectorXd inverse(6), force(6);
    inverse << 1 / m, 1 / m, 1 / m, 12 / m, 12 / m, 6 / m;
    force << push, 0, -100, 0, 0, 0;
    ContactProblem p;
    p.q = G * inverse.cwiseProduct(force);
    p.mu = Eigen::VectorXd::Constant(n, mu);
    p.kind.assign(points.size(), mu > 0 ? ContactKind::frictional : ContactKind::frictionless);
    constexpr Eigen::Index kDense = 4000; // rows; beyond, W is a function
    const Eigen::MatrixXd MG = G * inverse.asDiagonal();
    if (G.rows() <= kDense) {
        p.W = Eigen::MatrixXd(MG * G.transpose());
        return p;
    }
    MatrixFreeDelassus W;
    W.rows = G.rows();
    W.apply = [G, MG](const Eigen::VectorXd& r, Eigen::VectorXd& out) {
        out.noalias() = MG * (G.transpose() * r);
    };
    std::vector<Eigen::Triplet<double>> own;
    for (Eigen::Index i = 0; i < G.rows(); ++i)
        for (Eigen::Index j = i - i % rows; j < i - i % rows + rows; ++j)
            own.emplace_back(int(i), int(j), MG.row(i).dot(G.row(j)));
    W.blocks.resize(G.rows(), G.rows());
    W.blocks.setFromTriplets(own.begin(), own.end());
    p.W = std::move(W);
    return p;
}

std::vector<Vec3> square_of(int n)
{
    std::vector<Vec3> points;
    for (int i = 0; i < n * n; ++i)
        points.emplace_back(double(i % n) / (n - 1) - 0.5, double(i / n) / (n - 1) - 0.5, 0);
    return points;
}

} // namespace

std::vector<Measured> redundant_contacts()
{
    std::vector<Measured> rows;
    SolverOptions options;
    options.tolerance = 1e-10;
    for (const double mu : {0.0, 0.5})
        for (const int n : {2, 5, 10, 20, 30, 100}) {
            if (mu > 0 && n > 30) continue;
            const std::vector<Vec3> points = square_of(n);
            const ContactSolution s = solve(plate_on(points, mu, mu > 0 ? 20 : 0), options);
            double sum = 0;
            Vec3 moment = Vec3::Zero();
            for (std::size_t i = 0; i < points.size(); ++i) {
                const double f = s.reaction[Eigen::Index(i) * (mu > 0 ? 3 : 1)];
                sum += f;
                moment += f * points[i];
            }
            const std::string of = fmt::format(", {} points, mu {}", n * n, mu);
            rows.push_back(relative("sum [N]" + of, 100, sum, 1e-8));
            rows.push_back(at_most("centre of pressure [m]" + of, moment.norm() / sum, 1e-8));
            rows.push_back(at_most("iterations" + of, s.certificate.iterations, 50));
            rows.back().note = "of rank 6 at most, whatever the number of points";
        }
    rows.push_back(
        left_out("G05: 10 000 points with friction",
                 "10 000 without friction; with it to 900, whose W is dense, and more were "
                 "not measured"));
    // The same point many times: the same motion. It slides, so that there is one.
    for (const double mu : {0.0, 0.1}) {
        const std::vector<Vec3> once = square_of(2);
        std::vector<Vec3> often;
        for (const Vec3& x : once)
            often.insert(often.end(), 100, x);
        options.tolerance = 1e-12;
        const ContactSolution a = solve(plate_on(once, mu, 20), options),
                              b = solve(plate_on(often, mu, 20), options);
        const int of_one = mu > 0 ? 3 : 1;
        double worst = 0;
        for (Eigen::Index i = 0; i < Eigen::Index(often.size()); ++i)
            raise_to(
                worst,
                (b.u.segment(of_one * i, of_one) - a.u.segment(of_one * (i / 100), of_one)).norm());
        rows.push_back(at_most(
            fmt::format("each of four points 100 times, mu {}: motion [m/s]", mu), worst, 1e-10));
        rows.back().note = "the plate slides at 1 to 2 m/s";
    }
    // A plate as a body: its coplanar triangles are one face, and touch at the face's corners.
    {
        SolidScene s("a plate");
        RigidInput& b = s.rigid("plate", box_shape({1, 1, 0.1}));
        b.mass = 1;
        b.start.place = {0, 0, 0.05};
        b.force = {0, 0, -100};
        s.plane("floor", Vec3::Zero(), Vec3::UnitZ());
        s.touch("plate", "floor", 0.5).sliding = "finite";
        rows.push_back(relative("sum [N], a plate as a body", 100,
                                run_solids(s.scene).quantity("floor_on_plate_force_z"), 1e-10));
    }
    return rows;
}

} // namespace amontons::validation
