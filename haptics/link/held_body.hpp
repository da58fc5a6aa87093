#pragma once

#include "haptics/link/condensed.hpp"
#include "solver/step/body_contacts.hpp"

namespace amontons {

/// A rigid body or a solid in the hand: six more unknowns, shift and turn of its frame, which
/// springs couple to the device. So the step's own contact problem moves it, and the force on the
/// hand follows from the certified solution.
///
/// In quasi-static steps the matrix of the six is diag(k, k_turn); in dynamic ones, on velocities
/// and with the frame at the end of the step, h^2 times that: the handle has no mass of its own;
/// the mass is that of the hand.
class HeldBody final : public Body, public StepMatrix {
public:
    /// @param body    of a body whose motion is prescribed; outlives this
    /// @param origin  of the handle, in the body's own coordinates [m]: turns are about it
    HeldBody(const BodyRef& body, const Vec3& origin, const HandleSpring& spring);

    /// Sets the pose of the device at the end of the steps to come, to which the springs pull the
    /// handle.
    void aim(const HandPose& device) { device_ = device; }
    const HandPose& device() const { return device_; }
    const HandPose& pose() const { return state_; } ///< of the handle, accepted
    const Wrench& force() const { return force_; }  ///< of the contacts on the handle, accepted
    /// Where the arms of contacts with a rigid handle begin: in motion contacts are where the step
    /// found them at its start, and so is this [m].
    const Vec3& arm_from() const { return step_.dynamic ? begun_ : now_.position; }
    const HandleSpring& spring() const { return spring_; }
    /// W without the springs: of the elastic part alone. @param C  unknowns x any number
    void held_compliance(const SparseColumns& C, Eigen::MatrixXd& W);
    /// Moves the handle without a step, as it is held.
    void put(const HandPose& pose);

    StepMatrix& matrix() override { return *this; }
    const StepMatrix& matrix() const override { return *this; }
    int unknowns() const override { return inner_.matrix().unknowns() + 6; }
    void begin(const StepInput& step) override;
    bool reset_to_start() override { return inner_.reset_to_start(); }
    void linearise() override { inner_.linearise(); }
    void add_column(const BodyPlace& at, const Vec3& direction, double scale, int column,
                    std::vector<Eigen::Triplet<double>>& out) const override;
    Vec3 displacement(const BodyPlace& at) const override { return inner_.displacement(at); }
    Vec3 velocity(const BodyPlace& at, VelocityAt when) const override
    {
        return inner_.velocity(at, when);
    }
    Eigen::VectorXd free_change() const override;
    void compliance(const SparseColumns& C, Eigen::MatrixXd& W) override;
    Eigen::VectorXd solve(const Eigen::VectorXd& force) override;
    const Eigen::MatrixXd& modes() const override { return inner_.matrix().modes(); }
    Eigen::VectorXd mode_load() const override { return inner_.matrix().mode_load(); }
    std::string mode_name(const Eigen::VectorXd& a) const override
    {
        return inner_.matrix().mode_name(a);
    }
    void update(const Eigen::VectorXd& y, const Eigen::VectorXd& mode,
                const Eigen::VectorXd& force) override;
    BodyOutcome outcome() const override { return inner_.outcome(); }
    double imbalance(const Eigen::VectorXd& force) override;
    BodyEnergy accept(const Eigen::VectorXd& force) override;
    double speed() const override { return inner_.speed(); }
    BodyMotion motion() const override { return inner_.motion(); }
    std::vector<double> state() const override;
    void set_state(std::span<const double> state) override;

private:
    Vec6
    spring_compliance() const; ///< of the springs, by axis [m/N, rad/(N m); dynamic: per impulse]
    void drive();
    Placement placement(const HandPose& pose) const;

    BodyRef body_;
    Body& inner_;
    Vec3 origin_;
    HandleSpring spring_;
    StepInput step_;
    HandPose device_, state_, now_;
    Vec3 begun_ = Vec3::Zero(); ///< the frame's place where the last step began [m]
    Wrench force_;
};

} // namespace amontons
