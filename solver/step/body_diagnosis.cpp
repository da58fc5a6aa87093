#include "solver/step/body_stepper.hpp"

#include "mesh/base/dense.hpp"
#include "mesh/quality.hpp"
#include "solver/body/solid_body.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <numbers>

// The reason why a step found no balance, from its last iterations, for the message of the refusal.

namespace amontons {
namespace {

constexpr std::size_t kLast = 10;        // iterations that are examined
constexpr double kRoundOffMatters = 0.1; // of the tolerance: round-off matters
constexpr double kSliver = 2;            // least angle between an element's faces [degrees]
constexpr double kLongElement = 100;     // longest edge / shortest
constexpr int kMostRowsExplained = 900;  // of W: dense algebra on them, a fifth of a second
constexpr double kNoStiffness = 1e-14, kUneven = 1e9; // of eigenvalues of W: least / largest, back

/// Properties of a mesh that impair convergence; "" if there are none.
std::string poor_elements(const SolidBody& solid)
{
    const QualityReport q = report_of(measure_quality(solid.mesh()));
    const double angle = q.least_dihedral.least * 180 / std::numbers::pi;
    std::string poor;
    if (angle < kSliver) poor = fmt::format("angles down to {:.2g} degrees", angle);
    if (q.aspect.greatest > kLongElement)
        poor += fmt::format("{}edges up to {:.3g} times as long as others of theirs",
                            poor.empty() ? "" : " and ", q.aspect.greatest);
    return poor.empty() ? "" : "its elements have " + poor;
}

} // namespace

/// Called once an iteration, with the three parts of its error.
/// @param acting  contacts that carry a force now
void BodyStepper::log_iteration(double law, double turned, double imbalance, int body,
                                std::vector<BodySystem::Key> acting)
{
    std::ranges::sort(acting);
    std::vector<BodySystem::Key> changed;
    if (!iteration_log_.empty())
        std::ranges::set_symmetric_difference(acting, acting_, std::back_inserter(changed));
    iteration_log_.push_back({law, turned, imbalance, body, int(changed.size())});
    if (!changed.empty()) changed_ = std::move(changed);
    acting_ = std::move(acting);
}

std::string BodyStepper::why_no_balance() const
{
    if (iteration_log_.empty() || !options_.explain) return "";
    const IterationLog& last = iteration_log_.back();
    std::string why;
    if (last.imbalance >= std::max(last.law, last.turned) && last.body >= 0) {
        const auto b = std::size_t(last.body);
        why += "; " + system_.refs[b].name + " is out of balance";
        if (SolidBody* solid = system_.refs[b].solid) why += solid->worst_imbalance(body_force_[b]);
    } else if (last.turned >= last.law) {
        why += "; contact forces rotate or move to other places between iterations";
    } else {
        why += "; gaps, slips and forces of contacts violate the contact laws";
    }

    const std::size_t n = std::min(kLast, iteration_log_.size());
    const auto turns = std::count_if(iteration_log_.end() - std::ptrdiff_t(n), iteration_log_.end(),
                                     [](const IterationLog& c) { return c.changed > 0; });
    if (2 * std::size_t(turns) > n) {
        why += fmt::format("; contacts open and close alternately, in {} of the last {} iterations",
                           turns, n);
        for (int c = 0; c < int(list_.contact.size()); ++c)
            if (std::ranges::binary_search(changed_, key(c))) {
                why += ", among them " + who(c);
                break;
            }
    }
    for (const BodyRef& b : system_.refs) {
        if (!b.solid || !b.solid->nonlinear()) continue;
        const bool stabilised = b.solid->is_stabilised();
        if (b.solid->leaves_balance() || (stabilised && true_tangent_.empty()))
            why += "; " + b.name +
                   " has no stable balance nearby: it buckles or snaps, which "
                   "a dynamic step can follow";
        else if (stabilised)
            why += "; " + b.name + " is stable by its contacts alone: without them it would buckle";
        const double round_off = b.solid->round_off();
        if (round_off > kRoundOffMatters * report_.threshold)
            why += fmt::format("; round-off of its places leaves {} an error of {:.1g}", b.name,
                               round_off);
        if (const std::string poor = poor_elements(*b.solid); !poor.empty())
            why += "; " + b.name + ": " + poor;
    }
    return why;
}

/// Of a contact problem that has not been solved to the tolerance.
std::string BodyStepper::why_no_forces() const
{
    if (rows_.count == 0 || rows_.count > kMostRowsExplained || !options_.explain) return "";
    const Eigen::MatrixXd W =
        problem_.W.is_dense() ? problem_.W.dense() : Eigen::MatrixXd(problem_.W.as_sparse());
    const Eigen::VectorXd values = symmetric_eigenvalues(W);
    const double most = values.cwiseAbs().maxCoeff();
    if (!(most > 0)) return "; none of the bodies in contact is compliant";
    const auto rigid = (values.array() <= kNoStiffness * most).count();
    if (rigid > 0)
        return fmt::format("; {} of the {} motions of its contacts are left by round-off alone: "
                           "there are more contacts than degrees of freedom",
                           rigid, rows_.count);
    const double span = most / values[0];
    return span < kUneven ? ""
                          : fmt::format("; some motions of its contacts are {:.1g} times as stiff "
                                        "as others, which leaves an error of {:.0e} by round-off",
                                        span, 1e-16 * span);
}

} // namespace amontons
