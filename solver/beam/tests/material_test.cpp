#include "solver/beam/material.hpp"

#include "mesh/tests/relative.hpp"
#include "solver/beam/held_base.hpp"
#include "solver/beam/rotation.hpp"
#include "solver/beam/tests/random_wire.hpp"

#include <cmath>
#include <doctest/doctest.h>

using namespace amontons;

namespace {

/// integral of f over [a, b] by the midpoint rule in many pieces.
template <class F> double integral(double a, double b, F f)
{
    const int n = 20000;
    double sum = 0;
    for (int i = 0; i < n; ++i)
        sum += f(a + (b - a) * (i + 0.5) / n);
    return sum * (b - a) / n;
}

/// Two segments of 0.4 m, the second with this curvature and twist [1/m].
WireMaterial straight_then_bent(double curvature, double twist)
{
    std::vector<BeamSegment> parts(2);
    for (BeamSegment& g : parts) {
        g.length = 0.4;
        g.radius = 1e-4;
        g.EI = {2e-4, 2e-4};
        g.GJ = {1e-4, 1e-4};
        g.EA = {100, 100};
        g.element = 0.4;
    }
    parts[1].curvature = curvature;
    parts[1].twist = twist;
    return make_material(parts, 0);
}

} // namespace

TEST_CASE("nodes and contact points divide the wire as its segments specify")
{
    const WireMaterial m = make_material(test::three_segments(), 0.2);
    CHECK(m.length == test::relative(8.5).epsilon(1e-15));
    CHECK(m.node.size() == 12 + 6 + 4 + 1);
    CHECK(m.node.front() == 0);
    CHECK(m.node.back() == m.length);
    CHECK(m.point.front().s == m.length); // the tip is a contact point
    for (std::size_t p = 0; p + 1 < m.point.size(); ++p) {
        CHECK(m.point[p].s - m.point[p + 1].s == test::relative(0.2).epsilon(1e-12));
        const std::size_t e = std::size_t(m.point[p].element);
        CHECK(m.point[p].s ==
              test::relative(m.node[e] + m.point[p].xi * (m.node[e + 1] - m.node[e])));
    }
    // The radius belongs to the segment that the point is on.
    CHECK(m.point.front().segment == 2);
    CHECK(m.point.back().segment == 0);
}

TEST_CASE("flexibilities and bending energy of the held part are the integrals of the section")
{
    const WireMaterial m = make_material(test::three_segments(), 0);
    for (double s : {0.3, 5.99, 6.4, 7.5, 7.6, 8.3, 8.5}) {
        CAPTURE(s);
        const HeldWire held = held_between_base_and(m, s);
        CHECK(held.axial == test::relative(integral(0, s, [&](double x) {
                                return 1 / section_at(m, x).stiffness[0];
                            })).epsilon(1e-6));
        CHECK(held.torsion == test::relative(integral(0, s, [&](double x) {
                                  return 1 / section_at(m, x).stiffness[3];
                              })).epsilon(1e-6));
        const double bending = integral(0, s, [&](double x) {
            const Section c = section_at(m, x);
            return 0.5 * (c.stiffness[4] * c.natural[4] * c.natural[4] +
                          c.stiffness[5] * c.natural[5] * c.natural[5]);
        });
        CHECK(std::abs(held.bending - bending) < 1e-5 * 0.128);
    }
}

TEST_CASE("a tapered element bends and stretches as its sections in series")
{
    const WireMaterial m = make_material(test::three_segments(), 0);
    const ElementLaw law = law_between(m, 6.1, 7.3);
    const double L = 7.3 - 6.1;
    for (std::size_t i : {0, 3, 4, 5}) {
        const double flexibility =
            integral(6.1, 7.3, [&](double x) { return 1 / section_at(m, x).stiffness[i]; });
        CHECK(law.S[i] == test::relative(L * L / flexibility).epsilon(1e-8));
    }
    // Closed form of the linear taper from 2 to 0.4 over 1.5.
    const double a = 2 - 1.6 * 0.1 / 1.5, b = 2 - 1.6 * 1.3 / 1.5;
    CHECK(law.S[5] == test::relative(L * (b - a) / std::log(b / a)).epsilon(1e-12));
    const double c = 1.1 - 0.4 * 0.1 / 1.5, d = 1.1 - 0.4 * 1.3 / 1.5; // across
    CHECK(law.S[4] == test::relative(L * (d - c) / std::log(d / c)).epsilon(1e-12));
    // The bending flexibility that a constant strain cannot show is in the shear.
    CHECK(law.S[1] == test::relative(L * 12 * law.S[5] / (L * L * L)).epsilon(1e-12));
    CHECK(law.S[2] == test::relative(L * 12 * law.S[4] / (L * L * L)).epsilon(1e-12));
}

