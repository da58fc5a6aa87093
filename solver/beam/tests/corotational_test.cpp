#include "solver/beam/corotational.hpp"
#include "solver/beam/rotation.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <doctest/doctest.h>
#include <random>

using namespace amontons;

namespace {

struct Sample {
    ElementLaw law;
    BeamNode a, b;
    CorotationalStrain natural;
};

Sample some_element(std::mt19937& rng)
{
    std::normal_distribution<double> normal;
    const auto vector = [&](double size) {
        const double x = normal(rng), y = normal(rng), z = normal(rng);
        return Vec3(size * x, size * y, size * z);
    };
    Sample s;
    s.law.length = 0.3;
    s.law.S = {30, 5, 7, 2, 3, 3.5};
    for (std::size_t i = 0; i < 6; ++i)
        s.law.P[i] = s.law.S[i] * (i == 0 ? 1 : i < 3 ? 0 : 0.8 * normal(rng));
    const Vec3 place = vector(1), more = vector(0.02);
    for (int k = 0; k < 3; ++k)
        s.a.x[k] = place[k];
    rotate_in_body(s.a.q, vector(1));
    s.b = s.a;
    const Vec3 chord = rotation_matrix(s.a.q) * (Vec3(0.3, 0, 0) + more);
    for (int k = 0; k < 3; ++k)
        s.b.x[k] += chord[k];
    rotate_in_body(s.b.q, vector(0.4));
    s.natural = corotational_natural(s.law);
    return s;
}

BeamNode rod_node_moved(BeamNode n, const Vec12& y, int end)
{
    for (int k = 0; k < 3; ++k)
        n.x[k] += y[6 * end + k];
    rotate_in_body(n.q, y.segment<3>(6 * end + 3));
    return n;
}

} // namespace

TEST_CASE("the corotational element's forces and tangent are the derivatives of its energy")
{
    std::mt19937 rng{1};
    for (int trial = 0; trial < 5; ++trial) {
        const Sample s = some_element(rng);
        Vec12 g;
        Mat12 H;
        corotational_element(s.a, s.b, s.law, s.natural, g, H);
        constexpr double kStep = 1e-5;
        for (int i = 0; i < 12; ++i) {
            Vec12 y = Vec12::Zero(), after, before;
            Mat12 unused;
            y[i] = kStep;
            const auto energy = [&](const Vec12& d) {
                return corotational_energy(rod_node_moved(s.a, d, 0), rod_node_moved(s.b, d, 1),
                                           s.law, s.natural);
            };
            CHECK(std::abs((energy(y) - energy(-y)) / (2 * kStep) - g[i]) < 1e-7 * g.norm());
            corotational_element(rod_node_moved(s.a, y, 0), rod_node_moved(s.b, y, 1), s.law,
                                 s.natural, after, unused);
            corotational_element(rod_node_moved(s.a, -y, 0), rod_node_moved(s.b, -y, 1), s.law,
                                 s.natural, before, unused);
            Vec12 column = (after - before) / (2 * kStep);
            // The gradient stands in axes that turn with the body: half of that is no stiffness.
            const int end = i / 6;
            if (i % 6 >= 3)
                column.segment<3>(6 * end + 3) -=
                    0.5 * Vec3(g.segment<3>(6 * end + 3)).cross(Vec3::Unit(i % 3));
            CHECK((column - H.col(i)).norm() < 1e-7 * H.norm());
        }
    }
}

TEST_CASE("a corotational element in its natural shape is free of stress wherever it is")
{
    std::mt19937 rng{2};
    const Sample s = some_element(rng);
    // The natural shape: the exact element's pose with its natural strains.
    BeamNode a = s.a, b = a;
    const Vec3 turn = s.law.length * Vec3(s.law.P[3] / s.law.S[3], s.law.P[4] / s.law.S[4],
                                          s.law.P[5] / s.law.S[5]);
    const int parts = 20000; // of the curve, by the midpoint rule
    Vec3 chord = Vec3::Zero();
    for (int i = 0; i < parts; ++i) {
        BeamNode n;
        rotate_in_body(n.q, (i + 0.5) / parts * turn);
        chord += s.law.length / parts * first_axis(n.q);
    }
    const Vec3 d = rotation_matrix(a.q) * chord;
    for (int k = 0; k < 3; ++k)
        b.x[k] = a.x[k] + d[k];
    rotate_in_body(b.q, turn);
    CHECK(corotational_energy(a, b, s.law, s.natural) < 1e-14);
}
