#pragma once

#include "contact/curve/curve_contact.hpp"
#include "contact/rigid/shape.hpp"
#include "solver/beam/held_base.hpp"
#include "solver/beam/rod_elements.hpp"
#include "solver/body/body.hpp"
#include "solver/body/live_curve.hpp"
#include "solver/scene/scene.hpp"

#include <optional>

namespace amontons {

/// Rows on the two nodes of an element, as columns.
using Mat12x3 = Eigen::Matrix<double, 12, 3>;

/// A contact force on a rod at the last iterate, known before linearise().
struct ContactLoad {
    /// Where the force acts.
    BodyPlace at;
    Vec3 force = Vec3::Zero();     ///< on the rod, in space [N]
    Vec3 normal = Vec3::UnitZ();   ///< unit, into the rod
    double gap = 0;                ///< at the iterate [m]
    Mat3 curvature = Mat3::Zero(); ///< derivative of the normal by the place [1/m]
    bool still = false;            ///< the other body does not move under contact forces
    /// Lower bound of the other body's stiffness at the contact [N/m]; 0: unknown.
    double firm = 0;
};

/// A beam that is held and loaded anywhere: docs/theory/beams.md.
///
/// Unknowns are six a node: its place in space and its rotation in the section's axes; of dynamic
/// steps the velocities of both. All nodes have unknowns, also those that are held: their rows and
/// columns are removed from the matrix, and prescribed motions are part of the free motion, so that
/// Newton's method moves a rod together with its ends. A place on a rod is one entry (element, xi)
/// and a point that is fixed to the cross-section there.
class RodBody final : public Body, public StepMatrix {
public:
    /// @param curve    of its shape, if it has one
    /// @param damping  mass-proportional [1/s]
    /// @param joined   places in space of its couplings: nodes are placed there, if they are on the
    ///                 rod [m]
    /// @throws InputError  (places relative to the body)
    RodBody(const RodInput& input, const Centreline* curve, double damping,
            std::span<const Vec3> joined = {});

    /// The place of its centreline, in the first shape, that is nearest to a point.
    struct Nearest {
        double s = 0;        ///< arc length from the start [m]
        double distance = 0; ///< [m]
        double radius = 0;   ///< of the rod there [m]
        int node = 0;        ///< the nearest node along the rod
    };
    /// The nearest place of the middle line to x [m].
    Nearest nearest(const Vec3& x) const;
    /// A node as a place of the rod: (element, xi).
    StencilEntry place_of_node(int node) const;
    /// Place of a node and rotation of its section at the iterate.
    Placement node_pose(int node) const;
    /// True of a node that a sheath holds where the rod begins.
    bool starts_in_sheath(int node) const;
    /// Before the first step of a dynamic run: sets the velocity of a rod that is fed out of a
    /// sheath to that of its feed.
    void start_with_feed();

