#include "solver/step/body_stepper.hpp"

#include "contact/solvers/solve.hpp"
#include "mesh/base/dense.hpp"
#include "mesh/base/phase_timer.hpp"
#include "solver/body/solid_body.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

// The rigid motions of bodies that contacts alone hold.

namespace amontons {
namespace {

constexpr int kMostModeSteps = 60;
constexpr int kMostOfModes = 15000; // iterations of all contact problems of one balance of modes
constexpr int kModesPatience = 400; // a shorter step may converge
constexpr double kFinest = 1e-4;    // of the tolerance: where a finer solution costs little
constexpr double kMostTaken = 0.7;  // of T by S, or (T + S)^-1 is large
constexpr double kSameLoad = 1e-3;
constexpr int kMostDrifts = 4;
constexpr int kMostStalled = 10;        // steps that have not halved the imbalance
constexpr int kPlacesOfSlide = 3;       // on fewer a body rolls
constexpr char kMostFed = 3;            // growths of a scale, then that of a body alone
constexpr double kSlow = 0.3;           // of the imbalance before
constexpr double kSizeRounding = 1e-12; // of a body's size
constexpr double kPushedAside = 1e-2;   // of the forces, that come of faces which deform
constexpr int kMostRolling = 8; // steps of modes, where the next geometry has other loads anyway

/// Where stress takes much of what contacts hold a body with, or only the direction of its sliding
/// friction holds it (a box that is pushed beside its middle), multipliers converge by a factor
/// near 1 each: the next ones by those before. Source: Anderson 1965 as in Walker & Ni 2011,
/// eq. 1.1.
class Extrapolation {
public:
    /// @param change  of each body's modes; out: what is to be made
    void improve(const std::vector<Eigen::VectorXd>& modes, std::vector<Eigen::VectorXd>& change)
    {
        constexpr Eigen::Index kMost = 8;
        constexpr double kLongest =
            1000; // times the step: where each leaves 0.99, 100 times are due
        Eigen::Index size = 0;
        for (const Eigen::VectorXd& c : change)
            size += c.size();
        Eigen::VectorXd at(size), step(size);
        for (std::size_t b = 0, k = 0; b < change.size(); k += std::size_t(change[b++].size())) {
            step.segment(Eigen::Index(k), change[b].size()) = change[b];
            if (change[b].size() > 0) at.segment(Eigen::Index(k), change[b].size()) = modes[b];
        }
        if (step_.size() != size) {
            places_.resize(size, 0);
            steps_.resize(size, 0);
        } else {
            const Eigen::Index kept = std::min(kMost - 1, steps_.cols());
            places_ = places_.rightCols(kept).eval();
            steps_ = steps_.rightCols(kept).eval();
            places_.conservativeResize(size, kept + 1);
            steps_.conservativeResize(size, kept + 1);
            places_.col(kept) = at - at_;
            steps_.col(kept) = step - step_;
        }
        at_ = at;
        step_ = step;
        if (steps_.cols() == 0) return;
        step -= (places_ + steps_) * least_squares(steps_, step_);
        if (!(step.norm() <= kLongest * step_.norm())) return;
        for (std::size_t b = 0, k = 0; b < change.size(); k += std::size_t(change[b++].size()))
            change[b] = step.segment(Eigen::Index(k), change[b].size());
    }

private:
    Eigen::VectorXd at_, step_;
    Eigen::MatrixXd places_, steps_; ///< changes from one to the next
};

} // namespace

bool BodyStepper::stressed(std::size_t b) const
{
    const SolidBody* solid = system_.refs[b].solid;
    return solid && solid->mode_stiffness().size() > 0;
}

/// Change of the loads on a stressed body's modes with their amplitudes. Where contacts do not
/// stabilise the body against all of it, only as much as they do; the rest is left to the next
/// iterations.
Eigen::MatrixXd BodyStepper::mode_stiffness(std::size_t b) const
{
    if (!stressed(b) || !(mode_scale_[b] > 0)) return {};
    const Eigen::MatrixXd S = system_.refs[b].solid->mode_stiffness();
    if (!stabilised_only_) return S;
    const SymmetricEigen eigen = symmetric_eigen(S);
    return eigen.vectors * eigen.values.cwiseMax(-kMostTaken / mode_scale_[b]).asDiagonal() *
           eigen.vectors.transpose();
}

Eigen::VectorXd BodyStepper::load_on_modes(std::size_t b) const
{
    if (!hanging_.empty()) return mode_load_[b] - change_by_hanging(b);
    const Eigen::MatrixXd S = mode_stiffness(b);
    return S.size() > 0 ? mode_load_[b] - S * mode_[b] : mode_load_[b];
}

/// (T + S)^-1, T = 1 / s, or what is needed to have it positive.
Eigen::MatrixXd BodyStepper::mode_gain(std::size_t b) const
{
    const Eigen::Index modes = mode_load_[b].size();
    const Eigen::MatrixXd S = mode_stiffness(b);
    if (S.size() == 0) return mode_scale_[b] * Eigen::MatrixXd::Identity(modes, modes);
    const SymmetricEigen eigen = symmetric_eigen(S);
    const Eigen::ArrayXd own = eigen.values.array();
    const Eigen::VectorXd gain = (own + (-own / kMostTaken).max(1 / mode_scale_[b])).inverse();
    return eigen.vectors * gain.asDiagonal() * eigen.vectors.transpose();
}

/// The first body held by contacts alone that these, as they are, do not keep in balance: its
/// tangent K is not positive on all motions that leave closed contacts closed (and where they
/// stick). Of its parts w and a (solid_free.cpp), with W of w and B of a in the rows of those
/// contacts, w is held where W has as many negative eigenvalues as K has there, and a where
///     S + B^T W^-1 B
/// is positive. A contact that a small motion would close counts as closed: a round side rolls on
/// to the next of its nodes.
/// @returns  "" if there is none, or it cannot be reported
std::string BodyStepper::toppling()
{
    constexpr Eigen::Index kMostClosed = 1500; // dense algebra on them
    constexpr double kNear = 0.1;              // of the body's size
    constexpr double kSoft = 1e-9;             // of W: rows that repeat others
    constexpr double kMargin = 0.05;           // of S
    constexpr double kRound = 1e-9;            // of what holds it
    std::string some;
    for (std::size_t b = 0; b < bodies() && some.empty(); ++b)
        if (stressed(b)) some = system_.refs[b].name;
    if (some.empty() || step_.dynamic) return "";

    const int n_contacts = int(list_.contact.size());

    // ---- Rows of closed contacts
    Rows rows;
    for (int c = 0; c < int(value_.size()); ++c)
        if (c >= n_contacts || force_.count(key(c)) > 0 ||
            list_.contact[std::size_t(c)].gap <=
                kNear * body(std::size_t(list_.contact[std::size_t(c)].a)).size())
            rows.chosen.push_back(c);
    make_rows(contacts(), rows);
    if (rows.count == 0) return "";
    std::vector<Eigen::Index> closed;
    std::vector<Eigen::Index> place(std::size_t(rows.count), -1);
    std::vector<std::pair<int, double>> soft;
    for (std::size_t i = 0; i < rows.chosen.size(); ++i) {
        const int c = rows.chosen[i], first = rows.first[i],
                  end = i + 1 < rows.chosen.size() ? rows.first[i + 1] : rows.count;
        int count = 1;
        if (c >= n_contacts) {
            soft.emplace_back(first, compliance_of_row(std::size_t(c - n_contacts)));
        } else if (const auto known = force_.find(key(c)); known != force_.end()) {
            const BodyContact& contact = list_.contact[std::size_t(c)];
            const Vec3 f = contact.frame.transpose() * known->second;
            const double friction = friction_of(system_.finder.pairs(), contact);
            if (std::hypot(f.y(), f.z()) < kStickShare * friction * f.x()) count = end - first;
        }
        for (int row = first; row < first + count; ++row) {
            place[std::size_t(row)] = Eigen::Index(closed.size());
            closed.push_back(row);
        }
    }
    if (Eigen::Index(closed.size()) > kMostClosed) return "";

    int negative = 0;
    Eigen::Index modes = 0;
    std::vector<Eigen::MatrixXd> W(bodies());

    // ---- Stability with these rows held
    for (std::size_t b = 0; b < bodies(); ++b) {
        if (rows.row[b].empty()) continue;
        SolidBody* const solid = system_.refs[b].solid;
        if (system_.refs[b].rod || (solid && !stressed(b) && solid->is_stabilised())) return "";
        body(b).matrix().compliance(rows.columns[b], W[b]);
        modes += body(b).matrix().modes().cols();
        if (!stressed(b)) continue;
        Eigen::MatrixXd none;
        negative += solid->true_tangent_compliance(rows.columns[b].leftCols(0), none);
    }
    const Delassus sum = sum_of_bodies(rows, W, soft);
    const Eigen::MatrixXd all = sum.is_dense() ? sum.dense() : Eigen::MatrixXd(sum.as_sparse());
    Eigen::MatrixXd held = all(closed, closed);
    held.diagonal().array() += kSoft * held.diagonal().cwiseAbs().mean();
    const SymmetricEigen of_held = symmetric_eigen(held);
    if (!of_held.converged) return "";
    if (int((of_held.values.array() < 0).count()) < negative) return some;

    Eigen::MatrixXd S = Eigen::MatrixXd::Zero(modes, modes),
                    B = Eigen::MatrixXd::Zero(Eigen::Index(closed.size()), modes);
    Eigen::Index at = 0;
    for (std::size_t b = 0; b < bodies(); ++b) {
        const Eigen::MatrixXd& R = body(b).matrix().modes();
        if (rows.row[b].empty() || R.cols() == 0) continue;
        const Eigen::MatrixXd seen = rows.columns[b].transpose() * R;
        for (std::size_t i = 0; i < rows.row[b].size(); ++i)
            if (const Eigen::Index k = place[std::size_t(rows.row[b][i])]; k >= 0)
                B.row(k).segment(at, R.cols()) += seen.row(Eigen::Index(i));
        if (stressed(b))
            S.block(at, at, R.cols(), R.cols()) = system_.refs[b].solid->mode_stiffness();
        at += R.cols();
    }
    const Eigen::MatrixXd turned = of_held.vectors.transpose() * B;
    const Eigen::MatrixXd hold =
        turned.transpose() * of_held.values.cwiseInverse().asDiagonal() * turned;
    const Eigen::VectorXd signs = symmetric_eigenvalues(Eigen::MatrixXd(S + hold));
    const double least = kMargin * S.cwiseAbs().maxCoeff() + kRound * hold.cwiseAbs().maxCoeff();
    return signs[0] < -least ? some : "";
}

/// Method of multipliers on the balance of the modes: R^T H^T r + g = 0 is the condition, the
/// modes' amplitudes are its multipliers, and each try is a contact problem with the modes held by
/// s: W + s B B^T. Its answer is that of the modes as free unknowns, whatever s.
bool BodyStepper::solve_with_modes()
{
    SolverOptions options;
    options.solver = options_.solver;
    options.threads = options_.threads;
    options.scope = ErrorScope::acting_rows;
    options.least_norm = spread_;

    // ---- Modes, their loads and weights
    const Eigen::VectorXd q = problem_.q;
    bool modes = false, some_stressed = false;
    for (std::size_t b = 0; b < bodies(); ++b) {
        modes |= mode_load_[b].size() > 0;
        some_stressed |= stressed(b);
    }
    Extrapolation extrapolation;
    // The weight of the modes is in W and q, and so in what the error is relative to.
    options.tolerance = (modes ? 0.01 / mode_weight() : 0.1) * options_.tolerance;
    options.acceptable = 5 * options.tolerance;
    options.patience = kModesPatience;
    options.stop = options_.stop;

    unbalanced_.resize(0);

    // Whether a rod moves a body that it touches, which stands on several places.
    const auto is_pushed_by_rod = [&](std::size_t b) {
        int count = 0;
        bool rod = false;
        for (std::size_t i = 0; i < rows_.chosen.size(); ++i) {
            if (rows_.chosen[i] >= int(list_.contact.size()) || r_[rows_.first[i]] <= 0) continue;
            const BodyContact& k = list_.contact[std::size_t(rows_.chosen[i])];
            if (k.a != int(b) && k.b != int(b)) continue;
            ++count;
            const int other = k.a == int(b) ? k.b : k.a;
            rod = rod || (other >= 0 && system_.refs[std::size_t(other)].rod);
        }
        return rod && count >= kPlacesOfSlide;
    };

    // ---- Multipliers: solve, then a <- a + s (B^T r + g)
    double best = std::numeric_limits<double>::infinity();
    const int begun = report_.iterations;
    Eigen::VectorXd load_before; // on the modes that were worst in the step before
    int drifts = 0;              // steps in which these did not change
    bool slow = false;
    double worst_before = 0, halved = std::numeric_limits<double>::infinity();
    int stalled = 0; // steps that have not halved the imbalance
    for (int step = 0; step < kMostModeSteps; ++step) {
        problem_.q = q;
        std::vector<Eigen::VectorXd> of_load(bodies());
        for (std::size_t b = 0; b < bodies(); ++b)
            if (B_[b].size() > 0)
                of_load[b] = modes_coupled_ ? load_on_modes(b)
                                            : Eigen::VectorXd(mode_gain(b) * load_on_modes(b));
        if (modes_coupled_) of_load = coupled_gain(of_load);
        for (std::size_t b = 0; b < bodies(); ++b) {
            if (B_[b].size() == 0) continue;
            const Eigen::VectorXd shift = B_[b] * (mode_[b] + of_load[b]);
            for (std::size_t i = 0; i < rows_.row[b].size(); ++i)
                problem_.q[rows_.row[b][i]] += shift[Eigen::Index(i)];
        }
        if (held_.size() > 0) problem_.q -= taken_ * Eigen::VectorXd(problem_.q);
        if (rows_.count > 0 && all_rows_hold()) {
            ++report_.iterations;
            certificate_ = {};
            certificate_.status = SolveStatus::converged;
        } else if (rows_.count > 0) {
            const Stopwatch watch;
            std::string why;
            ContactSolution solution = solve_contact(options, why);
            if (!why.empty()) {
                report_.refusal = why;
                return false;
            }
            report_.contact_solve += watch.seconds();
            report_.iterations += solution.certificate.iterations;
            r_ = std::move(solution.reaction);
            held_r_ = r_;
            if (held_.size() > 0) r_ -= held_.cwiseProduct(problem_.W * r_ + problem_.q);
            certificate_ = solution.certificate;
            unsolved_ = false;
            if (!is_solved(certificate_.status) &&
                (certificate_.status == SolveStatus::infeasible ||
                 certificate_.error > options_.tolerance)) {
                unsolved_ = certificate_.status != SolveStatus::infeasible;
                report_.refusal =
                    options_.outside ? fmt::format("the solution of contact_solver has an error of "
                                                   "{:.1e}, the tolerance is {:.1e}",
                                                   certificate_.error, options.tolerance)
                                     : fmt::format("contact problem {} at an error of {:.1e}",
                                                   name(certificate_.status), certificate_.error);
                if (certificate_.status == SolveStatus::infeasible) {
                    report_.refusal = "no motion avoids penetration:";
                    for (const int c : certificate_.proof.contacts)
                        report_.refusal += " " + who(rows_.chosen[std::size_t(c)]) + ",";
                    report_.refusal.pop_back();
                } else if (certificate_.worst_contact >= 0) {
                    report_.refusal +=
                        ", worst: " + who(rows_.chosen[std::size_t(certificate_.worst_contact)]);
                    report_.refusal += why_no_forces();
                }
                return false;
            }
        }
        if (!modes) return true;
        // How far the modes are from balance, of the forces on them.
        double worst = 0;
        std::size_t worst_body = 0;
        Eigen::VectorXd worst_motion;
        double growth = 0;
        std::vector<Eigen::VectorXd> change(bodies());
        for (std::size_t b = 0; b < bodies(); ++b) {
            if (mode_load_[b].size() == 0) continue;
            Eigen::VectorXd e = load_on_modes(b);
            double size = e.norm();
            if (B_[b].size() > 0) {
                const Eigen::VectorXd r = own(rows_, r_, b);
                e += B_[b].transpose() * r;
                size += (B_[b].cwiseAbs().transpose() * r.cwiseAbs()).norm();
            }
            if (size == 0) continue;
            const double scale = mode_scale_[b] > 0 ? mode_scale_[b] : body(b).size() / size;
            // A force that moves the body by less than round-off does not count.
            const double share =
                scale * e.norm() > kSizeRounding * mode_way_[b] ? e.norm() / size : 0;
            if (share > worst) {
                worst = share;
                worst_body = b;
                worst_motion = e;
            }
            change[b] = modes_coupled_       ? e
                        : mode_scale_[b] > 0 ? Eigen::VectorXd(mode_gain(b) * e)
                                             : Eigen::VectorXd(scale * e);
        }
        if (modes_coupled_) change = coupled_gain(change);
        const bool there = worst <= (linear_ ? kFinest : 0.01) * options_.tolerance;
        slow |= step > 0 && worst > kSlow * worst_before;
        worst_before = worst;
        if ((some_stressed || slow) && !there) extrapolation.improve(mode_, change);
        for (std::size_t b = 0; b < bodies(); ++b) {
            if (change[b].size() > 0) mode_[b] += change[b];
            growth = std::max(growth, mode_[b].norm() / body(b).size());
        }
        if (there) return true;
        if (worst <= options_.tolerance && worst > 0.5 * best) return true; // at round-off
        // Balance is required where bodies have rolled to, not here.
        if (rolls_ && !hanging_.empty() && step + 1 == kMostRolling) return true;
        // The forces on a small body may be negligible beside those that the error is relative to:
        // continue.
        constexpr double kLeast = 1e-30;
        if (worst > 0.5 * best) options.tolerance = std::max(0.1 * options.tolerance, kLeast);
        best = std::min(best, worst);
        // A force that does not change with the modes: no elastic body constrains them.
        const bool same = load_before.size() == worst_motion.size() &&
                          (worst_motion - load_before).norm() <= kSameLoad * worst_motion.norm();
        drifts = same ? drifts + 1 : 0;
        load_before = worst_motion;
        if (worst <= 0.5 * halved) {
            halved = worst;
            stalled = 0;
        } else {
            ++stalled;
        }
        const bool drifts_on = drifts >= kMostDrifts; // no scale of the elastic part would do
        const bool slides = stalled >= kMostStalled && is_pushed_by_rod(worst_body);
        drifting_ = (drifts_on || slides) && may_feed_freely(worst_body) ? int(worst_body) : -1;
        if (drifting_ >= 0 && drifts_on) feeds_freely_[worst_body] = kMostFed - 1;
        const bool stuck = (step > 20 && worst > 0.5 * best && growth > 1e3) || drifting_ >= 0 ||
                           report_.iterations - begun > kMostOfModes;
        if (step + 1 == kMostModeSteps || stuck || rows_.count == 0) {
            unbalanced_ = worst_motion;
            unbalanced_body_ = worst_body;
            report_.refusal = fmt::format(
                "{} is not in balance ({:.1e} of the forces on it): nothing holds its {}",
                system_.refs[worst_body].name, worst,
                body(worst_body).matrix().mode_name(worst_motion));
            if (worst <= kPushedAside && is_free_to_slide(worst_body))
                report_.refusal +=
                    "; its contacts have no friction, and surfaces that deform push it "
                    "by so much: friction, a hold of that motion or \"sliding\": "
                    "\"small\" would hold it";
            return false;
        }
    }
    return false;
}

/// No contact of a solid has friction, and the geometry of some is that of the end of the step.
bool BodyStepper::is_free_to_slide(std::size_t b) const
{
    if (!system_.refs[b].solid || step_.dynamic) return false;
    bool finite = false;
    for (const int c : rows_.chosen) {
        if (c >= int(list_.contact.size())) continue;
        const BodyContact& k = list_.contact[std::size_t(c)];
        if (k.a != int(b) && k.b != int(b)) continue;
        const ContactPair& pair = system_.finder.pairs()[std::size_t(k.pair)];
        if (pair.friction > 0) return false;
        finite |= !pair.small;
    }
    return finite;
}

bool BodyStepper::may_feed_freely(std::size_t b) const
{
    return system_.refs[b].rigid && !modes_coupled_ && feeds_freely_[b] < kMostFed &&
           mode_scale_[b] > 0;
}

/// A rigid body that rolls in contact with an elastic body, or slides before one: the compliance of
/// the contact is far smaller than the motion, and friction bounds the forces on it, so that
/// multipliers of the elastic scale move it by nearly nothing each. Its scale grows, by no more
/// than is necessary, as digits are lost by it; in the end it is that of a body that touches
/// nothing elastic.
/// @return  whether there is such a body
bool BodyStepper::feed_freely()
{
    if (drifting_ < 0) return false;
    ++feeds_freely_[std::size_t(drifting_)];
    mode_scale_[std::size_t(drifting_)] = 0;
    drifting_ = -1;
    return true;
}

/// Multipliers that are scaled body by body do not converge where a stiff body rests on a far
/// softer one: it has to follow the soft one in steps of its own scale. Then the modes of all
/// bodies take T = B^T B / compliance, summed over rows, in place of 1/s of each: the common motion
/// of two bodies is scaled by the bodies that both rest on.
/// @return  whether that is new in this step
bool BodyStepper::couple_modes()
{
    constexpr double kContrast = 1e3;
    constexpr int kMostCoupled = 2000; // rows: W is dense then
    if (modes_coupled_ || modes_apart_ || step_.dynamic || rows_.count > kMostCoupled) return false;
    if (!hanging_.empty()) return modes_coupled_ = true;
    double least = std::numeric_limits<double>::infinity(), most = 0;
    for (std::size_t b = 0; b < bodies(); ++b) {
        if (B_[b].size() == 0) continue;
        if (stressed(b) || !(mode_scale_[b] > 0)) return false;
        least = std::min(least, mode_scale_[b]);
        most = std::max(most, mode_scale_[b]);
    }
    modes_coupled_ = most > kContrast * least;
    return modes_coupled_;
}

/// W with the modes at the weight that the multipliers have, and with their own, for the
/// certificate.
/// @param row_compliance  elastic compliance of each row [m/N]
/// @return  false: they cannot be coupled in numbers of this size
bool BodyStepper::add_coupled_modes(const Eigen::VectorXd& row_compliance,
                                    const std::vector<Eigen::MatrixXd>& W,
                                    const std::vector<std::pair<int, double>>& soft)
{
    constexpr double kFree = 1e-10; // of 1/s: of modes that no contact constrains
    Eigen::Index modes = 0;
    for (std::size_t b = 0; b < bodies(); ++b)
        modes += B_[b].cols();
    Eigen::MatrixXd B = Eigen::MatrixXd::Zero(rows_.count, modes);
    Eigen::VectorXd free(modes);
    double least_size = std::numeric_limits<double>::infinity(); // of bodies with modes [m]
    for (std::size_t b = 0; b < bodies(); ++b)
        if (B_[b].cols() > 0) least_size = std::min(least_size, body(b).size());
    Eigen::VectorXd least = Eigen::VectorXd::Constant(rows_.count, double(rows_.count));
    for (std::size_t b = 0, at = 0; b < bodies(); at += std::size_t(B_[b++].cols())) {
        free.segment(Eigen::Index(at), B_[b].cols()).setConstant(kFree / mode_scale_[b]);
        for (std::size_t i = 0; i < rows_.row[b].size(); ++i) {
            const int row = rows_.row[b][i];
            least[row] = std::min(least[row], double(rows_.row[b].size()));
            if (B_[b].cols() > 0)
                B.row(row).segment(Eigen::Index(at), B_[b].cols()) += B_[b].row(Eigen::Index(i));
        }
    }
    Eigen::MatrixXd T = free.asDiagonal();
    // Rows of rigid bodies alone hold with any weight, but S may be negative there.
    const double firm = hanging_.empty() ? 0 : hanging_.load / least_size;
    Eigen::VectorXd yields = row_compliance;
    if (!hanging_.empty())
        for (const auto& [row, own] : soft)
            yields[row] += own;
    const Eigen::VectorXd bound =
        rolls_ && !hanging_.empty() ? stiffness_by_forces(least_size) : Eigen::VectorXd();
    for (Eigen::Index row = 0; row < rows_.count; ++row) {
        double weight = yields[row] > 0 ? 1 / (least[row] * yields[row] * mode_weight()) : firm;
        if (bound.size() > 0) weight = std::min(weight, bound[row]);
        if (weight > 0) T.noalias() += B.row(row).transpose() * (weight * B.row(row));
    }
    const std::vector<Eigen::Index> seen = seen_modes();
    if (!hanging_.empty()) T.diagonal() += hanging_.support(seen);
    if (rolls_ && !hanging_.empty()) hold_unseen(T, hanging_.used(seen, seen), firm);
    // Two bodies that touch stiffly and stand on something soft leave T singular by round-off.
    constexpr double kRoundOff = 1e-12;
    T.diagonal() *= 1 + kRoundOff;
    coupled_root_ =
        cholesky_root(hanging_.empty() ? T : Eigen::MatrixXd(T + hanging_.used(seen, seen)));
    if (!hanging_.empty() && coupled_root_.size() == 0) {
        hanging_.used = hanging_.away;
        coupled_root_ = cholesky_root(T + hanging_.used(seen, seen));
    }
    if (modes > 0 && coupled_root_.size() == 0) return false;
    const Delassus elastic = sum_of_bodies(rows_, W, soft);
    Eigen::MatrixXd all =
        elastic.is_dense() ? elastic.dense() : Eigen::MatrixXd(elastic.as_sparse());
    if (!hanging_.empty()) {
        coupled_B_ = B;
        elastic_W_ = all;
    }
    if (coupled_root_.size() > 0) {
        const Eigen::MatrixXd half =
            coupled_root_.transpose().triangularView<Eigen::Lower>().solve(B.transpose());
        const Eigen::MatrixXd rigid = half.transpose() * half;
        measured_W_ = Delassus(Eigen::MatrixXd(all + rigid / mode_weight()));
        all += rigid;
    } else {
        measured_W_ = Delassus(all);
    }
    problem_.W = Delassus(std::move(all));
    return true;
}

/// T^-1 of all modes.
std::vector<Eigen::VectorXd>
BodyStepper::coupled_gain(const std::vector<Eigen::VectorXd>& load) const
{
    Eigen::VectorXd all = Eigen::VectorXd::Zero(coupled_root_.rows());
    Eigen::Index at = 0;
    for (std::size_t b = 0; b < bodies(); at += B_[b++].cols())
        if (load[b].size() > 0) all.segment(at, load[b].size()) = load[b];
    all = coupled_root_.transpose().triangularView<Eigen::Lower>().solve(all);
    all = coupled_root_.triangularView<Eigen::Upper>().solve(all);
    std::vector<Eigen::VectorXd> gain(bodies());
    at = 0;
    for (std::size_t b = 0; b < bodies(); at += B_[b++].cols())
        if (B_[b].cols() > 0) gain[b] = all.segment(at, B_[b].cols());
    return gain;
}

/// A rigid body through which far larger forces pass than its own load takes their scale: W r of
/// all rows is then of one size, and light bodies below heavy ones do not cause round-off in the
/// others.
/// @return  whether a scale has changed, and the problem with it
bool BodyStepper::rescale_modes()
{
    bool changed = false;
    for (std::size_t b = 0; b < bodies(); ++b) {
        if (!system_.refs[b].rigid || B_[b].size() == 0) continue;
        const Eigen::VectorXd r = own(rows_, r_, b);
        const double force = (B_[b].cwiseAbs().transpose() * r.cwiseAbs()).norm();
        constexpr double kMuch = 100;
        if (!(mode_scale_[b] * force > kMuch * mode_way_[b])) continue;
        mode_scale_[b] = mode_way_[b] / force;
        changed = true;
    }
    return changed;
}

} // namespace amontons
