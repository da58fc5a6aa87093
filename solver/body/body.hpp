#pragma once

#include "contact/surface/contact_points.hpp"
#include "mesh/base/types.hpp"
#include "solver/body/time_rule.hpp"
#include "solver/record/step_record.hpp"
#include "solver/solid/patch.hpp"

#include <Eigen/Geometry>
#include <Eigen/SparseCore>
#include <optional>
#include <span>
#include <string>
#include <vector>

// Interface between the time step and a body (rigid, solid, rod).
//
// A body has a state at the start of the step and an iterate, which becomes the state at its end.
// Its unknowns y are a change of the iterate: of places [m] in quasi-static steps, of velocities
// [m/s] in dynamic ones. With A its step matrix and H the rows of the contacts on it,
//   A y = A y_free + H^T r:   y_free is its motion without contact.
// The rigid modes R of a body that is held by its contacts alone, for which A is singular, have
// unknowns a of their own: y = y_free + A^+ H^T r + R a with the balance R^T (H^T r) + g = 0.

namespace amontons {

/// Text of remarks of bodies and of steps.
inline constexpr const char* kNotStable = "its balance is not stable";

/// One step in time.
struct StepInput {
    double start = 0, h = 0; ///< [s]
    bool dynamic = false;
    TimeRule rule; ///< dynamic: how places follow velocities, and velocities forces
    /// Acceleration [m/s^2].
    Vec3 gravity = Vec3::Zero();
    double load = 1; ///< share of the bodies' own loads, gravity apart
    /// Motion of second order: joints and the contacts of rigid bodies are satisfied at the end of
    /// the step, and their forces act at its middle (docs/theory/motion.md).
    bool follows = false;
    /// Time at the end of the step [s].
    double end() const { return start + h; }
};

/// A place on a body: nodes with weights, or (no nodes) a point that is fixed to a rigid body or to
/// a patch of a solid.
struct BodyPlace {
    /// Nodes and weights of a place on a mesh.
    std::span<const StencilEntry> nodes;
    Vec3 point = Vec3::Zero(); ///< at the iterate; of steps that follow it, half way [m]
    /// The row is of the rotation, and its force a moment; of rigid bodies, patches and rods.
    bool turns = false;
    /// The patch that carries the place, of joints on solids; else nullptr.
    const PatchPose* patch = nullptr;
    Vec3 arm = Vec3::Zero(); ///< of the point, from the patch's centre [m]
    bool half_way = false;   ///< of rods: forces act on the section at the middle of the step
};

/// A rigid placement: x = turn X + shift.
struct Placement {
    /// Rotation of the body.
    Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
    Vec3 shift = Vec3::Zero(); ///< [m]
    Vec3 operator*(const Vec3& X) const { return turn * X + shift; }
};

using SparseColumns = Eigen::SparseMatrix<double>;

/// Energy of one step: external work, dissipation, stored energy [J].
struct BodyEnergy {
    double work = 0, work_absolute = 0; ///< of loads, weight and prescribed motion over the step
    double dissipated = 0;              ///< by damping and by the time-stepping rule over the step
    double elastic = 0, kinetic = 0;    ///< at the end of the step [J]
};

/// What a body is worth in balances of a motion; of the accepted state.
struct BodyMotion {
    double kinetic_energy = 0;            ///< [J]
    Vec3 momentum = Vec3::Zero();         ///< linear [kg m/s]
    Vec3 angular_momentum = Vec3::Zero(); ///< about the origin [kg m^2/s]
};

/// What update() has made of an iterate.
struct BodyOutcome {
    double accepted_length = 1; ///< of the step, in (0, 1]; < 1 where inversion was avoided (ratio)
    std::string fault;          ///< why the iterate is invalid; empty if it is valid
    std::string remark;         ///< on the accepted state, for the user; empty: none
};

/// The instant of a velocity.
enum class VelocityAt {
    iterate,
    start, ///< of the step
    past,  ///< the known part of the mean of a dynamic step: without the share of the end velocity
};

/// The matrix A of a body at its iterate, after Body::linearise(), and its rigid modes.
class StepMatrix {
public:
    virtual ~StepMatrix() = default;