    /// Curves that a caller may set between steps: its loads, and the length fed out of a sheath.
    std::vector<LiveCurve> live_curves();
    /// Constant data of the rod.
    const RodModel& model() const { return rod_; }
    /// Nodes of the iterate.
    const std::vector<BeamNode>& nodes() const { return now_.nodes; }
    /// Nodes of the run's first state.
    const std::vector<BeamNode>& first_nodes() const { return rod_.nodes; }
    /// Whether it is free of stress in its first shape, whole, and so stays there by itself.
    bool rests_in_first_shape() const;
    /// Whether this instrument lies in the bore of the other one: both come out of one introducer.
    bool lies_in(const RodBody& other) const;
    /// Radii of its bore, of each element [m].
    std::vector<double> bore() const;
    std::array<double, 6>
    strain(int element) const; ///< of the iterate: see element_strain [-, 1/m]
    /// Forces and moments of an element's section, in the order of its strains [N], [N m].
    std::array<double, 6> resultants(int element) const;
    AxisBox box() const;        ///< box around its surface, at the iterate [m]
    AxisBox box_before() const; ///< the same at the start of the step [m]
    Curve curve() const;        ///< its centreline, at the iterate
    Curve curve_before() const; ///< the same at the start of the step
    /// True of a place in the sheath, or between two nodes that the sheath holds.
    bool in_sheath(const CurvePlace& at) const;
    /// Where a contact force on a place acts: of a place in the sheath that is the section at the
    /// sheath's end, which slides and turns with it.
    StencilEntry acting_place(const CurvePlace& at) const;
    /// Force of the feed on the rod's base, > 0 out of the sheath, at the accepted state [N].
    double push_force() const { return push_; }
    /// Torque of the feed on the rod's base, about the sheath, at the accepted state [N m].
    double sheath_torque() const { return torque_; }
    double length_out_of_sheath() const; ///< at the state [m]
    double turned_in_sheath() const;     ///< rotation of its base, at the state [rad]
    /// Limits the feed to its length at the state, until release_feed().
    void stop_feed() { most_fed_ = accepted_.end.fed; }
    /// The feed follows its prescribed length again.
    void release_feed() { most_fed_ = -1; }
    /// Whether stop_feed() is in effect.
    bool feed_is_stopped() const { return most_fed_ >= 0; }
    /// The segment of a place; at a common end of two, the first.
    int segment_of(const CurvePlace& at) const;
    /// Rotation of its end about the sheath, from that at a base rotation of 0, at the state [rad].
    double tip_rotation() const;
    /// Whether the scene gives it a viscous drag.
    bool has_drag() const { return input_.drag > 0; }
    /// True at a node that is held along this direction.
    bool holds(const CurvePlace& at, const Vec3& direction) const;
    double least_radius() const;  ///< of its segments [m]
    double contact_reach() const; ///< search distance of its contacts [m]
    /// What the next iteration can reach [m]: of a rod that its feed alone moves; else infinity.
    double reach_of_iteration() const;
    /// The stations of its contacts (contact/curve/curve_contact.hpp).
    const std::vector<CurvePlace>& stations() const { return stations_; }
    /// The same with all elements of full length, as away from the end of a sheath.
    const std::vector<CurvePlace>& whole_stations() const
    {
        return material_ ? whole_stations_ : stations_;
    }
    /// Forces of the holds on the rod in the accepted state, in the scene's order: force in space
    /// [N] and moment in space about the place of the hold [N m]; sums over its nodes.
    std::vector<std::array<Vec3, 2>> reactions() const;
    /// Number of negative eigenvalues of the tangent at the iterate; the equilibrium is unstable
    /// unless there are none.
    int negative() const { return negative_; }
    /// Sets negative() to the number on the motions that contacts leave free.
    void note_negative(int count) { negative_ = count; }
    /// True if its lateral stiffness is by tension, not bending, and the tangent at the iterate has
    /// negative eigenvalues, while it had none at the start of the step.
    bool slip_is_unbalanced();
    /// Names of the rigid motions that no hold prevents.
    std::vector<std::string> free_motions() const;
    /// For rods that only contacts keep from moving: each Newton step at rest is made with a spring
    /// towards the iterate on the motions that no hold prevents (the proximal point method,
    /// Rockafellar 1976). The equilibrium is unchanged by it, and the rod does not move along
    /// motions that nothing constrains.
    void stabilise_with_contacts();
    /// True after stabilise_with_contacts().
    bool is_stabilised() const { return anchor_ > 0; }
    /// Stiffness of that spring on the place of a node and on its rotations [N/m, N m].
    std::array<double, 2> anchor_on(int node) const;
    /// Shifts along x, y, z and turns about them through the middle node, over the rod's size, at
    /// the accepted state: unknowns x 6.
    Eigen::MatrixXd rigid_motions() const;
    /// H^T H, 6 x 6, with H the motions of the held unknowns by rigid_motions(); the identity where
    /// a sheath holds the base.
    Mat6 held_rigid_motions() const;
    /// Sets the contact forces at the iterate of a quasi-static step: their change with the
    /// rotation of the rod becomes part of the matrix of the next linearise(). It changes the
    /// convergence, not the solution.
    void set_contact_forces(std::span<const ContactLoad> loads);
    /// A place on the middle line and its derivatives: by the place along its element (0 to 1) and
    /// by the displacements of the element's two nodes.
    struct Line {
        /// The element's nodes.
        int node[2] = {0, 0};
        /// Place [m] and first and second derivative along the element's 0 to 1.
        Vec3 x, slope, bend;
        /// Derivatives of place and slope by the twelve unknowns.
        Eigen::Matrix<double, 3, 12> J, J_slope;
    };
    /// The middle line at a place of a contact, for the geometry of contact.
    Line line(const BodyPlace& at) const;
    /// Derivative of (direction . motion of the place) by the displacements of its two nodes.
    Vec12 row(const BodyPlace& at, const Vec3& direction) const;
    /// The same along three directions, columns of `frame`; of a contact's place.
    Mat12x3 rows(const BodyPlace& at, const Mat3& frame) const;
    /// Geometric stiffness -(dJ/dy)^T f of a force f on the centreline that is fixed in space.
    Mat12 force_stiffness(const BodyPlace& at, const Vec3& force) const;
    /// EI / l^3 of an element [N/m].
    double element_stiffness(int element) const;
    /// Integral of EA over its length [N m]: energies below 1e-16 of it are rounding.
    double energy_scale() const
    {
        double sum = 0;
        for (const ElementLaw& law : rod_.law)
            sum += law.S[0];
        return sum;
    }
    /// Length of an element at rest [m].
    double element_length(int element) const { return rod_.law[std::size_t(element)].length; }
    /// Radius of an element [m].
    double element_radius(int element) const { return rod_.radius[std::size_t(element)]; }
    /// The system of linearise(), A y' = right for the motion y = y' + prescribed. Rows and columns
    /// of held unknowns are zero in A except for their diagonal, and y' is zero there.
    const RodMatrix& rod_matrix() const { return K_; }
    const Eigen::VectorXd& right() const { return right_; }
    const Eigen::VectorXd& prescribed() const { return prescribed_; }
    /// Appends, for each node from this one on, the projector to its motions that holds leave free.
    void add_free_of_nodes(int from, std::vector<Mat6>& free) const;
    /// First node whose element is not in the sheath: all unknowns of nodes before it are held.
    int first_outside() const { return material_ ? sheath_.node : 0; }
    /// Largest of the loads and of EI / length^2 [N].
    double force_scale() const;

