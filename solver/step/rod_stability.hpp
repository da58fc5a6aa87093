#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

namespace amontons {

struct BodyStepReport;
struct BodySystem;
struct StepInput;

/// A balance of rods that does not stand: they leave it along this motion.
struct UnstableBalance {
    std::string body;                  ///< the one that moves the most
    int modes = 0;                     ///< negative ones of the rods by themselves, all of them
    double stiffness = 0;              ///< along the motion, < 0 [N/m]
    std::vector<Eigen::VectorXd> push; ///< of each body: a small part of the motion [m], [rad]
};

/// Looks whether an accepted balance of rods at rest has a negative mode on the motions that its
/// contacts allow (docs/theory/rods.md). Nothing in a medium. Where other bodies can move, too, they
/// are taken to stand still: what is found is an unstable balance all the more, but not each is
/// found. Rods alone whose contacts hold them count as stable afterwards.
/// @param step  that ended there
/// Cost: nothing where all rods are stable by themselves; else a linearisation and a factor.
std::optional<UnstableBalance> unstable_rods(BodySystem& system, const StepInput& step,
                                             const BodyStepReport& report);

/// What nothing holds of rods that rest on contacts (RodBody::stabilise_with_contacts), at an
/// accepted balance: friction counts as holding wherever a contact presses. It stays where it is.
/// @return  "NAME: shift along ..." of the rod that moves the most; "" if all are held
/// Cost: nothing without such rods; else a linearisation, a factor and some solves.
std::string unheld_rods(BodySystem& system, const StepInput& step, const BodyStepReport& report);

} // namespace amontons
