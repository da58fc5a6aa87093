#include "solver/beam/soft_tube.hpp"

#include "mesh/tests/relative.hpp"
#include "solver/beam/tests/held_tube.hpp"

#include <doctest/doctest.h>

using namespace amontons;

namespace {

constexpr double kModulus = 0.5e6;

SolidTubeOptions half_straight(ElementKind kind)
{
    Centreline line(Vec3::Zero(), Vec3::UnitX(), Vec3::UnitY(), kTubeRadius);
    line.append_line(0.02, kTubeRadius);
    line.append_arc(0.04, 1, 0.3, kTubeRadius);
    const bool H8 = kind == ElementKind::H8;
    return {line, 0.0015, H8 ? 14 : 8, 1, H8 ? 16 : 8, kind};
}

SoftTube neo_hooke_tube(ElementKind kind, double nu, double pressure)
{
    const SolidTubeOptions o = half_straight(kind);
    VolumeMesh mesh = make_solid_tube(o);
    WallMaterial m;
    m.law.law = find_law("neo_hooke");
    m.law.constants = {kModulus, nu};
    for_each_element(mesh, [&](std::int32_t, ElementKind k, auto nodes) {
        m.elements.push_back(make_hyperelastic(k, places_of(mesh, nodes), Mat3::Identity()));
    });
    if (pressure != 0)
        m.pressures.push_back({find_set(mesh.face_sets, "inner")->members, pressure});
    const SoftTubeSupport support = held_ends(mesh);
    return SoftTube(o, std::move(mesh), std::move(m), support);
}

/// Plain rounds of offset + K^-1 imbalance.
WallState settled(SoftTube& tube, const std::vector<TubeForce>& forces)
{
    WallState s = tube.state();
    tube.set_forces(forces);
    for (int round = 0; round < 200; ++round) {
        REQUIRE(tube.evaluate_material(s).empty());
        const Eigen::VectorXd off = tube.imbalance(s);
        if (off.cwiseAbs().maxCoeff() < 1e-11) break;
        s.offset += tube.answer(off);
    }
    CHECK(tube.imbalance(s).cwiseAbs().maxCoeff() < 1e-11);
    tube.take(std::make_shared<const WallState>(s));
    return s;
}

} // namespace

TEST_CASE("at rest a hyperelastic wall has the compliance of a linear one")
{
    for (const ElementKind kind : {ElementKind::H8, ElementKind::T10}) {
        const double nu = 0.4;
        SoftTube large = neo_hooke_tube(kind, nu, 0),
                 linear = held_tube(half_straight(kind), {kModulus, nu, 0}, 0);
        const std::vector<TubePlace> places{large.place(0.02, 0.3), large.place(0.03, 1)};
        const Eigen::MatrixXd C = linear.compliance(places);
        CHECK((large.compliance(places) - C).norm() < 1e-9 * C.norm());
    }
}

TEST_CASE("a displacement does not depend on where the tangent is taken and forces on the wall are "
          "the derivative of its energy" *
          doctest::test_suite("slow"))
{
    for (const ElementKind kind : {ElementKind::H8, ElementKind::T10}) {
        SoftTube tube = neo_hooke_tube(kind, 0.45, 2000);
        const TubePlace at = tube.place(0.03, 0.5), other = tube.place(0.035, 1.5);
        const Vec3 f(0.02, 0.03, -0.05);
        const std::vector<TubeForce> forces{{at, f}, {other, Vec3(0, 0.05, 0.02)}};
        const WallState first = settled(tube, forces);
        const Vec3 u = tube.displacement(at);
        CHECK(u.norm() > 1e-4);
        // Castigliano: d energy = sum of forces times what their places move.
        const double h = 1e-3;
        double energy[2], work = 0;
        Vec3 moved[2][2];
        for (int side = 0; side < 2; ++side) {
            const double factor = 1 + (side ? h : -h);
            const WallState s =
                settled(tube, {{at, factor * f}, {other, factor * forces[1].force}});
            energy[side] = s.energy;
            moved[side][0] = tube.displacement(at);
            moved[side][1] = tube.displacement(other);
        }
        work = f.dot(moved[1][0] - moved[0][0]) + forces[1].force.dot(moved[1][1] - moved[0][1]);
        CHECK(energy[1] - energy[0] == test::relative(work).epsilon(1e-5));

        REQUIRE(tube.relinearise(std::make_shared<const Eigen::VectorXd>(first.u)));
        tube.take(std::make_shared<const WallState>(first)); // of the tangent before
        tube.set_forces(forces);
        CHECK((tube.displacement(at) - u).norm() < 1e-10 * u.norm());
        const WallState again = settled(tube, forces);
        CHECK((again.u - first.u).norm() < 1e-9 * first.u.norm());
        CHECK((tube.displacement(at) - u).norm() < 1e-9 * u.norm());
    }
}
