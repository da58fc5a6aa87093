#include "contact/certificate.hpp"

#include "contact/cone.hpp"
#include "contact/units.hpp"
#include "mesh/base/limits.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

namespace amontons {
namespace {

constexpr double kFloorFactor = 50 * std::numeric_limits<double>::epsilon();
constexpr double kFloorShare = 1.0 / 50; // of the floor: what the round-off of u is at worst
/// A diverging reaction raises its own floor: above this the floor is not used.
constexpr double kFloorLimit = 1e-3;
constexpr double kDoubt = 0.1;        // of an error: round-off that is less is left
constexpr double kNegligible = 1e-15; // errors below this are not recomputed [-]

/// rows / trace, with what is left when the trace gives no information (zero or indefinite W).
double scalar_rho(const Delassus& W, const Eigen::VectorXd& diagonal)
{
    const double rows = static_cast<double>(W.rows());
    if (diagonal.sum() > 0) return rows / diagonal.sum();
    if (const double s = diagonal.cwiseAbs().sum(); s > 0) return rows / s;
    if (const double s = W.absolute_times(Eigen::VectorXd::Ones(W.rows())).norm(); s > 0)
        return rows / s;
    return 1;
}

constexpr int kContactBatch = 8;
using Batch = Eigen::Array<double, kContactBatch, 1>;

/// |natural_map| of kContactBatch contacts at once: the same formulas, all three cases computed.
Batch natural_maps(const double* r, const double* u, const double* mu_of, const Batch& rho)
{
    Batch r0, r1, r2, w0, w1, w2;
    for (int i = 0; i < kContactBatch; ++i, r += 3, u += 3) {
        r0[i] = r[0];
        r1[i] = r[1];
        r2[i] = r[2];
        w0[i] = u[0];
        w1[i] = u[1];
        w2[i] = u[2];
    }
    const Batch mu = Eigen::Map<const Batch>(mu_of);
    w0 = rho * (w0 + mu * (w1.square() + w2.square()).sqrt());
    w1 *= rho;
    w2 *= rho;
    const Batch n = r0 - w0, x1 = r1 - w1, x2 = r2 - w2;
    const Batch t = (x1.square() + x2.square()).sqrt();

    const Batch inverse = 1 / t, c = x1 * inverse, s = x2 * inverse;
    const Batch along = w1 * c + w2 * s;
    const Batch beyond = r1 * c + r2 * s - mu * r0;
    const Batch edge = w0 + mu * along;
    const Batch share = 1 / (1 + mu.square());
    const Batch tangential = (beyond + mu * edge) * share - along;
    const Batch slip = ((edge - mu * beyond) * share).square() + (w1 + tangential * c).square() +
                       (w2 + tangential * s).square();
    const Batch inside = w0.square() + w1.square() + w2.square();
    const Batch open = r0.square() + r1.square() + r2.square();
    return (mu * t <= -n).select(open, (t <= mu * n).select(inside, slip)).sqrt();
}

double ratio(double residual, double size)
{
    if (!std::isfinite(residual)) return kInfinity;
    if (residual == 0) return 0;
    return size > 0 ? residual / size : kInfinity;
}

} // namespace

const char* name(SolveStatus status)
{
    switch (status) {
    case SolveStatus::converged:
        return "converged";
    case SolveStatus::at_round_off:
        return "at_round_off";
    case SolveStatus::stagnated:
        return "stagnated";
    case SolveStatus::infeasible:
        return "infeasible";
    case SolveStatus::out_of_time:
        return "out_of_time";
    }
    return "";
}

const char* name(ContactSolver solver)
{
    switch (solver) {
    case ContactSolver::automatic:
        return "auto";
    case ContactSolver::nsgs:
        return "nsgs";
    case ContactSolver::anderson:
        return "anderson";
    case ContactSolver::uzawa:
        return "uzawa";
    case ContactSolver::newton:
        return "newton";
    case ContactSolver::path:
        return "path";
    }
    return "";
}

std::string report(const Certificate& c)
{
    const char* length = c.level == ContactLevel::position ? "m" : "m/s";
    std::ostringstream out;
    out << "contact solve " << name(c.status) << " at error " << c.error << ", threshold "
        << c.threshold << " (" << name(c.solver) << ", " << c.iterations << " iterations, "
        << c.seconds << " s, " << c.contacts << " contacts)";
    if (c.worst_contact >= 0)
        out << "; worst: contact " << c.worst_contact << ", penetration at most "
            << c.worst_penetration << ' ' << length;
    if (c.rank_deficient && !c.indefinite) out << "; W is singular: one of several reactions";
    if (c.indefinite) out << "; W has a negative eigenvalue";
    if (c.status == SolveStatus::infeasible) {
        out << "; no reaction can prevent penetration at contacts";
        for (int i : c.proof.contacts)
            out << ' ' << i;
    }
    return out.str();
}

NaturalMapError::NaturalMapError(const ContactProblem& problem, ErrorScope scope)
    : problem_(problem)
    , scope_(scope)
    , offset_(row_offsets(problem))
    , own_rho_(problem.mu.size())
    , diagonal_(problem.W.diagonal())
    , size_(problem.q.norm())
{
    rho_ = scalar_rho(problem.W, diagonal_);
    for (int i = 0; i < contact_count(problem); ++i) {
        const int rows = rows_of(kind_of(problem, i));
        all_frictional_ = all_frictional_ && rows == 3;
        const double trace = diagonal_.segment(first_row(i), rows).sum();
        own_rho_[i] = trace > 0 ? rows / trace : rho_;
        scaled_size_ += own_rho_[i] * problem.q.segment(first_row(i), rows).squaredNorm();
    }
    scaled_size_ = std::sqrt(scaled_size_);
}

double NaturalMapError::residual(int contact, const double* r, const double* u, double rho) const
{
    switch (kind_of(problem_, contact)) {
    case ContactKind::frictional:
        return natural_map(Eigen::Map<const Vec3>(r), Eigen::Map<const Vec3>(u),
                           problem_.mu[contact], rho)
            .norm();
    case ContactKind::frictionless:
        return std::abs(std::min(*r, rho * *u));
    case ContactKind::bilateral:
        break;
    }
    return std::abs(rho * *u);
}

double NaturalMapError::size_of_q(const Eigen::VectorXd& r, const Eigen::VectorXd& u,
                                  bool scaled) const
{
    if (scope_ == ErrorScope::all_rows) return scaled ? scaled_size_ : size_;
    double acting = 0;
    for (int i = 0; i < contact_count(problem_); ++i) {
        const int k = first_row(i);
        const ContactKind kind = kind_of(problem_, i);
        const int rows = rows_of(kind);
        const bool open =
            kind != ContactKind::bilateral && u[k] >= 0 && r.segment(k, rows).isZero(0);
        if (!open) acting += problem_.q.segment(k, rows).squaredNorm() * (scaled ? rho(i) : 1);
    }
    // If no contact acts, or only contacts with q = 0, all rows give the size.
    return acting > 0 ? std::sqrt(acting) : scaled ? scaled_size_ : size_;
}

double NaturalMapError::operator()(const Eigen::VectorXd& r, const Eigen::VectorXd& u) const
{
    Eigen::VectorXd residuals(contact_count(problem_));
    return (*this)(r, u, residuals);
}

double NaturalMapError::operator()(const Eigen::VectorXd& r, const Eigen::VectorXd& u,
                                   Eigen::VectorXd& residuals) const
{
    const Batch rho = Batch::Constant(rho_);
    int i = 0;
    if (all_frictional_)
        for (; i + kContactBatch <= contact_count(problem_); i += kContactBatch)
            Eigen::Map<Batch>(residuals.data() + i) =
                natural_maps(r.data() + 3 * i, u.data() + 3 * i, problem_.mu.data() + i, rho);
    for (; i < contact_count(problem_); ++i)
        residuals[i] = residual_of(i, r, u, rho_);
    return ratio(residuals.norm(), rho_ * size_of_q(r, u, false));
}

double NaturalMapError::exact(const Eigen::VectorXd& r, const Eigen::VectorXd& u,
                              Eigen::VectorXd& residuals) const
{
    for (int i = 0; i < contact_count(problem_); ++i) {
        const int k = first_row(i);
        residuals[i] =
            kind_of(problem_, i) == ContactKind::frictional
                ? exact_natural_map_norm(r.segment<3>(k), u.segment<3>(k), problem_.mu[i], rho_)
                : residual_of(i, r, u, rho_);
    }
    return ratio(residuals.norm(), rho_ * size_of_q(r, u, false));
}

double NaturalMapError::in_long_double_if_doubtful(const Eigen::VectorXd& r, Eigen::VectorXd& u,
                                                   Eigen::VectorXd& residuals, double limit,
                                                   bool reported) const
{
    const double error = (*this)(r, u, residuals);
    if (error == 0 || !std::isfinite(error)) return error;
    const double in_map = rounding(r, u);
    const auto matters = [&](double floor) {
        const double noise = in_map + kFloorShare * floor;
        return error + noise > kNegligible &&
               ((reported && noise > kDoubt * error) || (error <= limit && error + noise > limit));
    };
    // The bound is cheap, the floor a product, what follows ten.
    if (!matters(floor_bound(r, u)) || !matters(uncapped_floor(r, u))) return error;
    problem_.W.apply_exactly(r, problem_.q, u);
    return exact(r, u, residuals);
}

double NaturalMapError::rounding(const Eigen::VectorXd& r, const Eigen::VectorXd& u) const
{
    return std::numeric_limits<double>::epsilon() * ratio(r.norm(), rho_ * size_of_q(r, u, false));
}

Eigen::VectorXd NaturalMapError::rounded(const Eigen::VectorXd& r, const Eigen::VectorXd& u) const
{
    Eigen::VectorXd on_cone = r;
    for (int i = 0; i < contact_count(problem_); ++i)
        if (const int k = first_row(i); kind_of(problem_, i) == ContactKind::frictional)
            on_cone.segment<3>(k) =
                rounded_to_cone(r.segment<3>(k), u.segment<3>(k), problem_.mu[i], rho_);
    return on_cone;
}

double NaturalMapError::scaled(const Eigen::VectorXd& r, const Eigen::VectorXd& u) const
{
    // r_i / sqrt(rho_i) and sqrt(rho_i) u_i make every diagonal block of trace 3.
    double sum = 0;
    int i = 0;
    if (all_frictional_)
        for (; i + kContactBatch <= contact_count(problem_); i += kContactBatch) {
            const Batch own = Eigen::Map<const Batch>(own_rho_.data() + i);
            sum += (natural_maps(r.data() + 3 * i, u.data() + 3 * i, problem_.mu.data() + i, own)
                        .square() /
                    own)
                       .sum();
        }
    for (; i < contact_count(problem_); ++i) {
        const double f = residual_of(i, r, u, rho(i));
        sum += f * f / rho(i);
    }
    return ratio(std::sqrt(sum), size_of_q(r, u, true));
}

double NaturalMapError::uncapped_floor(const Eigen::VectorXd& r, const Eigen::VectorXd& u) const
{
    const Eigen::VectorXd size = problem_.q.cwiseAbs() + problem_.W.absolute_times(r.cwiseAbs());
    return kFloorFactor * ratio(size.norm(), size_of_q(r, u, false));
}

double NaturalMapError::floor(const Eigen::VectorXd& r, const Eigen::VectorXd& u) const
{
    if (!r.allFinite()) return 0;
    const double floor = uncapped_floor(r, u);
    return floor <= kFloorLimit ? floor : 0;
}

/// Not below the floor, without its product.
double NaturalMapError::floor_bound(const Eigen::VectorXd& r, const Eigen::VectorXd& u) const
{
    const Eigen::VectorXd root = diagonal_.cwiseAbs().cwiseSqrt();
    const double most = root.norm() * root.dot(r.cwiseAbs()) + size_;
    return kFloorFactor * ratio(most, size_of_q(r, u, false));
}

double NaturalMapError::threshold(const Eigen::VectorXd& r, const Eigen::VectorXd& u,
                                  double tolerance) const
{
    return floor_bound(r, u) <= tolerance ? tolerance : std::max(tolerance, floor(r, u));
}

Certificate certify(const ContactProblem& problem, const Eigen::VectorXd& r, double tolerance,
                    ErrorScope scope)
{
    if (const Units units = units_of(problem); !units.are_one()) {
        const int force = units.q - units.W; // as an exponent
        Certificate c = certify(in_units(problem, units), times_power(r, -force), tolerance, scope);
        c.worst_penetration = std::ldexp(c.worst_penetration, units.q);
        c.worst_cone_violation = std::ldexp(c.worst_cone_violation, force);
        c.worst_dissipation = std::ldexp(c.worst_dissipation, force + units.q);
        return c;
    }
    Eigen::VectorXd u;
    return certify(NaturalMapError(problem, scope), r, tolerance, u);
}

Certificate certify(const NaturalMapError& error, const Eigen::VectorXd& r, double tolerance,
                    Eigen::VectorXd& u)
{
    const ContactProblem& problem = error.problem();
    Certificate c;
    c.tolerance = tolerance;
    c.threshold = tolerance;
    c.level = problem.level;
    c.contacts = contact_count(problem);

    problem.W.apply(r, u);
    u += problem.q;
    Eigen::VectorXd residuals(c.contacts);
    c.error = error.certain(r, u, residuals, tolerance);
    c.scaled_error = error.scaled(r, u);
    c.rounding = error.rounding(r, u);
    // The floor costs a product, and is computed only where the error is above the tolerance.
    if (!(c.error <= tolerance)) c.threshold = error.threshold(r, u, tolerance);
    c.status = c.error <= tolerance     ? SolveStatus::converged
               : c.error <= c.threshold ? SolveStatus::at_round_off
                                        : SolveStatus::stagnated;

    double worst = -1;
    for (int i = 0; i < c.contacts; ++i) {
        const int k = error.first_row(i);
        const ContactKind kind = kind_of(problem, i);
        if (residuals[i] > worst) {
            worst = residuals[i];
            c.worst_contact = i;
        }
        if (kind == ContactKind::bilateral) {
            c.worst_penetration = std::max(c.worst_penetration, std::abs(u[k]));
            continue;
        }
        c.worst_penetration = std::max(c.worst_penetration, -u[k]);
        c.worst_cone_violation = std::max(c.worst_cone_violation, -r[k]);
        if (kind == ContactKind::frictional) {
            const Eigen::Vector2d rt = r.segment<2>(k + 1), ut = u.segment<2>(k + 1);
            const double limit = problem.mu[i] * r[k];
            c.worst_cone_violation = std::max(c.worst_cone_violation, rt.norm() - limit);
            c.worst_dissipation = std::max(c.worst_dissipation, limit * ut.norm() + rt.dot(ut));
        }
    }
    return c;
}

} // namespace amontons
