#include "mesh/generate/plane.hpp"
#include "mesh/generate/tube.hpp"
#include "mesh/tests/relative.hpp"
#include "solver/beam/clamp.hpp"
#include "solver/step/tests/vessel_scene.hpp"
#include "solver/step/wire_newton.hpp"

#include <cmath>
#include <cstring>
#include <doctest/doctest.h>
#include <numbers>

using namespace amontons;

TEST_CASE("a beam on a foundation bends as Winkler's: w = q/k + P beta / (2 k) under the load")
{
    const double EI = 5.2e-4, radius = 4e-4, k = 2000, h = 2.5e-3;
    const double beta = std::pow(k / (4 * EI), 0.25);
    const int elements = 2 * int(std::round(8 / beta / h));
    Wire wire;
    BeamSegment g;
    g.length = elements * h;
    g.radius = radius;
    g.EI = {EI, EI};
    g.GJ = {0.77 * EI, 0.77 * EI};
    g.EA = {5000, 5000};
    g.element = h;
    wire.material = make_material({g}, h); // contact points at the nodes
    wire.state.reaction.assign(wire.material.point.size(), {});
    start_clamped(wire, Vec3::Zero(), Mat3::Identity());
    // q keeps the wire on the springs where P alone would lift it.
    const double q = 0.05, P = 0.002;
    wire.dead_force.assign(wire.material.node.size(), Vec3(0, 0, -q * h));
    wire.dead_force.back() *= 0.5;
    const auto middle = std::size_t(elements / 2);
    const Wall plane = make_plane_wall(Vec3(0, 0, -radius), Vec3::UnitZ());
    std::vector<WireWall> walls(1);
    walls[0].wall = &plane;
    walls[0].foundation = k;
    walls[0].friction.assign(wire.material.point.size(), 0);
    NewtonWorkspace work(wire, 1);
    NewtonOptions options;
    options.reach = 1.35 * radius;
    options.longest_move = 2e-3;
    CHECK(solve_equilibrium(wire, walls, mark_step_start(wire), {}, options, work).converged);
    const double settled = -wire.state.nodes[middle].position().z();
    CHECK(settled == test::relative(q / k).epsilon(1e-3));
    wire.dead_force[middle].z() -= P;
    const NewtonReport r = solve_equilibrium(wire, walls, mark_step_start(wire), {}, options, work);
    CHECK(r.converged);
    CHECK(r.stable);
    CHECK(r.iterations <= 6); // [regression] our own run
    CHECK(-wire.state.nodes[middle].position().z() - settled ==
          test::relative(P * beta / (2 * k)).epsilon(3e-3));
    // Some way off: e^(-x) (cos x + sin x) of it.
    const double x = 10 * h * beta, shape = std::exp(-x) * (std::cos(x) + std::sin(x));
    CHECK(-wire.state.nodes[middle + 10].position().z() - settled ==
          test::relative(P * beta / (2 * k) * shape).epsilon(1e-2));
    // Energy of the springs: half of each force times its give.
    double energy = 0;
    for (const Candidate& c : work.candidates)
        energy += 0.5 * c.normal * c.normal / (k * h);
    CHECK(energy > 0);
    CHECK(wire.state.wall_energy >= 0.9 * energy); // the ends stand for half a spacing or a whole
}

TEST_CASE("a wire in a soft vessel: certified and in balance and its energy accounted for" *
          doctest::test_suite("slow"))
{
    for (const double mu : {0.0, 0.1}) {
        CAPTURE(mu);
        const Run r = run(vessel_scene(0.6e6, mu, 0.09));
        REQUIRE_MESSAGE(r.summary.status == "done", r.summary.message);
        CHECK(r.summary.uncertified_steps == 0);
        CHECK(r.summary.worst_penetration < 1e-9);
        CHECK(std::abs(r.summary.energy.error()) < 0.01 * r.summary.energy.work_absolute);
        CHECK((r.summary.energy.friction > 0) == (mu > 0));
        // What the contacts push with is what the wall carries.
        Vec3 on_wire = Vec3::Zero(), on_wall = Vec3::Zero();
        for (const ContactRecord& c : r.keep.records.back().contacts)
            on_wire += c.force;
        REQUIRE(r.bodies.size() == 1);
        const std::vector<double>& f = r.bodies[0].point_fields[1].values;
        REQUIRE(r.bodies[0].point_fields[1].name == "contact_force");
        for (std::size_t i = 0; i + 2 < f.size(); i += 3)
            on_wall += Vec3(f[i], f[i + 1], f[i + 2]);
        CHECK(on_wire.norm() > 0.01);
        CHECK((on_wire + on_wall).norm() < 1e-8 * on_wire.norm());
    }
}

