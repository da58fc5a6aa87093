#pragma once

#include "mesh/extract_surface.hpp"
#include "solver/body/body.hpp"
#include "solver/body/solid_matrix.hpp"
#include "solver/body/solid_memory.hpp"
#include "solver/body/solid_model.hpp"
#include "solver/body/solid_tangent.hpp"

#include <memory>
#include <optional>

namespace amontons {

/// An elastic solid: linear in a frame that is fixed, driven or floats with it, corotational, or
/// hyperelastic (its own part: solid_hyperelastic.cpp).
///
/// The frame holds the reference shape: x = frame (X + u). Prescribed displacements are along the
/// frame's axes, unknowns too; velocities are those of space.
class SolidBody : public Body, public StepMatrix {
public:
    /// @param mesh    checked; its sets are those of the input's holds and loads
    /// @param small     all of its contacts are of small sliding
    /// @param touching  nodes that may be in contact; pins avoid them
    /// @throws InputError  names of sets that the mesh has not
    SolidBody(const SolidInput& input, VolumeMesh mesh, bool small, std::span<const char> touching,
              const std::string& file);

    /// Takes the matrices of a body of the same mesh, material and conditions, if it is one. Before
    /// make_ready().
    /// @return  whether it is
    bool share_matrix(const SolidBody& other);

    /// The offline stage: all that does not depend on the state, for steps of this length.
    /// @param cache     folder where factors are kept; "": none
    /// @param messages  gets what was read, and what could not be
    virtual void make_ready(const StepInput& step, const std::string& cache,
                            std::vector<std::string>& messages);

    /// No factor: solves by Krylov's methods with multigrid, on all ranks of mpirun or on this one
    /// alone. Of linear solids; before make_ready().
    void iterate(bool on_all_ranks)
    {
        solving_.iterative = true;
        solving_.on_all_ranks = on_all_ranks;
    }
    /// Whether iterate() was called.
    bool iterative() const { return solving_.iterative; }
    /// Doubtful holds and loads of the scene.
    const std::vector<Issue>& warnings() const { return model_.conditions.warnings; }
    /// For contact without W of an iterative solid, on all degrees of freedom: the matrix; below,
    /// the residual force of the last linearise() (0 where held), A y and the diagonal of A.
    LargeMatrix& large() { return *matrix_->large; }
    /// The residual force: see large().
    const Eigen::VectorXd& large_load() const { return free_.load; }
    /// The step matrix times y.
    Eigen::VectorXd step_times(const Eigen::VectorXd& y) const;
    /// Diagonal of the step matrix.
    Eigen::VectorXd step_diagonal() const;
    /// Numbers of the unknown degrees of freedom.
    std::span<const std::int32_t> unknown_dofs() const { return unknowns_.dof; }
    /// The free change that linearise() of an iterative solid leaves out.
    void find_free_change();

    /// Sets the contact forces from bodies that do not move, on the unknowns: a matrix that is not
    /// positive definite is stabilised at these contacts first. Of hyperelastic solids; before
    /// linearise().
    void stabilise_with(const Eigen::VectorXd& force);
    /// True if its matrix may have to be stabilised by contacts.
    bool may_be_stabilised() const { return model_.hyperelastic; }
    /// True if the last matrix is the true tangent plus N N^T, a stiffness at the contacts.
    bool is_stabilised() const;
    /// W of the true matrix less W of the stabilised one.
    /// @return  negative eigenvalues of the true matrix; -1 where it cannot be used
    int true_tangent_compliance(const SparseColumns& C, Eigen::MatrixXd& more);
    /// A^-1 f by the true matrix from y = L^-1 f, after true_tangent_compliance().
    Eigen::VectorXd unstabilised(const Eigen::VectorXd& y) const;

    /// Number of threads for loops over elements, nodes and columns; the result does not depend on
    /// it.
    void use_threads(int threads);

    /// Expected number of steps to come, by which is decided which columns are stored.
    void expect_steps(double steps) { solving_.expected_steps = steps; }

    /// Names of the rigid motions that no prescribed displacement prevents.
    std::vector<std::string> free_motions() const;

