#pragma once

#include "contact/problem.hpp"

#include <limits>
#include <string>

// Error of a reaction, computed from (W, q, mu, r) alone, independent of the solver.
// Formulas, and why they do not depend on units: docs/theory/contact.md.

namespace amontons {

/// How a solve ended.
enum class SolveStatus {
    converged,    ///< error <= tolerance
    at_round_off, ///< error <= threshold: the round-off floor is above the tolerance
    stagnated,    ///< ended at the error that the certificate states
    infeasible,   ///< no reaction can prevent penetration: see Certificate::proof
    out_of_time   ///< max_seconds, or a stop from outside, before the threshold
};

/// The error is below the requested tolerance, or as low as round-off allows.
constexpr bool is_solved(SolveStatus status)
{
    return status == SolveStatus::converged || status == SolveStatus::at_round_off;
}

/// The solvers of contact/solvers/solve.hpp; which to choose when: docs/theory/contact.md.
enum class ContactSolver {
    automatic, ///< sweeps while they are cheap, else the path and its fallbacks
    nsgs,      ///< block Gauss-Seidel with an exact local solver
    anderson,  ///< nsgs with Anderson's extrapolation
    uzawa,     ///< De Saxcé and Feng's predictor and projection
    newton,    ///< semismooth Newton after sweeps
    path       ///< Newton along a central path
};
/// All solvers, in the order of the enumeration.
constexpr ContactSolver kContactSolvers[] = {ContactSolver::automatic, ContactSolver::nsgs,
                                             ContactSolver::anderson,  ContactSolver::uzawa,
                                             ContactSolver::newton,    ContactSolver::path};

/// Which rows count in ||q'||, the size that the error is relative to.
enum class ErrorScope {
    all_rows,   ///< every row: the measure for a problem from a file
    acting_rows ///< not those of open contacts (r = 0, u_n >= 0): in a run a candidate far
                ///< away must not loosen the test
};

/// Normal reactions d >= 0 that cause no motion (W^T d = 0 to round-off) yet close a gap
/// (q . d < 0). Any r with u_n >= 0 would give 0 <= u . d = q . d + r . W^T d.
struct InfeasibilityProof {
    Eigen::VectorXd direction; ///< n, one normal component per contact, largest = 1 [-]
    double closing = 0;        ///< -q . d > 0 [m]
    double holds_up_to = 0;    ///< no solution exists with |r| below this [N]
    std::vector<int> contacts; ///< those with direction > 0
};

/// Status and errors of a solution, recomputed from (W, q, mu, r) alone:
/// docs/theory/certificate.md.
struct Certificate {
    SolveStatus status = SolveStatus::stagnated;
    double error = std::numeric_limits<double>::infinity(); ///< natural map over ||q'|| [-]
    double tolerance = 0;                                   ///< as requested [-]
    double threshold = 0; ///< tolerance, or the round-off floor if that is larger [-]
    /// Error of the last digit of r: a recomputation in doubles, projection included, may find this
    /// more [-].
    double rounding = 0;
    /// The same after scaling each contact by its own block: contains stiff contacts [-].
    double scaled_error = std::numeric_limits<double>::infinity();
    double worst_penetration = 0;    ///< largest -u_n, or |u| of a bilateral row, >= 0 [m]
    double worst_cone_violation = 0; ///< largest |r_t| - mu r_n or -r_n, >= 0 [N]
    double worst_dissipation = 0;    ///< largest mu r_n |u_t| + r_t . u_t: work missing from the
                                     ///< dissipation of friction, >= 0 [J]
    int worst_contact = -1;          ///< largest share of the error; -1 without contacts
    int contacts = 0;
    bool analysed = false;       ///< the next two are known: SolverOptions::analyse
    bool rank_deficient = false; ///< W is singular: the reaction need not be the only one
    bool indefinite = false;     ///< W has a negative eigenvalue: a solution need not exist
    ContactSolver solver = ContactSolver::nsgs; ///< the one that ran
    ContactLevel level = ContactLevel::position;
    int iterations = 0;
    double seconds = 0;       ///< wall time of the solve [s]
    InfeasibilityProof proof; ///< empty unless infeasible
};

/// The status as result files write it: "converged", "at_round_off", ...
const char* name(SolveStatus status);
const char* name(ContactSolver solver); ///< "auto", "nsgs", "anderson", "uzawa", "newton", "path"

/// Errors up to this times NaturalMapError::rounding may be rounding alone.
constexpr double kRoundings = 10;

/// One line for a log: status, error against threshold, effort, the worst contact.
std::string report(const Certificate& certificate);

/// The natural-map error of a fixed problem: O(rows) per value once u is known.
///
/// With rho = rows / trace(W):  error = ||F|| / (rho ||q||),
/// F_i = r_i - proj_Kmu(r_i - rho (u_i + mu_i |u_it| n)), frictionless min(r, rho u),
/// bilateral rho u. Same number for any unit of force and length and any scale of W.
/// Derivation: docs/theory/contact.md.
class NaturalMapError {
public:
    NaturalMapError(const ContactProblem& problem, ErrorScope scope);

