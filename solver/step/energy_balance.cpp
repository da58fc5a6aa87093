#include "solver/step/energy_balance.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace amontons {

void follow(EnergyRecord& e)
{
    e.most_kinetic = std::max(e.most_kinetic, std::abs(e.kinetic - e.kinetic_start));
    e.most_elastic = std::max(e.most_elastic, std::abs(e.elastic - e.elastic_start));
}

double energy_fault(double error, const EnergyRecord& e, const EnergyScale& scale)
{
    const double floor = std::max(scale.accuracy * e.largest_force * scale.size, scale.round_off);
    return error > floor && e.scale() > 0 ? error / e.scale() : 0;
}

double energy_fault(const EnergyRecord& e, const EnergyScale& scale)
{
    const double error = scale.dynamic ? -e.error() : std::abs(e.error());
    return energy_fault(std::max(error, -e.released), e, scale);
}

std::string energy_warning(const EnergyRecord& e, const EnergyScale& scale)
{
    const double fault = energy_fault(e, scale);
    if (!(fault > kEnergyReported)) return "";
    if (-e.released >= (scale.dynamic ? -e.error() : std::abs(e.error())))
        return fmt::format(
            "the energy has grown by {:.3g} J without a cause, {:.2g} of what the run "
            "turned over; shorter steps gain less",
            -e.released, fault);
    return fmt::format(
        "{:.3g} J of energy {}, {:.2g} of what the run turned over: its steps, or jumps "
        "within them, miss as much of the work; shorter steps, or finer meshes where "
        "bodies slide, miss less",
        std::abs(e.error()), e.error() > 0 ? "were lost" : "were generated", fault);
}

namespace {

/// A part that closes its energy and ends a half of a longer part: the next one is that long.
void lengthen(StepRefinement& r, double time)
{
    constexpr double kWhole = 1e-6; // of a part: its end is that of a longer one
    if (r.level < 2) return;
    const double longer = 2 * r.length, parts = (time - (r.until - r.whole)) / longer;
    if (std::abs(parts - std::round(parts)) > kWhole) return;
    r.length = longer;
    --r.level;
}

} // namespace

StepJudgement judge_step(StepRefinement& r, const StepEnergy& step, bool may_refine,
                         const std::function<double()>& left_by_meshes)
{
    constexpr int kMostLevels = 5;
    constexpr double kLess = 0.4;
    const double own = step.energy.error() - step.error_before,
                 fault = energy_fault(std::abs(own), step.energy, step.scale);
    if (fault > kEnergyRefused && r.level < kMostLevels && (r.level > 0 || may_refine)) {
        if (r.level == 0) r = {0, step.time, 0, step.h, own, step.error_before};
        ++r.level;
        r.length = step.h / 2;
        return {EnergyVerdict::again, "", false};
    }
    if (r.level == 0) return {};
    if (step.time < r.until * (1 - 1e-12)) {
        // Parts that have missed much of the whole step's error are beside a jump: after longer
        // ones balances might jump once more.
        const double missed = std::abs(step.energy.error() - r.error_before);
        const bool jumped = missed > 0.5 * kLess * std::abs(r.first) &&
                            energy_fault(missed, step.energy, step.scale) > kEnergyRefused;
        if (!(fault > kEnergyReported) && !jumped) lengthen(r, step.time);
        return {};
    }
    const double whole = step.energy.error() - r.error_before, first = r.first;
    r = {};
    // What would not have been repeated had it been the error of one step is not refused either.
    if (std::abs(whole) < kLess * std::abs(first) ||
        energy_fault(std::abs(whole), step.energy, step.scale) <= kEnergyRefused)
        return {
            EnergyVerdict::stands,
            fmt::format("in one step {:.3g} J of energy would have been missed, in shorter ones "
                        "it is {:.3g} J",
                        first, whole),
            false};
    std::string message =
        fmt::format("{:.3g} J of energy {} in the step, and in shorter ones {:.3g} J: {:.2g} of "
                    "what the run has "
                    "turned over. Its ends are balances that no continuous path joins",
                    std::abs(first), first > 0 ? "are lost" : "are gained", std::abs(whole),
                    std::abs(whole) / step.energy.scale());
    if (whole > 0 || -whole <= left_by_meshes())
        return {EnergyVerdict::stands, std::move(message), true};
    return {EnergyVerdict::refused, message + ": a finer mesh or a dynamic run may find one", true};
}

} // namespace amontons
