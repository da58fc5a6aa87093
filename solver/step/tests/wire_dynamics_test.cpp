#include "solver/step/wire_step.hpp"

#include "mesh/tests/relative.hpp"
#include "mesh/wall.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <doctest/doctest.h>
#include <numbers>

using namespace amontons;

namespace {

constexpr double kStiffLength = 0.2, kStiffRadius = 1e-3, kStiffEI = 1e-3, kEA = 4000,
                 kDensity = 8000;

/// A wire along x that hangs on its sheath by a first element of almost no stiffness: free.
WireBody free_wire(std::vector<WireWall> walls = {})
{
    BeamSegment link;
    link.length = 0.1;
    link.radius = kStiffRadius;
    link.EI = link.GJ = {1e-15, 1e-15};
    link.EA = {1e-12, 1e-12};
    link.element = 0.05;
    link.density = 1e-9;
    BeamSegment g = link;
    g.length = kStiffLength;
    g.EI = {kStiffEI, kStiffEI};
    g.GJ = {0.77 * kStiffEI, 0.77 * kStiffEI};
    g.EA = {kEA, kEA};
    g.element = 0.01;
    g.density = kDensity;
    Wire wire;
    wire.material = make_material({link, g}, 0);
    wire.sheath = Sheath{};
    WireMotion motion = make_motion(wire.material, 0);
    for (WireWall& w : walls)
        w.friction.assign(wire.material.point.size(), w.friction.front());
    WireBody b = make_wire_body(std::move(wire), std::move(walls), std::move(motion), 1e-11);
    start_in_sheath(b.wire, kStiffLength + 0.05, 0);
    return b;
}

/// Node where the stiff part begins.
int begin(const WireBody& b)
{
    return b.wire.state.first + 1;
}

/// Sets the velocity of a rigid motion about a point.
void set_motion(WireBody& b, const Vec3& about, const Vec3& velocity, const Vec3& spin)
{
    for (int i = begin(b); i <= b.wire.last(); ++i) {
        const std::size_t k = std::size_t(i);
        const BeamNode& n = b.wire.state.nodes[k];
        b.dynamics.velocity[k] = velocity + spin.cross(n.position() - about);
        b.dynamics.spin[k] = rotation_matrix(n.q).transpose() * spin;
    }
}

Vec3 momentum(const WireBody& b)
{
    Vec3 sum = Vec3::Zero();
    for (int i = begin(b); i <= b.wire.last(); ++i)
        sum += b.motion.mass[std::size_t(i)] * b.dynamics.velocity[std::size_t(i)];
    return sum;
}

Vec3 angular_momentum(const WireBody& b, const Vec3& about)
{
    Vec3 sum = Vec3::Zero();
    for (int i = begin(b); i <= b.wire.last(); ++i) {
        const std::size_t k = std::size_t(i);
        const BeamNode& n = b.wire.state.nodes[k];
        sum += b.motion.mass[k] * (n.position() - about).cross(b.dynamics.velocity[k]) +
               rotation_matrix(n.q) * b.motion.inertia[k].cwiseProduct(b.dynamics.spin[k]);
    }
    return sum;
}

Vec3 centre(const WireBody& b)
{
    Vec3 sum = Vec3::Zero();
    double mass = 0;
    for (int i = begin(b); i <= b.wire.last(); ++i) {
        sum += b.motion.mass[std::size_t(i)] * b.wire.state.nodes[std::size_t(i)].position();
        mass += b.motion.mass[std::size_t(i)];
    }
    return sum / mass;
}

StepReport step(WireBody& b, double h)
{
    const StepReport r = try_step(b, b.wire.state.base_insertion, 0, h);
    REQUIRE(r.accepted);
    return r;
}

} // namespace