    /// Adds a viscous drag to later quasi-static steps: the force on a node is its motion over the
    /// step times drag [N/m^2] times the length that the node represents (moments: times that
    /// length squared too). 0, the default: none.
    /// @param from_rest  the drag forces at the end of the last step are dropped
    void set_viscous_drag(double drag, bool from_rest = false);
    /// Largest motion of a node over the step so far [m].
    double largest_motion() const;

    /// The lowest frequencies about the iterate [rad/s].
    std::vector<double> frequencies(int count);

    StepMatrix& matrix() override { return *this; }
    const StepMatrix& matrix() const override { return *this; }
    int unknowns() const override { return 6 * rod_.node_count(); }
    void begin(const StepInput& step) override;
    bool reset_to_start() override;
    void linearise() override;
    /// The system of linearise() alone, which is neither factored nor solved: free_change(),
    /// solve() and negative() are not those of the iterate then.
    void set_up_system();
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
    const Eigen::MatrixXd& modes() const override { return modes_; }
    Eigen::VectorXd mode_load() const override { return {}; }
    std::string mode_name(const Eigen::VectorXd&) const override { return ""; }
    void update(const Eigen::VectorXd& y, const Eigen::VectorXd& mode,
                const Eigen::VectorXd& force) override;
    double imbalance(const Eigen::VectorXd& force) override;
    BodyEnergy accept(const Eigen::VectorXd& force) override;
    double speed() const override;
    void swap_velocities(std::vector<double>& velocities) override;
    BodyMotion motion() const override
    {
        return {kinetic_energy(), momentum(), angular_momentum()};
    }
    double kinetic_energy() const; ///< of the state [J]
    Vec3 momentum() const;         ///< linear [kg m/s]
    Vec3 angular_momentum() const; ///< about the origin [kg m^2/s]
    std::vector<double> state() const override;
    void set_state(std::span<const double> state) override;

