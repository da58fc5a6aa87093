#include "solver/body/rod_body.hpp"
#include "solver/step/body_step.hpp"
#include "solver/step/rod_stability.hpp"

#include <algorithm>
#include <fmt/format.h>
#include <limits>

// Snaps of rods. Where equilibria end, the rods move fast, and the energy that they lose is not
// determined by statics. Here they are followed in a medium so viscous that inertia is negligible:
// gradient flow with implicit steps, with contact and friction as in any step. The drag follows the
// motion.

namespace amontons {
namespace {

constexpr int kMostSteps = 3000, kMostRefused = 100;
constexpr int kMostIterations = 10;
constexpr double kStart = 1e-7;                // of the drag, of the largest EI / radius^4
constexpr double kWay = 0.5;                   // of a step, of the smallest radius: aimed at
constexpr double kRest = 0.05;                 // ... below which the rods are tried at rest,
constexpr double kWeak = 1e-4;                 // and with less of the first drag,
constexpr int kBetween = 2, kMostBetween = 32; // after so many steps, and twice as many each time
constexpr double kGrows = 1.5;                 // by which a mode grows in a step
constexpr double kStrongest = 1e8;             // of the drag, of that of the start
constexpr double kHeavy = 10;                  // ... of what loads call for: ropes hardly bend

struct Kept { // what a step changes
    std::vector<std::vector<double>> bodies;
    std::map<BodySystem::Key, Vec3> warm;
    std::map<BodySystem::Key, bool> sticks;
};

Kept keep(const BodySystem& system)
{
    Kept k;
    for (const auto& b : system.bodies)
        k.bodies.push_back(b->state());
    k.warm = system.warm;
    k.sticks = system.warm_sticks;
    return k;
}

void restore_bodies(BodySystem& system, const Kept& k)
{
    for (std::size_t b = 0; b < system.bodies.size(); ++b)
        system.bodies[b]->set_state(k.bodies[b]);
    system.warm = k.warm;
    system.warm_sticks = k.sticks;
}

} // namespace

BodyStepReport relax_rods(BodySystem& system, const StepInput& step, const BodyStepOptions& options,
                          const UnstableBalance* leave)
{
    // ---- Rods and their drag
    std::vector<RodBody*> rods;
    double unit = 0, radius = std::numeric_limits<double>::infinity(), shortest = radius;
    double load = 0; // of a drag under which loads move a rod by its radius
    for (const BodyRef& b : system.refs) {
        if (!b.rod) continue;
        rods.push_back(b.rod);
        for (int e = 0; e < b.rod->model().element_count(); ++e) {
            const double own = b.rod->element_radius(e), length = b.rod->element_length(e);
            const double EI = b.rod->element_stiffness(e) * length * length * length;
            unit = std::max(unit, EI / (own * own * own * own));
            radius = std::min(radius, own);
            shortest = std::min(shortest, length);
            load = std::max(load, b.rod->force_scale() / (length * own));
        }
    }
    const auto set_viscous_drag = [&](double drag, bool from_rest = false) {
        for (RodBody* rod : rods)
            rod->set_viscous_drag(drag, from_rest);
    };
    const auto way = [&] {
        double most = 0;
        for (const RodBody* rod : rods)
            most = std::max(most, rod->largest_motion());
        return most;
    };

    // ---- First push, out of an unstable equilibrium
    BodyStepOptions quick = options; // with a drag Newton's method converges quickly or not at all
    quick.most_iterations = kMostIterations;
    const Kept start = keep(system);
    StepInput input = step;
    for (std::size_t b = 0; leave && b < system.bodies.size(); ++b) {
        if (!system.refs[b].rod) continue;
        RodBody& rod = *system.refs[b].rod;
        rod.begin(step);
        rod.update(leave->push[b], {}, {});
        rod.accept({});
    }
    BodyStepReport sum;
    const auto count = [&](const BodyStepReport& r) {
        sum.add_cost_of(r);
        if (!r.accepted) return;
        sum.friction += r.friction;
        sum.energy.work += r.energy.work;
        sum.energy.work_absolute += r.energy.work_absolute;
        sum.energy.dissipated += r.energy.dissipated;
    };

    // ---- Increments against the drag
    double drag = kStart * unit, last_way = 0, longest_way = 0;
    const double strongest = std::max(kStrongest * drag, kHeavy * load), weak = kWeak * drag;
    // With less drag than the (negative) stiffness of an unstable mode implicit steps return to its
    // balance: so the motion at first grows by this factor in each.
    double least = leave ? kGrows / (kGrows - 1) * -leave->stiffness / shortest : 0;
    drag = std::max(drag, least);
    int next_try = kBetween, between = kBetween, refused = 0;
    set_viscous_drag(drag, true);
    for (int k = 0; k < kMostSteps; ++k) {
        if (k >= next_try && least == 0 && drag < weak && last_way < kRest * radius) {
            next_try = k + (between = std::min(2 * between, kMostBetween));
            set_viscous_drag(0);
            const Kept before = keep(system);
            BodyStepReport still = try_body_step(system, input, options);
            const double jump = way();
            const bool rests = still.accepted && jump <= kWay * radius;
            if (still.accepted && !rests) {
                restore_bodies(system, before);
                still.accepted = false;
            }
            count(still);
            if (rests) {
                still.iterations = sum.iterations;
                still.factorisations = sum.factorisations;
                still.friction = sum.friction;
                still.free_motion = sum.free_motion;
                still.detection = sum.detection;
                still.compliance = sum.compliance;
                still.contact_solve = sum.contact_solve;
                still.correction = sum.correction;
                const double elastic = still.energy.elastic, kinetic = still.energy.kinetic;
                still.energy = sum.energy;
                still.energy.elastic = elastic;
                still.energy.kinetic = kinetic;
                still.remarks.push_back(fmt::format(
                    "snapped: followed with a viscous drag in {} steps, which dissipated {:.3g} J",
                    k, sum.energy.dissipated));
                return still;
            }
        }
        set_viscous_drag(drag);
        const BodyStepReport r = try_body_step(system, input, quick);
        count(r);
        if (options.stop && *options.stop) {
            sum.refusal = r.refusal;
            break;
        }
        if (!r.accepted) {
            drag *= 8;
            if (drag > strongest || ++refused > kMostRefused) {
                sum.refusal = r.refusal + " (followed with a viscous drag)";
                break;
            }
            continue;
        }
        last_way = way();
        longest_way = std::max(longest_way, last_way);
        if (last_way > 0.5 * kWay * radius || last_way < 0.5 * longest_way) least = 0;
        drag = std::max(drag * std::clamp(last_way / (kWay * radius), 0.25, 4.0), least);
        input.start = step.end();
        input.h = 0;
    }

    // ---- Result
    set_viscous_drag(0);
    restore_bodies(system, start);
    if (sum.refusal.empty())
        sum.refusal =
            fmt::format("no balance found within {} steps with a viscous drag", kMostSteps);
    return sum;
}

} // namespace amontons
