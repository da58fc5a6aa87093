#include "solver/step/wall_force.hpp"

#include "mesh/generate/ball.hpp"

#include <algorithm>
#include <cmath>
#include <doctest/doctest.h>
#include <limits>

using namespace amontons;

namespace {

/// The corner that a force at x counts at, by a search of all triangles.
std::size_t corner_next_to(const SurfaceMesh& mesh, const Vec3& x)
{
    double least = std::numeric_limits<double>::infinity();
    std::size_t best = 0;
    for (const auto& t : mesh.triangles) {
        const auto at = [&](int i) { return mesh.points[std::size_t(t[std::size_t(i)])]; };
        const double d = (x - closest_on_triangle(x, at(0), at(1), at(2)).point).norm();
        if (d >= least) continue;
        least = d;
        best = std::size_t(*std::min_element(t.begin(), t.end(), [&](auto i, auto j) {
            return (mesh.points[std::size_t(i)] - x).norm() <
                   (mesh.points[std::size_t(j)] - x).norm();
        }));
    }
    return best;
}

} // namespace

TEST_CASE("a wall keeps the largest force at the corner next to each contact of two sliding wires")
{
    const SurfaceMesh mesh = *make_ball({Vec3::Zero(), 1, true, 0.2}).surface;
    constexpr int kWall = 3, kOther = 1;
    WallForce force;
    std::vector<double> expected(mesh.points.size(), 0);
    for (int step = 0; step < 60; ++step) {
        std::vector<ContactRecord> contacts;
        for (int wire = 5; wire < 7; ++wire)
            for (int i = 0; i < 10 + step % 3; ++i) { // some appear and disappear
                const double s = 0.11 * i - 0.013 * step, aside = wire == 5 ? 0.3 : -0.4;
                ContactRecord c;
                c.point = 0.99 * Vec3{std::cos(s), std::sin(s), aside}.normalized();
                c.body_a = wire;
                c.body_b = i % 4 == 3 ? kOther : kWall;
                c.clustered_force = 2 + std::sin(7.0 * i + 3 * step + wire);
                contacts.push_back(c);
                if (c.body_b != kWall) continue;
                double& f = expected[corner_next_to(mesh, c.point)];
                f = std::max(f, c.clustered_force);
            }
        note_forces(kWall, contacts, force);
        if (step % 7 == 2) assign_forces(mesh, force); // at any time
    }
    CHECK(!force.pending.empty());
    assign_forces(mesh, force);
    REQUIRE(*std::max_element(expected.begin(), expected.end()) > 2.9);
    CHECK(force.largest == expected);
}
