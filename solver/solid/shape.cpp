#include "solver/solid/shape.hpp"

#include "mesh/base/error.hpp"

#include <array>
#include <cmath>
#include <vector>

namespace amontons {
namespace {

/// Corners of the cube in VTK's order.
constexpr double kCube[8][3] = {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1},
                                {-1, -1, 1},  {1, -1, 1},  {1, 1, 1},  {-1, 1, 1}};

// Simplices in their barycentric coordinates L: corner functions are L_i, or L_i (2 L_i - 1) with
// middle nodes, whose functions are 4 L_a L_b.

Eigen::Vector4d barycentric(const Vec3& xi)
{
    return {1 - xi.sum(), xi[0], xi[1], xi[2]};
}

Eigen::Matrix<double, 3, 4> barycentric_gradients()
{
    Eigen::Matrix<double, 3, 4> G;
    G.col(0).setConstant(-1);
    G.rightCols<3>().setIdentity();
    return G;
}

constexpr std::array<std::array<int, 2>, 6> kTetrahedronEdges{
    {{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}}};

void quadratic_values(const Vec3& xi, ShapeValues& N)
{
    const Eigen::Vector4d L = barycentric(xi);
    for (int i = 0; i < 4; ++i)
        N[i] = L[i] * (2 * L[i] - 1);
    for (int e = 0; e < 6; ++e) {
        const auto [a, b] = kTetrahedronEdges[std::size_t(e)];
        N[4 + e] = 4 * L[a] * L[b];
    }
}

void quadratic_gradients(const Vec3& xi, ShapeGradients& dN)
{
    const Eigen::Vector4d L = barycentric(xi);
    const Eigen::Matrix<double, 3, 4> dL = barycentric_gradients();
    for (int i = 0; i < 4; ++i)
        dN.col(i) = (4 * L[i] - 1) * dL.col(i);
    for (int e = 0; e < 6; ++e) {
        const auto [a, b] = kTetrahedronEdges[std::size_t(e)];
        dN.col(4 + e) = 4 * (L[a] * dL.col(b) + L[b] * dL.col(a));
    }
}

std::vector<QuadraturePoint> one_point()
{
    return {{Vec3::Constant(0.25), 1.0 / 6}};
}

/// All points whose barycentric coordinates are permutations of (b, b, b, a).
void add_corner_orbit(std::vector<QuadraturePoint>& points, double a, double weight)
{
    for (int i = 0; i <= 3; ++i) {
        Vec3 xi = Vec3::Constant((1 - a) / 3);
        if (i > 0) xi[i - 1] = a;
        points.push_back({xi, weight});
    }
}

/// Degree 2 in the tetrahedron.
std::vector<QuadraturePoint> four_points()
{
    std::vector<QuadraturePoint> points;
    add_corner_orbit(points, (5 + 3 * std::sqrt(5.0)) / 20, 1.0 / 24);
    return points;
}

/// Degree 3 in the tetrahedron: corners and middles of faces.
std::vector<QuadraturePoint> eight_points()
{
    std::vector<QuadraturePoint> points;
    add_corner_orbit(points, 1, 1.0 / 240);
    add_corner_orbit(points, 0, 9.0 / 240);
    return points;
}

/// Degree 5 in the tetrahedron, positive weights: a mass matrix of T10 that is positive definite.
/// The numbers solve the moment equations (checked in the tests up to degree 5).
std::vector<QuadraturePoint> fourteen_points()
{
    std::vector<QuadraturePoint> points;
    add_corner_orbit(points, 1 - 3 * 0.31088591926330060980, 0.11268792571801585080 / 6);
    add_corner_orbit(points, 1 - 3 * 0.092735250310891226402, 0.073493043116361949544 / 6);
    const double a = 0.045503704125649649492, b = 0.5 - a, w = 0.042546020777081466438 / 6;
    for (const Vec3& xi :
         {Vec3{a, b, b}, Vec3{b, a, b}, Vec3{b, b, a}, Vec3{b, a, a}, Vec3{a, b, a}, Vec3{a, a, b}})
        points.push_back({xi, w});
    return points;
}

/// Gauss's points along each of the axes.
std::vector<QuadraturePoint> cube_points(int along)
{
    std::vector<QuadraturePoint> points;
    const std::span<const QuadraturePoint> square = square_points(along);
    const auto n = static_cast<std::size_t>(along);
    for (std::size_t k = 0; k < n; ++k) // along an axis: those of the square's first row
        for (const QuadraturePoint& p : square)
            points.push_back({{p.xi[0], p.xi[1], square[k].xi[0]},
                              p.weight * square[k].weight / std::sqrt(square[0].weight)});
    return points;
}

} // namespace

ShapeValues shape_values(ElementKind kind, const Vec3& xi)
{
    ShapeValues N(shape_of(kind).nodes);
    switch (kind) {
    case ElementKind::T4:
        N = barycentric(xi);
        break;
    case ElementKind::T10:
        quadratic_values(xi, N);
        break;
    case ElementKind::H8:
        for (int i = 0; i < 8; ++i)
            N[i] = (1 + kCube[i][0] * xi[0]) * (1 + kCube[i][1] * xi[1]) *
                   (1 + kCube[i][2] * xi[2]) / 8;
        break;
    }
    return N;
}

ShapeGradients shape_gradients(ElementKind kind, const Vec3& xi)
{
    ShapeGradients dN(3, shape_of(kind).nodes);
    switch (kind) {
    case ElementKind::T4:
        dN = barycentric_gradients();
        break;
    case ElementKind::T10:
        quadratic_gradients(xi, dN);
        break;
    case ElementKind::H8:
        for (int i = 0; i < 8; ++i) {
            const double* c = kCube[i];
            const Vec3 f{1 + c[0] * xi[0], 1 + c[1] * xi[1], 1 + c[2] * xi[2]};
            dN.col(i) = Vec3{c[0] * f[1] * f[2], f[0] * c[1] * f[2], f[0] * f[1] * c[2]} / 8;
        }
        break;
    }
    return dN;
}

ShapeGradients reference_nodes(ElementKind kind)
{
    ShapeGradients xi = ShapeGradients::Zero(3, shape_of(kind).nodes);
    if (kind == ElementKind::H8) {
        for (int i = 0; i < 8; ++i)
            xi.col(i) = Vec3{kCube[i][0], kCube[i][1], kCube[i][2]};
        return xi;
    }
    xi.middleCols<3>(1).setIdentity();
    for (int e = 0; e + 4 < xi.cols(); ++e) {
        const auto [a, b] = kTetrahedronEdges[std::size_t(e)];
        xi.col(4 + e) = (xi.col(a) + xi.col(b)) / 2;
    }
    return xi;
}

std::span<const QuadraturePoint> stiffness_points(ElementKind kind)
{
    static const std::vector<QuadraturePoint> points[] = {one_point(), eight_points(),
                                                          cube_points(2)};
    return points[std::size_t(kind)];
}

std::span<const QuadraturePoint> mass_points(ElementKind kind)
{
    static const std::vector<QuadraturePoint> points[] = {four_points(), fourteen_points(),
                                                          cube_points(3)};
    return points[std::size_t(kind)];
}

} // namespace amontons
