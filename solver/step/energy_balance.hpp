#pragma once

#include "solver/output/step_record.hpp"

#include <functional>
#include <string>

// What every step's energy is judged by. Of a run at rest all that is missing or too much is an
// error: forces are balanced, and their work is known to the second order of the step (trapezoid
// rule). Of a run in motion only energy that is made is: what a rule of time or a blow takes is
// reported as released.

namespace amontons {

/// After a step: keeps the largest changes of both energies.
void follow(EnergyRecord& energy);

/// What a run is judged with.
struct EnergyScale {
    double accuracy = 1e-8; ///< of contacts [-]
    double size = 1;        ///< of the scene [m]
    bool dynamic = false;
    double round_off = 0; ///< less is the rounding of stiff bodies [J]
};

/// Energy that was made, or at rest lost or made, as a share of what the run turned over; 0 where
/// it is below the accuracy of contacts times the largest force times the size of the scene, or
/// round-off.
double energy_fault(const EnergyRecord& energy, const EnergyScale& scale);
/// The same of what a part of the run did to `error` [J].
double energy_fault(double error, const EnergyRecord& energy, const EnergyScale& scale);

constexpr double kEnergyTold = 0.01, kEnergyRefused = 0.1; ///< of the scale

/// A sentence if more than kEnergyTold is faulty; "" if not.
std::string energy_warning(const EnergyRecord& energy, const EnergyScale& scale);

/// A step at rest whose energy did not close, and that is done again in halves.
struct StepRefinement {
    int level = 0;           ///< 0: none
    double until = 0;        ///< the end of that step [s]
    double length = 0;       ///< of the present ones [s]
    double whole = 0;        ///< of that step [s]
    double first = 0;        ///< what it missed [J]
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
    bool jump = false;   ///< shorter steps miss as much
};

/// A step whose own error is more than kEnergyRefused of the scale is done again in halves, and so
/// is a half, five times. Where they leave less than 0.4 of the error, it was the trapezoid rule's,
/// of a force that sets in within the step: of second order then. Where not, the ends of the step
/// are balances between which there is no way: energy that was made is refused, unless contacts
/// whose gaps meshes leave open explain it; energy that is lost is lost in a jump, as of a snap.
/// @param r            of this step; changed
/// @param may_refine   a new refinement may begin
/// @param left_by_meshes  energy that contacts make where meshes leave gaps; asked if needed [J]
StepJudgement judge_step(StepRefinement& r, const StepEnergy& step, bool may_refine,
                         const std::function<double()>& left_by_meshes);

} // namespace amontons
