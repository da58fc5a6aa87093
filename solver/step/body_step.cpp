#include "solver/step/body_stepper.hpp"

#include "contact/curve/curve_contact.hpp"
#include "mesh/base/dense.hpp"
#include "mesh/base/phase_timer.hpp"
#include "solver/body/rigid_body.hpp"
#include "solver/body/rod_body.hpp"
#include "solver/body/solid_body.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <set>

namespace amontons {
namespace {

constexpr int kDescent = 5; // times the iterations, from an unstable balance
// Iterations that do not halve the error before bodies are stabilised, and before the true tangent
// is tried again; how often this may alternate in a step.
constexpr int kTrueTangentPatience = 3, kStabilisedPatience = 5, kMostTurns = 9;
// Steps from rest have nothing in common with other steps, frames and units but their end: they
// are iterated to this share of the tolerance, within so many iterations.
constexpr double kEndFromRest = 0.01;
constexpr int kMostBeyond = 4;

} // namespace

BodySystem::Key BodyStepper::key(int c) const
{
    const int contacts = int(list_.contact.size());
    if (c >= contacts) return {-1, c - contacts};
    const BodyContact& k = list_.contact[std::size_t(c)];
    return {k.pair, k.id};
}

void BodyStepper::linearise()
{
    const Stopwatch watch;
    free_.clear();
    mode_load_.clear();
    set_contact_forces(!rods_only_);
    pass_fixed_contact_forces();
    // Of linear solids in motion the try before has left what the first iterate needs.
    const bool known = repeats_ && free_at_start_ && linearised_ == 0 && step_.dynamic;
    ++linearised_;
    // solve_rods() factors the rods' matrices with their contacts.
    const bool sparse = rods_only_ && list_.contact.size() + system_.couplings.size() > 0;
    for (std::size_t b = 0; b < bodies(); ++b) {
        const SolidBody* solid = system_.refs[b].solid;
        if (RodBody* const rod = system_.refs[b].rod; rod && sparse) {
            rod->set_up_system();
            free_.emplace_back();
            mode_load_.emplace_back();
            continue;
        }
        if (!known || !solid || solid->nonlinear() || solid->iterative()) body(b).linearise();
        free_.push_back(body(b).matrix().free_change());
        mode_load_.push_back(body(b).matrix().modes().cols() > 0 ? body(b).matrix().mode_load()
                                                                 : Eigen::VectorXd());
    }
    find_hanging();
    report_.free_motion += watch.seconds();
}

/// Passes the contact forces of the step before, or of the last iteration, to the rods.
/// @param known_too if false, no force is passed
void BodyStepper::set_contact_forces(bool known_too)
{
    if (step_.dynamic) return;
    std::vector<std::vector<ContactLoad>> loads(bodies());
    for (int c = 0; known_too && c < int(list_.contact.size()); ++c) {
        const auto known = force_.find(key(c));
        if (known == force_.end()) continue;
        const BodyContact& contact = list_.contact[std::size_t(c)];
        for (const Side& side : sides_of(contacts(), c)) {
            if (side.body < 0 || !system_.refs[std::size_t(side.body)].rod) continue;
            const Side other = sides_of(contacts(), c)[side.sign > 0 ? 1 : 0];
            ContactLoad load;
            load.at = side.place;
            load.force = side.sign * known->second;
            load.normal = side.sign * contact.frame.col(0);
            load.gap = contact.gap;
            load.still = other.body < 0 || fixed(std::size_t(other.body));
            if (const auto firm = support_stiffness_.find(key(c)); firm != support_stiffness_.end())
                load.firm = firm->second;
            if (load.still) load.curvature = side.sign * contact.curvature;
            loads[std::size_t(side.body)].push_back(load);
        }
    }
    for (std::size_t b = 0; b < bodies(); ++b)
        if (RodBody* rod = system_.refs[b].rod) rod->set_contact_forces(loads[b]);
}

/// Passes the last contact forces from bodies that do not move to the hyperelastic solids.
void BodyStepper::pass_fixed_contact_forces()
{
    const auto is_stabilised = [](const BodyRef& b) {
        return b.solid && b.solid->may_be_stabilised();
    };
    if (step_.dynamic || std::none_of(system_.refs.begin(), system_.refs.end(), is_stabilised))
        return;
    std::vector<ActingForce> firm;
    for (int c = 0; c < int(list_.contact.size()); ++c) {
        const BodyContact& contact = list_.contact[std::size_t(c)];
        const auto known = force_.find(key(c));
        if (known == force_.end() ||
            (contact.b >= 0 && !fixed(std::size_t(contact.a)) && !fixed(std::size_t(contact.b))))
            continue;
        const int n = rows_of(system_.finder.pairs(), contact);
        const Vec3 own = contact.frame.transpose() * known->second;
        firm.push_back({c, contact.frame.leftCols(n) * own.head(n)});
    }
    std::vector<Eigen::VectorXd> on;
    forces_on_bodies(contacts(), firm, on);
    for (std::size_t b = 0; b < bodies(); ++b)
        if (is_stabilised(system_.refs[b])) system_.refs[b].solid->stabilise_with(on[b]);
}

/// By the last linearise(), of all bodies that have one.
bool BodyStepper::matrices_kept() const
{
    bool some = false;
    for (const BodyRef& b : system_.refs) {
        if (b.rod || (b.solid && !b.solid->matrix_kept())) return false;
        some |= b.solid != nullptr;
    }
    return some;
}

/// No contact force moves it.
bool BodyStepper::fixed(std::size_t b) const
{
    return system_.fixed(b);
}

/// Contacts by the finder, or of a try before with the rows that are new.
void BodyStepper::find_at_start()
{
    if (!at_start_.contact.empty()) {
        list_ = at_start_;
        system_.finder.find_rows(system_.refs, step_, list_);
        return;
    }
    system_.finder.find(system_.refs, step_, list_, options_.threads);
    if (!step_.dynamic) return;
    at_start_ = list_;
    std::erase_if(at_start_.contact, [&](const BodyContact& k) {
        return k.id >= kFirstPlaceRow &&
               !system_.refs[std::size_t(k.a)].rod; // rods number their own
    });
}

/// Contacts at the iterate. Dynamic steps find them once, where the step starts; later iterations
/// move them along their normals, as those of a step that body_lag.cpp has frozen.
void BodyStepper::find()
{
    const Stopwatch watch;
    if (found_ && step_.follows) {
        follow_to_end();
    } else if (found_ && (step_.dynamic || frozen_)) {
        for (std::size_t c = 0; c < list_.contact.size(); ++c) {
            BodyContact& contact = list_.contact[c];
            const double now = contact.frame.col(0).dot(moved(contact));
            contact.gap += now - moved_[c];
        }
    } else {
        std::swap(list_, list_before_);
        find_at_start();
        if (!found_ && !step_.dynamic) note_friction_before();
        found_ = true;
        follow_contacts();
        if (!step_.dynamic) hold_lost(list_before_, moved_);
        if (step_.dynamic && step_.rule.end < 1) mark_sliding();
        if (step_.follows) start_following();
    }
    find_joints();
    row_values(contacts(), step_, contacts_on_, value_);
    moved_.assign(list_.contact.size(), 0);
    for (std::size_t c = 0; c < moved_.size() && !finds_anew(); ++c)
        moved_[c] = list_.contact[c].frame.col(0).dot(moved(list_.contact[c]));
    report_.detection += watch.seconds();
}

/// Of a contact against the other over the part of the step that its end velocity has no share in:
/// tangential [m/s].
Vec3 BodyStepper::past_slip(const BodyContact& c) const
{
    Vec3 slip = body(std::size_t(c.a)).velocity(list_.place_a(c), VelocityAt::past);
    if (c.b >= 0) slip -= body(std::size_t(c.b)).velocity(list_.place_b(c), VelocityAt::past);
    const Vec3 n = c.frame.col(0);
    return slip - n.dot(slip) * n;
}

/// Contacts that were on the cone and move: friction against the mean velocity is of second order,
/// and takes exactly mu r_n of the slip's length.
void BodyStepper::mark_sliding()
{
    constexpr double kOnCone = 1 - 1e-6, kMoves = 1e-10; // of the bound; of the body's size
    for (std::size_t c = 0; c < list_.contact.size(); ++c) {
        BodyContact& contact = list_.contact[c];
        const auto known = force_.find(key(int(c)));
        if (known == force_.end()) continue;
        const Vec3 force = contact.frame.transpose() * known->second;
        const double friction = friction_of(system_.finder.pairs(), contact);
        contact.sliding_at_start =
            friction > 0 && force.x() > 0 &&
            force.tail<2>().norm() >= kOnCone * friction * force.x() &&
            step_.h * past_slip(contact).norm() > kMoves * body(std::size_t(contact.a)).size();
    }
}

/// Some contact that slid has stopped or turned back within the step, where the mean velocity
/// contains no friction: the law of the end velocity is due.
bool BodyStepper::sliding_reversed()
{
    bool some = false;
    for (BodyContact& c : list_.contact) {
        if (!c.sliding_at_start) continue;
        BodyContact at = c;
        if (!contacts_on_.empty())
            at.point = contacts_on_[std::size_t(&c - list_.contact.data())].end_point;
        Vec3 velocity = body(std::size_t(c.a)).velocity(list_.place_a(at), VelocityAt::iterate);
        if (c.b >= 0)
            velocity -= body(std::size_t(c.b)).velocity(list_.place_b(at), VelocityAt::iterate);
        if (past_slip(at).dot(velocity) > 0) continue;
        c.sliding_at_start = false;
        some = true;
    }
    return some;
}

/// Contacts of rods wander along both: what is known of one that has left its neighbourhood, and
/// its number with it, is known of the one that has come up next to it.
void BodyStepper::follow_contacts()
{
    followed_.clear();
    const auto wanders = [&](const ContactPair& p) {
        return p.b >= 0 && system_.refs[std::size_t(p.a)].rod &&
               (system_.refs[std::size_t(p.b)].rod || system_.refs[std::size_t(p.b)].solid);
    };
    if (std::ranges::none_of(system_.finder.pairs(), wanders)) return;
    std::set<BodySystem::Key> now;
    for (int c = 0; c < int(list_.contact.size()); ++c)
        now.insert(key(c));
    std::vector<BodySystem::Key> dropped;
    for (const auto& [k, force] : force_) {
        if (k.pair < 0 || now.count(k) > 0) continue;
        const ContactPair& pair = system_.finder.pairs()[std::size_t(k.pair)];
        if (pair.b < 0 || !system_.refs[std::size_t(pair.a)].rod) continue;
        const BodyRef& b = system_.refs[std::size_t(pair.b)];
        if (b.rod || (b.solid && is_crossing(k.id))) dropped.push_back(k);
    }
    for (const BodySystem::Key& old : dropped)
        for (const std::int64_t id : neighbours(old.id)) {
            const BodySystem::Key next{old.pair, id};
            if (now.count(next) == 0 || force_.count(next) > 0 || motion_.count(next) > 0) continue;
            followed_[old] = next;
            const auto rename = [&](auto& map) {
                if (auto known = map.extract(old)) {
                    known.key() = next;
                    map.insert(std::move(known));
                }
            };
            rename(force_);
            rename(motion_);
            rename(sticks_);
            break;
        }
}

/// Of the two sides of a contact against each other over the step so far.
Vec3 BodyStepper::moved(const BodyContact& c) const
{
    Vec3 d = body(std::size_t(c.a)).displacement(list_.place_a(c));
    if (c.b >= 0) d -= body(std::size_t(c.b)).displacement(list_.place_b(c));
    return d;
}

/// A body's motion with the turns of a rod's nodes as displacements at its size [m]: norms of what
/// is partly in [rad] would depend on the unit of length.
/// @param back  the other way round
Eigen::VectorXd BodyStepper::in_lengths(std::size_t b, Eigen::VectorXd motion, bool back) const
{
    if (!system_.refs[b].rod) return motion;
    const double size = system_.bodies[b]->size(), factor = back ? 1 / size : size;
    for (Eigen::Index i = 3; i < motion.size(); i += 6)
        motion.segment<3>(i) *= factor;
    return motion;
}

/// The share of the motion y_, mode_ that is made. On geometry that moves, iterations converge by a
/// factor each: Anderson's rule extrapolates them from those before, but not where nonlinear solids
/// make that factor small: Newton's method, which extrapolation would spoil. Where an iteration
/// passes back on the one before and does not at least halve the error (an edge that is on a facet
/// or off it: alternation between two states), a share of the motion by Aitken's rule. Source:
/// Anderson 1965 as in Walker & Ni 2011, eq. 1.1; Küttler & Wall 2008, eq. 44.
void BodyStepper::relax()
{
    left_out_ = 0;
    if (rows_.count == 0 || step_.dynamic) return; // Newton's method alone; made as it is
    Eigen::Index size = 0;
    for (std::size_t b = 0; b < bodies(); ++b)
        size += y_[b].size() + mode_[b].size();
    Eigen::VectorXd motion(size);
    for (std::size_t b = 0, at = 0; b < bodies(); ++b) {
        const Eigen::VectorXd own = in_lengths(b, y_[b]);
        motion.segment(Eigen::Index(at), own.size()) = own;
        motion.segment(Eigen::Index(at) + own.size(), mode_[b].size()) = mode_[b];
        at += std::size_t(own.size() + mode_[b].size());
    }

    // Nothing to extrapolate.
    const bool newton = all_in_matrix() || !true_tangent_.empty() || only_hangs() || rolls_;
    // The rest of the motion is round-off of its solution, which extrapolation would amplify.
    const bool there = !errors_.empty() && errors_.back() <= report_.threshold;
    constexpr double kFast = 0.3;
    // Directions that nothing holds (a ball rolls) do not count: the motion may grow along them.
    const bool shrinks =
        (motion_before_.size() == size && motion.norm() < kFast * motion_before_.norm()) ||
        (errors_.size() > 1 && errors_.back() < kFast * errors_[errors_.size() - 2]);
    const bool fast = shrinks && std::ranges::any_of(system_.refs, [](const BodyRef& b) {
                          return b.solid && b.solid->nonlinear();
                      });
    relaxing_ = !newton && !there && errors_.size() > 2 &&
                errors_.back() > 0.5 * errors_[errors_.size() - 2] &&
                motion_before_.size() == size && motion_before_.dot(motion) < 0;
    Eigen::VectorXd made = motion;
    if (motion_before_.size() == size && !newton && !there) {
        const Eigen::VectorXd change = motion - motion_before_;
        const double length = change.squaredNorm();
        if (relaxing_ && length > 0) {
            relaxation_ = std::clamp(-relaxation_ * motion_before_.dot(change) / length, 0.1, 1.0);
            made = relaxation_ * motion;
        } else if (!relaxing_ && !fast) {
            made = extrapolated(motion, change);
        }
    }
    const Eigen::VectorXd left = motion - made;
    for (std::size_t b = 0, at = 0; b < bodies(); ++b) {
        const Eigen::VectorXd of_body =
            left.segment(Eigen::Index(at), y_[b].size() + mode_[b].size());
        if (!body(b).nonlinear()) // of others the balance shows where they are
            left_out_ = std::hypot(left_out_, of_body.norm());
        y_[b] -= in_lengths(b, of_body.head(y_[b].size()), true);
        mode_[b] -= of_body.tail(mode_[b].size());
        at += std::size_t(of_body.size());
    }
    motion_before_ = std::move(motion);
    made_before_ = std::move(made);
}

/// Contacts of rods with what stands still are in their matrices with all that turns with them: the
/// iteration is Newton's.
bool BodyStepper::all_in_matrix() const
{
    for (const int c : rows_.chosen) {
        if (c >= int(list_.contact.size())) return false;
        const BodyContact& k = list_.contact[std::size_t(c)];
        if (!system_.refs[std::size_t(k.a)].rod || (k.b >= 0 && !fixed(std::size_t(k.b))))
            return false;
    }
    return true;
}

/// Anderson's extrapolation of an iteration's motion; stores this iteration.
/// @param change  of the motion since the iteration before
Eigen::VectorXd BodyStepper::extrapolated(const Eigen::VectorXd& motion,
                                          const Eigen::VectorXd& change)
{
    constexpr Eigen::Index kMost = 5;
    // Times the motion. Where each iteration leaves 0.99 of the error, 100 times are due.
    constexpr double kLongest = 1000;
    if (changes_.cols() == kMost) {
        changes_ = changes_.rightCols(kMost - 1).eval();
        made_ = made_.rightCols(kMost - 1).eval();
    }
    changes_.conservativeResize(motion.size(), changes_.cols() + 1);
    made_.conservativeResize(motion.size(), made_.cols() + 1);
    changes_.rightCols<1>() = change;
    made_.rightCols<1>() = made_before_;
    const Eigen::VectorXd share = least_squares(changes_, motion);
    const Eigen::VectorXd made = motion - (made_ + changes_) * share;
    return made.norm() <= kLongest * motion.norm() ? made : motion;
}

/// Refuses the step if the iterate of some body is invalid, with its reason.
bool BodyStepper::faulty()
{
    for (std::size_t b = 0; b < bodies(); ++b)
        if (std::string why = body(b).outcome().fault; !why.empty()) {
            report_.refusal = std::move(why);
            append_lost_ellipticity();
            return true;
        }
    for (const Coupling& c : system_.couplings) // drives that a caller sets are known here only
        for (const auto& side : {c.a, c.b}) {
            if (side.body < 0 || side.node < 0) continue;
            const BodyRef& b = system_.refs[std::size_t(side.body)];
            if (!b.rod || !b.rod->in_sheath({side.node, 0})) continue;
            report_.refusal = fmt::format("the place of coupling {} on {} comes into its sheath",
                                          c.input, b.name);
            return true;
        }
    return false;
}

/// A refusal names the laws that are pressed beyond where they are stable.
void BodyStepper::append_lost_ellipticity()
{
    for (const BodyRef& b : system_.refs)
        if (const std::string soft = b.solid ? b.solid->unstable_material_report() : "";
            !soft.empty())
            report_.refusal += "; " + b.name + ": " + soft;
}

bool BodyStepper::run()
{
    for (std::size_t b = 0; b < bodies(); ++b)
        body(b).begin(step_);
    for (const BodyRef& b : system_.refs)
        spread_ |= b.rigid && b.rigid->spread();
    // What carries moving rods at their couplings may share their forces in any way.
    for (const Coupling& c : system_.couplings)
        for (const CoupledPlace& side : {c.a, c.b})
            spread_ |= step_.dynamic && side.body >= 0 && system_.refs[std::size_t(side.body)].rod;
    system_.finder.begin_step(system_.refs);
    if (from_) {
        begin_at_places();
    } else {
        force_ = system_.warm;
        sticks_ = system_.warm_sticks;
    }

    // ---- Start: contacts of motion, first iterate
    if (step_.dynamic) { // contacts stand where the step starts; what is prescribed moves them
        std::vector<std::size_t> prescribed;
        for (std::size_t b = 0; b < bodies(); ++b)
            if (body(b).reset_to_start()) prescribed.push_back(b);
        if (step_.follows) {
            JointFrames frames;
            joints_start_.resize(system_.couplings.size());
            for (std::size_t c = 0; c < joints_start_.size(); ++c)
                find_row(system_.refs, system_.couplings[c], system_.coupling_memory[c].value,
                         frames, joints_start_[c]);
        }
        if (!prescribed.empty()) {
            find_at_start();
            found_ = true;
            if (step_.follows) start_following();
            moved_.assign(list_.contact.size(), 0);
            for (const std::size_t b : prescribed)
                body(b).begin(step_);
        }
    }
    find();
    expect_motion();
    if (repeats_) begin_from_repeated();
    rods_only_ = rods_alone() && (!system_.finder.pairs().empty() || !system_.couplings.empty());
    bool nonlinear = false;
    for (const BodyRef& b : system_.refs)
        nonlinear |= b.body->nonlinear();
    linear_ = !nonlinear && !step_.dynamic;

    // ---- Iterations on the geometry at the end of the step
    // Joints turn with their bodies.
    const bool geometry =
        !step_.dynamic && (!system_.finder.all_small() || !system_.couplings.empty());
    double least = std::numeric_limits<double>::infinity();
    int most = options_.most_iterations, beyond = 0;
    for (int i = 0, halved = 0, turns = 0; i < most; ++i) {
        if (options_.stop && *options_.stop) {
            report_.refusal = "interrupted";
            return false;
        }
        linearise();
        if (faulty()) return false;
        if (!matrices_kept()) ++report_.factorisations;
        if (!(rods_only_ ? solve_rods() : solve())) return false;
        if (faulty()) return false;
        if ((!geometry && !nonlinear && !follows_some()) || check_end_of_step()) {
            const bool at_rest = sliding_reversed(), unstabilised = leave_unstable_balance();
            if (!at_rest && !unstabilised && !adds_rows()) {
                if (from_ && !part_ && geometry && !frozen_ && ++beyond <= kMostBeyond &&
                    report_.error > kEndFromRest * report_.threshold)
                    continue;
                if (!frozen_ || lags_little()) break;
                report_.refusal = fmt::format("contacts jump at the end of the step, by {:.1e} of "
                                              "their forces",
                                              lag_);
                return false;
            }
            frozen_ = false;
            if (!at_rest && !unstabilised &&
                step_.dynamic) { // contacts are found where the step starts
                again_ = true;
                report_.refusal = "bodies overlap";
                return false;
            }
            find();
            if (!at_rest) {
                least = std::numeric_limits<double>::infinity();
                halved = i;
                most = i + 1 + options_.most_iterations;
            }
            continue;
        }
        if (report_.error < 0.5 * least) {
            least = report_.error;
            halved = i;
        }
        const int patience = stabilised_in_step_ ? kStabilisedPatience : kTrueTangentPatience;
        if ((stabilised_in_step_ || !true_tangent_.empty()) && i - halved >= patience &&
            turns < kMostTurns) {
            stabilised_in_step_ = !stabilised_in_step_; // stabilised bodies damp what jumps
            halved = i;
            ++turns;
        }
        // Away from an unstable balance round-off grows by a factor in each iteration, while the
        // energy decreases.
        if (std::ranges::any_of(system_.refs, [](const BodyRef& b) {
                return b.solid && b.solid->leaves_balance();
            })) {
            halved = i;
            most = kDescent * options_.most_iterations;
        }
        if (i + 1 == most || i - halved >= options_.patience ||
            report_.error > options_.most_rise * least) {
            if (geometry && freeze()) {
                least = std::numeric_limits<double>::infinity();
                halved = i;
                most = i + 1 + options_.most_iterations;
                continue;
            }
            report_.errors = errors_;
            report_.refusal = fmt::format("no balance on the geometry at the end of the step: "
                                          "error {:.1e} after {} iterations",
                                          report_.error, i + 1);
            if (!deepest_.empty()) report_.refusal += ", " + deepest_;
            report_.refusal += why_no_balance();
            append_lost_ellipticity();
            if (tipping_.empty()) tipping_ = toppling();
            return false;
        }
    }

    if (part_) return report_.error <= report_.threshold;
    converged_ = report_.error <= report_.threshold;
    if (refuse_path_ && depends_on_path()) {
        report_.refusal = "contacts that may depend on the path";
        return false;
    }
    if (refuse_kept_ && converged_ && keeps_lost()) {
        report_.refusal = "contacts that are not found at the end of the step";
        return false;
    }
    converged_ = false;

    // ---- Refusal and its reason
    if (!(report_.error <= report_.threshold)) {
        report_.refusal = fmt::format("certificate {:.1e}", report_.error) + why_no_forces();
        return false;
    }
    report_.refusal = system_.finder.passed(system_.refs);
    if (report_.refusal.empty()) report_.refusal = deepest_overlap_message();
    for (const BodyRef& b : system_.refs)
        if (b.solid && report_.refusal.empty()) report_.refusal = b.solid->spurious_energy_report();
    // Ropes have many balances, with loops and kinks: Newton's method may have jumped to one.
    for (const BodyRef& b : system_.refs)
        if (b.rod && !step_.dynamic && force_.empty() && report_.refusal.empty() &&
            b.rod->slip_is_unbalanced())
            report_.refusal = b.name + " reached a balance that is not stable";
    if (const std::string rod = rod_that_buckles(); !rod.empty() && report_.refusal.empty())
        report_.refusal = rod + " buckles within the step, faster than the step follows";
    if (!report_.refusal.empty()) return false;
    if (options_.stop &&
        *options_.stop) { // solvers may have ended with less than they do otherwise
        report_.refusal = "interrupted";
        return false;
    }

    // ---- Acceptance: bodies, couplings, rows
    report_modes();
    if (rods_only_) set_contact_forces(true); // their tangent shows stability
    const std::string toppling_body = toppling();
    fill_report();
    report_.lag = frozen_ ? lag_ : 0;
    report_.errors = errors_;
    for (std::size_t b = 0; b < bodies(); ++b) {
        const BodyEnergy e = body(b).accept(body_force_[b]);
        const std::string remark = body(b).outcome().remark;
        if (!remark.empty()) report_.remarks.push_back(remark);
        if (system_.refs[b].name == toppling_body && remark.find(kNotStable) == remark.npos)
            report_.remarks.push_back(toppling_body + ": " + kNotStable +
                                      ": its contacts do not keep it from tipping or buckling");
        if (RodBody* rod = system_.refs[b].rod; rod && !true_tangent_.empty() && true_tangent_[b])
            rod->note_negative(0);
        report_.energy.work += e.work;
        report_.energy.work_absolute += e.work_absolute;
        report_.energy.dissipated += e.dissipated;
        report_.energy.elastic += e.elastic;
        report_.energy.kinetic += e.kinetic;
    }
    store_joints();
    report_.energy.elastic += spring_energy(system_.couplings, system_.coupling_memory);
    system_.warm = force_;
    system_.warm_friction = std::move(friction_);
    system_.warm_sticks = sticks_;
    system_.finder.keep_rows([&](int pair, std::int64_t id) {
        // In motion those that are near, which the next step would need again.
        if (step_.dynamic) return motion_.count({pair, id}) > 0;
        const auto known = force_.find({pair, id});
        return known != force_.end() && !known->second.isZero(0);
    });
    if (step_.dynamic) {
        std::vector<BodyOverlap> ahead = overlaps_;
        for (BodyOverlap& o : ahead)
            if (may_stay(o)) o.rows_beyond = std::max(o.rows_beyond, o.depth);
        system_.finder.add_rows_ahead(ahead);
    }
    for (const BodyOverlap& o : overlaps_)
        if (o.depth > report_.overlap.depth) report_.overlap = o;
    report_.overlaps = std::move(overlaps_);
    report_.recorded = std::move(problem_);
    report_.recorded_reaction = r_;
    for (const int c : rows_.chosen)
        report_.recorded_identity.push_back(c);
    return true;
}

} // namespace amontons
