#include "solver/solid/shape.hpp"

#include "mesh/base/error.hpp"

#include <array>
#include <cmath>
#include <vector>

namespace amontons {
namespace {

/// Corners of the cube in VTK's order; the first four are those of the square.
constexpr double kCube[8][3] = {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1},
                                {-1, -1, 1},  {1, -1, 1},  {1, 1, 1},  {-1, 1, 1}};

// Simplices in their barycentric coordinates L: corner functions are L_i, or L_i (2 L_i - 1) with
// middle nodes, whose functions are 4 L_a L_b.

template <int D> Eigen::Matrix<double, D + 1, 1> barycentric(const Vec3& xi)
{
    Eigen::Matrix<double, D + 1, 1> L;
    L[0] = 1 - xi.head<D>().sum();
    L.template tail<D>() = xi.head<D>();
    return L;
}

template <int D> Eigen::Matrix<double, D, D + 1> barycentric_gradients()
{
    Eigen::Matrix<double, D, D + 1> G;
    G.col(0).setConstant(-1);
    G.template rightCols<D>().setIdentity();
    return G;
}

constexpr std::array<std::array<int, 2>, 6> kTetrahedronEdges{
    {{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}}};

/// The triangle's edges are the first three of the tetrahedron's.
constexpr int edges_of(int dimension)
{
    return dimension == 2 ? 3 : 6;
}

template <int D, class Values> void quadratic_values(const Vec3& xi, Values& N)
{
    const auto L = barycentric<D>(xi);
    for (int i = 0; i <= D; ++i)
        N[i] = L[i] * (2 * L[i] - 1);
    for (int e = 0; e < edges_of(D); ++e) {
        const auto [a, b] = kTetrahedronEdges[std::size_t(e)];
        N[D + 1 + e] = 4 * L[a] * L[b];
    }
}

template <int D, class Gradients> void quadratic_gradients(const Vec3& xi, Gradients& dN)
{
    const auto L = barycentric<D>(xi);
    const auto dL = barycentric_gradients<D>();
    for (int i = 0; i <= D; ++i)
        dN.col(i) = (4 * L[i] - 1) * dL.col(i);
    for (int e = 0; e < edges_of(D); ++e) {
        const auto [a, b] = kTetrahedronEdges[std::size_t(e)];
        dN.col(D + 1 + e) = 4 * (L[a] * dL.col(b) + L[b] * dL.col(a));
    }
}

std::vector<QuadraturePoint> one_point()
{
    return {{Vec3::Constant(0.25), 1.0 / 6}};
}

/// All points whose barycentric coordinates are permutations of (b, ..., b, a) in D dimensions.
void add_corner_orbit(std::vector<QuadraturePoint>& points, int dimension, double a, double weight)
{
    const double b = (1 - a) / dimension;
    for (int i = 0; i <= dimension; ++i) {
        Vec3 xi = Vec3::Zero();
        xi.head(dimension).setConstant(b);
        if (i > 0) xi[i - 1] = a;
        points.push_back({xi, weight});
    }
}

/// Degree 2 in the tetrahedron.
std::vector<QuadraturePoint> four_points()
{
    std::vector<QuadraturePoint> points;
    add_corner_orbit(points, 3, (5 + 3 * std::sqrt(5.0)) / 20, 1.0 / 24);
    return points;
}

/// Degree 3 in the tetrahedron: corners and middles of faces.
std::vector<QuadraturePoint> eight_points()
{
    std::vector<QuadraturePoint> points;
    add_corner_orbit(points, 3, 1, 1.0 / 240);
    add_corner_orbit(points, 3, 0, 9.0 / 240);
    return points;
}

/// Degree 5 in the tetrahedron, positive weights: a mass matrix of T10 that is positive definite.
/// The numbers solve the moment equations (checked in the tests up to degree 5).
std::vector<QuadraturePoint> fourteen_points()
{
    std::vector<QuadraturePoint> points;
    add_corner_orbit(points, 3, 1 - 3 * 0.31088591926330060980, 0.11268792571801585080 / 6);
    add_corner_orbit(points, 3, 1 - 3 * 0.092735250310891226402, 0.073493043116361949544 / 6);
    const double a = 0.045503704125649649492, b = 0.5 - a, w = 0.042546020777081466438 / 6;
    for (const Vec3& xi :
         {Vec3{a, b, b}, Vec3{b, a, b}, Vec3{b, b, a}, Vec3{b, a, a}, Vec3{a, b, a}, Vec3{a, a, b}})
        points.push_back({xi, w});
    return points;
}

/// Gauss's points along each of the axes.
std::vector<QuadraturePoint> gauss_points(int dimension, int along)
{
    const double a = along == 2 ? 1 / std::sqrt(3.0) : std::sqrt(0.6);
    const std::vector<double> x =
        along == 2 ? std::vector<double>{-a, a} : std::vector<double>{-a, 0, a};
    const std::vector<double> w =
        along == 2 ? std::vector<double>{1, 1} : std::vector<double>{5.0 / 9, 8.0 / 9, 5.0 / 9};
    std::vector<QuadraturePoint> points;
    const std::size_t n = x.size();
    for (std::size_t k = 0; k < (dimension == 3 ? n : 1); ++k)
        for (std::size_t j = 0; j < n; ++j)
            for (std::size_t i = 0; i < n; ++i)
                points.push_back({{x[i], x[j], dimension == 3 ? x[k] : 0},
                                  w[i] * w[j] * (dimension == 3 ? w[k] : 1)});
    return points;
}

/// Degree 2 and 5 (Radon) in the triangle.
std::vector<QuadraturePoint> triangle_points(int degree)
{
    std::vector<QuadraturePoint> points;
    if (degree == 2) {
        add_corner_orbit(points, 2, 2.0 / 3, 1.0 / 6);
        return points;
    }
    const double root = std::sqrt(15.0);
    points.push_back({{1.0 / 3, 1.0 / 3, 0}, 9.0 / 80});
    add_corner_orbit(points, 2, 1 - 2 * (6 - root) / 21, (155 - root) / 2400);
    add_corner_orbit(points, 2, 1 - 2 * (6 + root) / 21, (155 + root) / 2400);
    return points;
}

} // namespace

