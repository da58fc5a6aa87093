#pragma once

#include "contact/options.hpp"
#include "contact/solution.hpp"
#include "solver/large/linear_plan.hpp"
#include "solver/step/body_contacts.hpp"
#include "solver/step/couplings.hpp"

#include <atomic>
#include <functional>
#include <limits>
#include <map>
#include <string>

// One step of solids and rigid bodies: free motion, contacts, one contact problem for all, motion,
// repeated until the contact laws hold on the geometry at the end of the step.

namespace amontons {

/// Bodies, couplings and contacts of a scene, and what is stored from step to step.
struct BodySystem {
    std::vector<std::unique_ptr<Body>> bodies;
    std::vector<BodyRef> refs; ///< the same bodies, by kind
    /// Surfaces of solids that pairs use, by the names of body and set.
    std::map<std::pair<std::string, std::string>, ContactSurface> surfaces;
    ContactFinder finder{{}, {}};
    std::vector<Coupling> couplings;
    std::vector<std::unique_ptr<Patch>> patches; ///< of solids, that couplings act on
    std::vector<CouplingMemory> coupling_memory; ///< of each

    /// Identity of a contact over steps.
    struct Key {
        /// Number of the pair.
        int pair = 0;
        /// Identity within the pair.
        std::int64_t id = 0;
        auto operator<=>(const Key&) const = default;
    };
    std::map<Key, Vec3> warm;          ///< forces of the last step, in space [N or N s]
    std::map<Key, Vec3> warm_friction; ///< their tangential parts, of steps at rest [N]
    std::map<Key, bool> warm_sticks;   ///< of rods' contacts
    LinearPlan linear;
    std::vector<std::string> obstacles;  ///< their names
    std::vector<double> mean_compliance; ///< of large solids: see LargeContactSolution

    /// True if one of the bodies is a rod.
    bool has_rods() const
    {
        return std::ranges::any_of(refs, [](const BodyRef& b) { return b.rod != nullptr; });
    }
    /// True if a body cannot move.
    bool fixed(std::size_t b) const
    {
        return bodies[b]->matrix().unknowns() == 0 && bodies[b]->matrix().modes().cols() == 0;
    }
    /// True if only rods can move.
    bool rods_alone() const
    {
        for (std::size_t b = 0; b < refs.size(); ++b)
            if (!refs[b].rod && !fixed(b)) return false;
        return has_rods();
    }
};

/// Options of one step.
struct BodyStepOptions {
    /// Of the contact law and of balances (relative).
    double tolerance = 1e-8;
    ContactSolver solver = ContactSolver::automatic;
    /// External solver of contact problems, given a warm start; empty: none. Where it finds no
    /// solution, `why` is the reason, as the end of a sentence that begins with its name.
    std::function<ContactSolution(const ContactProblem&, const SolverOptions&,
                                  const Eigen::VectorXd&, std::string& why)>
        outside;
    int threads = 1;
    int most_iterations = 60; ///< of the outer loop
    int patience = 30;        ///< iterations that do not halve the least error so far
    /// Of the least error so far: an iteration that leaves more ends the step.
    double most_rise = std::numeric_limits<double>::infinity();
    /// Where overlap rows are added: at every place deeper than BodyOverlap::rows_beyond, only
    /// where the step would else be refused, or nowhere.
    enum class AddRows { deep, refused, none } add_rows = AddRows::deep;
    /// Where contacts jump, an equilibrium with those of the last iteration is accepted: see
    /// body_lag.cpp.
    bool may_lag = false;
    /// All that is prescribed is what the scene prescribes, from its start on.
    bool of_scene = false;
    bool explain = true; ///< find the reason where a step is refused, which takes time
    /// Set from outside, it ends the step as not accepted; none if null.
    const std::atomic<bool>* stop = nullptr;
};

/// Result of a step.
struct BodyStepReport {
    /// True if the step is solved.
    bool accepted = false;
    std::string refusal; ///< the reason if not
    int iterations = 0, factorisations = 0;
    BodyContacts contacts;             ///< at the end of the step
    std::vector<Vec3> force;           ///< of each contact on body a, in space [N]
    std::vector<Vec3> slip;            ///< of each contact over the step, in space [m]
    std::vector<Vec3> coupling_force;  ///< of each coupling's rows on its first body, in order [N]
    std::vector<Vec3> coupling_place;  ///< where these act [m]
    BodyOverlap overlap;               ///< the deepest of the accepted step; depth 0: none
    std::vector<BodyOverlap> overlaps; ///< all of them
    /// Error and threshold (relative), worst penetration [m], worst violation of a cone [N].
    double error = 0, threshold = 0, penetration = 0, cone = 0;
    int worst = -1;
    /// Distance of the contacts used from those at the end of the step (relative): 0 except where
    /// contacts jump from one iteration to the next.
    double lag = 0;
    /// Of a step with contacts that are not found at its end: how much the forces of other balances
    /// differ that were found there (relative).
    double spread = 0;
    std::vector<double> errors;       ///< of each iteration, where one is not enough
    std::vector<std::string> remarks; ///< e.g. unconstrained modes
    double friction = 0;              ///< dissipated by friction [J]
    double normal_work = 0;  ///< work of normal forces and couplings: dissipated by impacts [J]
    BodyEnergy energy;       ///< sums over the bodies
    ContactProblem recorded; ///< the last problem that was solved, and its answer
    Eigen::VectorXd recorded_reaction;
    std::vector<std::int32_t> recorded_identity;
    double free_motion = 0, detection = 0, compliance = 0, contact_solve = 0,
           correction = 0; ///< [s]

    /// Adds the iterations, factors and seconds of another try of the same step.
    void add_cost_of(const BodyStepReport& other);
};

/// The contact problem of the last step of rods alone, which was solved without forming W: with W
/// of the tangent at the end of the step, including the geometric stiffness of the contact forces.
/// The bodies are in the accepted state.
/// @param reaction  out: the reactions of the step, rows [N]
ContactProblem rods_problem(BodySystem& system, const BodyStepReport& report,
                            Eigen::VectorXd& reaction);

/// "a and b overlap by 0.001 m at (0, 0, 0)".
std::string describe(const BodyOverlap& overlap, const BodySystem& system);

/// Tries a step; if it is not accepted, the state is unchanged.
BodyStepReport try_body_step(BodySystem& system, const StepInput& step,
                             const BodyStepOptions& options);

struct UnstableBalance;

/// Snap of rods, where equilibria end and no step converges: gradient flow against a drag to the
/// next equilibrium, in many small steps of try_body_step. The work of the drag is counted as
/// dissipated. If it is not accepted, the state is unchanged.
/// @param leave  an unstable equilibrium that is left along its lowest mode; null: none
BodyStepReport relax_rods(BodySystem& system, const StepInput& step, const BodyStepOptions& options,
                          const UnstableBalance* leave = nullptr);

} // namespace amontons
