#pragma once

#include "solver/beam/tip_hold.hpp"
#include "solver/beam/wire_contact.hpp"

#include <algorithm>
#include <atomic>
#include <vector>

// One equilibrium of a wire with Signorini-Coulomb contact: Newton's method on the wire;
// within each iteration the linearised contact problem is solved exactly, by pivoting the
// contacts between open, stick and slip with one O(n) factor a trial. docs/theory/beams.md.

namespace amontons {

/// Pulls every node towards a reference: the viscous force of a damped relaxation, or inertia.
struct ViscousPull {
    /// Nodes towards which the pull acts.
    std::vector<BeamNode> reference;
    std::vector<double> linear; ///< per node [N/m]; empty: no pull
    std::vector<Vec3> angular;  ///< per node, about the section's axes [N m/rad]
    /// True if it has a stiffness.
    bool active() const { return !linear.empty(); }
};
/// A pull towards the present state, by a stiffness per length; the rotational stiffness of a
/// section is h^2 / 12 of the linear one, h the element's length.
/// @param stiffness  [N/m^2]
ViscousPull make_viscous_pull(const Wire& wire, double stiffness);

/// Errors of a state against the laws, in newtons; all zero at the solution.
struct Residual {
    double equilibrium = 0; ///< largest unbalanced force, or moment over element length [N]
    double contact = 0;     ///< largest natural map of a contact [N]
    double scale = 0;       ///< reference force of the relative errors [N]
    double floor = 0;       ///< round-off of the equilibrium, relative [-]
    double penetration = 0; ///< [m]
    double cone = 0;        ///< [N]
    int worst = -1;         ///< index into the candidates
    /// The largest of its parts (relative).
    double error() const { return std::max(equilibrium, contact) / scale; }
};

/// Options of Newton's method on wires.
struct NewtonOptions {
    double tolerance = 1e-8; ///< relative error of forces [-]
    int max_iterations = 16;
    double reach = 0;        ///< contacts nearer than this enter the linear problem [m]
    double longest_move = 0; ///< of a node in one iteration [m]
    const std::atomic<bool>* stop = nullptr; ///< set from outside, it ends the solve without result
};

/// True if `stop` is set.
inline bool stopped(const NewtonOptions& options)
{
    return options.stop && *options.stop;
}

/// Forces by which a status may be violated without being wrong [N].
inline double least_violation(const Residual& res, const NewtonOptions& options)
{
    return 1e-3 * options.tolerance * res.scale;
}

/// Iterations before the active rows are closed exactly by close_active_rows().
constexpr int kIterationsBeforeClosing = 8;

/// How Newton's method ended.
struct NewtonReport {
    /// True if the error is below the tolerance.
    bool converged = false;
    bool stable = false; ///< no negative eigenvalue on the motions that contact leaves free
    int iterations = 0;
    int factorisations = 0;
    int shifted = 0; ///< iterations that needed a shift to be positive definite
    /// Of hyperelastic walls: evaluations of their equilibrium, and new tangents.
    int wall_evaluations = 0, wall_tangents = 0;
    Residual residual;
    /// Time by phase [s].
    double seconds_elements = 0, seconds_detection = 0, seconds_contact = 0, seconds_rest = 0;
};

/// Work arrays, kept between solves so that nothing is allocated in the loop.
struct NewtonWorkspace {
    explicit NewtonWorkspace(const Wire& wire, std::size_t walls);
    /// The matrix without and with contacts.
    BlockTridiagonal base, system;
    /// Vectors of an iteration.
    std::vector<Node6> gradient, right, increment;
    std::vector<ElementLaw> laws;
    /// Predicted strains of the elements: to first order by the last increment, or by the motion of
    /// the base; empty: those of the state. Only within a solve.
    std::vector<std::array<double, 6>> predicted;
    std::vector<Candidate> candidates;
    std::vector<Proximity> proximity;
    /// Status of a candidate and the result of a trial.
    struct Trial {
        int status = 0;                    ///< 0 open, 1 stick, 2 slip
        double c1 = 0, c2 = 0;             ///< slip force direction (cosines)
        double across = 0;                 ///< stiffness across it [N/m]
        double hold = 0;                   ///< weight of the rows while it sticks [N/m]
        double normal = 0, t1 = 0, t2 = 0; ///< reaction after the trial [N]
        double gap = 0, v1 = 0, v2 = 0;    ///< after the trial [m]
    };
    std::vector<Trial> trial;
    const std::vector<WireWall>* compliant_walls = nullptr; ///< the walls, if any is compliant
    double unsettled = 0;                                   ///< imbalance of these walls [N]
    double shift = 0;   ///< of the last iterate of this solve that needed one [N/m]
    TipLoad tip;        ///< of a held one, at the last iterate
    double covered = 0; ///< contact points up to here lie in another instrument [m from the base]
};

// What one iterate is made of, for a solve of several wires too.

/// Candidates, base system, and gradient with the present reactions.
void assemble_iterate(const Wire& wire, const std::vector<WireWall>& walls, const StepStart& start,
                      const ViscousPull& anchor, const NewtonOptions& options,
                      NewtonWorkspace& work, NewtonReport& report);
/// The residual of the iterate that assemble_iterate() has set up in `work`.
Residual residual_of_iterate(const Wire& wire, const NewtonWorkspace& work);
/// Natural map of a contact [N].
/// @param cone  in and out: the largest violation of Coulomb's cone [N]
double contact_error(const Candidate& c, double& cone);
/// Admissible factor on an increment, in (0, 1]; 0 if the increment is not finite (factor).
/// @param longest_move  of a node [m]
double step_factor(const Wire& wire, const std::vector<Node6>& increment, double longest_move);
/// Moves a reaction by a factor in (0, 1] of its difference to that of a trial.
void take_trial(const Candidate& c, const NewtonWorkspace::Trial& t, double factor, Reaction& r);

/// Brings the wire to equilibrium at its present base. On failure the state is the last iterate.
NewtonReport solve_equilibrium(Wire& wire, const std::vector<WireWall>& walls,
                               const StepStart& start, const ViscousPull& anchor,
                               const NewtonOptions& options, NewtonWorkspace& work);

/// Candidates and residual of the wire's state as it is: the certificate of a step.
Residual residual_of(const Wire& wire, const std::vector<WireWall>& walls, const StepStart& start,
                     const ViscousPull& anchor, const NewtonOptions& options,
                     NewtonWorkspace& work);

} // namespace amontons
