#pragma once

#include "haptics/link/held_body.hpp"
#include "haptics/reduced_operator.hpp"
#include "solver/step/body_step.hpp"

namespace amontons {

/// What of a step's contacts is handed over.
struct CondenseOptions {
    double speed = 0.2;       ///< fastest motion of the handle that is foreseen [m/s]
    double period = 0.02;     ///< of the simulation [s]
    int latency = 1;          ///< periods from a pose to its operator
    double damper_spring = 0; ///< what a damper adds to the spring's stiffness in a tick [N/m]
    int most_contacts = 300;
};

/// The reduced problem of a step, in double and in full.
struct Condensed {
    std::vector<CandidateContact> contact;
    Eigen::MatrixXd W; ///< spring and damper included [m/N]
    double reach = 0;  ///< handle motion within which no other contact can close [m]
    int left_out = 0;  ///< candidates beyond most_contacts: their forces are held as they are
    double left_out_force = 0; ///< of those, on the handle: what is not felt to change [N]
};

/// Condenses the end of a step on its contacts near the handle, and near all bodies that contacts
/// tie to it: see docs/theory/haptics.md.
/// @param system  after the accepted step; body `handle` of it is `held`
/// @param step    the step that led there
Condensed condense(BodySystem& system, int handle, HeldBody& held, const StepInput& step,
                   const BodyStepReport& report, const CondenseOptions& options);

} // namespace amontons