    /// One step of this length (root mean square of the nodes' motion [m]) along the path of
    /// equilibria, on which the time t is an unknown too. If it fails, the state is unchanged.
    /// @param gravity  [m/s^2]
    /// @param t      in: at the state; out: at the end of the step [s]
    /// @param first  step in time by which the direction of the path at its start is found [s]
    /// @param end    a step that would pass this time ends there, and is shorter [s]
    /// @return  number of iterations; 0: it failed
    int path_step(double length, double first, double end, double tolerance, const Vec3& gravity,
                  double& t);

private:
    Vec3 iterate_velocity(const BodyPlace& at) const;
    Vec3 start_velocity(const BodyPlace& at) const;
    Vec3 past_velocity(const BodyPlace& at) const;
    /// Where a rod comes out of its sheath.
    struct SheathEnd {
        int node = 0;                    ///< which stands there
        double s = -1;                   ///< place of the rod there [m]; < 0: there is no sheath
        double fed = 0;                  ///< way of the base: what would be out of a rigid rod [m]
        double stretch = 0;              ///< of what is in the sheath [m]
        double turned = 0, rotation = 0; ///< about it, of the base and at its end [rad]
    };
    struct Motion {
        std::vector<BeamNode> nodes;
        std::vector<Vec6> velocity; ///< of the place in space, of the turn in the section's axes
        SheathEnd end;              ///< of dynamic steps
    };
    /// A scene's hold and its nodes.
    struct Hold {
        const RodHold* input;
        std::vector<int> nodes;
        std::array<bool, 3> axis{}; ///< places held along x, y, z
    };
    /// What holds leave of a node: free motions (a projector), and what is prescribed of the rest.
    struct Held {
        int node = 0;
        Mat6 free = Mat6::Identity();
        Vec6 move = Vec6::Zero(); ///< from the iterate
    };
    struct KnownForce {
        StencilEntry at; ///< element, xi
        ContactLoad load;
    };
    struct Load {
        const RodLoad* input;
        int node = -1; ///< -1: along the rod
    };