TEST_CASE("a free wire keeps its momentum and implicit Euler slows its spin as it must")
{
    WireBody b = free_wire();
    const Vec3 v(0.3, -0.2, 0.1);
    const double h = 1e-3, spin = 20; // 0.02 rad a step
    set_motion(b, centre(b), v, Vec3(0, 0, spin));
    const Vec3 p0 = momentum(b), l0 = angular_momentum(b, centre(b));
    // Points at a fixed distance from a centre: x_{n+1} - 2 x_n + x_{n-1} along x_{n+1}, so
    // 2 sin(a_n+1) = sin(a_n+1 + a_n) for the angle a_n of step n; da/dn = -a^3.
    double before = spin * h, now = before, angle = 0;
    for (int i = 0; i < 60; ++i) {
        now = before;
        for (int k = 0; k < 50; ++k)
            now -= (2 * std::sin(now) - std::sin(now + before)) /
                   (2 * std::cos(now) - std::cos(now + before));
        before = now;
        angle += now;
        step(b, h);
    }
    const double slowed = angular_momentum(b, centre(b)).z() / l0.z();
    MESSAGE("momentum drifts by " << (momentum(b) - p0).norm() / p0.norm() << ", spin by "
                                  << slowed - 1 << " in 60 steps of 0.02 rad");
    CHECK((momentum(b) - p0).norm() < 1e-8 * p0.norm());
    CHECK(slowed < 1 - 0.02);
    CHECK(slowed - 1 == test::relative(now / (spin * h) - 1).epsilon(0.02));
    const Vec3 along = rotation_matrix(b.wire.state.nodes.back().q).col(0);
    CHECK(std::atan2(along.y(), along.x()) == test::relative(angle).epsilon(1e-3));
    CHECK(std::abs(angular_momentum(b, centre(b)).x()) < 1e-8 * l0.z());
}

TEST_CASE("the drift of the angular momentum follows the step's length")
{
    double drift[2];
    for (int k = 0; k < 2; ++k) {
        WireBody b = free_wire();
        set_motion(b, centre(b), Vec3::Zero(), Vec3(0, 0, 20));
        const double l0 = angular_momentum(b, centre(b)).z();
        for (int i = 0; i < (k ? 80 : 40); ++i)
            step(b, k ? 5e-4 : 1e-3);
        drift[k] = 1 - angular_momentum(b, centre(b)).z() / l0;
    }
    CHECK(drift[0] / drift[1] == test::relative(2).epsilon(0.05));
}

// Thrown along itself it slides to rest; thrown across, friction sets it rolling: a cylinder keeps
// 2/3 of its speed. Impact is without rebound: it gives friction an impulse of mu m v_z at once.
TEST_CASE("a wire that falls onto a rough plane only loses energy and slides to rest or rolls at "
          "2/3 of its speed")
{
    for (const bool along : {true, false}) {
        CAPTURE(along);
        const double mu = 0.3, g = 9.81, h = 2e-4, speed = 0.2, height = 0.003;
        const Wall plane = make_plane_wall(Vec3(0, 0, -height - kStiffRadius), Vec3::UnitZ());
        std::vector<WireWall> walls(1);
        walls[0].wall = &plane;
        walls[0].friction = {mu};
        WireBody b = free_wire(walls);
        double mass = 0;
        b.wire.dead_force.assign(b.wire.material.node.size(), Vec3::Zero());
        for (int i = begin(b); i <= b.wire.last(); ++i) {
            b.wire.dead_force[std::size_t(i)] = Vec3(0, 0, -g * b.motion.mass[std::size_t(i)]);
            mass += b.motion.mass[std::size_t(i)];
        }
        set_motion(b, centre(b), speed * (along ? Vec3::UnitX() : Vec3::UnitY()), Vec3::Zero());
        const auto total = [&] {
            return elastic_energy(b.wire) + kinetic_energy(b) + mass * g * centre(b).z();
        };
        const double from = centre(b).x();
        const double start = total(), thrown = 0.5 * mass * speed * speed;
        double energy = start, friction = 0, released = 0, rise = 0;
        for (int i = 0; i < 500; ++i) {
            const StepReport r = step(b, h);
            rise = std::max(rise, total() - energy);
            energy = total();
            friction += r.energy.friction;
            released += r.energy.released;
            CHECK(r.energy.friction >= -1e-12 * thrown);
            CHECK(r.newton.residual.penetration < 1e-9);
        }
        MESSAGE("of " << start - energy << " J: friction " << friction << ", numerical and impact "
                      << released << "; largest rise " << rise);
        CHECK(rise < 1e-9 * thrown);
        CHECK(friction + released == test::relative(start - energy).epsilon(1e-3));
        if (along) {
            const double after = speed - mu * std::sqrt(2 * g * height);
            CHECK(momentum(b).norm() < 1e-3 * mass * speed);
            const double way = speed * std::sqrt(2 * height / g) + after * after / (2 * mu * g);
            CHECK(centre(b).x() - from == test::relative(way).epsilon(0.01));
            // The impact's friction acts at speeds between those before and after it.
            CHECK(friction > mass * after * (0.5 * after + speed - after));
            CHECK(friction < thrown);
        } else {
            CHECK(momentum(b).y() == test::relative(2. / 3 * mass * speed).epsilon(1e-3));
            CHECK(kinetic_energy(b) == test::relative(2. / 3 * thrown).epsilon(1e-3));
        }
    }
}

