#pragma once

#include "contact/rigid/shape.hpp"
#include "solver/body/body.hpp"
#include "solver/body/live_curve.hpp"
#include "solver/scene/scene.hpp"

#include <optional>

namespace amontons {

/// A rigid body, free or driven. Six unknowns: motion of its centre of mass, and rotation about it.
///
/// Its angular momentum is a state variable, so that a free body conserves it to round-off; the
/// inertia is that at the end of the step (in steps of second order: rigid_turn.hpp).
class RigidBody final : public Body, public StepMatrix {
public:
    /// @param mass  of the shape: density times volume [kg], and its inertia [kg m^2]
    RigidBody(const RigidInput& input, RigidShape shape, const MassProperties& mass);

    const RigidShape& shape() const { return shape_; }
    /// Placement of the shape at the iterate.
    Placement placement() const { return placement_of(now_); }
    /// Centre of mass [m] and turn at the iterate of a step at rest.
    std::pair<Vec3, Eigen::Quaterniond> iterate() const { return {now_.centre, now_.turn}; }
    /// Sets centre of mass [m] and turn of the iterate, as iterate() gave them.
    void set_iterate(const std::pair<Vec3, Eigen::Quaterniond>& at)
    {
        now_.centre = at.first;
        now_.turn = at.second;
    }
    /// Placement at the end of a step without contact.
    Placement free_placement(const StepInput& step) const;
    /// Placement at the start of the step.
    Placement start_placement() const { return placement_of(state_); }

    const Vec3& centre() const { return state_.centre; } ///< of mass [m]
    /// Velocity of the centre of mass [m/s].
    const Vec3& centre_velocity() const { return state_.velocity; }
    const Vec3& spin() const { return state_.spin; } ///< [rad/s]
    /// Its weight and loads at a time, as the last step has them [N, N m].
    std::pair<Vec3, Vec3> loads(double t) const { return {force(t), torque(t)}; }

