#include "solver/large/contact_newton.hpp"

#include "contact/certificate.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace amontons {
namespace {

/// Stiffness with which a closed or sticking contact is held within a Newton step, over its node's
/// own: what is left of a gap then is about 2 / this of what it was; multigrid still copes.
constexpr double kStiffer = 100;
constexpr double kTest = 0.5; // of it: what turns a gap into a force where states are decided
constexpr double kLinearTolerance = 1e-3;     // of a Newton step
constexpr double kComplianceTolerance = 1e-3; // of W r where only its size counts
constexpr double kTraceTolerance = 1e-2;
constexpr int kTraceProbes = 2;
constexpr double kUseless = 0.5; // share of a residual that a linear solve leaves: no step
constexpr int kMostNewton = 80;
constexpr int kPatience = 12;          // iterations without a better error, then the symmetric way
constexpr int kCertificates = 4;       // tries at a tighter tolerance
constexpr double kWithin = 0.1;        // of the tolerance: the error at which the loop itself ends
constexpr double kOtherStates = 0.002; // share of the contacts: then the preconditioner is renewed

enum class State : char { open, stick, slip };

/// A contact's directions at one node: C's rows of that node.
struct Arm {
    std::int32_t node = 0;
    Eigen::Matrix3d direction = Eigen::Matrix3d::Zero(); ///< columns: rows of the contact
};

class Newton {
public:
    Newton(LargeMatrix& A, const LargeContactProblem& p) : A_(A), p_(p)
    {
        const std::size_t n = p.kind.size();
        arms_.resize(n);
        rho_.resize(Eigen::Index(n));
        for (std::size_t i = 0; i < n; ++i) {
            double compliance = 0;
            for (int row = 0; row < rows_of(p.kind[i]); ++row)
                for (Eigen::SparseMatrix<double>::InnerIterator at(p.C, p.first[i] + row); at;
                     ++at) {
                    const auto node = std::int32_t(at.row() / 3);
                    auto arm = std::ranges::find(arms_[i], node, &Arm::node);
                    if (arm == arms_[i].end()) {
                        arms_[i].push_back({node, Eigen::Matrix3d::Zero()});
                        arm = arms_[i].end() - 1;
                    }
                    arm->direction(at.row() % 3, row) = at.value();
                    if (row == 0) compliance += at.value() * at.value() / p.diagonal[at.row()];
                }
            rho_[Eigen::Index(i)] = compliance > 0 ? 1 / compliance : 0;
            symmetric_ = symmetric_ && !(p.mu[Eigen::Index(i)] > 0);
        }
    }

    Eigen::VectorXd motion(const Eigen::VectorXd& y) const { return p_.q + p_.C.transpose() * y; }

    /// The laws' conditions on the next r and u, linear in them: r = base - D (change of u).
    struct Linear {
        Eigen::VectorXd base;
        std::vector<Eigen::Matrix3d> D;
        std::vector<State> state;
    };

    Linear linearised(const Eigen::VectorXd& r, const Eigen::VectorXd& u) const
    {
        Linear out;
        out.base = Eigen::VectorXd::Zero(r.size());
        out.D.assign(arms_.size(), Eigen::Matrix3d::Zero());
        out.state.assign(arms_.size(), State::open);
        for (std::size_t i = 0; i < arms_.size(); ++i) {
            const int at = p_.first[i];
            const double own = rho_[Eigen::Index(i)], rho = kStiffer * own;
            const double pressed = r[at] - kTest * own * u[at];
            // Just touching without force: closed, so that a first step does not fall through.
            if (!(own > 0) || pressed < 0 || (pressed == 0 && u[at] != 0)) continue;
            Eigen::Matrix3d& D = out.D[i];
            out.state[i] = State::stick;
            out.base[at] = r[at] - rho * u[at];
            D(0, 0) = rho;
            if (p_.kind[i] != ContactKind::frictional) continue;
            const Eigen::Vector2d slip = u.segment<2>(at + 1);
            const Eigen::Vector2d t = r.segment<2>(at + 1) - kTest * own * slip;
            // The force of a new contact is guessed by what tests it: one that stuck to a body that
            // slides would tear it open again, and so on for ever.
            const double normal = r[at] > 0 ? r[at] : pressed;
            const double mu = p_.mu[Eigen::Index(i)], bound = mu * normal, size = t.norm();
            if (size <= bound || bound == 0) { // one that just touches sticks for now
                out.base.segment<2>(at + 1) = r.segment<2>(at + 1) - rho * slip;
                D(1, 1) = D(2, 2) = rho;
                continue;
            }
            out.state[i] = State::slip;
            const Eigen::Vector2d along = t / size;
            // Across the direction, friction is against the slip: b / |u_t| of it.
            const double share = bound / size;
            const double across = std::min(share * kTest * own / (1 - share), rho);
            const Eigen::Matrix2d other = Eigen::Matrix2d::Identity() - along * along.transpose();
            out.base.segment<2>(at + 1) = -across * (other * slip);
            D.bottomRightCorner<2, 2>() = across * other;
            if (symmetric_) {
                out.base.segment<2>(at + 1) += bound * along;
            } else {
                out.base.segment<2>(at + 1) += mu * out.base[at] * along;
                D.block<2, 1>(1, 0) = mu * rho * along;
            }
        }
        return out;
    }

