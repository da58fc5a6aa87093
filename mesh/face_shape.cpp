#include "mesh/face_shape.hpp"

#include "mesh/base/error.hpp"

#include <array>
#include <cmath>
#include <vector>

namespace amontons {
namespace {

constexpr int kMostAlong = 12;

/// Adds the places whose barycentric coordinates are permutations of (b, b, a).
void add_orbit(std::vector<QuadraturePoint>& points, double a, double weight)
{
    const double b = (1 - a) / 2;
    points.push_back({{b, b, 0}, weight});
    points.push_back({{a, b, 0}, weight});
    points.push_back({{b, a, 0}, weight});
}

std::vector<QuadraturePoint> degree_2()
{
    std::vector<QuadraturePoint> points;
    add_orbit(points, 2.0 / 3, 1.0 / 6);
    return points;
}

/// The moment equations of two orbits, in closed form.
std::vector<QuadraturePoint> degree_4()
{
    std::vector<QuadraturePoint> points;
    const double root = std::sqrt(10.0), inner = std::sqrt(38 - 44 * std::sqrt(0.4)),
                 outer = std::sqrt(213125 - 53320 * root);
    add_orbit(points, 1 - (8 - root + inner) / 9, (620 + outer) / 7440);
    add_orbit(points, 1 - (8 - root - inner) / 9, (620 - outer) / 7440);
    return points;
}

/// Radon's points.
std::vector<QuadraturePoint> degree_5()
{
    const double root = std::sqrt(15.0);
    std::vector<QuadraturePoint> points{{{1.0 / 3, 1.0 / 3, 0}, 9.0 / 80}};
    add_orbit(points, 1 - 2 * (6 - root) / 21, (155 - root) / 2400);
    add_orbit(points, 1 - 2 * (6 + root) / 21, (155 + root) / 2400);
    return points;
}

/// Gauss's points along both axes.
std::vector<QuadraturePoint> gauss(const std::vector<double>& x, const std::vector<double>& w)
{
    std::vector<QuadraturePoint> points;
    for (std::size_t j = 0; j < x.size(); ++j)
        for (std::size_t i = 0; i < x.size(); ++i)
            points.push_back({{x[i], x[j], 0}, w[i] * w[j]});
    return points;
}

/// Gauss-Legendre on [0, 1]: roots of P_n by Newton's method from Tricomi's estimate.
void gauss_legendre(int n, std::vector<double>& x, std::vector<double>& w)
{
    for (int k = 1; k <= n; ++k) {
        double z = std::cos(std::acos(-1.0) * (k - 0.25) / (n + 0.5)), slope = 1;
        for (int step = 0; step < 8; ++step) {
            double below = 1, value = z;
            for (int j = 2; j <= n; ++j) {
                const double next = ((2 * j - 1) * z * value - (j - 1) * below) / j;
                below = value;
                value = next;
            }
            slope = n * (z * value - below) / (z * z - 1);
            z -= value / slope;
        }
        x.push_back((1 + z) / 2);
        w.push_back(1 / ((1 - z * z) * slope * slope));
    }
}

std::vector<QuadraturePoint> collapsed(int along)
{
    std::vector<double> x, w;
    gauss_legendre(along, x, w);
    std::vector<QuadraturePoint> points;
    for (std::size_t j = 0; j < x.size(); ++j)
        for (std::size_t i = 0; i < x.size(); ++i)
            points.push_back({{x[i] * (1 - x[j]), x[j], 0}, w[i] * w[j] * (1 - x[j])});
    return points;
}

} // namespace

FaceValues face_shape_values(int nodes, const Vec3& xi)
{
    AMONTONS_ASSERT(nodes == 3 || nodes == 4 || nodes == 6);
    FaceValues N(nodes);
    double dx[kMostSolidFaceNodes], dy[kMostSolidFaceNodes];
    evaluate_face(nodes, xi[0], xi[1], N.data(), dx, dy);
    return N;
}

FaceGradients face_shape_gradients(int nodes, const Vec3& xi)
{
    AMONTONS_ASSERT(nodes == 3 || nodes == 4 || nodes == 6);
    FaceGradients dN(2, nodes);
    double N[kMostSolidFaceNodes], dx[kMostSolidFaceNodes], dy[kMostSolidFaceNodes];
    evaluate_face(nodes, xi[0], xi[1], N, dx, dy);
    for (int i = 0; i < nodes; ++i)
        dN.col(i) << dx[i], dy[i];
    return dN;
}

std::span<const QuadraturePoint> face_points(int nodes)
{
    AMONTONS_ASSERT(nodes == 3 || nodes == 4 || nodes == 6);
    return nodes == 3 ? triangle_points(2) : nodes == 4 ? square_points(2) : triangle_points(5);
}

std::span<const QuadraturePoint> triangle_points(int degree)
{
    AMONTONS_ASSERT(degree == 2 || degree == 4 || degree == 5);
    static const std::vector<QuadraturePoint> two = degree_2(), four = degree_4(),
                                              five = degree_5();
    return degree == 2 ? two : degree == 4 ? four : five;
}

std::span<const QuadraturePoint> triangle_points_along(int along)
{
    AMONTONS_ASSERT(along >= 2 && along <= kMostAlong);
    static const std::vector<std::vector<QuadraturePoint>> rules = [] {
        std::vector<std::vector<QuadraturePoint>> all;
        for (int n = 2; n <= kMostAlong; ++n)
            all.push_back(collapsed(n));
        return all;
    }();
    return rules[static_cast<std::size_t>(along - 2)];
}

std::span<const QuadraturePoint> square_points(int along)
{
    AMONTONS_ASSERT(along == 2 || along == 3);
    static const double a = 1 / std::sqrt(3.0), b = std::sqrt(0.6);
    static const std::vector<QuadraturePoint> two = gauss({-a, a}, {1, 1}),
                                              three = gauss({-b, 0, b}, {5. / 9, 8. / 9, 5. / 9});
    return along == 2 ? two : three;
}

} // namespace amontons