    /// Number of unknowns of the body's iterate.
    virtual int unknowns() const = 0;
    virtual Eigen::VectorXd free_change() const = 0; ///< y_free
    /// W = C^T A^+ C, symmetric.
    virtual void compliance(const SparseColumns& C, Eigen::MatrixXd& W) = 0;
    virtual Eigen::VectorXd solve(const Eigen::VectorXd& force) = 0; ///< A^+ f
    /// A^+ C r, with the C of the last compliance().
    virtual Eigen::VectorXd solve(const SparseColumns& C, const Eigen::VectorXd& r)
    {
        return solve(Eigen::VectorXd(C * r));
    }
    virtual const Eigen::MatrixXd& modes() const = 0; ///< R, unknowns x m
    virtual Eigen::VectorXd mode_load() const = 0;    ///< g: loads on the modes, less inner forces
    /// Name of a combination of modes, e.g. "shift along (0, 0, 1)". @param a  amplitudes, m
    virtual std::string mode_name(const Eigen::VectorXd& a) const = 0;
};

/// Interface between the time step and a body (rigid, solid, rod): its state and its kinematics.
class Body {
public:
    virtual ~Body() = default;

    bool nonlinear() const { return nonlinear_; } ///< its forces are a nonlinear function of places
    double size() const { return size_; }         ///< [m]
    virtual StepMatrix& matrix() = 0;             ///< of the last linearise()
    virtual const StepMatrix& matrix() const = 0; ///< of the last linearise()

    /// Bound of the prescribed motion of any place from one time to another [m].
    virtual double prescribed_motion(double /*from*/, double /*to*/) const { return 0; }
    virtual double speed() const = 0; ///< bound of the velocity of any place at the start [m/s]

    /// Begins a step (or, after a refusal, the same one anew): the iterate is the state with the
    /// prescribed motion applied.
    virtual void begin(const StepInput& step) = 0;
    /// Resets the iterate to the state, until begin() applies the prescribed motion.
    /// @return  false if nothing is prescribed: nothing was done
    virtual bool reset_to_start() = 0;
    /// Matrix and residual at the iterate, without contact forces.
    virtual void linearise() = 0;

    /// Adds `scale` times the derivative of (direction . motion of the place) to a column:
    /// of its place by y in quasi-static steps, of its velocity in dynamic ones.
    virtual void add_column(const BodyPlace& at, const Vec3& direction, double scale, int column,
                            std::vector<Eigen::Triplet<double>>& out) const = 0;
    virtual Vec3 displacement(const BodyPlace& at) const = 0; ///< iterate - start of step [m]
    virtual Vec3 velocity(const BodyPlace& at, VelocityAt when) const = 0; ///< [m/s]

    /// Sets rigid modes constrained by no contact, m x some, orthonormal; the next update() leaves
    /// them at rest.
    void set_unconstrained_modes(const Eigen::MatrixXd& modes) { unconstrained_ = modes; }
    /// Moves the iterate. @param force  H^T r of the contact forces that led to it
    virtual void update(const Eigen::VectorXd& y, const Eigen::VectorXd& mode,
                        const Eigen::VectorXd& force) = 0;
    virtual BodyOutcome outcome() const { return {}; } ///< of the last update(), or accept()
    /// How far the iterate is from balance under these contact forces, relative to the forces [-].
    virtual double imbalance(const Eigen::VectorXd& force) = 0;

    /// Before a dynamic step is accepted: the moment of its contacts and joints about the origin
    /// [N m s], each at one place for both bodies. On surfaces that slide along each other, or with
    /// a gap between them, the places on the two bodies differ; forces there would have a moment.
    void set_contact_moment(const Vec3& moment) { contact_moment_ = moment; }
    /// The iterate becomes the state.
    virtual BodyEnergy accept(const Eigen::VectorXd& force) = 0;

    virtual BodyMotion motion() const = 0; ///< of the state

    /// Everything that the next step depends on.
    virtual std::vector<double> state() const = 0;
    virtual void set_state(std::span<const double> state) = 0; ///< as long as state()
    /// The state of the same body with other conditions, for set_state(); of another length than
    /// state() where this one cannot continue from it.
    virtual std::vector<double> state_from(const Body& before) const { return before.state(); }
    /// Exchanges the velocities of the state with these; before the first step.
    /// @param velocities  empty: all are zero
    virtual void swap_velocities(std::vector<double>& /*velocities*/) {}

protected:
    bool nonlinear_ = false;
    double size_ = 0;
    Eigen::MatrixXd unconstrained_;      ///< set_unconstrained_modes
    std::optional<Vec3> contact_moment_; ///< set_contact_moment
};

} // namespace amontons