    Mat6 rigid_motion(const BeamNode& node) const;
    std::vector<Held> held_at(const Motion& m, double t) const;
    void add_loads(const Motion& m, double t, std::vector<Node6>& f, RodMatrix* K) const;
    /// Inner forces less loads, at places m and time t; the tangent into K_.
    void forces(const Motion& m, double t, std::vector<Node6>& inner, std::vector<Node6>& load);
    void forces_at_iterate();
    double slack_share(const Eigen::VectorXd& y) const;
    /// Tension holds it at the iterate, and not bending.
    bool is_taut() const;
    void hold_matrix(RodMatrix& A, int first) const;
    void factor_at_iterate();
    void move_nodes(Motion& m, const Eigen::VectorXd& y);
    void unroll(Motion& m, const Eigen::VectorXd& y);
    void note_motion(const std::vector<BeamNode>& before, const Eigen::VectorXd& y);
    double safe_share(const Motion& m, const Eigen::VectorXd& y) const;
    Eigen::VectorXd projected(const Eigen::VectorXd& f) const;
    double floor() const;                                               ///< round-off of forces [N]
    double force_size(const Motion& m, const std::vector<Node6>& load); ///< [N]
    Mat3 section(const Motion& m, int element, double xi) const;
    template <int Count>
    Eigen::Matrix<double, 12, Count>
    rows_along(const BodyPlace& at, const Eigen::Matrix<double, 3, Count>& directions) const;
    Curve curve_of(const Motion& m) const;
    AxisBox box_of(const std::vector<BeamNode>& nodes) const;
    void add_contact_stiffness(Eigen::VectorXd& rest);
    void add_drag();
    void add_viscous_pull();
    double length_at(int node) const; ///< that a node stands for [m]
    double taken_by_drag();           ///< in the step [J]
    double drag() const;
    double drag_on(int node, int axis) const;
    // The sheath: rod_sheath.cpp
    /// Of the node at its end, in its two unknowns.
    struct SheathBalance {
        Vec3 along = Vec3::Zero();
        double slope = 0;                   ///< of the energy with the way of the material [N]
        double torque = 0;                  ///< of what is held, on the rod [N m]
        Vec12 mixed = Vec12::Zero();        ///< of the slope by the first element's nodes
        double way = 0, turn = 0, both = 0; ///< second derivatives
    };
    /// Nodes that the sheath holds, from the start on: those in it and the one at its end.
    int nodes_in_sheath() const;
    int node_at_end(double s) const; ///< which stands there for this place
    Vec3 along_sheath() const;
    double base_turn(double t) const; ///< prescribed [rad]
    double base_way(double t) const;  ///< prescribed, or where it was stopped [m]
    bool out_of_sheath() const { return material_ && sheath_.node < rod_.element_count(); }
    bool compliant_at(double fed) const;
    bool compliant_in_sheath() const; ///< there is enough in it to stretch
    HeldBase held_base(const SheathEnd& at) const;
    double torsion_to(const SheathEnd& at, double s) const;
    static double turn_in_sheath(const SheathEnd& at, double part, double whole);
    BeamNode held_in_sheath(int node, double whole) const;
    BeamNode at_place(double s) const; ///< of the rod, at the accepted state, on its mesh
    std::optional<BeamNode> place_before(int element, double xi) const;
    void take_sheath_end(const SheathEnd& next);
    void move_sheath_end(const SheathEnd& next);
    void place_stations();
    void start_at_sheath();
    void begin_at_sheath();
    void turn_with_sheath();
    SheathBalance sheath_balance(const Motion& m, double t, bool stiffness) const;
    void balance_at_sheath(const SheathBalance& b, const Eigen::VectorXd& move,
                           Eigen::VectorXd& missing) const;
    void stiffness_at_sheath(const SheathBalance& b);
    Vec3 along_by_way(const std::vector<BeamNode>& nodes, double length, double xi) const;
    std::array<double, 2> past_sheath_end(Eigen::VectorXd& y) const;
    double share_past_end(double way) const;
    void pass_sheath_end(double way, double turn);
    double accept_at_sheath(std::vector<Node6>& acting);
    double energy_in_sheath() const;
    Vec3 line_load(double t) const; ///< without weight [N/m]
    // ... of dynamic steps: rod_feed.cpp
    bool grows(int element) const; ///< it comes out of the sheath in the step
    double first_length(const SheathEnd& end) const;
    double xi_now(int element, double xi) const;
    RodPlace place_on(const Motion& m, int element, double xi) const;
    Vec6 velocity_before(double s) const;
    void begin_motion_at_sheath();
    void place_at_sheath();
    SheathEnd part_way(double share) const; ///< of the step
    Vec6 velocity_in_sheath() const;        ///< at the end of the step, of its nodes
    void lead_base(Eigen::VectorXd& rest);
    double base_off() const; ///< way to where it is led [m]
    std::array<double, 2> base_forces(const SheathEnd& end) const;
    double accept_motion_at_sheath(std::vector<Node6>& acting);
    double energy_fed(double share) const;
    // dynamic steps
    void begin_memory();
    void dynamic_residual();
    Vec3 moment_of_loads(const Motion& m) const;
    void leave_no_inner_moment(const Motion& middle);
    void place_by_velocity();
    BeamNode half_way(int node) const; ///< of a dynamic step
    Motion between() const;            ///< where a step's one force is taken
    Motion middle() const;             ///< where momentum changes
    template <class Visit> void for_moving_mass(const Motion& middle, Visit visit) const;
    void add_mass(const Motion& middle, double scale);
    /// Loads less inner forces at a motion, and their tangent into K_.
    Eigen::VectorXd missing_forces(const Motion& m, double t);
    Vec3 point_velocity(const Motion& m, const std::vector<Vec6>& velocity, int element,
                        double xi) const;
    Vec3 with_velocity(const std::vector<Vec6>& velocity, const BodyPlace& at) const;
    double end_memory(); ///< carries on; returns what the rule and damping took [J]