TEST_CASE("forces scale with all stiffnesses together" * doctest::test_suite("slow"))
{
    const Run one = run(vessel_scene(0.6e6, 0.1, 0.07)),
              two = run(vessel_scene(0.6e6, 0.1, 0.07, 2));
    REQUIRE(one.keep.records.size() == two.keep.records.size());
    CHECK(value(two.keep.records.back(), "push_force") ==
          test::relative(2 * value(one.keep.records.back(), "push_force")).epsilon(1e-6));
}

namespace {

/// The rigid scene of vessel_scene(), on springs of k [N/m^2] below its wall; 0: rigid.
Run run_on_springs(double k, double mu, double depth, std::vector<Obstacle>& tube)
{
    Scene scene = vessel_scene(1, mu, depth);
    Centreline line(Vec3::Zero(), Vec3::UnitX(), Vec3::UnitY(), 0.005);
    line.append_line(0.02, 0.005);
    line.append_arc(0.03, std::numbers::pi / 2, 0, 0.005);
    line.append_line(0.03, 0.005);
    scene.solids.clear();
    scene.obstacles.resize(1);
    scene.obstacles[0].name = "vessel";
    scene.contact[0].foundation = k;
    std::vector<Obstacle> obstacles;
    tube.clear();
    tube.push_back({"vessel", make_tube({line, 0})});
    obstacles.push_back({"vessel", make_tube({line, 0})});
    return run(scene, std::move(obstacles));
}

} // namespace

TEST_CASE("a stiffer wall takes the push force to that of a rigid one and gives less" *
          doctest::test_suite("slow"))
{
    const double depth = 0.08;
    std::vector<Obstacle> tube;
    const double expected =
        value(run_on_springs(0, 0.1, depth, tube).keep.records.back(), "push_force");
    double before = 1e300;
    for (const double E : {0.3e6, 3e6, 3e8}) {
        CAPTURE(E);
        const Run r = run(vessel_scene(E, 0.1, depth));
        REQUIRE_MESSAGE(r.summary.status == "done", r.summary.message);
        const double off = std::abs(value(r.keep.records.back(), "push_force") - expected);
        CHECK(off < before);
        before = off;
    }
    CHECK(before < 2e-3 * expected);
}

TEST_CASE("a scene's foundation: the wall yields by force over stiffness and length and energy "
          "is accounted for and stiff springs are a rigid wall")
{
    const double depth = 0.08, h = 1.25e-3; // two contact points an element
    for (const double mu : {0.0, 0.1}) {
        CAPTURE(mu);
        std::vector<Obstacle> tube;
        const double k = 2e5; // about 0.1 mm under the forces here
        const Run soft = run_on_springs(k, mu, depth, tube);
        REQUIRE_MESSAGE(soft.summary.status == "done", soft.summary.message);
        CHECK(soft.summary.uncertified_steps == 0);
        double deepest = 0;
        for (const ContactRecord& c : soft.keep.records.back().contacts) {
            WallHint hint;
            const double compliance = -tube[0].model.wall.distance(c.point, hint);
            CHECK(compliance == test::relative(c.normal_force / (k * h)).epsilon(1e-4));
            deepest = std::max(deepest, compliance);
        }
        CHECK(deepest > 5e-5);
        const EnergyRecord& e = soft.keep.records.back().energy;
        CHECK(std::abs(e.error()) < 1e-2 * e.work);
        const double force = value(soft.keep.records.back(), "push_force");
        const double rigid =
            value(run_on_springs(0, mu, depth, tube).keep.records.back(), "push_force");
        const double stiff =
            value(run_on_springs(1e10, mu, depth, tube).keep.records.back(), "push_force");
        CHECK(std::abs(force - rigid) > 1e-2 * rigid);
        CHECK(stiff == test::relative(rigid).epsilon(1e-3));
    }
}

TEST_CASE("a run in a soft vessel continues from a saved state to the last bit")
{
    const Scene scene = vessel_scene(0.6e6, 0.1, 0.06);
    std::atomic<bool> never{false}, stop{false};
    Keep whole, first, rest;
    WireSimulation a(scene, {});
    REQUIRE(a.run(whole, never).status == "done");
    first.stop = &stop;
    first.stop_at = 40;
    WireSimulation b(scene, {});
    REQUIRE(b.run(first, stop).status == "interrupted");
    WireSimulation c(scene, {});
    c.restore(b.save());
    REQUIRE(c.run(rest, never).status == "done");
    REQUIRE(!rest.records.empty());
    REQUIRE(first.records.size() + rest.records.size() == whole.records.size());
    const StepRecord &r = rest.records.back(), &w = whole.records.back();
    REQUIRE(r.quantities.size() == w.quantities.size());
    for (std::size_t q = 0; q < w.quantities.size(); ++q)
        CHECK(std::memcmp(&r.quantities[q].value, &w.quantities[q].value, sizeof(double)) == 0);
}
