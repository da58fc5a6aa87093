#pragma once

#include "solver/step/coaxial.hpp"
#include "solver/step/wire_friction.hpp"
#include "solver/step/wire_step.hpp"

// Inside a step of wires: what wire_step (one step), wire_relax (the damped relaxation) and
// wire_dynamics (inertia) share.

namespace amontons {

/// What a step changes in the wires of a group, kept in case that it is refused.
struct GroupState {
    /// States of the wires.
    std::vector<WireState> wires;
    /// Reactions in the bores.
    std::vector<std::vector<Reaction>> nested;
};

/// While it is there, solves of these groups check `stop`.
class Listening {
public:
    Listening(std::vector<WireGroup>& groups, const std::atomic<bool>& stop) : groups_(groups)
    {
        for (WireGroup& g : groups_)
            g.stop = &stop;
    }
    ~Listening()
    {
        for (WireGroup& g : groups_)
            g.stop = nullptr;
    }
    Listening(const Listening&) = delete;
    Listening& operator=(const Listening&) = delete;

private:
    std::vector<WireGroup>& groups_;
};

/// A copy of the state of all wires.
GroupState state_of(const WireGroup& group);
/// Restores a state.
void restore(WireGroup& group, const GroupState& state);
/// Puts the wires back and gives the reason.
void refuse(WireGroup& group, const GroupState& keep, StepReport& report, std::string why);

/// Where an increment begins: slip and friction's work are counted from there.
struct GroupStart {
    /// What slip counts from, of each wire.
    std::vector<StepStart> wires;
    /// Contacts at the start, of each wire.
    std::vector<std::vector<ContactBefore>> touched;
    /// Contacts in the bores.
    CoaxialStart nested;
};

/// What a step starts from.
GroupStart start_of(const WireGroup& group);

/// Options of Newton's method for this group.
NewtonOptions newton_options(const WireGroup& group, const std::vector<BaseTarget>& to);
/// Adds the counts and times of a solve; its outcome is the sum's.
void add(NewtonReport& sum, const NewtonReport& report);
/// Newton's method for the group, from `start`.
NewtonReport solve(WireGroup& group, const GroupStart& start,
                   const std::vector<ViscousPull>& anchors, const NewtonOptions& options);
/// Moves the bases, with what the wires know of their contacts.
void drive(WireGroup& group, const std::vector<BaseTarget>& to);

double elastic_energy_of(const WireGroup& group); ///< [J]
/// Loads at the bases.
std::vector<BaseLoad> loads_of(const WireGroup& group);
/// Of the bases from where they were to where they are, by the trapezoid rule [J].
double base_work(const WireGroup& group, const GroupState& old,
                 const std::vector<BaseLoad>& before);
double friction_of(const WireGroup& group, const GroupStart& start); ///< [J]
/// Contact points that left the free space since the start, on their way or at its end.
int count_passages(const WireGroup& group, const GroupStart& start);

/// Turn that leads from one quaternion to another, in the first's frame [rad].
Vec3 rotation_between(const double from[4], const double to[4]);
/// A material node in a state, also if it is in the sheath then.
BeamNode node_in(const Wire& wire, const WireState& state, int node);

/// Inertia of implicit Euler as a pull towards x_n + h v_n / (1 + damping h).
ViscousPull inertia_pull(const WireBody& body, const WireState& old, double h);
/// Velocities and inertia of all wires at the end of a step; their kinetic energy, the work of the
/// drives for what has come out, and what the step dissipated.
/// @param energy  in: work and friction of the step
void update_dynamics(WireGroup& group, const GroupState& old, const GroupStart& start, double h,
                     EnergyRecord& energy);

} // namespace amontons
