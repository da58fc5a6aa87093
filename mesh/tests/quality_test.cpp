#include "mesh/quality.hpp"

#include "mesh/tests/sample_volumes.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <doctest/doctest.h>
#include <numbers>

using namespace amontons;

namespace {

VolumeMesh one_tetrahedron(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d)
{
    VolumeMesh mesh;
    mesh.nodes = {a, b, c, d};
    mesh.blocks = {{ElementKind::T4, {0, 1, 2, 3}}};
    return mesh;
}

} // namespace

TEST_CASE("the regular tetrahedron has shape 1 and dihedral angles acos(1/3)")
{
    for (const double size : {1e-6, 1.0, 1e6}) { // no unit of length is special
        const VolumeMesh mesh = one_tetrahedron(size * Vec3(1, 1, 1), size * Vec3(-1, 1, -1),
                                                size * Vec3(1, -1, -1), size * Vec3(-1, -1, 1));
        const ElementQuality q = measure_quality(mesh)[0];
        CHECK(q.shape == doctest::Approx(1).epsilon(1e-14));
        CHECK(q.least_dihedral == doctest::Approx(std::acos(1. / 3)).epsilon(1e-14));
        CHECK(q.greatest_dihedral == doctest::Approx(std::acos(1. / 3)).epsilon(1e-14));
        CHECK(q.volume == doctest::Approx(8. / 3 * size * size * size).epsilon(1e-14));
        CHECK(q.jacobian_ratio() == 1);
        CHECK(q.aspect() == doctest::Approx(1).epsilon(1e-14));
    }
}

TEST_CASE("the corner of a cube: dihedral angles 90 and acos(1/sqrt 3) and shape by hand")
{
    const ElementQuality q =
        measure_quality(one_tetrahedron({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}))[0];
    CHECK(q.volume == doctest::Approx(1. / 6).epsilon(1e-14));
    CHECK(q.least_dihedral == doctest::Approx(std::acos(1 / std::sqrt(3.0))).epsilon(1e-14));
    CHECK(q.greatest_dihedral == doctest::Approx(std::numbers::pi / 2).epsilon(1e-14));
    CHECK(q.shape == doctest::Approx(12 * std::pow(0.5, 2. / 3) / 9).epsilon(1e-14));
}

TEST_CASE("a tetrahedron that flattens loses its shape and one turned inside out is negative")
{
    double last = 1;
    for (const double height : {0.5, 0.1, 1e-2, 1e-4}) {
        const double shape =
            measure_quality(one_tetrahedron({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.3, 0.3, height}))[0]
                .shape;
        CHECK(shape > 0);
        CHECK(shape < last);
        last = shape;
    }
    const ElementQuality inside_out =
        measure_quality(one_tetrahedron({0, 0, 0}, {0, 1, 0}, {1, 0, 0}, {0, 0, 1}))[0];
    CHECK(inside_out.shape < 0);
    CHECK(inside_out.volume == doctest::Approx(-1. / 6));
}

TEST_CASE("a parallelepiped has one det J and a trapezium the ratio of its sides")
{
    VolumeMesh mesh;
    const Vec3 a(2, 0, 0), b(1, 1, 0), c(0.5, 0.5, 3);
    mesh.nodes = {{0, 0, 0}, a, a + b, b, c, a + c, a + b + c, b + c};
    mesh.blocks = {{ElementKind::H8, {0, 1, 2, 3, 4, 5, 6, 7}}};
    ElementQuality q = measure_quality(mesh)[0];
    CHECK(q.jacobian_ratio() == doctest::Approx(1).epsilon(1e-14));
    CHECK(q.volume == doctest::Approx(6).epsilon(1e-14));
    CHECK(q.least_jacobian == doctest::Approx(6. / 8).epsilon(1e-14));
    // Sides of 2 and 1 at distance 1, thickness 1: det J at a corner is proportional to its side.
    mesh.nodes = {{0, 0, 0}, {2, 0, 0}, {1.5, 1, 0}, {0.5, 1, 0},
                  {0, 0, 1}, {2, 0, 1}, {1.5, 1, 1}, {0.5, 1, 1}};
    q = measure_quality(mesh)[0];
    CHECK(q.volume == doctest::Approx(1.5).epsilon(1e-14));
    CHECK(q.jacobian_ratio() == doctest::Approx(0.5).epsilon(1e-14));
    CHECK(q.least_dihedral == doctest::Approx(std::atan2(1, 0.5)).epsilon(1e-14));
}

TEST_CASE("a T10 with straight edges is its T4 and the volume under a moved middle node is exact")
{
    VolumeMesh t4 = one_tetrahedron({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1});
    VolumeMesh t10;
    t10.nodes = t4.nodes;
    t10.nodes.insert(
        t10.nodes.end(),
        {{0.5, 0, 0}, {0.5, 0.5, 0}, {0, 0.5, 0}, {0, 0, 0.5}, {0.5, 0, 0.5}, {0, 0.5, 0.5}});
    t10.blocks = {{ElementKind::T10, {0, 1, 2, 3, 4, 5, 6, 7, 8, 9}}};
    const ElementQuality straight = measure_quality(t10)[0], flat = measure_quality(t4)[0];
    CHECK(straight.volume == doctest::Approx(flat.volume).epsilon(1e-14));
    CHECK(straight.jacobian_ratio() == doctest::Approx(1).epsilon(1e-13));
    CHECK(straight.shape == flat.shape);
    // Moving the node between 0 and 1 by -h e_y moves the face y = 0 by 4 L0 L1 h, the face z = 0
    // only within itself: the volume grows by the integral of 4 L0 L1 h over a triangle, h / 6.
    const double h = 0.05;
    t10.nodes[4][1] -= h;
    CHECK(measure_quality(t10)[0].volume == doctest::Approx(1. / 6 + h / 6).epsilon(1e-13));
    t10.nodes[4] = {0.5, 0.3, 0.3}; // through the element
    CHECK(measure_quality(t10)[0].least_jacobian < 0);
}

TEST_CASE("the report has the least and the median and the greatest")
{
    std::vector<ElementQuality> all(5);
    for (int i = 0; i < 5; ++i) {
        all[static_cast<std::size_t>(i)].volume = (7 * i) % 5 + 1; // 1 3 5 2 4
        all[static_cast<std::size_t>(i)].shortest_edge = 1;
        all[static_cast<std::size_t>(i)].longest_edge = 1 + i;
    }
    const QualityReport report = report_of(all);
    CHECK(report.volume == 15);
    CHECK(report.element_volume.least == 1);
    CHECK(report.element_volume.median == 3);
    CHECK(report.element_volume.greatest == 5);
    CHECK(report.aspect.greatest == 5);
    CHECK(report_of({}).volume == 0);
}
