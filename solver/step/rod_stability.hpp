#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

namespace amontons {

struct BodyStepReport;
struct BodySystem;
struct StepInput;

/// An unstable equilibrium of rods, and the motion along which they leave it.
struct UnstableBalance {
    std::string body;                  ///< name of the one that moves the most
    int modes = 0;                     ///< number of negative modes of all rods without contacts
    double stiffness = 0;              ///< along the motion, < 0 [N/m]
    std::vector<Eigen::VectorXd> push; ///< of each body: a small part of the motion [m], [rad]
};

/// The negative mode of an accepted equilibrium of rods at rest on the motions that its contacts
/// admit (docs/theory/rods.md); nothing if none is found, and with viscous drag. Other bodies that
/// can move are taken to stand still: an equilibrium that is unstable then is unstable, but not
/// each is found. Rods alone that are stable by their contacts are marked as such.
/// @param step  the step that ended there
/// Cost: nothing where all rods are stable by themselves; else a linearisation and a factor.
std::optional<UnstableBalance> unstable_rods(BodySystem& system, const StepInput& step,
                                             const BodyStepReport& report);

/// The unconstrained motion of rods that rest on contacts (RodBody::stabilise_with_contacts), at an
/// accepted equilibrium: friction counts as a constraint wherever a contact is closed. The rods do
/// not move along it.
/// @return  "NAME: shift along ..." of the rod that moves the most; "" if all are constrained
/// Cost: nothing without such rods; else a linearisation, a factor and some solves.
std::string unheld_rods(BodySystem& system, const StepInput& step, const BodyStepReport& report);

} // namespace amontons
