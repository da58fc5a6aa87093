#pragma once

#include "solver/output/step_record.hpp"

#include <string>

// What every step's energy is judged by. Of a run at rest all that is missing or too much is an
// error: forces are balanced, and their work is known to the second order of the step (trapezoid
// rule). Of a run in motion only energy that is made is: what a rule of time or a blow takes is
// told as released.

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
/// it is below the accuracy of contacts times the largest force times the size of the scene, or round-off.
double energy_fault(const EnergyRecord& energy, const EnergyScale& scale);
/// The same of what a part of the run did to `error` [J].
double energy_fault(double error, const EnergyRecord& energy, const EnergyScale& scale);

constexpr double kEnergyTold = 0.01, kEnergyRefused = 0.1; ///< of the scale

/// A sentence if more than kEnergyTold is faulty; "" if not.
std::string energy_warning(const EnergyRecord& energy, const EnergyScale& scale);

} // namespace amontons