    /// Its mesh, at rest.
    const VolumeMesh& mesh() const { return model_.mesh; }
    /// Its material, at rest.
    const SolidMaterial& material() const { return model_.material; }
    /// Of all nodes, at the iterate [m].
    std::span<const Vec3> places() const { return now_.x; }
    std::span<const Vec3> places_before() const { return state_.x; } ///< where the step starts
    std::span<const Vec3> first_places() const { return first_.x; }  ///< when the run began
    /// The least height of an element: no part of the body is thinner [m].
    double thinnest() const;
    double thickness() const; ///< least thickness at rest: see least_thickness() [m]
    /// The body without strain: moved by its frame, and within it by the mean of the prescribed
    /// displacements along each axis.
    struct Unstrained {
        /// The frame of the body.
        Placement frame;
        Vec3 shift = Vec3::Zero(); ///< in the frame [m]
        /// A place at rest X in space, as the frame moves it [m].
        Vec3 place(const Vec3& X) const { return frame * (X + shift); }
    };
    Unstrained unstrained() const; ///< of the iterate
    /// True if its places are a function of what is prescribed, of its loads and of the contact
    /// forces alone.
    virtual bool independent_of_path() const { return false; }
    /// Displacements of the touching nodes at the iterate, for begin_at() [m].
    std::vector<Vec3> at_touching() const;
    /// After begin(), of a body that is independent_of_path(): the iterate has these displacements
    /// where nothing is prescribed, in place of those of the state; none: those without contact.
    virtual void begin_at(std::span<const Vec3> /*touching*/) {}
    /// True if drive_to() has led it.
    bool led() const { return driven_to_.has_value(); }
    Vec3 moved_from_first(std::span<const StencilEntry> nodes) const; ///< the iterate [m]
    /// Young's modulus, for choosing slaves [Pa].
    double stiffness() const { return model_.material.youngs_modulus; }

    StepMatrix& matrix() override { return *this; }
    const StepMatrix& matrix() const override { return *this; }
    int unknowns() const override { return int(unknowns_.dof.size()); }
    /// True if the last linearise() has kept the earlier matrix; of hyperelastic solids.
    bool matrix_kept() const { return tangent_.kept; }
    /// True if the tangent of the last linearise() is not positive definite: the body moves away
    /// from an unstable equilibrium.
    bool leaves_balance() const { return tangent_.shift > 0 && volumes_.loads.empty(); }
    double prescribed_motion(double from, double to) const override;
    void begin(const StepInput& step) override;
    bool reset_to_start() override;
    void linearise() override;
    void add_column(const BodyPlace& at, const Vec3& direction, double scale, int column,
                    std::vector<Eigen::Triplet<double>>& out) const override;
    Vec3 displacement(const BodyPlace& at) const override;
    Vec3 velocity(const BodyPlace& at, VelocityAt when) const override;
    Eigen::VectorXd free_change() const override { return free_.change; }
    void compliance(const SparseColumns& C, Eigen::MatrixXd& W) override;
    Eigen::VectorXd solve(const Eigen::VectorXd& force) override;
    const Eigen::MatrixXd& modes() const override { return unknowns_.modes; }
    Eigen::VectorXd mode_load() const override { return free_.mode_load; }
    /// Change of the loads on the modes with their amplitudes, m x m [N/m]; empty: none.
    const Eigen::MatrixXd& mode_stiffness() const { return border_.mode_stiffness; }
    std::string mode_name(const Eigen::VectorXd& a) const override
    {
        return mode_name_of(model_, unknowns_, a);
    }
    void update(const Eigen::VectorXd& y, const Eigen::VectorXd& mode,
                const Eigen::VectorXd& force) override;
    BodyOutcome outcome() const override
    {
        return {search_.accepted_length, hyper_.fault, remark_};
    }
    /// A sentence on the energy that the time integration rule generates in the step of a
    /// hyperelastic solid; "" if it is small beside its energy.
    std::string spurious_energy_report();
    /// A sentence on the elements whose law has lost ellipticity at the iterate; "" if there are
    /// none.
    std::string unstable_material_report() const { return unstable_elements(model_, now_.u); }
    double imbalance(const Eigen::VectorXd& force) override;
    /// ", most at (x, y, z)": place of the node with the largest unbalanced force, for messages.
    std::string worst_imbalance(const Eigen::VectorXd& force);
    /// The part of imbalance() that may be round-off (relative).
    double round_off() const { return search_.round_off; }
    /// Before a step is accepted, to be called for each contact and coupling on the body: adds the
    /// part of its force on held nodes, which is not among H^T r of the unknowns.
    /// @param force  mean over a dynamic step, at the end of a quasi-static one [N]
    virtual void add_reaction(const BodyPlace& at, const Vec3& force);
    BodyEnergy accept(const Eigen::VectorXd& force) override;
    double speed() const override;
    BodyMotion motion() const override
    {
        return {kinetic_energy(), momentum(), angular_momentum()};
    }
    double kinetic_energy() const;          ///< of the state [J]
    Vec3 momentum() const;                  ///< linear [kg m/s]
    Vec3 angular_momentum() const;          ///< about the origin [kg m^2/s]
    std::vector<double> velocities() const; ///< of all nodes, of the state, 3n [m/s]
    void swap_velocities(std::vector<double>& velocities) override;
    std::vector<double> state() const override;
    std::vector<double> state_from(const Body& before) const override;
    void set_state(std::span<const double> state) override;

