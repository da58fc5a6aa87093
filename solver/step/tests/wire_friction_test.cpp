#include "solver/step/wire_friction.hpp"

#include "mesh/tests/relative.hpp"
#include "solver/beam/clamp.hpp"
#include "solver/step/tests/wire_on_plane.hpp"

#include <cmath>
#include <doctest/doctest.h>

using namespace amontons;

namespace {

constexpr double kWay = 1e-4;

/// A straight wire along x that lies on the plane z = -radius, all points of it.
struct Dragged {
    Wire wire;
    Wall plane = make_plane_wall(Vec3(0, 0, -kLyingRadius), Vec3::UnitZ());
    std::vector<WireWall> walls{1};
    std::vector<Proximity> near;
    StepStart start;
    std::vector<ContactBefore> before;

    Dragged()
    {
        BeamSegment g;
        g.length = 0.05;
        g.radius = kLyingRadius;
        g.EI = {kLyingEI, kLyingEI};
        g.GJ = {4e-4, 4e-4};
        g.EA = {5000, 5000};
        g.element = 2.5e-3;
        wire.material = make_material({g}, g.element);
        wire.state.reaction.assign(wire.material.point.size(), {});
        start_clamped(wire, Vec3::Zero(), Mat3::Identity());
        walls[0].wall = &plane;
        walls[0].friction.assign(wire.material.point.size(), kLyingFriction);
        near.resize(wire.material.point.size());
    }
    Dragged(const Dragged&) = delete;

    double points() const { return double(wire.material.point.size()); }
    void press(double normal, const Vec3& tangential)
    {
        for (Reaction& r : wire.state.reaction) {
            r.normal = normal;
            r.tangential = tangential;
        }
    }
    void begin()
    {
        start = mark_step_start(wire);
        before = contacts_before(wire, walls, near);
    }
    void drag()
    {
        for (BeamNode& n : wire.state.nodes)
            n.move(0, kWay);
    }
    double work()
    {
        std::vector<Candidate> candidates;
        find_candidates(wire, walls, start, kLyingRadius, near, candidates);
        return friction_work(wire, start, before, candidates);
    }
};

} // namespace

TEST_CASE("friction of a force that grows over the step does the mean force's work")
{
    Dragged d;
    d.press(1, -kLyingFriction * 1 * Vec3::UnitX());
    d.begin();
    d.drag();
    d.press(3, -kLyingFriction * 3 * Vec3::UnitX());
    CHECK(d.work() == test::relative(d.points() * kLyingFriction * 2 * kWay).epsilon(1e-12));
}

TEST_CASE("a contact that comes or leaves in the step has done half of its work and a chain of "
          "contacts that hand on a force has done all of it")
{
    Dragged appears, leaves;
    appears.begin();
    appears.drag();
    appears.press(2, -kLyingFriction * 2 * Vec3::UnitX());
    leaves.press(2, -kLyingFriction * 2 * Vec3::UnitX());
    leaves.begin();
    leaves.drag();
    leaves.press(0, Vec3::Zero());
    const double half = appears.points() * kLyingFriction * 1 * kWay;
    CHECK(appears.work() == test::relative(half).epsilon(1e-12));
    CHECK(leaves.work() == test::relative(half).epsilon(1e-12));
}

TEST_CASE("what stuck even the other way slips at Coulomb's bound")
{
    Dragged d;
    d.press(2, 0.5 * kLyingFriction * 2 * Vec3::UnitX());
    d.begin();
    d.drag();
    d.press(2, -kLyingFriction * 2 * Vec3::UnitX());
    CHECK(d.work() == test::relative(d.points() * kLyingFriction * 2 * kWay).epsilon(1e-12));
}

TEST_CASE("a contact that sticks does no work nor does one without friction")
{
    Dragged stuck, smooth;
    stuck.press(2, 0.5 * kLyingFriction * 2 * Vec3::UnitX());
    stuck.begin();
    CHECK(stuck.work() == 0);
    smooth.walls[0].friction.assign(smooth.wire.material.point.size(), 0.0);
    smooth.press(2, Vec3::Zero());
    smooth.begin();
    smooth.drag();
    CHECK(smooth.work() == 0);
}

TEST_CASE("a wire that turns about itself slips around by its radius times the angle")
{
    Dragged d;
    const double angle = 1e-3, force = kLyingFriction * 2;
    // The surface below moves towards -y when the wire turns about x, so friction is along +y.
    d.press(2, Vec3(0, force, 0));
    d.begin();
    for (BeamNode& n : d.wire.state.nodes)
        rotate_in_body(n.q, angle * Vec3::UnitX());
    const double slip = 2 * kLyingRadius * std::sin(angle / 2); // a chord, and that in the plane
    CHECK(std::abs(d.work()) == test::relative(d.points() * force * slip).epsilon(angle * angle));
    d.press(0, Vec3::Zero());
    CHECK(std::abs(d.work()) ==
          test::relative(d.points() * 0.5 * force * slip).epsilon(angle * angle));
}
