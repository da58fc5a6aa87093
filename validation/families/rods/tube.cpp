// C09: from where on a heavy rod in a tube runs around it.

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

/// The push at which some place of the rod first changes over the top [N].
double helical_push(double clearance)
{
    const double straight = 2 * std::sqrt(kLongRodEI * kWeight / clearance);
    SolidScene s("tube");
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
    rod.drag = kDrag;
    rod.hold.clear();
    RodHold start, end;
    start.set = "start";
    end.set = "end";
    end.y = end.z = {{0, 0}, {1, 0}};
    end.turns = "free";
    rod.hold = {start, end};
    RodLoad weight, push = end_load(-Vec3::UnitX()), aside;
    weight.set = "all";
    weight.line = Vec3(0, 0, -kWeight);
    push.over = {{0, 0}, {100, 100}};
    aside.at = 9.1;
    aside.force = Vec3(0, kAside, 0);
    rod.loads = {weight, push, aside};
    s.scene.order.push_back(rod.name);
    ContactLaw law;
    law.between = {rod.name, tube.name};
    s.scene.contact.push_back(law);
    s.scene.time.step = 0.02;
    s.scene.time.smallest_step = 1e-6;
    s.scene.time.end = 2 * straight;
    const SolidRun run = run_solids(s.scene);
    for (const StepRecord& step : run.steps)
        if (farthest_round(step.beams.at(0).points) > std::numbers::pi) return step.time;
    return std::nan("");
}

} // namespace

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