ShapeValues shape_values(ElementKind kind, const Vec3& xi)
{
    ShapeValues N(shape_of(kind).nodes);
    switch (kind) {
    case ElementKind::T4:
        N = barycentric<3>(xi);
        break;
    case ElementKind::T10:
        quadratic_values<3>(xi, N);
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
        dN = barycentric_gradients<3>();
        break;
    case ElementKind::T10:
        quadratic_gradients<3>(xi, dN);
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
                                                          gauss_points(3, 2)};
    return points[std::size_t(kind)];
}

std::span<const QuadraturePoint> mass_points(ElementKind kind)
{
    static const std::vector<QuadraturePoint> points[] = {four_points(), fourteen_points(),
                                                          gauss_points(3, 3)};
    return points[std::size_t(kind)];
}

FaceValues face_shape_values(int nodes, const Vec3& xi)
{
    AMONTONS_ASSERT(nodes == 3 || nodes == 4 || nodes == 6);
    FaceValues N(nodes);
    if (nodes == 3) N = barycentric<2>(xi);
    if (nodes == 6) quadratic_values<2>(xi, N);
    if (nodes == 4)
        for (int i = 0; i < 4; ++i)
            N[i] = (1 + kCube[i][0] * xi[0]) * (1 + kCube[i][1] * xi[1]) / 4;
    return N;
}

FaceGradients face_shape_gradients(int nodes, const Vec3& xi)
{
    AMONTONS_ASSERT(nodes == 3 || nodes == 4 || nodes == 6);
    FaceGradients dN(2, nodes);
    if (nodes == 3) dN = barycentric_gradients<2>();
    if (nodes == 6) quadratic_gradients<2>(xi, dN);
    if (nodes == 4)
        for (int i = 0; i < 4; ++i) {
            const double *c = kCube[i], f = 1 + c[0] * xi[0], g = 1 + c[1] * xi[1];
            dN.col(i) = Eigen::Vector2d{c[0] * g, f * c[1]} / 4;
        }
    return dN;
}

std::span<const QuadraturePoint> face_points(int nodes)
{
    AMONTONS_ASSERT(nodes == 3 || nodes == 4 || nodes == 6);
    static const std::vector<QuadraturePoint> three = triangle_points(2), four = gauss_points(2, 2),
                                              six = triangle_points(5);
    return nodes == 3 ? three : nodes == 4 ? four : six;
}

} // namespace amontons