    std::vector<LargeMatrix::Block> blocks(const Linear& law) const
    {
        std::vector<LargeMatrix::Block> out;
        for (std::size_t i = 0; i < arms_.size(); ++i)
            if (law.state[i] != State::open)
                for (const Arm& a : arms_[i])
                    for (const Arm& b : arms_[i])
                        out.push_back(
                            {a.node, b.node, a.direction * law.D[i] * b.direction.transpose()});
        return out;
    }

    /// How far r and u are from the laws, relative to r: the natural map (Alart & Curnier's form)
    /// with each contact's own stiffness.
    double distance(const Eigen::VectorXd& r, const Eigen::VectorXd& u) const
    {
        double sum = 0;
        for (std::size_t i = 0; i < arms_.size(); ++i) {
            const int at = p_.first[i];
            const double own = kTest * rho_[Eigen::Index(i)];
            const double normal = std::max(r[at] - own * u[at], 0.0);
            sum += (r[at] - normal) * (r[at] - normal);
            if (p_.kind[i] != ContactKind::frictional) continue;
            Eigen::Vector2d t = r.segment<2>(at + 1) - own * u.segment<2>(at + 1);
            const double bound = p_.mu[Eigen::Index(i)] * normal, size = t.norm();
            if (size > bound) t *= bound / size;
            sum += (r.segment<2>(at + 1) - t).squaredNorm();
        }
        const double size = r.norm();
        return size > 0 ? std::sqrt(sum) / size : sum > 0 ? 1 : 0;
    }

    /// Iterates until law and balance hold to `tolerance`, or no longer get better.
    void run(Eigen::VectorXd& y, Eigen::VectorXd& r, double tolerance,
             const LargeContactOptions& options, LargeContactSolution& out)
    {
        const double load = p_.load.norm();
        std::vector<State> prepared(arms_.size(), State::open); // of the preconditioner
        bool first = true;
        double best = std::numeric_limits<double>::infinity();
        int worse = 0;
        const auto be_steady = [&] { // bounds of friction from the step before: slower, too
            symmetric_ = true;
            best = std::numeric_limits<double>::infinity();
            worse = 0;
        };
        for (int i = 0; i < kMostNewton; ++i) {
            if (options.stop && *options.stop) return;
            const Linear law = linearised(r, motion(y));
            Eigen::VectorXd missing = p_.load - p_.times(y) + p_.C * law.base;
            std::ptrdiff_t changed = 0;
            for (std::size_t k = 0; k < prepared.size(); ++k)
                changed += law.state[k] != prepared[k];
            const bool renew = first || double(changed) > kOtherStates * double(prepared.size());
            if (renew) prepared = law.state;
            first = false;
            A_.set_blocks(blocks(law), symmetric_, renew);
            const LargeMatrix::Result done = A_.solve(missing, kLinearTolerance);
            ++out.newton;
            out.linear += done.iterations;
            // One that stops early is a worse step, which the balance below shows; or none: the
            // symmetric way, or no answer.
            if (!done.fault.empty() && !(done.reached <= kUseless)) {
                if (symmetric_) {
                    out.fault = done.fault;
                    return;
                }
                be_steady();
                first = true; // its preconditioner follows it
                continue;
            }
            y += missing;
            const Eigen::VectorXd moved = p_.C.transpose() * missing;
            r = law.base;
            for (std::size_t k = 0; k < arms_.size(); ++k) {
                const int at = p_.first[k], rows = rows_of(p_.kind[k]);
                r.segment(at, rows) -= law.D[k].topLeftCorner(rows, rows) * moved.segment(at, rows);
            }

            const Eigen::VectorXd acting = p_.C * r;
            const double size = std::max(load, acting.norm());
            const double balance = size > 0 ? (p_.load - p_.times(y) + acting).norm() / size : 0;
            const double error = std::max(balance, distance(r, motion(y)));
            if (error <= tolerance) return;
            if (error < 0.9 * best) {
                best = error;
                worse = 0;
            } else if (++worse >= kPatience) {
                if (symmetric_) return;
                be_steady();
            }
        }
    }

private:
    LargeMatrix& A_;
    const LargeContactProblem& p_;
    std::vector<std::vector<Arm>> arms_;
    Eigen::VectorXd rho_; ///< of each contact's own node [N/m]
    bool symmetric_ = true;
};

/// f <- A^-1 f to the tolerance; else `out.fault` is the reason.
void solve(LargeMatrix& A, Eigen::VectorXd& f, double tolerance, LargeContactSolution& out)
{
    LargeMatrix::Result done = A.solve(f, tolerance);
    out.linear += done.iterations;
    if (out.fault.empty()) out.fault = std::move(done.fault);
}

/// Trace of W = C^T A^-1 C over its rows, from z . W z of random signs.
/// Source: Hutchinson, Comm. Stat. Simul. 19 (1990) 433.
double mean_of_diagonal(LargeMatrix& A, const LargeContactProblem& p, LargeContactSolution& out)
{
    double sum = 0;
    std::uint64_t state = 0x9E3779B97F4A7C15u;
    for (int k = 0; k < kTraceProbes; ++k) {
        Eigen::VectorXd z(p.q.size());
        for (double& s : z) {
            state = state * 6364136223846793005u + 1442695040888963407u;
            s = (state >> 63) != 0 ? 1 : -1;
        }
        Eigen::VectorXd f = p.C * z;
        solve(A, f, kTraceTolerance, out);
        sum += z.dot(p.C.transpose() * f);
    }
    return sum / (kTraceProbes * double(p.q.size()));
}

} // namespace