TEST_CASE("shear flexibility adds to the residual bending flexibility")
{
    const WireMaterial rigid = make_material(test::three_segments(), 0);
    const WireMaterial soft = make_material(test::three_segments(40), 0);
    const ElementLaw a = law_between(rigid, 1, 1.5), b = law_between(soft, 1, 1.5);
    CHECK(1 / (b.S[1] / 0.5) == test::relative(1 / (a.S[1] / 0.5) + 1.0 / 40).epsilon(1e-12));
    CHECK(b.S[4] == a.S[4]);
}

TEST_CASE("an element across a step of natural curvature can be free of stress")
{
    // The step at 7.5 is spread over a radius; energy has its minimum, zero, at the mean.
    const WireMaterial m = make_material(test::three_segments(), 0);
    const ElementLaw law = law_between(m, 7.3, 7.8);
    BeamNode a, b;
    move_along(b, natural_strain(law), law.length);
    CHECK(std::abs(element_energy(a, b, law)) < 1e-14 * law.constant);
    const double mean =
        integral(7.3, 7.8, [&](double x) { return section_at(m, x).natural[5]; }) / 0.5;
    CHECK(law.P[5] / law.S[5] == test::relative(mean).epsilon(1e-5));
    CHECK(mean == test::relative(0.6 * 0.8 * std::cos(0.7)).epsilon(1e-6));
}

TEST_CASE("the ends of an unstressed element are where an arc after a straight piece has them")
{
    // A step of 5 / m halfway: its spread of a radius of 1e-4 is too short to count. Of the mean
    // curvature alone the second end would be off by angle * L / 8.
    const WireMaterial m = straight_then_bent(5, 0);
    const ElementLaw law = law_between(m, 0.2, 0.6);
    const double r = 1.0 / 5, angle = 0.2 / r;
    BeamNode b;
    move_along(b, natural_strain(law), law.length);
    CHECK(b.x[0] == test::relative(0.2 + r * std::sin(angle)).epsilon(1e-6));
    CHECK(b.x[1] == test::relative(r * (1 - std::cos(angle))).epsilon(1e-6));
    CHECK(b.x[2] == 0);
    CHECK(first_axis(b.q)[1] == test::relative(std::sin(angle)).epsilon(1e-9));
    CHECK(std::abs(element_energy(BeamNode{}, b, law)) < 1e-13 * law.constant);
}

TEST_CASE("what grows out of the sheath across a step of curvature has the slope of its energy")
{
    const WireMaterial m = straight_then_bent(5, 3);
    HeldBase base{m};
    base.next = 0.6;
    base.inserted = 0.6; // 0.2 m of the first segment are out, of 0.4
    base.base_insertion = 0.5999;
    base.rotation = 0.1;
    BeamNode a, b;
    move_along(b, {1.001, 0.05, -0.03, 0.4, 0.7, 2}, 0.4);
    const auto energy = [&](double further) {
        const HeldWire held = held_part(base, base.end() - further);
        const double stretch = base.stretch() + further, turn = base.base_twist - base.rotation;
        return element_energy(a, b, law_at_end(base, further)) +
               0.5 * stretch * stretch / held.axial + 0.5 * turn * turn / held.torsion +
               held.bending;
    };
    const double h = 1e-4, near = (energy(h) - energy(-h)) / (2 * h),
                 far = (energy(2 * h) - energy(-2 * h)) / (4 * h);
    const double slope = growth(base, a, b, law_at_end(base, 0), 0).slope;
    CHECK(slope == test::relative((4 * near - far) / 3).epsilon(1e-6));
}

TEST_CASE("a step of curvature is spread over a wire radius and nothing jumps")
{
    const WireMaterial m = make_material(test::three_segments(), 0);
    const double radius = 0.05, full = 0.8 * std::cos(0.7);
    CHECK(section_at(m, 7.5 - 0.51 * radius).natural[5] == 0);
    CHECK(section_at(m, 7.5 + 0.51 * radius).natural[5] == test::relative(full).epsilon(1e-12));
    CHECK(section_at(m, 7.5).natural[5] == test::relative(0.5 * full).epsilon(1e-9));
    double before = section_at(m, 7).natural[5];
    for (double s = 7; s < 8; s += 1e-4) {
        const double here = section_at(m, s).natural[5];
        CHECK(std::abs(here - before) < 1.01e-4 / radius * full + 1e-12);
        before = here;
    }
}
