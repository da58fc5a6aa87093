#include "solver/solid/shape.hpp"

#include "solver/solid/tests/solid_samples.hpp"

#include <doctest/doctest.h>

using namespace amontons;
using test::kAllKinds;

TEST_CASE("a shape function is 1 at its node and 0 at the others and they sum to 1")
{
    test::Random random(1);
    for (const ElementKind kind : kAllKinds) {
        CAPTURE(shape_of(kind).name);
        const ShapeGradients at = reference_nodes(kind);
        for (Eigen::Index i = 0; i < at.cols(); ++i)
            CHECK((shape_values(kind, at.col(i)) - ShapeValues::Unit(at.cols(), i)).norm() < 1e-15);
        const Vec3 xi = random.vector();
        CHECK(shape_values(kind, xi).sum() == doctest::Approx(1));
        // They reproduce the place itself.
        CHECK((at * shape_values(kind, xi) - xi).norm() < 1e-14);
        for (const LocalEdge& edge : shape_of(kind).edges)
            if (edge.middle >= 0)
                CHECK((at.col(edge.begin) + at.col(edge.end) - 2 * at.col(edge.middle)).norm() ==
                      0);
    }
}

TEST_CASE("shape gradients are the differences of shape values")
{
    // The functions are quadratic at most along each axis: central differences are exact.
    test::Random random(2);
    const double h = 0.25;
    for (int trial = 0; trial < 10; ++trial) {
        const Vec3 xi = random.vector();
        for (const ElementKind kind : kAllKinds) {
            const ShapeGradients dN = shape_gradients(kind, xi);
            for (int k = 0; k < 3; ++k)
                CHECK((dN.row(k).transpose() - (shape_values(kind, xi + h * Vec3::Unit(k)) -
                                                shape_values(kind, xi - h * Vec3::Unit(k))) /
                                                   (2 * h))
                          .norm() < 1e-13);
        }
        for (const int nodes : {3, 4, 6}) {
            const FaceGradients dN = face_shape_gradients(nodes, xi);
            for (int k = 0; k < 2; ++k)
                CHECK((dN.row(k).transpose() - (face_shape_values(nodes, xi + h * Vec3::Unit(k)) -
                                                face_shape_values(nodes, xi - h * Vec3::Unit(k))) /
                                                   (2 * h))
                          .norm() < 1e-13);
        }
    }
}

TEST_CASE("on a face the element's shape functions are those of the face")
{
    test::Random random(3);
    for (const ElementKind kind : kAllKinds)
        for (const LocalFace& face : shape_of(kind).faces) {
            const Vec3 s = random.vector();
            const FaceValues on_face = face_shape_values(face.count, s);
            Vec3 xi = Vec3::Zero();
            for (int i = 0; i < face.count; ++i)
                xi += on_face[i] * reference_nodes(kind).col(face.node[std::size_t(i)]);
            ShapeValues expected = ShapeValues::Zero(shape_of(kind).nodes);
            for (int i = 0; i < face.count; ++i)
                expected[face.node[std::size_t(i)]] = on_face[i];
            CHECK((shape_values(kind, xi) - expected).norm() < 1e-13);
        }
}

namespace {

/// Integral of x^a y^b z^c over the reference element (dimension 2: its face), in closed form.
double moment(bool simplex, int dimension, int a, int b, int c)
{
    const auto factorial = [](int n) { return std::tgamma(n + 1.0); };
    if (simplex)
        return factorial(a) * factorial(b) * factorial(c) / factorial(a + b + c + dimension);
    double product = 1;
    for (const int n : {a, b, c})
        product *= n % 2 ? 0 : 2.0 / (n + 1);
    return dimension == 3 ? product : product / 2;
}

/// The greatest error of a rule over all monomials of a degree (cubes: along each axis).
double worst_error(std::span<const QuadraturePoint> points, bool simplex, int dimension, int degree)
{
    double worst = 0;
    for (int a = 0; a <= degree; ++a)
        for (int b = 0; b <= degree; ++b)
            for (int c = 0; c <= (dimension == 3 ? degree : 0); ++c) {
                if (simplex && a + b + c > degree) continue;
                double sum = 0;
                for (const QuadraturePoint& p : points)
                    sum += p.weight * std::pow(p.xi[0], a) * std::pow(p.xi[1], b) *
                           std::pow(p.xi[2], c);
                worst = std::max(worst, std::abs(sum - moment(simplex, dimension, a, b, c)));
            }
    return worst;
}

} // namespace

TEST_CASE("integration points are exact up to their degree and no further")
{
    struct Rule {
        std::span<const QuadraturePoint> points;
        bool simplex;
        int dimension, degree;
    };
    const Rule rules[] = {{stiffness_points(ElementKind::T4), true, 3, 1},
                          {stiffness_points(ElementKind::T10), true, 3, 3},
                          {stiffness_points(ElementKind::H8), false, 3, 3},
                          {mass_points(ElementKind::T4), true, 3, 2},
                          {mass_points(ElementKind::T10), true, 3, 5},
                          {mass_points(ElementKind::H8), false, 3, 5},
                          {face_points(3), true, 2, 2},
                          {face_points(6), true, 2, 5},
                          {triangle_points(4), true, 2, 4},
                          {triangle_points_along(2), true, 2, 2},
                          {triangle_points_along(3), true, 2, 4},
                          {triangle_points_along(5), true, 2, 8},
                          {face_points(4), false, 2, 3},
                          {square_points(3), false, 2, 5}};
    for (const Rule& rule : rules) {
        CAPTURE(rule.points.size());
        CHECK(worst_error(rule.points, rule.simplex, rule.dimension, rule.degree) < 2e-15);
        CHECK(worst_error(rule.points, rule.simplex, rule.dimension, rule.degree + 1) > 1e-6);
        for (const QuadraturePoint& p : rule.points)
            CHECK(p.weight > 0);
    }
}
