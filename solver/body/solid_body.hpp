#pragma once

#include "mesh/base/dense.hpp"
#include "mesh/base/late.hpp"
#include "mesh/extract_surface.hpp"
#include "mesh/volume_mesh.hpp"
#include "solver/body/body.hpp"
#include "solver/body/live_curve.hpp"
#include "solver/body/solid_conditions.hpp"
#include "solver/large/large_matrix.hpp"
#include "solver/linear/supernodal.hpp"
#include "solver/scene/scene.hpp"
#include "solver/solid/assembly.hpp"
#include "solver/solid/compliance.hpp"
#include "solver/solid/corotational.hpp"
#include "solver/solid/hyperelastic.hpp"
#include "solver/solid/rigid_modes.hpp"

#include <array>
#include <memory>
#include <optional>
#include <utility>

namespace amontons {

/// The matrices of a solid in its frame, the factor of that of a step, and stored columns of its
/// inverse. Equal linear bodies share them.
struct SolidMatrix {
    SparseMatrix K, M, S;                    ///< stiffness at rest, mass, of a step
    Elimination parts;                       ///< of S
    SupernodalFactor factor;                 ///< of a matrix that changes
    std::optional<SolidCompliance> constant; ///< of one that does not
    std::unique_ptr<LargeMatrix> large;      ///< of a solid that is solved by iterations instead
    double scale = 1;                        ///< S over the matrix that is factored (factor)
    double h = -1, theta = -1; ///< length of the step that S is for [s], and theta of its rule
    int made = 0;              ///< number of times that S was made
};

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
        iterative_ = true;
        on_all_ranks_ = on_all_ranks;
    }
    bool iterative() const { return iterative_; }
    /// Doubtful holds and loads of the scene.
    const std::vector<Issue>& warnings() const { return conditions_.warnings; }
    /// For contact without W of an iterative solid, on all degrees of freedom: the matrix; below,
    /// the residual force of the last linearise() (0 where held), A y and the diagonal of A.
    LargeMatrix& large() { return *matrix_->large; }
    const Eigen::VectorXd& large_load() const { return large_load_; }
    /// The step matrix times y.
    Eigen::VectorXd step_times(const Eigen::VectorXd& y) const;
    /// Diagonal of the step matrix.
    Eigen::VectorXd step_diagonal() const;
    /// Numbers of the unknown degrees of freedom.
    std::span<const std::int32_t> unknown_dofs() const { return unknown_; }
    /// The free change that linearise() of an iterative solid leaves out.
    void find_free_change();

    /// Sets the contact forces from bodies that do not move, on the unknowns: a matrix that is not
    /// positive definite is stabilised at these contacts first. Of hyperelastic solids; before
    /// linearise().
    void stabilise_with(const Eigen::VectorXd& force);
    /// True if its matrix may have to be stabilised by contacts.
    bool may_be_stabilised() const { return hyperelastic_; }
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
    void expect_steps(double steps) { expected_steps_ = steps; }

    /// Names of the rigid motions that no prescribed displacement prevents.
    std::vector<std::string> free_motions() const;

    const VolumeMesh& mesh() const { return mesh_; }
    const SolidMaterial& material() const { return material_; }
    /// Of all nodes, at the iterate [m].
    std::span<const Vec3> places() const { return now_.x; }
    std::span<const Vec3> places_before() const { return state_.x; } ///< where the step starts
    std::span<const Vec3> first_places() const { return first_; }    ///< when the run began
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
    double stiffness() const { return material_.youngs_modulus; }

    StepMatrix& matrix() override { return *this; }
    const StepMatrix& matrix() const override { return *this; }
    int unknowns() const override { return int(unknown_.size()); }
    /// True if the last linearise() has kept the earlier matrix; of hyperelastic solids.
    bool matrix_kept() const { return matrix_kept_; }
    /// True if the tangent of the last linearise() is not positive definite: the body moves away
    /// from an unstable equilibrium.
    bool leaves_balance() const { return shift_ > 0 && volumes_.empty(); }
    double prescribed_motion(double from, double to) const override;
    void begin(const StepInput& step) override;
    bool reset_to_start() override;
    void linearise() override;
    void add_column(const BodyPlace& at, const Vec3& direction, double scale, int column,
                    std::vector<Eigen::Triplet<double>>& out) const override;
    Vec3 displacement(const BodyPlace& at) const override;
    Vec3 velocity(const BodyPlace& at, VelocityAt when) const override
    {
        if (when == VelocityAt::iterate) return iterate_velocity(at);
        return when == VelocityAt::start ? start_velocity(at) : past_velocity(at);
    }
    Eigen::VectorXd free_change() const override { return free_change_; }
    void compliance(const SparseColumns& C, Eigen::MatrixXd& W) override;
    Eigen::VectorXd solve(const Eigen::VectorXd& force) override;
    const Eigen::MatrixXd& modes() const override { return free_modes_; }
    Eigen::VectorXd mode_load() const override { return mode_load_; }
    /// Change of the loads on the modes with their amplitudes, m x m [N/m]; empty: none.
    const Eigen::MatrixXd& mode_stiffness() const { return mode_stiffness_; }
    std::string mode_name(const Eigen::VectorXd& a) const override;
    void update(const Eigen::VectorXd& y, const Eigen::VectorXd& mode,
                const Eigen::VectorXd& force) override;
    BodyOutcome outcome() const override { return {accepted_step_length_, fault_, remark_}; }
    /// A sentence on the energy that the time integration rule generates in the step of a
    /// hyperelastic solid; "" if it is small beside its energy.
    std::string spurious_energy_report();
    /// A sentence on the elements whose law has lost ellipticity at the iterate; "" if there are
    /// none.
    std::string unstable_material_report() const { return unstable_material_report(now_.u); }
    double imbalance(const Eigen::VectorXd& force) override;
    /// ", most at (x, y, z)": place of the node with the largest unbalanced force, for messages.
    std::string worst_imbalance(const Eigen::VectorXd& force);
    /// The part of imbalance() that may be round-off (relative).
    double round_off() const { return round_off_; }
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
    std::vector<LiveCurve> live_curves();
    /// The scene's probes with their places or sets.
    const std::vector<ProbeInput>& probes() const { return input_.probes; }
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
    std::span<const std::int32_t> touching() const { return touching_; }
    /// Sets the nodes that may be in contact (a flag for each node), and chooses pins elsewhere.
    /// Before the first step.
    void may_touch(std::span<const char> touching);
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
    Mat3 element_rotation(std::int32_t element) const;
    /// Stress of each element in the body's own frame, XX YY ZZ XY YZ XZ [Pa], and its energy
    /// density [J/m^3].
    void stresses(std::vector<Vec6>& stress, std::vector<double>& energy) const;