    RodInput input_;
    RodModel rod_;
    RodElement kind_ = RodElement::exact;
    double damping_ = 0;
    std::vector<Hold> holds_;
    std::vector<Load> loads_;
    std::vector<CurvePlace> stations_, whole_stations_;
    double fed_first_ = 0; ///< where the sheath's end is along the first shape [m]
    int root_ = -1;        ///< the only node that is held, of an open rod; -1: there is not one

    StepInput step_;
    Motion state_, now_;
    Motion begun_;            ///< where the last step of motion began, on its mesh
    std::vector<Vec6> moved_; ///< sum of the step's motions, turns in the sections' axes
    RodMatrix K_, M_;
    bool whole_matrix_ = false; ///< K_, inner_ and load_ are what forces() makes of the iterate
    std::vector<Held> held_;
    std::vector<KnownForce> expected_;
    std::vector<Node6> inner_, load_;          ///< at the iterate
    std::vector<Node6> acting_;                ///< loads and reactions at the accepted state
    std::vector<Node6> reaction_;              ///< at the accepted state
    Eigen::VectorXd residual_;                 ///< what is missing, without contact
    double inertia_size_ = 0;                  ///< of dynamic steps [N]
    double last_motion_ = 0, before_last_ = 0; ///< of Newton's method [m]
    Eigen::VectorXd free_change_, right_, prescribed_;
    Eigen::MatrixXd modes_;                ///< none
    SheathEnd sheath_;                     ///< of the iterate, on the step's mesh
    int remeshed_ = -1;                    ///< last node that is elsewhere than on accepted_'s mesh
    std::optional<WireMaterial> material_; ///< of a rod with a sheath
    std::vector<ElementLaw> whole_;        ///< laws of its elements where no node is moved
    struct AtSheath {                      ///< what was accepted, on its own mesh
        SheathEnd end;
        std::vector<BeamNode> nodes;
        std::vector<Vec6> velocity;
        std::vector<Node6> acting;
    } accepted_;
    SheathEnd led_; ///< where a dynamic step leads the base: fed, turned
    bool compliant_in_step_ =
        false;                 ///< of a dynamic step: there is enough in the sheath to stretch
    double passed_energy_ = 0; ///< of what began or ended to be out as the step began [J]
    int renewed_ = -1;         ///< last node whose filtered rates begin anew with the step's mesh
    bool broken_ = false;      ///< the iterate leaves the element at the sheath's end no length
    double push_ = 0, torque_ = 0;  ///< at the accepted state [N], [N m]
    bool stable_ = true;            ///< the accepted balance
    double drag_ = 0;               ///< [N/m^2]
    double anchor_ = 0;             ///< per length [N/m^2]; 0: holds hold it
    std::vector<Vec6> drag_before_; ///< its forces at the end of the step before
    int negative_ = 0;              ///< -1: not counted at the iterate
    double held_size_ = -1; ///< of forces in the sheath, at rest, in this step [N]; < 0: not known

    struct Memory { // of the generalised-alpha rule
        bool begun = false;
        std::vector<Vec6> velocity, force; ///< filtered rates
        std::vector<Vec6> force_now;       ///< loads less inner forces, at the state
        Vec3 moment = Vec3::Zero(), moment_now = Vec3::Zero(); ///< of loads, about the origin
    } memory_, memory_at_start_; ///< at the state; the same on the step's mesh
    std::vector<Vec6> past_velocity_, past_force_;
    Vec3 past_moment_ = Vec3::Zero(); ///< of loads

    Eigen::VectorXd path_; ///< last step along the path
    double most_fed_ = -1; ///< where the feed was stopped [m]; < 0: it is not
};

} // namespace amontons
