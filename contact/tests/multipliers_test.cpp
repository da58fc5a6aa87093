#include "contact/surface/multipliers.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <doctest/doctest.h>
#include <numeric>
#include <random>

using namespace amontons;

namespace {

/// A face of 3, 4 or 6 nodes in space; `bend` moves middle nodes of a T6 and a corner of a Q4 out
/// of the plane, `skew` takes a Q4 from a parallelogram and middle nodes along their sides.
FaceInPlane some_face(int nodes, double bend, double skew)
{
    std::vector<Vec3> places = {{0, 0, 0}, {1.2, 0.1, 0}, {0.3, 0.9, 0}};
    if (nodes == 4) places = {{0, 0, 0}, {1.2, 0.1, 0}, {1.4 + skew, 1.1, bend}, {0.2, 1, 0}};
    if (nodes == 6)
        for (int i = 0; i < 3; ++i) {
            const Vec3 a = places[std::size_t(i)], b = places[std::size_t((i + 1) % 3)];
            places.push_back((a + b) / 2 + skew * (b - a) + Vec3(0, 0, bend * (i + 1)));
        }
    const Eigen::AngleAxisd turn(0.7, Vec3(0.3, -0.8, 0.5).normalized());
    for (Vec3& x : places)
        x = turn * x;
    std::vector<std::int32_t> numbers(places.size());
    std::iota(numbers.begin(), numbers.end(), 0);
    return {numbers, places};
}

/// int psi_i N_j, by many points.
Eigen::Matrix<double, 4, 6> products(const FaceInPlane& face, const FaceMultipliers& m)
{
    Eigen::Matrix<double, 4, 6> sum = Eigen::Matrix<double, 4, 6>::Zero();
    const auto add = [&](const Vec2& xi, double weight) {
        const FaceSpot at = spot(face, xi);
        weight *= at.along[0].cross(at.along[1]).norm();
        sum += weight * (m.functions * at.values) * at.values.transpose();
    };
    constexpr int n = 16;
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j)
            if (face.nodes == 4) {
                for (const QuadraturePoint& p : square_points(3))
                    add({(p.xi[0] + 2 * i + 1) / n - 1, (p.xi[1] + 2 * j + 1) / n - 1},
                        p.weight / (n * n));
            } else {
                for (const QuadraturePoint& p : triangle_points(5)) {
                    if (i + j < n) add({(p.xi[0] + i) / n, (p.xi[1] + j) / n}, p.weight / (n * n));
                    if (i + j < n - 1)
                        add({(i + 1 - p.xi[0]) / n, (j + 1 - p.xi[1]) / n}, p.weight / (n * n));
                }
            }
    return sum;
}

/// The largest int psi_i N_j that should be 0, of the largest that should not.
double not_dual(const FaceInPlane& face)
{
    const FaceMultipliers m = face_multipliers(face);
    const Eigen::Matrix<double, 4, 6> all = products(face, m);
    double kept = 0, rest = 0;
    for (int i = 0; i < m.count; ++i)
        for (int j = 0; j < face.nodes; ++j) {
            double& largest = j == m.node[std::size_t(i)] ? kept : rest;
            largest = std::max(largest, std::abs(all(i, j)));
        }
    return rest / kept;
}

} // namespace

TEST_CASE(
    "multipliers are dual to the shape functions: T3 and T6 on flat faces and Q4 on any flat one")
{
    CHECK(not_dual(some_face(3, 0, 0)) < 1e-14);
    CHECK(not_dual(some_face(6, 0, 0)) < 1e-13);
    CHECK(not_dual(some_face(4, 0, 0)) < 1e-14);
    CHECK(not_dual(some_face(4, 0, 0.5)) < 1e-14);
    // A warped Q4 up to the points of integration, a curved T6 up to its curvature.
    CHECK(not_dual(some_face(4, 0.1, 0.3)) < 1e-5); // [regression] our points of integration
    const double once = not_dual(some_face(6, 0.02, 0)), twice = not_dual(some_face(6, 0.04, 0));
    CHECK(once < 0.02); // [regression] our own run
    CHECK(twice / once == doctest::Approx(4).epsilon(0.1));
    CHECK(not_dual(some_face(6, 0, 0.05)) > 1e-3); // the law can fail
}

TEST_CASE("multipliers sum to 1 everywhere on curved faces too")
{
    std::mt19937 rng{3};
    std::uniform_real_distribution<double> uniform(-1, 2);
    for (const int nodes : {3, 4, 6}) {
        const FaceInPlane face = some_face(nodes, 0.2, 0.1);
        const FaceMultipliers m = face_multipliers(face);
        for (int k = 0; k < 50; ++k) {
            const FaceSpot at = spot(face, {uniform(rng), uniform(rng)});
            CHECK(std::abs((m.functions * at.values).sum() - 1) < 1e-12);
        }
    }
}

TEST_CASE("full areas are the integrals of the multipliers and those of a face sum to its area")
{
    for (const int nodes : {3, 4, 6}) {
        const FaceInPlane face = some_face(nodes, 0.05, 0.1);
        const FaceMultipliers m = face_multipliers(face);
        const Eigen::Vector4d area = products(face, m).rowwise().sum();
        for (int i = 0; i < m.count; ++i)
            CHECK(m.full[std::size_t(i)] == doctest::Approx(area[i]).epsilon(1e-3));
    }
    const FaceInPlane flat = some_face(6, 0, 0);
    for (int i = 0; i < 3; ++i)
        CHECK(std::abs(face_multipliers(flat).full[std::size_t(i)] - (1.2 * 0.9 - 0.03) / 6) <
              1e-15);
}

TEST_CASE("the parts nearest to each node tile the reference face and hold their node")
{
    for (const int nodes : {3, 4, 6}) {
        double sum = 0;
        const FaceMultipliers m = face_multipliers(some_face(nodes, 0, 0));
        for (int i = 0; i < m.count; ++i) {
            const ConvexPolygon part = nearest_part(nodes, i);
            sum += area(part);
            const Vec2 inside = middle(part);
            Eigen::Index nearest = 0;
            shape_values(nodes, inside).maxCoeff(&nearest);
            CHECK(nearest == m.node[std::size_t(i)]);
            for (int j = 0; j < i; ++j) {
                ConvexPolygon shared;
                intersect(part, nearest_part(nodes, j), shared);
                CHECK(area(shared) < 1e-15);
            }
        }
        CHECK(std::abs(sum - (nodes == 4 ? 4 : 0.5)) < 1e-15);
    }
}