protected:
    Vec3 iterate_velocity(const BodyPlace& at) const;
    Vec3 start_velocity(const BodyPlace& at) const;
    Vec3 past_velocity(const BodyPlace& at) const;
    struct Motion {
        Placement frame;
        Eigen::VectorXd u;        ///< in the frame, 3n [m]
        Eigen::VectorXd v;        ///< in space, 3n [m/s]; dynamic only
        std::vector<Vec3> x;      ///< in space [m]
        std::int64_t version = 0; ///< another one wherever x is
    };
    enum class Frame { fixed, driven, floating };

    /// Floating: it carries the rigid motion that nothing prescribes.
    Frame frame_kind() const
    {
        return input_.drive.given              ? Frame::driven
               : !conditions_.supports.empty() ? Frame::fixed // they stand in space
               : !small_ && !nonlinear_ && rigid_->R.cols() > 0 ? Frame::floating
                                                                : Frame::fixed;
    }
    const Eigen::VectorXd& momenta() const
    {
        return momentum_.size() > 0 ? momentum_ : *first_momentum_;
    }
    template <class Of> Vec3 mean_of(const BodyPlace& at, Of motion) const;
    template <class Act> void spread(const BodyPlace& at, const Vec3& force, Act act) const;
    void hold(Motion& m, double t) const;
    Placement frame_at(double t) const;
    virtual void place_in_frame(Motion& m) { update_places(m); } ///< from m.frame and m.u
    void update_places(Motion& m);
    Vec3 centre(const std::vector<Vec3>& x) const; ///< of mass, at places x
    void into_frame_displacements(Motion& m) const;
    void find_spin();
    double keep_angular_momentum(const Eigen::VectorXd& load, const Eigen::VectorXd& reached);
    /// Amplitudes of the rigid modes nearest to u, of all nodes [m].
    Eigen::VectorXd mean_motion(const Eigen::VectorXd& u) const;
    /// A motion of the modes without those constrained by no contact.
    Eigen::VectorXd constrained_part(const Eigen::VectorXd& mode) const;
    void move_frame(Motion& m, const Eigen::VectorXd& mode) const; ///< by amplitudes of the modes
    /// W of the columns that came last.
    bool kept_W(const SparseColumns& C, Eigen::MatrixXd& W) const;
    void keep_W(const SparseColumns& C, const Eigen::MatrixXd& W);
    /// W by the matrix that stays. @param whole  C among all free unknowns
    /// @return  whether they are the columns that came last before the state was restored: then W
    ///          is made as it was made there
    bool make_W(const SparseColumns& C, const SparseColumns& whole, Eigen::MatrixXd& W);
    double print_of_last_columns() const;
    void float_frame(Motion& m) const;                      ///< from the places to the frame and u
    Eigen::VectorXd loads(const Motion& m, double t) const; ///< in space [N]
    /// Forces of the material at places, in space [N]; the energy [J].
    double inner_forces(const Motion& m, Eigen::VectorXd& f);
    Vec6 element_stress(std::int32_t element, const Vec3& xi) const;
    std::vector<Vec3> centres_of_holds(const Eigen::VectorXd& u) const;
    double add_support_forces(const Eigen::VectorXd& u, Eigen::VectorXd& f) const;
    Eigen::VectorXd residual(Eigen::VectorXd& scale); ///< in space; N or N s
    /// K v, of the rate of strain alone where elements turn with the material.
    /// @param v  along the frame that the last inner forces were found in [m/s]
    Eigen::VectorXd rate_forces(const Eigen::VectorXd& v) const;
    Eigen::VectorXd last_rate_forces_; ///< of the last residual, along the frame [N/s]
    Eigen::VectorXd damping_forces(const Motion& m) const; ///< along the frame of now_ [N]
    std::array<Eigen::VectorXd*, 6> carried_on();
    void begin_memory();
    Eigen::VectorXd filtered_residual(Eigen::VectorXd& scale);
    double filtered_loss(const Eigen::VectorXd& momentum) const; ///< [J]
    void end_memory(const Eigen::VectorXd& start_velocity, const Eigen::VectorXd& elastic);
    Eigen::VectorXd solved(const Eigen::VectorXd& f) const;    ///< of the free unknowns
    void solve_all(Eigen::MatrixXd& F) const;                  ///< the same of every column
    Eigen::VectorXd with_pins(const Eigen::VectorXd& y) const; ///< and 0 at the pins
    std::vector<double> kept_columns() const;
    void keep_columns(std::span<const double> kept);
    void turn_modes(); ///< rigid modes of the shape as it is now: true forces balance on these
    void prepare();
    void make_matrix();
    void make_step_matrix();
    std::pair<double, double> shares() const;
    void drop_step_matrix();
    std::vector<std::int32_t> node_of_free() const;
    Eigen::VectorXd mass_times(const Eigen::VectorXd& v) const;
    Eigen::VectorXd stiffness_times(const Eigen::VectorXd& u) const;
    Eigen::VectorXd into_frame(const Eigen::VectorXd& f) const;
    Eigen::VectorXd into_space(const Eigen::VectorXd& f) const;

    SolidInput input_;
    std::string file_; ///< the scene's
    VolumeMesh mesh_;
    SolidMaterial material_;
    bool small_ = false, corotational_ = false, hyperelastic_ = false;
    bool iterative_ = false, on_all_ranks_ = false;
    int threads_ = 1;
    Eigen::VectorXd large_load_; ///< see large_load()
    double stiffest_ = 0;        ///< largest entry of K [N/m]
    Vec3 middle_ = Vec3::Zero(); ///< mean of the reference places [m]

    SolidConditions conditions_; ///< points into input_ and mesh_

    // What only steps need is computed then: a scene can be checked without.
    Late<SolidPattern> pattern_;
    Late<std::vector<SparseMatrix>> supports_; ///< stiffness of each [N/m]
    Late<SparseMatrix> support_;               ///< their sum, of the pattern; 0 x 0: none
    std::shared_ptr<SolidMatrix> matrix_ = std::make_shared<SolidMatrix>();
    bool prepared_ = false;
    Late<SparseMatrix> m_;          ///< mass between nodes, of each axis [kg]; 0 x 0: no density
    Late<Eigen::VectorXd> weights_; ///< of each node in the weight [kg]
    Late<Eigen::VectorXd> first_momentum_; ///< momentum_ before the first step
    Eigen::VectorXd momentum_; ///< of each node's shape function, of the state [kg m/s]; momenta()
    Late<Eigen::VectorXd> lumped_; ///< 3n [kg]
    std::vector<CorotationalElement> elements_;
    std::vector<CorotationalState> element_states_;
    std::int64_t last_version_ = 0, known_version_ = -1; ///< inner forces of a version are kept
    Eigen::VectorXd known_forces_;
    double known_energy_ = 0;
    bool exact_tangent_ = false; ///< of corotational elements, while it is positive
    bool not_positive_ = false;  ///< the last one was not

    // Hyperelastic.
    void make_hyperelastic_elements(const std::string& file);
    double hyperelastic_inner(const Motion& m, Eigen::VectorXd& f);
    void assemble_tangent(SparseMatrix& S); ///< with that of pressures that follow
    void begin_hyperelastic();
    void follow_velocity();
    void linearise_hyperelastic();
    bool nothing_changed() const; ///< since the accepted state, of what the body's balance is of
    void change_hyperelastic(const Eigen::VectorXd& whole, const Eigen::VectorXd& mode);
    std::string unstable_material_report(const Eigen::VectorXd& u) const;
    void expect_pressures();
    void accept_hyperelastic();
    double next_shift(); ///< share of the stiffness at rest that makes the matrix positive
    SparseColumns stiffen(SparseMatrix& S, const Eigen::VectorXd& force, double along,
                          double across_size) const;
    void stabilise(SparseMatrix& S);
    void find_volumes();
    Eigen::VectorXd newton_solved(const Eigen::VectorXd& f) const;
    double volumes_missing() const;
    Eigen::VectorXd free_part(const Eigen::VectorXd& all) const;
    Eigen::VectorXd unknown_part(const Eigen::VectorXd& all) const;
    void support_body(SparseMatrix& S);
    void find_border();
    void bend_modes();
    Hyperelastic law_;
    std::vector<HyperelasticElement> hyper_;
    std::vector<HyperelasticState> hyper_states_;
    std::vector<InternalModes> state_modes_; ///< of the state: every step starts from them
    Eigen::VectorXd known_u_;                ///< at which inner forces were found last
    Eigen::VectorXd tangent_u_;              ///< at which the step's last tangent was made
    Eigen::VectorXd force_size_;             ///< sum of the sizes of elements' forces, in the frame
    Eigen::VectorXd start_residual_;         ///< of free unknowns, where the last matrix was made
    Eigen::VectorXd pending_;                ///< of u: what is prescribed and not yet moved
    Eigen::SparseMatrix<double> skew_;       ///< what the matrix lacks of the true tangent
    Eigen::SparseMatrix<double> true_part_;  ///< the matrix without its shift; empty: it has none
    SparseColumns stabilised_;               ///< N, of the free unknowns
    // Held by contacts alone: solid_free.cpp.
    std::vector<std::int32_t> springs_;      ///< nodes
    SparseColumns held_up_;                  ///< N, of the free unknowns
    Eigen::MatrixXd turning_;                ///< K R, of all nodes
    Eigen::MatrixXd mode_stiffness_;         ///< S
    Eigen::MatrixXd border_, border_matrix_; ///< X and the inverse of T; empty: no border
    int border_negative_ = 0;                ///< eigenvalues of K among motions without a mean
    LuFactor true_tangent_;                  ///< 1 - N^T L^-1 N
    double shift_ = 0, last_shift_ = 0;
    double accepted_step_length_ = 1, state_energy_ = 0, last_error_ = 0;
    bool matrix_kept_ = false;
    int stalled_ = 0;
    double round_off_ = 0;
    bool indefinite_ = false; ///< seen in this step
    bool unstable_ = false;   ///< the accepted state, by its last matrix
    std::string fault_, remark_;
    /// A load that prescribes a volume, by a pressure that is found.
    struct VolumeLoad {
        std::size_t load = 0; ///< of the conditions
        double pressure = 0, state_pressure = 0;
    };
    std::vector<VolumeLoad> volumes_;
    Eigen::MatrixXd volume_force_, volume_compliance_; ///< of 1 Pa on free unknowns, and A^-1 of it
    Eigen::MatrixXd volume_matrix_;                    ///< inverse of give per force
    Eigen::VectorXd volume_change_; ///< of the pressures, by the free change [Pa]
    FreeDofs dofs_;
    /// Degrees of freedom that are unknowns, and the number of each or -1: the free ones, then the
    /// pins of quasi-static steps, which move with the rigid modes.
    std::vector<std::int32_t> unknown_, unknown_number_;
    std::vector<std::int32_t> touching_;           ///< nodes that may come into contact
    std::string cache_;                            ///< folder of factors
    std::vector<std::string>* messages_ = nullptr; ///< while make_ready runs
    double expected_steps_ = 1;
    Late<RigidModes> rigid_;
    Eigen::MatrixXd free_modes_; ///< rows of unknowns

    SparseColumns last_columns_; ///< W of the last columns is kept with the factor
    Eigen::MatrixXd last_W_;
    int last_made_ = 0;               ///< the matrix of that W
    bool last_from_factor_ = false;   ///< that W
    double restored_columns_ = -1;    ///< print of those before the state was restored; or -1
    mutable double known_print_ = -1; ///< of last_columns_; or -1
    bool free_known_ = false;         ///< free_change_ is that of the iterate already

    StepInput step_;
    Motion state_, now_;
    std::optional<Placement> driven_to_;
    std::optional<Vec3> spin_; ///< of the state's body as a whole [rad/s]; none: find_spin()
    std::vector<Vec3> first_;
    Placement first_frame_;
    Eigen::VectorXd free_change_, mode_load_;
    Eigen::VectorXd contact_;           ///< forces of the last change, in the frame; 0 where held
    Eigen::VectorXd support_stiffness_; ///< of them those of stabilise_with()
    Eigen::VectorXd contact_held_;      ///< of add_reaction(), in the frame; 0 but where held [N]
    Eigen::VectorXd contact_before_;    ///< on all dofs, of the state before; quasi-static
    Eigen::VectorXd reaction_;          ///< of all dofs, in space [N]
    Eigen::VectorXd load_;              ///< of the state, in space [N]
    Eigen::VectorXd last_load_;         ///< of the last residual, in the frame [N]
    Eigen::VectorXd past_velocity_;     ///< see VelocityAt::past; 3n [m/s]

    /// What the generalised-alpha rule carries on, of all dofs, in space.
    struct Memory {
        bool begun = false;
        Eigen::VectorXd elastic, inner, load; ///< at the state [N]; inner: with damping
        Eigen::VectorXd filtered_velocity, filtered_inner, filtered_load; ///< [m/s], [N], [N]
    } memory_;
    Eigen::VectorXd past_inner_, past_load_;    ///< shares of the step's mean, in space [N]
    Eigen::VectorXd last_inner_, last_elastic_; ///< of the last residual, in space [N]
};

} // namespace amontons