    /// The error [-]; infinite if r or u is not finite.
    double operator()(const Eigen::VectorXd& r, const Eigen::VectorXd& u) const;
    /// The same, and leaves ||F_i|| of each contact in residuals, n [N].
    double operator()(const Eigen::VectorXd& r, const Eigen::VectorXd& u,
                      Eigen::VectorXd& residuals) const;
    /// The error to be reported: where the round-off of u = W r + q, or of the map itself, may be
    /// more than a tenth of it, or decide whether it is below the limit, both are formed anew in
    /// long double. In doubles the distance of a slipping r from its cone is known to the last
    /// digit of r only, which is more than a tight tolerance where stiff contacts stand beside soft
    /// ones: rho is that of the soft ones.
    /// @param u  W r + q; replaced where it is formed anew
    double certain(const Eigen::VectorXd& r, Eigen::VectorXd& u, Eigen::VectorXd& residuals,
                   double limit) const
    {
        return in_long_double_if_doubtful(r, u, residuals, limit, true);
    }
    /// The same, exact only as far as the comparison with the limit needs. Error (relative).
    double decided(const Eigen::VectorXd& r, Eigen::VectorXd& u, Eigen::VectorXd& residuals,
                   double limit) const
    {
        return in_long_double_if_doubtful(r, u, residuals, limit, false);
    }
    /// The error that a change of r in its last digit can make [-].
    double rounding(const Eigen::VectorXd& r, const Eigen::VectorXd& u) const;
    /// r with each slipping contact moved by a last digit or two onto its cone.
    Eigen::VectorXd rounded(const Eigen::VectorXd& r, const Eigen::VectorXd& u) const;
    /// The same with each contact in its own scale rho_i = rows_i / trace(W_ii) [-].
    double scaled(const Eigen::VectorXd& r, const Eigen::VectorXd& u) const;
    /// The round-off of u = W r + q seen in the error: 50 eps || |W||r| + |q| || / ||q|| [-];
    /// 0 where this exceeds 1e-3, since a diverging reaction would raise its own limit. O(rows^2).
    double floor(const Eigen::VectorXd& r, const Eigen::VectorXd& u) const;
    /// The larger of a tolerance and the floor. The floor's product is spared where |W_ij| <=
    /// sqrt(W_ii W_jj), which semidefinite W obey, shows that it is the smaller.
    double threshold(const Eigen::VectorXd& r, const Eigen::VectorXd& u, double tolerance) const;
    /// ||F_i|| of one contact with the given rho [N].
    /// @param r, u  of this contact, as many numbers as it has rows
    double residual(int contact, const double* r, const double* u, double rho) const;

    const ContactProblem& problem() const { return problem_; }
    ErrorScope scope() const { return scope_; }
    double rho() const { return rho_; } ///< rows / trace(W), common to all contacts [N/m]
    /// rows_i / trace(W_ii), a contact's own [N/m].
    double rho(int contact) const { return own_rho_[contact]; }
    /// The first row of a contact in u, r and q.
    int first_row(int contact) const { return offset_[static_cast<std::size_t>(contact)]; }

private:
    double residual_of(int contact, const Eigen::VectorXd& r, const Eigen::VectorXd& u,
                       double rho) const
    {
        return residual(contact, r.data() + first_row(contact), u.data() + first_row(contact), rho);
    }
    double size_of_q(const Eigen::VectorXd& r, const Eigen::VectorXd& u, bool scaled) const;
    double exact(const Eigen::VectorXd& r, const Eigen::VectorXd& u,
                 Eigen::VectorXd& residuals) const;
    double in_long_double_if_doubtful(const Eigen::VectorXd& r, Eigen::VectorXd& u,
                                      Eigen::VectorXd& residuals, double limit,
                                      bool reported) const;
    double uncapped_floor(const Eigen::VectorXd& r, const Eigen::VectorXd& u) const;
    double floor_bound(const Eigen::VectorXd& r, const Eigen::VectorXd& u) const;

    const ContactProblem& problem_;
    ErrorScope scope_;
    std::vector<int> offset_;
    bool all_frictional_ = true;
    double rho_ = 1;
    Eigen::VectorXd own_rho_;
    Eigen::VectorXd diagonal_;          // of W
    double size_ = 0, scaled_size_ = 0; // of q, all rows
};

/// Certifies r from (W, q, mu, r) alone: converged or stagnated, errors and physical figures.
/// Solver, effort, time and the other two statuses are left to the caller.
/// @param r  reaction, rows
/// Cost: two products with W.
Certificate certify(const ContactProblem& problem, const Eigen::VectorXd& r, double tolerance,
                    ErrorScope scope = ErrorScope::all_rows);
/// The same from the error object of a problem whose numbers are within 1e-60 .. 1e60.
/// @param u  out: W r + q
Certificate certify(const NaturalMapError& error, const Eigen::VectorXd& r, double tolerance,
                    Eigen::VectorXd& u);

} // namespace amontons
