#pragma once

#include "solver/beam/wire_contact.hpp"

#include <vector>

namespace amontons {

/// A contact that carried a reaction when the step began.
struct ContactBefore {
    int point = 0, index = 0; ///< index into WireState::reaction
    Vec3 n;                   ///< of the wall there
    double bound = 0;         ///< mu r_n [N]
    Vec3 tangential;          ///< in space [N]
    SoftTube* soft = nullptr; ///< of a wall that is compliant, and where on it
    /// Place on the wall [m, rad].
    double along = 0, around = 0;
};
/// Contacts and their forces at the start of a step.
std::vector<ContactBefore> contacts_before(const Wire& wire, const std::vector<WireWall>& walls,
                                           std::vector<Proximity>& proximity);

/// Dissipation by friction in a step [J]: minus the mean of the friction forces at its start and
/// its end, times the slip. A point that slips does so at Coulomb's bound, against its slip, also
/// if it stuck before.
/// @param candidates  of the end of the step, slips measured from `start`
double friction_work(const Wire& wire, const StepStart& start,
                     const std::vector<ContactBefore>& before,
                     const std::vector<Candidate>& candidates);

} // namespace amontons
