#pragma once

#include "solver/record/step_record.hpp"

#include <functional>
#include <string>

// The check of every step's energy balance. In a run at rest any residual is an error: forces are
// balanced, and their work is known to second order in the step (trapezoid rule). In a run in
// motion only an energy gain is: dissipation by the time integration rule or an impact is reported
// as released.

namespace amontons {

/// After a step: keeps the largest changes of both energies.
void follow(EnergyRecord& energy);

/// Scales for the errors of the energy balance of a run.
struct EnergyScale {
    double accuracy = 1e-8; ///< of contacts [-]
    double size = 1;        ///< of the scene [m]
    bool dynamic = false;
    double round_off = 0; ///< errors below this are round-off of stiff bodies [J]
};

/// The energy gained (at rest: gained or lost) without a source, as a share of the energy turned
/// over by the run; 0 where it is below the accuracy of contacts times the largest force times the
/// size of the scene, or below round-off.
double energy_fault(const EnergyRecord& energy, const EnergyScale& scale);
/// The same of an error of part of the run.
/// @param error  change of energy.error in that part [J]
double energy_fault(double error, const EnergyRecord& energy, const EnergyScale& scale);

/// Values of energy_fault() above which a run is warned of, and a step repeated or refused (ratio).
constexpr double kEnergyReported = 0.01, kEnergyRefused = 0.1;

/// A sentence if energy_fault() is above kEnergyReported; else "".
std::string energy_warning(const EnergyRecord& energy, const EnergyScale& scale);

/// A step at rest whose energy did not close, and that is done again in halves.
struct StepRefinement {
    int level = 0;           ///< 0: none
    double until = 0;        ///< the end of that step [s]
    double length = 0;       ///< of the present ones [s]
    double whole = 0;        ///< of that step [s]
    double first = 0;        ///< error of the energy balance of that step [J]
    double error_before = 0; ///< of the run when it began [J]
};

/// What is examined after a step at rest.
struct StepEnergy {
    double error_before = 0; ///< of the run before the step [J]
    const EnergyRecord& energy;
    const EnergyScale& scale;
    double time = 0, h = 0; ///< [s]
};

/// What the energy balance of a step means for it.
enum class EnergyVerdict { stands, again, refused };
/// Verdict on a step, and its message.
struct StepJudgement {
    EnergyVerdict verdict = EnergyVerdict::stands;
    std::string message; ///< a sentence if there is something to report
    bool jump = false;   ///< shorter steps have as large an error: energy is released in a jump
};

/// A step whose own error is more than kEnergyRefused of the scale is done again in halves, and so
/// is a half, five times; after parts that miss no more than kEnergyReported the next are as long
/// as their place among the halves permits, unless much of the error has stayed: beside a jump all
/// parts to the end of the step are short. If the parts leave less than 0.4 of the error, or no
/// more than kEnergyRefused of the scale, it was that of the trapezoid rule, of a force that begins
/// within the step. If not, no continuous path of equilibria joins the ends of the step: a gain of
/// energy is refused, unless contacts whose gaps meshes leave open explain it; a loss is released
/// in a jump, like a snap.
/// @param r               of this step; changed
/// @param may_refine      a new refinement may begin
/// @param left_by_meshes  energy gained by contacts where meshes leave gaps; called if needed [J]
StepJudgement judge_step(StepRefinement& r, const StepEnergy& step, bool may_refine,
                         const std::function<double()>& left_by_meshes);

} // namespace amontons
