// A10, G04, G05: rigid bodies in balance, or just no longer; see README.md.

#include "mesh/base/file.hpp"
#include "validation/cases/solids/blocks.hpp"
#include "validation/cases/solids/solids.hpp"

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

constexpr double kG = 9.81;

} // namespace

std::vector<Measured> wedge()
{
    // The push grows until nothing holds the block any more: the last step that is in balance.
    const double slope = std::atan(0.1), from = 0.1, to = 0.6;
    std::vector<Measured> rows;
    for (const bool rigid : {true, false})
        for (const double mu : {0.0, 0.1, 0.2, 0.3}) {
            if (!rigid && mu == 0) continue; // starts where it ends
            SolidScene s("a block on a wedge");
            const double mass = 1;
            const Vec3 normal(-std::sin(slope), 0, std::cos(slope)), size(0.4, 0.2, 0.05);
            const CurvePoints over{{0, from}, {1, to}};
            if (rigid) {
                RigidInput& b = s.rigid("block", box_shape(size));
                b.mass = mass;
                b.force = {mass * kG, 0, 0};
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
                push.force = Vec3(mass * kG, 0, 0);
                push.over = over;
                b.loads = {push};
            }
            s.plane("wedge", Vec3::Zero(), normal);
            ContactLaw& law = s.touch("block", "wedge", mu, rigid ? "" : "z_min");
            if (rigid) law.sliding = "finite";
            s.scene.gravity = {0, 0, -kG};
            s.scene.time.step = 0.02;
            s.scene.time.smallest_step = 1e-7;
            const SolidRun run = try_run(s.scene);
            const double reached = run.steps.empty() ? std::nan("") : run.steps.back().time;
            rows.push_back(relative(
                fmt::format("push over weight, mu {}, {}", mu, rigid ? "rigid" : "H8"),
                (0.1 + mu) / (1 - 0.1 * mu), from + (to - from) * reached, rigid ? 1e-6 : 1e-3));
            rows.back().note = run.summary.message;
        }
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
            s.scene.gravity = {0, 0, -kG};
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
            double worst = 0;
            for (std::size_t i = 0; i < a.u.size(); ++i)
                worst = std::max(worst, (a.u[i] - b.u[i]).norm() / a.u[0].norm());
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
    return rows;
}

std::vector<Measured> redundant_contacts()
{
    std::vector<Measured> rows;
    for (const double mu : {0.0, 0.5})
        for (const int n : {2, 5, 10, 20, 30}) {
            if (mu > 0 && n > 20) continue;
            // A plate of n x n points below, one above.
            SolidScene s("a plate on many points");
            std::string obj;
            const auto at = [n](int i) { return double(i) / (n - 1) - 0.5; };
            for (int j = 0; j < n; ++j)
                for (int i = 0; i < n; ++i)
                    obj += fmt::format("v {:.17g} {:.17g} 0\n", at(i), at(j));
            obj += "v 0 0 0.5\n";
            const int tip = n * n + 1;
            const auto point = [n](int i, int j) { return 1 + i + n * j; };
            for (int j = 0; j + 1 < n; ++j)
                for (int i = 0; i + 1 < n; ++i) {
                    obj += fmt::format("f {} {} {}\n", point(i, j), point(i + 1, j + 1),
                                       point(i + 1, j));
                    obj += fmt::format("f {} {} {}\n", point(i, j), point(i, j + 1),
                                       point(i + 1, j + 1));
                }
            for (int i = 0; i + 1 < n; ++i) {
                obj += fmt::format("f {} {} {}\n", point(i, 0), point(i + 1, 0), tip);
                obj += fmt::format("f {} {} {}\n", point(i + 1, n - 1), point(i, n - 1), tip);
                obj += fmt::format("f {} {} {}\n", point(0, i + 1), point(0, i), tip);
                obj += fmt::format("f {} {} {}\n", point(n - 1, i), point(n - 1, i + 1), tip);
            }
            ShapeInput shape;
            shape.file = s.path("plate.obj");
            write_file(shape.file, obj);
            RigidInput& b = s.rigid("plate", shape);
            b.mass = 1;
            b.force = {0, 0, -100};
            s.plane("floor", Vec3::Zero(), Vec3::UnitZ());
            s.touch("plate", "floor", mu).sliding = "finite";
            const SolidRun run = run_solids(s.scene);
            double sum = 0;
            Vec3 moment = Vec3::Zero();
            for (const ContactRecord& c : run.last().contacts) {
                sum += c.normal_force;
                moment += c.normal_force * c.point;
            }
            const std::string of = fmt::format(", {} points, mu {}", n * n, mu);
            rows.push_back(relative("sum [N]" + of, 100, sum, 1e-8));
            rows.back().note = fmt::format("{} iterations", run.last().iterations);
            rows.push_back(
                at_most("centre of pressure [m]" + of, moment.head<2>().norm() / sum, 1e-8));
        }
    return rows;
}

} // namespace amontons::validation
