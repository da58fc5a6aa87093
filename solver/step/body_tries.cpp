#include "solver/body/rod_body.hpp"
#include "solver/body/solid_body.hpp"
#include "solver/step/body_stepper.hpp"

#include <algorithm>
#include <fmt/format.h>
#include <memory>
#include <utility>

// The tries of a step: from contacts that are found, with rows that a try has added, from bodies
// without contact on, and with a shifted matrix.

namespace amontons {
namespace {

constexpr int kInMedium = 20;      // iterations; then a shorter step is more likely to converge
constexpr int kPatienceFactor = 2; // times the iterations, for steps that are not Newton's

} // namespace

/// @param before  ended with again()
void BodyStepper::repeat(BodyStepper& before)
{
    repeats_ = true;
    free_at_start_ = before.linearised_ == 1;
    at_start_ = std::move(before.at_start_);
    found_before_ = std::move(before.force_);
    for (int c = 0; c < int(before.list_.contact.size()); ++c)
        found_before_.try_emplace(before.key(c), Vec3::Zero());
}

/// The contacts that acted in the step before are in the problem, with the forces of the try that
/// is repeated, and so are rows that it did not have.
void BodyStepper::begin_from_repeated()
{
    for (auto& [key, force] : force_)
        force.setZero();
    for (int c = 0; c < int(list_.contact.size()); ++c) {
        const auto known = found_before_.find(key(c));
        if (known == found_before_.end())
            force_.try_emplace(key(c), Vec3::Zero());
        else if (!known->second.isZero(0))
            force_[key(c)] = known->second;
    }
    for (const auto& [key, force] : found_before_) // joints
        if (key.pair < 0) force_[key] = force;
}

void BodyStepReport::add_cost_of(const BodyStepReport& other)
{
    iterations += other.iterations;
    factorisations += other.factorisations;
    free_motion += other.free_motion;
    detection += other.detection;
    compliance += other.compliance;
    contact_solve += other.contact_solve;
    correction += other.correction;
}

BodyStepReport try_body_step(BodySystem& system, const StepInput& step,
                             const BodyStepOptions& options)
{
    constexpr int kMostTries = 8; // each with rows that the one before has added
    BodyStepReport report;
    const bool medium = std::ranges::any_of(
        system.refs, [](const BodyRef& b) { return b.rod && b.rod->has_drag(); });
    BodyStepOptions own = options;
    if (medium) own.most_iterations = std::min(own.most_iterations, kInMedium);
    std::unique_ptr<BodyStepper> tried;
    try {
        const bool of_end = !step.dynamic && options.of_scene && is_independent_of_path(system);
        system.finder.begin_rows(step.dynamic);
        for (int i = 0; i < kMostTries; ++i) {
            const std::unique_ptr<BodyStepper> before = std::move(tried);
            report = {};
            // Steps in motion find contacts once, and are done again from their start with rows
            // that are new: once. What slides on is found by the next step.
            if (i > 0) own.add_rows = BodyStepOptions::AddRows::refused;
            if (i + 1 == kMostTries) own.add_rows = BodyStepOptions::AddRows::none;
            tried = std::make_unique<BodyStepper>(system, step, own, report);
            if (before) tried->repeat(*before);
            if (of_end) tried->refuse_path();
            report.accepted = tried->run();
            if (of_end && !report.accepted && !(options.stop && *options.stop)) {
                if (step_from_rest(system, step, own, report, *tried)) return report;
                system.finder.begin_rows(false);
                const BodyStepReport refused = std::exchange(report, {});
                tried = std::make_unique<BodyStepper>(system, step, own, report);
                report.accepted = tried->run();
                report.add_cost_of(refused);
            }
            if (!tried->again()) break;
        }
    } catch (const LinearFault& fault) {
        report.refusal = fault.what();
        return report;
    }
    BodyStepper& stepper = *tried;
    if (!report.accepted && !stepper.unheld().empty())
        report.refusal +=
            fmt::format("; the contacts of {} do not keep it from buckling", stepper.unheld());
    else if (const std::string tips = report.accepted ? "" : stepper.tipping(); !tips.empty())
        report.refusal += fmt::format("; the contacts of {} do not balance its loads at their "
                                      "present places: it tips over or buckles",
                                      tips);
    if (report.accepted || !stepper.of_rods_only() || medium) return report;
    // Rods on which Newton's method diverges: with a shifted matrix, towards a stable balance.
    BodyStepReport again;
    BodyStepOptions patient = options;
    patient.most_iterations *= kPatienceFactor;
    again.accepted = BodyStepper(system, step, patient, again, true).run();
    again.iterations += report.iterations;
    return again;
}

} // namespace amontons
