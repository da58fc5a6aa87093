#pragma once

#include "solver/record/step_record.hpp"
#include "solver/step/wire_newton.hpp"

#include <atomic>
#include <memory>
#include <string>
#include <vector>

// Wires over time: a step from given bases to the next, its energy, and what happens when
// the equilibrium is lost: a snap, crossed by a damped relaxation whose dissipation is counted.

namespace amontons {

/// How a wire moves in time.
struct WireMotion {
    /// True if masses act.
    bool dynamic = false;
    double damping = 0;        ///< mass-proportional [1/s]
    std::vector<double> mass;  ///< lumped, per node [kg]
    std::vector<Vec3> inertia; ///< lumped, about the section's axes, per node [kg m^2]
};

/// Dynamic, with the masses and rotary inertias of a wire lumped at its nodes.
/// @param damping  of mass [1/s]
WireMotion make_motion(const WireMaterial& material, double damping);

/// Dynamic quantities of a wire, stored from step to step beside its state.
struct WireDynamics {
    std::vector<Vec3> velocity; ///< per node [m/s]
    std::vector<Vec3> spin;     ///< per node, in the body frame [rad/s]
    /// Forces and moments of inertia and damping at the end of the last step, per node [N], [N m]
    /// in the body frame; and the contact forces [N] with their arms from the centreline [m],
    /// ordered as WireState::reaction. Work is by the trapezoid rule, which needs the forces of the
    /// start.
    std::vector<Vec3> inertia_force, inertia_moment, contact_force, contact_arm;
};

/// A wire with its walls and everything that a step needs.
struct WireBody {
    Wire wire;
    std::vector<WireWall> walls;
    WireMotion motion;
    WireDynamics dynamics;
    /// Of the certificate (relative).
    double tolerance = 1e-8;
    double element_size = 0; ///< length scale of the wire's mesh: its longest element [m]
    double scale_force = 0;  ///< EI / length^2 of the wire [N]
    /// The energy error of a step may be as large as the change of loads within it explains
    /// (decision 0021).
    bool course = false;
    int halvings = 0; ///< of the distance of its contact points since it was made
    std::unique_ptr<NewtonWorkspace> work;
};
/// A wire with its walls, drives and tolerance.
WireBody make_wire_body(Wire wire, std::vector<WireWall> walls, WireMotion motion,
                        double tolerance);

/// What one accepted step did.
struct StepReport {
    /// True if the step is solved.
    bool accepted = false;
    std::string refusal; ///< why not
    NewtonReport newton; ///< sums over all its solves; residual of the last
    EnergyRecord energy; ///< increments of work, friction, released; elastic and kinetic now
    bool snapped = false;
    double released = 0; ///< in a snap [J]
    double missed = 0;   ///< error of the energy balance: work - elastic - friction - released [J]
    /// Of a step refused for its energy balance: `missed` over its admissible value; 0: refused for
    /// another reason (ratio).
    double missed_by = 0;
    bool lasting = false;   ///< no shorter step would be accepted
    int relaxations = 0;    ///< increments of the damped relaxation
    int passed_through = 0; ///< contact points beyond a wall
};

/// Where a base is: the length of wire past the sheath's rigid end, and its twist.
struct BaseTarget {
    double insertion = 0;    ///< [m]
    double twist = 0;        ///< [rad]
    Vec3 tip = Vec3::Zero(); ///< displacement of a held tip since the hold began [m]
};

struct Coaxial; // solver/step/coaxial.hpp

/// Wires that are solved together: one alone, or instruments in one another.
struct WireGroup {
    /// The wires of the group.
    std::vector<WireBody*> wires;
    Coaxial* coaxial = nullptr;              ///< of instruments in one another
    const std::atomic<bool>* stop = nullptr; ///< set from outside, a step is refused
};

/// Tries to bring the wires from their present equilibrium to new bases in one step.
/// If it is refused, they are as before.
/// @param to      of each wire
/// @param length  of the step [s]; matters for dynamics only
/// @param any_balance  takes the step whatever its energy balance misses
StepReport try_step(WireGroup& group, const std::vector<BaseTarget>& to, double length,
                    bool any_balance = false);
/// The same for one wire.
/// @param insertion, twist, length  [m], [rad], [s]
StepReport try_step(WireBody& body, double insertion, double twist, double length,
                    bool any_balance = false);

/// State of a damped relaxation that is computed in parts.
struct GradientFlow {
    int most = 0;           ///< most Newton iterations of a part; at least one increment is made
    bool under_way = false; ///< the wires still move ...
    std::vector<ViscousPull> anchor; ///< ... and are held where they are by this pull, of each wire
    double weight = 0;               ///< of the pull [N/m]
    std::vector<std::vector<Node6>> pull;
    int until_attempt = 1; ///< increments before the wires are tried at rest
    int pushed_off = 0; ///< how often, from equilibria that were unstable
};

/// The same by damped relaxation, for bases close to the present ones: for a state that has
/// lost its stability. Always leaves the present branch if it is unstable.
/// @param part  if given, wires that are not at rest at its end are left in their motion; the next
///              call continues from there, whatever the bases are by then
StepReport relax_step(WireGroup& group, const std::vector<BaseTarget>& to,
                      GradientFlow* part = nullptr);

/// try_step(), and relax_step() if that is refused. If it was refused for its energy balance alone
/// and the error of the relaxation is larger (a kink of the forces, a change of the mesh), the step
/// is accepted as it was.
StepReport try_or_relax(WireGroup& group, const std::vector<BaseTarget>& to);

/// A step that fails is halved; at these shares of the longest step the equilibrium is assumed to
/// be lost (unstable; no convergence), and the wire is relaxed to the next one (ratios).
constexpr double kRelaxUnstable = 1.0 / 8, kRelaxFailed = 1.0 / 64;

/// Kinetic energy of a wire [J].
double kinetic_energy(const WireBody& body);

} // namespace amontons