    /// Forces of the holds on the body, along the world's axes, summed over each hold's set [N]; of
    /// the accepted state.
    virtual std::vector<Vec3> reactions() const;
    /// Moments of the holds, in space [N m]: about `about` where they turn their set or give it a
    /// gradient, else about the mean place of the nodes; arms of linear solids are those at rest.
    virtual std::vector<Vec3> moments() const;
    /// The rigid rotation nearest to the motion of the nodes since the start: a rotation vector of
    /// length at most pi [rad]. Of the nodes that may be in contact, if there are three, else of
    /// all.
    Vec3 turn_since_start();
    /// Curves that a caller may set between steps: its drive, holds and loads.
    std::vector<LiveCurve> live_curves() { return live_curves_of(model_.input); }
    /// The scene's probes with their places or sets.
    const std::vector<ProbeInput>& probes() const { return model_.input.probes; }
    /// Mean displacement since the start of the place or set of a probe, in space [m], and stress
    /// there, of the accepted state, in space [Pa]: at a place of its element (of hyperelastic and
    /// corotational ones the element's mean), over faces of the elements behind them. complete()
    /// first.
    Vec3 probe_displacement(const ProbeInput& probe) const;
    /// Mean stress of a probe, XX YY ZZ XY YZ XZ [Pa]; empty if it has none.
    std::optional<Vec6> probe_stress(const ProbeInput& probe) const;
    /// Stress caused by the round-off of places: smaller stresses are not significant [Pa].
    double stress_round_off() const;
    /// Forces that the scene's supports exert on the body, in space [N], and their energy [J]; of
    /// the accepted state. complete() first.
    struct Support {
        /// On the body [N].
        Vec3 force = Vec3::Zero();
        /// Stored in its springs [J].
        double energy = 0;
    };
    /// Forces and energies of the scene's supports.
    std::vector<Support> supports() const;
    /// Sets the frame of a driven body, at the iterate and at the ends of later steps, in place of
    /// that of its drive.
    void drive_to(const Placement& frame);
    /// Computes the accepted state of all nodes, inner ones included.
    virtual void complete() {}
    /// True if between frames only the nodes that may be in contact are at the accepted state.
    virtual bool condensed() const { return false; }
    /// Nodes that may be in contact, ascending.
    std::span<const std::int32_t> touching() const { return unknowns_.touching; }
    /// Sets the nodes that may be in contact (a flag for each node), and chooses pins elsewhere.
    /// Before the first step.
    void may_touch(std::span<const char> touching) { set_touching(model_, touching, unknowns_); }
    /// Adds the nodes of a patch on which a coupling acts to them. Before the first step.
    void also_touch(const Patch& patch);
    /// u of each node in the frame [m], of the accepted state.
    const Eigen::VectorXd& displacements() const { return state_.u; }
    /// Frame of the linear solid.
    const Placement& frame() const { return state_.frame; }
    /// Pressures that move the scene's loads of a volume, in their order, of the accepted state
    /// [Pa]
    std::vector<double> found_pressures() const;
    /// Rotation of the material of an element in the frame.
    Mat3 element_rotation(std::int32_t element) const
    {
        return rotation_of_element(corotated_, element);
    }
    /// Stress of each element in the body's own frame, XX YY ZZ XY YZ XZ [Pa], and its energy
    /// density [J/m^3].
    void stresses(std::vector<Vec6>& stress, std::vector<double>& energy) const;

protected:
    using Motion = SolidMotion;
    /// The free motion, the loads on the rigid modes, and of an iterative solid the residual.
    struct FreeChange {
        Eigen::VectorXd change, mode_load;
        Eigen::VectorXd load; ///< see large_load()
        bool known = false;   ///< change is that of the iterate already
    };
    /// Where the run began.
    struct First {
        std::vector<Vec3> x;
        Placement frame;
        Late<Eigen::VectorXd> momentum; ///< of each node's shape function [kg m/s]
    };

