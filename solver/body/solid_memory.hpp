#pragma once

#include "solver/body/solid_model.hpp"

#include <array>
#include <optional>

// What a solid carries from step to step, and of the generalised-alpha rule what that needs.

namespace amontons {

/// Forces of contacts on a solid, along its frame, of all degrees of freedom [N].
struct SolidContactForces {
    Eigen::VectorXd on_unknowns; ///< of the last change; 0 where held
    Eigen::VectorXd firm;        ///< of them those of bodies that do not move
    Eigen::VectorXd held;        ///< 0 but where held
};

/// Forces and energy at the accepted state.
struct SolidStateForces {
    Eigen::VectorXd momentum; ///< of each node's shape function [kg m/s]; empty: not yet found
    Eigen::VectorXd reaction; ///< of all degrees of freedom, in space [N]
    Eigen::VectorXd load;     ///< in space [N]; empty: before the first step
    Eigen::VectorXd contact;  ///< in the frame, held ones too; quasi-static [N]
    double energy = 0;        ///< elastic, of nonlinear solids [J]
    bool unstable = false;    ///< by its last matrix
    std::optional<Vec3> spin; ///< of the body as a whole [rad/s]; none: not yet found
};

/// What the rule carries on, of all degrees of freedom, in space.
struct SolidMemory {
    bool begun = false;                   ///< the first step has begun
    Eigen::VectorXd elastic, inner, load; ///< at the state [N]; inner: with damping
    Eigen::VectorXd filtered_velocity, filtered_inner, filtered_load; ///< [m/s], [N], [N]
    /// As they are kept with the state.
    std::array<Eigen::VectorXd*, 6> all()
    {
        return {&elastic, &inner, &load, &filtered_velocity, &filtered_inner, &filtered_load};
    }
    std::array<const Eigen::VectorXd*, 6> all() const
    {
        return {&elastic, &inner, &load, &filtered_velocity, &filtered_inner, &filtered_load};
    }
};

/// The known part of a step's means: see TimeRule::past.
struct PastShares {
    Eigen::VectorXd velocity;    ///< 3n [m/s]
    Eigen::VectorXd inner, load; ///< in space [N]; of the generalised-alpha rule
};

/// Forces of the last residual.
struct LastForces {
    Eigen::VectorXd load;           ///< in the frame [N]
    Eigen::VectorXd rate_forces;    ///< along the frame [N/s]
    Eigen::VectorXd inner, elastic; ///< in space; of the theta rule in the frame [N]
};

/// Forces at the state, where the first step begins. @param velocity  of the state
void begin_memory(const Eigen::VectorXd& velocity, const Eigen::VectorXd& elastic,
                  const Eigen::VectorXd& inner, const Eigen::VectorXd& load, SolidMemory& memory);
/// The known part of the means of the step to come. @param velocity  of the state
PastShares past_shares(const TimeRule& rule, const SolidMemory& memory,
                       const Eigen::VectorXd& velocity);
/// What the rule and the damping take: the work of the mean inner forces and of the mean change of
/// momentum, less what energy they store [J].
/// @param start_momentum, momentum  of the state and the iterate
double filtered_loss(const SolidMotion& state, const SolidMotion& now, double h,
                     const LastForces& last, const SolidMemory& memory,
                     const Eigen::VectorXd& start_momentum, const Eigen::VectorXd& momentum);
/// The rules of time-stepping lose some angular momentum of a body that turns; what loads and
/// contacts gave it is exact, and the difference is put back as a turn of the whole.
/// @param contact_moment  of the contacts about the origin, where it is known [N m s]
/// @param load            mean of the step, in space [N]
/// @param reached         momentum of the iterate's velocities
/// @return  the energy that the turn brings [J]
double keep_angular_momentum(const SolidModel& model, const StepInput& step,
                             const SolidMotion& state, const SolidStateForces& at_state,
                             const SolidContactForces& contact,
                             const std::optional<Vec3>& contact_moment, const Eigen::VectorXd& load,
                             const Eigen::VectorXd& reached, SolidMotion& now);

/// Carries on to the end of the step, all in space.
/// @param start_velocity  of the state that the step began with
/// @param velocity, elastic, inner, load  at the end
void end_memory(const TimeRule& rule, const Eigen::VectorXd& start_velocity,
                const Eigen::VectorXd& velocity, const Eigen::VectorXd& elastic,
                const Eigen::VectorXd& inner, const Eigen::VectorXd& load, SolidMemory& memory);

} // namespace amontons
