// C09: a heavy rod in a tube: its unstable modes, and from where on it runs around the tube.

#include "mesh/base/limits.hpp"
#include "solver/obstacle/build.hpp"
#include "solver/step/body_build.hpp"
#include "validation/families/rods/rods.hpp"
#include "validation/solid_run.hpp"

#include <cmath>
#include <fmt/format.h>
#include <numbers>

namespace amontons::validation {
namespace {

constexpr double kLongRodEI = 0.157079633, kWeight = 0.241929338, kLength = 20,
                 kLongRodRadius = 1e-3;
constexpr int kElements = 200;
constexpr double kDrag = 0.02;  // the push grows by 1 N/s: slow against w / (clearance drag)
constexpr double kAside = 1e-3; // [N], at a place: straight, the rod would be in balance

/// The largest angle from below at which a rod on a wall along x stands, by way of the rod.
double farthest_round(const std::vector<Vec3>& line)
{
    double angle = 0, most = 0;
    Vec3 before = -Vec3::UnitZ();
    for (const Vec3& x : line) {
        angle += std::atan2(before.y() * x.z() - before.z() * x.y(),
                            before.y() * x.y() + before.z() * x.z());
        most = std::max(most, std::abs(angle));
        before = x;
    }
    return most;
}

/// The load of sinusoidal buckling [N].
double sinusoidal_load(double clearance)
{
    return 2 * std::sqrt(kLongRodEI * kWeight / clearance);
}

/// The rod on the bottom of the tube, its start clamped and its end pinned, under its weight and
/// a push at its end of 1 N/s.
/// @return  the rod of the scene
RodInput& add_rod_in_tube(SolidScene& s, double clearance)
{
    ObstacleInput& tube = s.scene.obstacles.emplace_back();
    tube.name = "tube";
    tube.side = "inside";
    tube.surface.generate = "cylinder";
    tube.surface.axis = Vec3::UnitX();
    tube.surface.radius = clearance + kLongRodRadius;
    s.scene.order.push_back(tube.name);
    RodInput& rod = s.scene.rods.emplace_back(
        uniform_rod(kLength, kLongRodEI, 0.77 * kLongRodEI, 628000, 0, kElements));
    rod.segments[0].radius = kLongRodRadius;
    rod.shape.start = Vec3(0, 0, -clearance);
    rod.hold.clear();
    RodHold start, end;
    start.set = "start";
    end.set = "end";
    end.y = end.z = {{0, 0}, {1, 0}};
    end.turns = "free";
    rod.hold = {start, end};
    RodLoad weight, push = end_load(-Vec3::UnitX());
    weight.set = "all";
    weight.line = Vec3(0, 0, -kWeight);
    push.over = {{0, 0}, {100, 100}};
    rod.loads = {weight, push};
    s.scene.order.push_back(rod.name);
    ContactLaw law;
    law.between = {rod.name, tube.name};
    s.scene.contact.push_back(law);
    return rod;
}

/// The push at which some place of the rod first changes over the top [N].
double helical_push(double clearance)
{
    SolidScene s("tube");
    RodInput& rod = add_rod_in_tube(s, clearance);
    rod.drag = kDrag;
    RodLoad aside;
    aside.at = 9.1;
    aside.force = Vec3(0, kAside, 0);
    rod.loads.push_back(aside);
    s.scene.time.step = 0.02;
    s.scene.time.smallest_step = 1e-6;
    s.scene.time.end = 2 * sinusoidal_load(clearance);
    const SolidRun run = run_solids(s.scene);
    for (const StepRecord& step : run.steps)
        if (farthest_round(step.beams.at(0).points) > std::numbers::pi) return step.time;
    return std::nan("");
}

/// The equilibrium of the straight rod under a push, unstable or not: steps as a run makes them,
/// but unstable equilibria are not left.
/// @return  negative modes of the rod between its contacts; NaN if there is no such equilibrium
double straight_modes(double clearance, double push)
{
    SolidScene s("tube");
    add_rod_in_tube(s, clearance);
    s.scene.time.end = push;
    const std::vector<Obstacle> obstacles = build_obstacles(s.scene);
    std::vector<Issue> doubtful;
    const std::unique_ptr<BodySystem> system = build_bodies(s.scene, obstacles, doubtful);
    BodyStepOptions options;
    options.tolerance = s.scene.accuracy.contact;
    for (const double start : {-0.5 * push, 0.0, 0.5 * push}) {
        StepInput step;
        step.start = std::max(0.0, start); // the first one: the balance of the weight
        step.h = start < 0 ? 0 : 0.5 * push;
        if (!try_body_step(*system, step, options).accepted) return kNaN;
    }
    const RodBody& rod = *system->refs.at(0).rod;
    for (const BeamNode& node : rod.nodes())
        if (std::abs(node.position().y()) > 1e-6 * clearance) return kNaN; // not the straight one
    return rod.negative();
}

/// What a run under a push ends with.
struct PushedRod {
    double aside = 0; ///< the farthest from the straight line, of the clearance
    double modes = 0; ///< negative ones
};

PushedRod pushed_rod(double clearance, double push)
{
    SolidScene s("tube");
    add_rod_in_tube(s, clearance);
    s.scene.time.step = 0.5 * push;
    s.scene.time.end = push;
    const SolidRun run = run_solids(s.scene);
    PushedRod out;
    out.modes = run.quantity("rod_negative");
    for (const Vec3& x : run.last().beams.at(0).points)
        out.aside = std::max(out.aside, std::abs(x.y()) / clearance);
    return out;
}

} // namespace

std::vector<Measured> rod_in_tube()
{
    // Of 200 to 800 Hermite elements on a foundation w/r, one end clamped, one pinned: the signs of
    // their pivots, at these shares of the load.
    constexpr double kShares[] = {0.997, 1.006, 1.015, 1.03};
    struct Counted {
        double clearance;
        int modes[4];
    };
    std::vector<Measured> rows;
    for (const Counted& of :
         {Counted{0.005, {0, 2, 4, 6}}, Counted{0.01, {0, 2, 3, 5}}, Counted{0.02, {0, 2, 3, 4}}})
        for (int k = 0; k < 4; ++k) {
            const double push = kShares[k] * sinusoidal_load(of.clearance);
            rows.push_back(absolute(
                fmt::format("unstable modes, r = {} m, {} of the load", of.clearance, kShares[k]),
                of.modes[k], straight_modes(of.clearance, push), 0));
        }
    // Runs leave unstable equilibria, and no others.
    for (const double share : {kShares[0], kShares[1]}) {
        const PushedRod rod = pushed_rod(0.01, share * sinusoidal_load(0.01));
        const std::string at = fmt::format(", r = 0.01 m, {} of the load", share);
        rows.push_back(absolute("a run ends aside of the straight line (1: yes)" + at, share > 1,
                                rod.aside > 0.05, 0));
        rows.back().note = fmt::format("by {:.2g} of the clearance", rod.aside);
        rows.push_back(absolute("... with negative modes" + at, 0, rod.modes, 0));
    }
    rows.push_back(left_out(
        "C09: load of helical buckling",
        "its constants scatter from 2.83 to 5.66 sqrt(EI w/r) in the literature, none is verified; "
        "the sinusoidal load is"));
    return rows;
}

std::vector<Measured> rod_helical()
{
    std::vector<Measured> rows;
    for (const double clearance : {0.005, 0.01, 0.02}) {
        const double F = helical_push(clearance),
                     unit = std::sqrt(kLongRodEI * kWeight / clearance);
        const std::string at = fmt::format(", clearance {} m", clearance);
        rows.push_back(relative("push at which the rod runs around the tube [N]" + at,
                                2 * std::sqrt(2) * unit, F, 0.1));
        // Published: 2.83 to 5.66.
        rows.push_back(absolute("... below or above 2.83 to 5.66 sqrt(EI w/r), in these" + at, 0,
                                std::max({0.0, 2.83 - F / unit, F / unit - 5.66}), 0));
    }
    return rows;
}

} // namespace amontons::validation
