#pragma once

#include "solver/step/coaxial.hpp"
#include "solver/step/wire_friction.hpp"
#include "solver/step/wire_step.hpp"

// Inside a step of wires: what wire_step (one step), wire_relax (the damped relaxation) and
// wire_dynamics (inertia) share.

namespace amontons {

/// State of the wires of a group, kept to be restored if a step is refused.
struct GroupState {
    /// States of the wires.
    std::vector<WireState> wires;
    /// Reactions in the bores.
    std::vector<std::vector<Reaction>> nested;
};

/// While an object exists, solves of these groups check `stop`.
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
/// Restores the state `keep` and sets the reason of the refusal in the report.
void refuse(WireGroup& group, const GroupState& keep, StepReport& report, std::string why);

/// The start of an increment: slip and the work of friction are measured from it.
struct GroupStart {
    /// What slip counts from, of each wire.
    std::vector<StepStart> wires;
    /// Contacts at the start, of each wire.
    std::vector<std::vector<ContactBefore>> touched;
    /// Contacts in the bores.
    CoaxialStart nested;
};

/// The start of an increment at the present state.
GroupStart start_of(const WireGroup& group);

/// Options of Newton's method for this group.
NewtonOptions newton_options(const WireGroup& group, const std::vector<BaseTarget>& to);
/// Adds the counts and times of a solve; its outcome is the sum's.
void add(NewtonReport& sum, const NewtonReport& report);
/// Newton's method for the group, from `start`.
NewtonReport solve(WireGroup& group, const GroupStart& start,
                   const std::vector<ViscousPull>& anchors, const NewtonOptions& options);
/// Moves the bases to new targets, and the stored reactions along with the material.
void drive(WireGroup& group, const std::vector<BaseTarget>& to);

double elastic_energy_of(const WireGroup& group); ///< [J]
/// Loads at the bases.
std::vector<BaseLoad> loads_of(const WireGroup& group);
/// Work of the base loads from the state `old` to the present one, by the trapezoid rule [J].
/// @param before  loads in the state `old`
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