TEST_CASE("a wire pushed out of its sheath at a steady speed keeps that speed")
{
    BeamSegment g;
    g.length = 0.3;
    g.radius = kStiffRadius;
    g.EI = {kStiffEI, kStiffEI};
    g.GJ = {0.77 * kStiffEI, 0.77 * kStiffEI};
    g.EA = {kEA, kEA};
    g.element = 0.01;
    g.density = kDensity;
    Wire wire;
    wire.material = make_material({g}, 0);
    wire.sheath = Sheath{};
    WireMotion motion = make_motion(wire.material, 0);
    WireBody b = make_wire_body(std::move(wire), {}, std::move(motion), 1e-10);
    start_in_sheath(b.wire, 0.1, 0);
    const double speed = 1, h = 1e-3;
    for (Vec3& v : b.dynamics.velocity)
        v = Vec3(speed, 0, 0);
    EnergyRecord sum;
    double push = 0, kinetic = kinetic_energy(b);
    const double mass_per_length = kDensity * std::numbers::pi * kStiffRadius * kStiffRadius;
    for (int i = 1; i <= 100; ++i) {
        const StepReport r = try_step(b, 0.1 + speed * h * i, 0, h);
        REQUIRE(r.accepted);
        push = std::max(push, std::abs(base_load(b.wire).push));
        sum.work += r.energy.work;
        sum.released += r.energy.released;
    }
    // Mass that came out moving needs no force; at rest it would take density A v^2 to set it
    // in motion.
    CHECK(push < 0.01 * mass_per_length * speed * speed);
    CHECK(kinetic_energy(b) - kinetic ==
          test::relative(0.5 * mass_per_length * 0.1 * speed * speed).epsilon(1e-6));
    CHECK(sum.work == test::relative(kinetic_energy(b) - kinetic).epsilon(1e-3));
    CHECK(std::abs(sum.released) < 1e-3 * sum.work);
}

TEST_CASE("a refused dynamic step changes nothing and no velocities either")
{
    WireBody b = free_wire();
    set_motion(b, centre(b), Vec3(0.1, 0.2, 0.3), Vec3(0, 0, 5));
    step(b, 1e-3);
    const std::vector<Vec3> velocity = b.dynamics.velocity, spin = b.dynamics.spin,
                            force = b.dynamics.inertia_force;
    const Vec3 tip = b.wire.state.nodes.back().position();
    const Wall wall =
        make_plane_wall(tip + Vec3(0, 0, 1e-4), Vec3::UnitZ()); // the wire is behind it
    b.walls.resize(1);
    b.walls[0].wall = &wall;
    b.walls[0].friction.assign(b.wire.material.point.size(), 0);
    b.wire.state.reaction.assign(b.wire.material.point.size(), {});
    b.dynamics.contact_force.assign(b.wire.material.point.size(), Vec3::Zero());
    b.dynamics.contact_arm = b.dynamics.contact_force;
    b.work = std::make_unique<NewtonWorkspace>(b.wire, 1);
    const StepReport r = try_step(b, b.wire.state.base_insertion, 0, 1e-6);
    CHECK(!r.accepted);
    CHECK(b.dynamics.velocity == velocity);
    CHECK(b.dynamics.spin == spin);
    CHECK(b.dynamics.inertia_force == force);
    CHECK(b.wire.state.nodes.back().position() == tip);
}
