#pragma once

#include "solver/step/body_rows.hpp"
#include "solver/step/body_step.hpp"
#include "solver/step/closed_rows.hpp"
#include "solver/step/rod_problem.hpp"

// The inside of try_body_step, for the files that carry it out: body_step (the loop on the geometry
// at the end), body_problem (the contact problem of an iterate, rigid modes among its unknowns),
// body_certificate (the error of its solution there) and body_rods (both, of rods alone).

namespace amontons {

/// A contact sticks if its friction force is below this share of Coulomb's bound (ratio).
constexpr double kStickShare = 1 - 1e-6;

/// One try of a step, with its iterates.
class BodyStepper {
public:
    BodyStepper(BodySystem& system, const StepInput& step, const BodyStepOptions& options,
                BodyStepReport& report, bool guarded = false)
        : system_(system)
        , step_(followed(system, step))
        , options_(options)
        , report_(report)
    {
        rods_.guarded = guarded;
    }

    /// Displacements at touching nodes, of each body: of an iterate from which a step begins.
    using Places = std::vector<std::vector<Vec3>>;

    /// Forces of contacts and couplings, in space [N or N s].
    using Forces = std::map<BodySystem::Key, Vec3>;

    /// Makes the step. @returns  true if it is accepted
    bool run();
    /// The step begins from these places and forces in place of the state's.
    /// @param part  it ends with an iterate, of which nothing is accepted
    void begin_from(Places places, Forces forces, bool part)
    {
        from_ = std::move(places);
        force_ = std::move(forces);
        part_ = part;
    }
    /// The step is refused where its contacts may depend on the path to its end.
    void refuse_path() { refuse_path_ = true; }
    /// The step is refused where a force acts at a contact that is not found at its end.
    void refuse_kept() { refuse_kept_ = true; }
    /// The iteration has converged, and the step was refused for its contacts alone.
    bool converged() const { return converged_; }
    /// Of the last iterate, for begin_from().
    Places places() const;
    const Forces& forces() const { return force_; } ///< of the last iterate, for begin_from()
    /// True if rods alone are solved, without W.
    bool of_rods_only() const { return rods_only_; }
    /// True if the step has to be tried again, with rows that this try has added.
    bool again() const { return again_; }
    /// Repeats the step of another try, with rows that it has added: takes what is the same (the
    /// contacts found at the start of a dynamic step, without overlap rows), and the forces found.
    void repeat(BodyStepper& before);
    /// Name of a rod that its contacts do not stabilise in the last iteration; "" if there is none.
    const std::string& unheld() const { return unheld_; }
    /// Name of a solid whose contacts do not balance the moment of its stress; "" if there is none.
    /// Where a contact problem was not solved, an analysis of stability has to confirm it.
    std::string tipping() { return unsolved_ && !tipping_.empty() ? toppling() : tipping_; }

private:
    std::size_t bodies() const { return system_.refs.size(); }
    Body& body(std::size_t b) const { return *system_.refs[b].body; }
    Contacts contacts() const
    {
        return {system_.refs, system_.finder.pairs(), list_, joints_, system_.couplings};
    }
    BodySystem::Key key(int c) const;
    void linearise();
    void set_contact_forces(bool known_too);
    void pass_fixed_contact_forces();
    bool fixed(std::size_t b) const;
    bool matrices_kept() const;
    bool all_in_matrix() const;
    void find();
    /// At rest, rods alone: contacts never stay where an iteration before has found them.
    bool finds_anew() const { return !step_.dynamic && system_.rods_alone(); }
    void follow_contacts();
    // body_follow.cpp
    static StepInput followed(const BodySystem& system, StepInput step);
    bool follows_some() const;
    void start_following();
    void expect_motion();
    bool all_rows_hold();
    bool close(const Eigen::VectorXd& u);
    void refine();
    void follow_to_end();
    double farthest_gap(int pair) const;
    double of_turn(const Coupling& coupling, const CouplingRow& row, double before) const;
    void find_joints();
    void store_joints();
    double spring_loss(std::size_t coupling, double force) const;
    // body_lag.cpp
    void hold_lost(const BodyContacts& before, std::span<const double> moved_before);
    bool freeze();
    bool lags_little();
    Vec3 moved(const BodyContact& c) const;
    Vec3 common_place(int c) const;
    bool solve();
    void assemble();
    void note_support_stiffness(std::size_t b, const Eigen::MatrixXd& W);
    bool uses_factored_delassus() const;
    bool solve_with_modes();
    Eigen::VectorXd closed_rows(bool sticking) const;
    bool release_stabilised_rows();
    bool use_true_tangent(std::vector<Eigen::MatrixXd>& W,
                          const std::vector<std::pair<int, double>>& soft);
    Eigen::VectorXd unstabilised(std::size_t b, const Eigen::VectorXd& y) const;
    std::string rod_that_buckles() const;
    bool uses_matrix_free() const;
    bool solve_without_W();
    void take_answer(const Eigen::VectorXd& u);
    bool finish_iteration();
    ContactSolution solve_contact(const SolverOptions& options, std::string& why) const;
    Eigen::VectorXd warm_start() const;
    Eigen::VectorXd values(const Rows& rows) const;
    void add_motion(const Rows& rows, const std::vector<Eigen::VectorXd>& y,
                    Eigen::VectorXd& u) const;
    Eigen::VectorXd own(const Rows& rows, const Eigen::VectorXd& r, std::size_t b) const;
    std::vector<Eigen::VectorXd> forces(const Rows& rows, const Eigen::VectorXd& r) const;
    bool rescale_modes();
    Eigen::VectorXd in_lengths(std::size_t b, Eigen::VectorXd motion, bool back = false) const;
    bool exceeds_motion_bound();
    bool rods_alone() const;
    bool swings() const;
    bool solve_rods();
    void certify_rods(const Eigen::VectorXd& u);
    void relax();
    Eigen::VectorXd extrapolated(const Eigen::VectorXd& motion, const Eigen::VectorXd& change);
    Vec3 past_slip(const BodyContact& c) const;
    void mark_sliding();
    bool sliding_reversed();
    bool check_end_of_step();
    bool adds_rows();
    bool may_stay(const BodyOverlap& o) const;
    std::string deepest_overlap_message() const;
    bool faulty();
    void append_lost_ellipticity();
    void log_iteration(double law, double turned, double imbalance, int body,
                       std::vector<BodySystem::Key> acting);
    std::string why_no_balance() const;
    std::string why_no_forces() const;
    void certify_rows(const Eigen::VectorXd& u);
    Eigen::MatrixXd unconstrained_modes(std::size_t b, double share) const;
    void report_modes();
    void fill_report();
    std::string who(int contact) const;
    double compliance_of_row(std::size_t coupling) const; ///< of a spring's row, 0 of a joint's
    double mode_weight() const;
    bool stressed(std::size_t b) const; ///< a body of the kind that solid_free.cpp is about
    Eigen::MatrixXd mode_stiffness(std::size_t b) const;
    Eigen::VectorXd load_on_modes(std::size_t b) const;
    Eigen::MatrixXd mode_gain(std::size_t b) const;
    std::string toppling();
    bool is_free_to_slide(std::size_t b) const;
    bool couple_modes();
    bool may_feed_freely(std::size_t body) const;
    bool feed_freely();
    bool add_coupled_modes(const Eigen::VectorXd& compliance, const std::vector<Eigen::MatrixXd>& W,
                           const std::vector<std::pair<int, double>>& soft);
    std::vector<Eigen::VectorXd> coupled_gain(const std::vector<Eigen::VectorXd>& load) const;
    // body_roll.cpp
    bool touches_round(int body) const;
    bool roll();
    void find_rolling();
    Eigen::MatrixXd rolling_stiffness();
    void pull_back(double load);
    Eigen::VectorXd stiffness_by_forces(double length) const;
    void hold_unseen(Eigen::MatrixXd& T, const Eigen::MatrixXd& S, double stiffness) const;
    // body_hang.cpp
    bool hangs() const;
    bool only_hangs() const;
    void find_hanging();
    void find_hanging_on_joints();
    std::vector<Eigen::Index> first_modes() const;
    Eigen::MatrixXd of_body(const Eigen::MatrixXd& all, std::size_t body) const;
    std::vector<Eigen::Index> seen_modes() const;
    Eigen::MatrixXd unloaded_modes(std::size_t b, const Eigen::MatrixXd& unconstrained) const;
    bool leave_unstable_balance();
    Eigen::VectorXd change_by_hanging(std::size_t b) const;
    double hanging_imbalance(const std::vector<Eigen::VectorXd>& forces) const;

