#pragma once

#include "haptics/reduced_operator.hpp"

#include <algorithm>
#include <limits>

// The part of a simulation step that is handed over to the loop, for any kind of simulation.

namespace amontons {

/// The coupling of handle and device: a spring for shifts, and one for turns about its origin.
struct HandleSpring {
    double stiffness = 500;                                          ///< [N/m]
    double turn_stiffness = std::numeric_limits<double>::infinity(); ///< [N m/rad]; infinite: rigid
};

/// Options of the reduction: which of a step's contacts are handed over.
struct ReductionOptions {
    double speed = 0.2;       ///< fastest motion of the handle that is predicted in full [m/s]
    double most_speed = 1;    ///< at which the loop reduces the force to zero [m/s]
    double period = 0.02;     ///< of the simulation [s]
    int latency = 1;          ///< periods from a pose to its operator
    double damper_spring = 0; ///< what a damper adds to the spring's stiffness in a tick [N/m]
    int most_contacts = 300;
    /// What the handle can move until the operator after this one comes: latency and one period
    /// more, and a tenth [m].
    double reach() const { return 1.1 * speed * period * (latency + 1); }
    /// The share of it for which operators are made; beyond it an operator is outdated [-].
    int periods_ahead() const { return std::min(latency, 1) + 1; }
    /// The same at most_speed: so far the nearest contacts at least are handed over, so that
    /// nothing is passed through [m].
    double farthest() const { return reach() * std::max(1.0, most_speed / speed); }
};

/// What q and the rest of the force are beyond first order, some way on.
struct CondensedSample {
    double at = 0;          ///< of `ahead` [-]
    std::vector<Vec3> bend; ///< of each contact's q [m]
    Wrench rest;
    double jump = 0; ///< deviation from linearity over the contacts' displacement [-]
};

/// A path that the hand may follow, with samples of the state on it.
struct CondensedPath {
    Vec6 ahead = Vec6::Zero();            ///< [1/m], [1/rad]
    bool backwards = false;               ///< the other way round, too
    std::vector<CondensedSample> samples; ///< kMostPathSamples at most
};

/// The reduced problem of a step, in double and in full.
struct Condensed {
    std::vector<CandidateContact> contact;
    Eigen::MatrixXd W; ///< spring and damper included [m/N]
    double reach = 0;  ///< handle motion within which no other contact can close [m]
    int left_out = 0;  ///< candidates beyond most_contacts: their forces are held as they are
    /// On the hand without contact forces, see ReducedOperator.
    Wrench rest;
    /// Their derivative by the displacement [N/m, N m/rad].
    Mat6 stiffness = Mat6::Zero();
    std::vector<CondensedPath> way; ///< kMostPaths at most; first where the hand is moving
    HandPose handle;                ///< that this is of
    /// Where the body in the hand jumps on the first path, and the reduced problem from there on
    /// (one element, if any).
    double jump_at = std::numeric_limits<double>::infinity(); ///< of its `ahead` [-]
    std::vector<Condensed> after;
    bool solvable = true; ///< false: W is that of no body in balance; nothing can be handed over
};

} // namespace amontons