    StepMatrix& matrix() override { return *this; }
    const StepMatrix& matrix() const override { return *this; }
    int unknowns() const override { return driven() ? 0 : 6; }
    /// True if its contacts represent equal parts of a face (shape.points).
    bool spread() const { return input_.shape.points > 0; }
    /// True if a drive prescribes its motion.
    bool driven() const { return input_.drive.given; }
    /// True if drive_to() has led it.
    bool led() const { return driven_to_.has_value(); }
    /// Curves that a caller may set between steps: its drive, the factor on its force and torque.
    std::vector<LiveCurve> live_curves();
    /// The start, as the scene gives it.
    const StartInput& begun() const { return input_.start; }
    /// Sets the placement of a driven body, at the iterate and at the ends of later steps, in place
    /// of that of its drive.
    void drive_to(const Placement& at);
    /// Sets the sum of the contact and coupling forces on a driven body, against which its drive
    /// does work.
    /// @param force   mean over a dynamic step, at the end of a quasi-static one [N]
    /// @param torque  about the origin [N m]
    void add_reaction(const Vec3& force, const Vec3& torque);
    double prescribed_motion(double from, double to) const override;
    void begin(const StepInput& step) override;
    bool reset_to_start() override;
    void linearise() override {}
    void add_column(const BodyPlace& at, const Vec3& direction, double scale, int column,
                    std::vector<Eigen::Triplet<double>>& out) const override;
    /// Adds a force, or a moment, at a place to the generalised forces on its unknowns: what
    /// add_column() gives, added up at once.
    void add_force(const BodyPlace& at, const Vec3& force, Eigen::VectorXd& on) const;
    Vec3 displacement(const BodyPlace& at) const override;
    Vec3 velocity(const BodyPlace& at, VelocityAt when) const override
    {
        if (when == VelocityAt::iterate) return iterate_velocity(at);
        return when == VelocityAt::start ? start_velocity(at) : past_velocity(at);
    }
    Eigen::VectorXd free_change() const override;
    void compliance(const SparseColumns& C, Eigen::MatrixXd& W) override;
    Eigen::VectorXd solve(const Eigen::VectorXd& force) override;
    const Eigen::MatrixXd& modes() const override { return modes_; }
    Eigen::VectorXd mode_load() const override;
    std::string mode_name(const Eigen::VectorXd& a) const override;
    void update(const Eigen::VectorXd& y, const Eigen::VectorXd& mode,
                const Eigen::VectorXd& force) override;
    double imbalance(const Eigen::VectorXd&) override { return 0; }
    BodyEnergy accept(const Eigen::VectorXd& force) override;
    double speed() const override
    {
        const Motion& m = driven() ? now_ : state_;
        return m.velocity.norm() + m.spin.norm() * 2 * size_;
    }
    BodyMotion motion() const override
    {
        return {kinetic_energy(), momentum(), angular_momentum()};
    }
    double kinetic_energy() const; ///< of the state [J]
    Vec3 momentum() const;         ///< linear [kg m/s]
    Vec3 angular_momentum() const; ///< about the origin [kg m^2/s]
    void swap_velocities(std::vector<double>& velocities) override;
    std::vector<double> state() const override;
    void set_state(std::span<const double> state) override;

private:
    Vec3 lever(const BodyPlace& at) const;
    Vec3 iterate_velocity(const BodyPlace& at) const;
    Vec3 start_velocity(const BodyPlace& at) const;
    Vec3 past_velocity(const BodyPlace& at) const;
    struct Motion {
        Vec3 centre = Vec3::Zero(); ///< of mass [m]
        Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
        Vec3 velocity = Vec3::Zero(), spin = Vec3::Zero();
    };
    Placement placement_of(const Motion& m) const;
    bool is_of_revolution_about(const Vec3& axis) const;
    Motion driven_motion(double t) const;
    Mat3 inertia(const Eigen::Quaterniond& turn) const;
    Vec3 force(double t) const;
    Vec3 torque(double t) const;
    void drive(double t);
    void begin_memory();
    void move_with_velocity();
    /// Steps of motion by any rule but implicit Euler's: see rigid_turn.hpp.
    bool second_order() const { return step_.dynamic && !driven() && step_.rule.end < 1; }
    void move_by(const Vec3& impulse, const Vec3& moment);
    Vec3 reference() const;
    Mat3 inverse_inertia() const;
    struct MeanMotion {
        Vec3 shift, turn; ///< of the centre [m]; see cayley_turn [rad]
        Vec3 centre;      ///< its mean place [m]
    };
    MeanMotion mean_motion() const;
    BodyEnergy accept_second_order();

    RigidInput input_;
    RigidShape shape_;
    MassProperties mass_; ///< about the shape's origin and axes
    Mat3 inverse_inertia_ = Mat3::Zero();
    StepInput step_;
    Motion state_, now_;
    Vec3 begun_ = Vec3::Zero(); ///< centre where the last step began [m]
    std::optional<Placement> driven_to_;
    Vec3 carried_ = Vec3::Zero(), carried_torque_ = Vec3::Zero();       ///< about its own centre
    Vec3 carried_before_ = Vec3::Zero(), torque_before_ = Vec3::Zero(); ///< at the state
    Vec3 angular_ = Vec3::Zero(); ///< angular momentum about the centre of mass, of the state
    Eigen::MatrixXd modes_;

    /// The filtered rates of the generalised-alpha rule.
    struct Memory {
        bool begun = false;
        Vec3 velocity = Vec3::Zero();
        Vec3 angular = Vec3::Zero(); ///< the momentum along the body's axes
        Vec3 force = Vec3::Zero(), torque = Vec3::Zero();
    } memory_;
    Vec3 past_velocity_ = Vec3::Zero(), past_spin_ = Vec3::Zero(); ///< see VelocityAt::past
    Vec3 past_angular_ = Vec3::Zero(), now_angular_ = Vec3::Zero();
    Vec3 mean_spin_ = Vec3::Zero();                               ///< of a step of second order
    Vec3 mean_force_ = Vec3::Zero(), mean_torque_ = Vec3::Zero(); ///< over the step
};

} // namespace amontons