LargeContactSolution solve_large_contact(LargeMatrix& A, const LargeContactProblem& p,
                                         const Eigen::VectorXd& guess, double mean,
                                         const LargeContactOptions& options)
{
    LargeContactSolution out;
    out.y = Eigen::VectorXd::Zero(p.load.size());
    out.r = guess.size() == p.q.size() ? guess : Eigen::VectorXd(Eigen::VectorXd::Zero(p.q.size()));
    out.mean_compliance = mean;
    if (p.q.size() == 0) { // no contact: one solve
        A.set_blocks({}, true, true);
        const double load = p.load.norm();
        for (int k = 0; k <= kCertificates; ++k) {
            if (options.stop && *options.stop) return out;
            Eigen::VectorXd missing = p.load - p.times(out.y);
            out.error = load > 0 ? missing.norm() / load : 0;
            out.converged = out.error <= kWithin * options.tolerance;
            if (out.converged || k == kCertificates) break;
            // The iteration continues from a solve that stopped early: the error of the balance
            // decides.
            const LargeMatrix::Result done =
                A.solve(missing, kWithin * kWithin * options.tolerance);
            out.linear += done.iterations;
            out.fault = done.fault;
            if (!std::isfinite(done.reached)) break;
            out.y += missing;
        }
        if (out.converged) out.fault.clear();
        return out;
    }
    Newton newton(A, p);
    double tolerance = kWithin * options.tolerance;
    for (int k = 0; k < kCertificates; ++k, tolerance *= 0.1) {
        newton.run(out.y, out.r, tolerance, options, out);
        if (options.stop && *options.stop) return out;
        if (!out.fault.empty()) return out; // no iterate that an error could be stated of
        // The error of the solution: u = W r + q of these r, with A alone.
        A.set_blocks({}, true, true);
        if (!(out.mean_compliance > 0)) out.mean_compliance = mean_of_diagonal(A, p, out);
        const Eigen::VectorXd acting = p.C * out.r;
        Eigen::VectorXd missing = p.load - p.times(out.y) + acting;
        if (missing.squaredNorm() > 0) {
            solve(A, missing, kTraceTolerance, out);
            out.y += missing;
        }
        Eigen::VectorXd given = acting;
        if (k == 0 || out.compliance.size() == 0) {
            solve(A, given, kComplianceTolerance, out);
            out.compliance = p.C.transpose() * given;
        }
        if (!out.fault.empty()) return out; // of what the error is made of
        const Eigen::VectorXd u = newton.motion(out.y);
        ContactProblem seen;
        seen.W = Eigen::SparseMatrix<double>(
            (Eigen::VectorXd::Constant(p.q.size(), out.mean_compliance)).asDiagonal());
        seen.q = u - out.compliance;
        seen.mu = p.mu;
        seen.kind = p.kind;
        // Rows of open contacts do not count in what the error is relative to.
        const NaturalMapError map(seen, ErrorScope::acting_rows);
        out.error = map(out.r, u);
        if (out.error <= options.tolerance) {
            out.converged = true;
            return out;
        }
    }
    return out;
}

} // namespace amontons