    BodySystem& system_;
    const StepInput step_;
    const BodyStepOptions& options_;
    BodyStepReport& report_;

    void begin_at_places();
    void begin_from_repeated();
    bool depends_on_path() const;
    bool keeps_lost() const;

    std::optional<Places> from_;
    bool part_ = false, refuse_path_ = false; ///< see begin_from(), refuse_path()
    bool refuse_kept_ = false, converged_ = false;
    void find_at_start();
    void note_friction_before();
    double friction_of_departed() const;

    BodyContacts list_, list_before_, at_start_;
    /// A contact that appeared and disappeared, as it was found.
    struct HeldContact {
        BodyContact contact;
        std::vector<StencilEntry> a, b;
        double moved = 0;          ///< along its normal, then [m]
        std::optional<Vec3> along; ///< across it, when it was lost [m]
    };
    std::map<BodySystem::Key, HeldContact> stays_;
    std::map<BodySystem::Key, int> lost_;     ///< how often contacts with a force were
    bool frozen_ = false, measuring_ = false; ///< contacts stay as found; are found all the same
    int freezes_ = 0;
    double lag_ = 0;
    std::vector<BodyOverlap> overlaps_; ///< at the last iterate that was measured
    int rounds_ = 0;                    ///< of rows added to it
    bool again_ = false;                ///< rows were added to a step that finds contacts once
    int linearised_ = 0;                ///< how often bodies were
    bool repeats_ = false;              ///< another try of the same step
    bool free_at_start_ = false;        ///< that try needed no free motions but the first
    std::map<BodySystem::Key, Vec3> found_before_; ///< forces of that try; 0: no contact of it acts
    bool found_ = false;
    bool nothing_ = false;   ///< moves but for rounding
    bool spread_ = false;    ///< contacts stand for areas: forces are to be even
    bool elastic_ = false;   ///< some body of the problem is
    bool linear_ = false;    ///< all are, at rest: the problem is solved beyond the tolerance
    bool rods_only_ = false; ///< solve_rods() is for them
    std::vector<CouplingRow> joints_;
    std::vector<CouplingRow> joints_start_;    ///< of steps that follow them
    std::vector<double> joint_value_;          ///< of each at the iterate
    std::vector<FollowedContact> contacts_on_; ///< of each contact, in steps that follow them
    bool stands_ = false;                      ///< rows are those of the iterate already
    int follows_ = 0;                          ///< how often contacts were followed
    ClosedRows closed_;                        ///< where all rows hold; empty where they may not
    std::vector<Vec3> value_;                  ///< of every contact and coupling, at the iterate
    std::vector<double> moved_; ///< of each contact along its normal, when it was found
    std::vector<Eigen::VectorXd> free_, mode_load_;
    std::vector<Eigen::MatrixXd> B_; ///< modes in the chosen rows
    std::vector<double> mode_scale_; ///< [m/N]
    std::vector<char> feeds_freely_; ///< rigid bodies: how often their scale has grown in the step
    int drifting_ = -1;              ///< the body that has to become one, or -1
    bool unsolved_ = false;          ///< the last contact problem was
    bool modes_coupled_ = false;     ///< in place of it, for this step: see couple_modes()
    bool modes_apart_ = false;       ///< they cannot be, for this step
    Eigen::MatrixXd coupled_root_;   ///< U^T U = T of the modes of all bodies [N/m]
    std::vector<double> mode_way_;   ///< of each body, the length scale of its balance [m]
    std::vector<Eigen::VectorXd> mode_, y_;
    Rows all_, rows_;
    ContactProblem problem_;
    bool stabilised_only_ = false;    ///< that problem had no solution in this iteration
    bool stabilised_in_step_ = false; ///< that problem's iterations did not converge
    std::string unheld_;
    std::string tipping_; ///< a body whose stress takes more of its hold than contacts have
    std::vector<char> true_tangent_; ///< bodies whose true matrix is in W beside the stabilised one
    Eigen::VectorXd held_;           ///< Gamma of body_stabilisation.cpp, by rows [N/m]; or empty
    Eigen::VectorXd held_r_;         ///< r' there
    std::vector<char> released_;     ///< of each contact: 1 its tangents, 2 all of it
    Eigen::MatrixXd taken_;          ///< q of the problem with it: (1 - taken) q
    Delassus measured_W_; ///< with modes of the elastic part's size: what errors are measured in
    Eigen::VectorXd r_;
    std::vector<Eigen::VectorXd> body_force_;
    std::map<BodySystem::Key, Vec3> force_;    ///< in space; of a coupling in x
    std::map<BodySystem::Key, Vec3> friction_; ///< of the accepted step at rest, in space
    std::map<BodySystem::Key, Vec3> motion_;   ///< u of the solved rows, in their frames
    std::map<BodySystem::Key, double> support_stiffness_; ///< of solids that rods touch [N/m]
    std::map<BodySystem::Key, bool> sticks_;              ///< of rods
    std::map<BodySystem::Key, BodySystem::Key> followed_; ///< of the last find(): old and new
    RodProblem rods_;
    Certificate certificate_;
    std::string deepest_;        ///< penetration that no contact of the problem prevented
    std::vector<double> errors_; ///< of the outer iterations
    /// The parts of one, and how many contacts came to act or ceased to.
    struct IterationLog {
        double law, turned, imbalance;
        int body; ///< that is furthest from its balance, -1: none
        int changed;
    };
    std::vector<IterationLog> iteration_log_;
    std::vector<BodySystem::Key> acting_, changed_; ///< of the last iteration; when last some did
    bool swung_ = false;                            ///< rods alone: they alternated in this step
    bool relaxing_ = false;
    double relaxation_ = 1; ///< share of the motion made
    double left_out_ = 0;   ///< the rest, of bodies whose balance is not evaluated again [m or m/s]
    Eigen::VectorXd made_before_;
    Eigen::MatrixXd changes_, made_; ///< of the motion between iterations, and the motions made
    Eigen::VectorXd motion_before_;
    BodyContacts rubbed_; ///< of steps at rest: contacts at its start that had friction then
    /// How the loads on the modes of all bodies change with them, where rigid bodies hang or roll.
    struct Hanging {
        Eigen::MatrixXd stiffness; ///< by the forces at the iterate
        Eigen::MatrixXd away;      ///< never negative: far from the balance
        Eigen::MatrixXd used;      ///< one of both
        Eigen::VectorXd support;   ///< for turns that nothing holds
        Eigen::VectorXd pull;      ///< back to the start of the step, where bodies roll
        double load = 0;           ///< of all bodies [N]
        bool empty() const { return used.size() == 0; }
    } hanging_;
    bool rolls_ = false;              ///< rigid bodies on curved surfaces, in this step: see roll()
    std::vector<Vec3> rolled_;        ///< of each body, its shift over the step so far [m]
    Eigen::VectorXd unbalanced_;      ///< load on the modes of a body that multipliers left
    std::size_t unbalanced_body_ = 0; ///< that body
    double pull_back_ = 0;            ///< of its load over its size, towards the start of the step
    bool left_unstable_ = false;      ///< an unstable balance, in this step
    Eigen::MatrixXd coupled_B_;       ///< modes of all bodies in all rows, where some hang
    Eigen::MatrixXd elastic_W_;       ///< W of these rows without modes
};

/// True if the end of a step at rest is a function of what is prescribed and of loads.
bool is_independent_of_path(const BodySystem& system);
/// Such a step, from bodies without contact on (body_rest.cpp).
/// @param from_before  converged from the end of the step before, or not
/// @return  false if it was not accepted
bool step_from_rest(BodySystem& system, const StepInput& step, const BodyStepOptions& options,
                    BodyStepReport& report, const BodyStepper& from_before);

} // namespace amontons