    Placement frame_at(double t) const
    {
        return driven_to_ ? *driven_to_ : amontons::frame_at(model_, t);
    }
    SolidFrame frame_kind() const { return amontons::frame_kind(model_, unknowns_); }
    const Eigen::VectorXd& momenta() const
    {
        return at_state_.momentum.size() > 0 ? at_state_.momentum : *first_.momentum;
    }
    /// A motion of the modes without those constrained by no contact.
    Eigen::VectorXd constrained_part(const Eigen::VectorXd& mode) const;
    virtual void place_in_frame(Motion& m) { update_places(m); } ///< from m.frame and m.u
    void update_places(Motion& m)
    {
        m.version = ++known_.last_version;
        place_nodes(model_, m);
    }
    void follow_velocity();
    /// Forces of the material at places, in the frame [N]; the energy [J].
    double inner_forces(const Motion& m, Eigen::VectorXd& f);
    /// Along the axes of the frame; N or N s.
    Eigen::VectorXd residual(Eigen::VectorXd& scale);
    Eigen::VectorXd filtered_residual(Eigen::VectorXd& scale);
    Eigen::VectorXd theta_residual(Eigen::VectorXd& scale);
    void accept_loads(BodyEnergy& e);
    void accept_rest(BodyEnergy& e);
    void accept_motion(BodyEnergy& e);

    bool prepared() const { return !unknowns_.dofs.number.empty(); }
    void prepare();
    void make_matrix(std::vector<std::string>* messages = nullptr);
    void make_step_matrix();
    FactorResult factor_step_matrix(std::vector<std::string>* messages, double& scale);

    // Hyperelastic.
    void begin_hyperelastic();
    void linearise_hyperelastic();
    void assemble_tangent(SparseMatrix& S); ///< with that of pressures that follow
    bool nothing_changed() const; ///< since the accepted state, of what the body's balance is of
    void change_hyperelastic(const Eigen::VectorXd& whole, const Eigen::VectorXd& mode);
    void accept_hyperelastic();
    void find_volumes();
    Eigen::VectorXd newton_solved(const Eigen::VectorXd& f) const;

    SolidModel model_;
    SolidUnknowns unknowns_;
    SolidSolving solving_;
    std::shared_ptr<SolidMatrix> matrix_ = std::make_shared<SolidMatrix>();
    KeptCompliance kept_;
    KnownForces known_;
    CorotationalPart corotated_;
    HyperelasticPart hyper_;
    SolidTangent tangent_;
    ContactBorder border_;
    BalanceSearch search_;
    VolumeLoads volumes_;

    StepInput step_;
    SolidMotion state_, now_;
    SolidStateForces at_state_;
    SolidMemory memory_;
    PastShares past_;
    LastForces last_;
    SolidContactForces contact_;
    FreeChange free_;
    First first_;
    std::optional<Placement> driven_to_;
    std::string remark_;
};

} // namespace amontons
