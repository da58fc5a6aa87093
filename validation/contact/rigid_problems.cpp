#include "validation/contact/rigid_problems.hpp"

#include "validation/contact/problem_builder.hpp"

#include <algorithm>
#include <cmath>
#include <random>

namespace amontons {
namespace {

/// Mass and inertia of a new body, its momentum before the step and its weight.
int add_body(ProblemBuilder& p, double mass, const Mat3& inertia, const Vec3& velocity)
{
    const int dof = p.add_unknowns(6);
    for (int i = 0; i < 3; ++i) {
        p.add_stiffness(dof + i, dof + i, mass);
        p.add_force(dof + i, mass * velocity[i]);
        for (int j = 0; j < 3; ++j)
            if (inertia(i, j) != 0) p.add_stiffness(dof + 3 + i, dof + 3 + j, inertia(i, j));
    }
    p.add_force(dof + 2, -mass * kProblemGravity * kProblemStep);
    return dof;
}

Mat3 box_inertia(double mass, const Vec3& size)
{
    const Vec3 s = size.cwiseAbs2();
    return (mass / 12 * Vec3(s[1] + s[2], s[0] + s[2], s[0] + s[1])).asDiagonal();
}

struct Sphere {
    Vec3 x;
    double radius;
};

/// Falls and is pushed apart until nothing overlaps by more than a thousandth.
void settle(std::vector<Sphere>& all, double side)
{
    constexpr int kSweeps = 4000;
    constexpr double kOverlap = 1e-3;
    double mean = 0;
    for (const Sphere& s : all)
        mean += s.radius / static_cast<double>(all.size());
    for (int sweep = 0; sweep < kSweeps; ++sweep) {
        const bool falls = sweep < kSweeps / 2;
        double worst = 0;
        for (Sphere& s : all)
            if (falls) s.x[2] -= 0.01 * mean;
        for (std::size_t a = 0; a < all.size(); ++a) {
            for (std::size_t b = a + 1; b < all.size(); ++b) {
                const Vec3 d = all[a].x - all[b].x;
                const double touch = all[a].radius + all[b].radius, length = d.norm();
                if (length >= touch) continue;
                worst = std::max(worst, touch - length);
                const Vec3 apart = 0.5 * (touch - length) / length * d;
                all[a].x += apart;
                all[b].x -= apart;
            }
            Sphere& s = all[a];
            for (int k = 0; k < 2; ++k)
                s.x[k] = std::clamp(s.x[k], s.radius, side - s.radius);
            s.x[2] = std::max(s.x[2], s.radius);
        }
        if (!falls && worst < kOverlap * mean) return;
    }
}

} // namespace

GlobalProblem tower(const Tower& t)
{
    ProblemBuilder p;
    int below = -1;
    for (int k = 0; k < t.boxes; ++k) {
        const bool top = k + 1 == t.boxes;
        const double mass = top ? t.top_mass : 1;
        const int body = add_body(p, mass, box_inertia(mass, t.size),
                                  top ? Vec3(t.push, 0, 0) : Vec3(Vec3::Zero()));
        for (const double x : {-0.5, 0.5})
            for (const double y : {-0.5, 0.5}) {
                const Vec3 corner(x * t.size[0], y * t.size[1], 0);
                const Vec3 half(0, 0, 0.5 * t.size[2]);
                p.add_contact({body, corner - half}, {below, corner + half}, Vec3::UnitZ(), 0,
                              t.mu);
            }
        below = body;
    }
    return p.finish(ContactLevel::velocity);
}

GlobalProblem wall(const BrickWall& w)
{
    const Vec3 size(0.2, 0.1, 0.1);
    std::mt19937 rng{w.seed};
    std::uniform_real_distribution<double> uniform;
    ProblemBuilder p;
    struct Brick {
        int body;
        double x;
    };
    std::vector<Brick> below;
    for (int row = 0; row < w.rows; ++row) {
        std::vector<Brick> here;
        for (int column = 0; column < w.columns; ++column) {
            const double mass = std::pow(w.mass_ratio, uniform(rng));
            const bool kicked = row == w.rows / 2 && column == w.columns / 2;
            const int body =
                add_body(p, mass, box_inertia(mass, size), Vec3(0, kicked ? w.perturb : 0, 0));
            const double x = (column + 0.5 * (row % 2)) * size[0];
            here.push_back({body, x});
            // The ground carries the first row; every other brick has one or two below it.
            const std::vector<Brick> ground{{-1, x}};
            for (const Brick& b : row == 0 ? ground : below) {
                const double left = std::max(x, b.x) - size[0] / 2;
                const double right = std::min(x, b.x) + size[0] / 2;
                if (right - left < 0.1 * size[0]) continue;
                for (const double at : {left, right})
                    for (const double y : {-0.5, 0.5}) {
                        const Vec3 up(0, y * size[1], size[2] / 2),
                            down(0, y * size[1], -size[2] / 2);
                        p.add_contact({body, down + Vec3(at - x, 0, 0)},
                                      {b.body, up + Vec3(at - b.x, 0, 0)}, Vec3::UnitZ(), 0, w.mu);
                    }
            }
        }
        below = here;
    }
    return p.finish(ContactLevel::velocity);
}

GlobalProblem spheres(const Spheres& s)
{
    constexpr double kNear = 0.02; // gaps below this share of the radius are contacts
    std::mt19937 rng{s.seed};
    std::uniform_real_distribution<double> uniform;
    std::vector<Sphere> all;
    double volume = 0;
    for (int k = 0; k < s.count; ++k) {
        const double radius = 0.05 * std::pow(s.radius_ratio, uniform(rng));
        volume += 8 * std::pow(radius, 3);
        all.push_back({Vec3::Zero(), radius});
    }
    const double side = std::max(std::cbrt(volume), 0.1 * s.radius_ratio * 1.5);
    for (Sphere& a : all)
        a.x = Vec3(side * uniform(rng), side * uniform(rng), 2 * side * uniform(rng));
    settle(all, side);

    ProblemBuilder p;
    std::vector<int> body;
    for (const Sphere& a : all) {
        const double mass = 1000 * 4.0 / 3 * 3.14159265358979 * std::pow(a.radius, 3);
        const Vec3 velocity = 0.1 * Vec3(uniform(rng) - 0.5, uniform(rng) - 0.5, -uniform(rng));
        body.push_back(
            add_body(p, mass, 0.4 * mass * a.radius * a.radius * Mat3::Identity(), velocity));
    }
    for (std::size_t a = 0; a < all.size(); ++a) {
        const double r = all[a].radius;
        const auto touch = [&](const Vec3& n, double gap, const ProblemBuilder::Place& other) {
            if (gap < kNear * r)
                p.add_contact({body[a], -r * n}, other, n, std::max(gap, 0.0) / kProblemStep, s.mu);
        };
        touch(Vec3::UnitZ(), all[a].x[2] - r, {});
        for (const int k : {0, 1}) {
            touch(Vec3::Unit(k), all[a].x[k] - r, {});
            touch(-Vec3::Unit(k), side - all[a].x[k] - r, {});
        }
        for (std::size_t b = 0; b < a; ++b) {
            const Vec3 d = all[a].x - all[b].x;
            const Vec3 n = d.normalized();
            touch(n, d.norm() - r - all[b].radius, {body[b], all[b].radius * n});
        }
    }
    return p.finish(ContactLevel::velocity);
}

GlobalProblem rods(const Rods& r)
{
    const double length = 1, mass = 1, thin = 1e-3 * mass;
    const Vec3 along(std::cos(r.angle), 0, std::sin(r.angle));
    // About its middle: m L^2 / 12 across, almost 0 along.
    const Mat3 inertia =
        mass * length * length / 12 * (Mat3::Identity() - along * along.transpose()) +
        thin * along * along.transpose();
    ProblemBuilder p;
    int before = -1;
    for (int k = 0; k < r.count; ++k) {
        const int body = add_body(p, mass, inertia, Vec3(r.speed, 0, 0));
        const Vec3 half = 0.5 * length * along;
        // Sliding towards the side to which the rod is inclined presses the lower end into the floor.
        p.add_contact({body, -half}, {}, Vec3::UnitZ(), 0, r.mu);
        if (before >= 0) {
            const Vec3 across(std::sin(r.angle), 0, -std::cos(r.angle));
            p.add_contact({body, 0.3 * half}, {before, 0.6 * half}, across, 0, r.mu);
        }
        before = body;
    }
    return p.finish(ContactLevel::velocity);
}

} // namespace amontons
