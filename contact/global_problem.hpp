#pragma once

#include "contact/problem.hpp"

#include <memory>

// Bodies not yet condensed on their contacts. With M the bodies' step matrix and H what a
// reaction does to them, find v, u, r with
//   M v = H r + f,   u = H^T v + w,   and every contact's law between u and r.

namespace amontons {

/// M, H, f, w, mu: the letters are those of FCLib's global problem.
struct GlobalProblem {
    Eigen::SparseMatrix<double> M; ///< dofs x dofs, symmetric positive definite [N/m or kg]
    Eigen::SparseMatrix<double> H; ///< dofs x rows [-]; rows as in ContactProblem
    Eigen::VectorXd f;             ///< dofs [N or N s]
    Eigen::VectorXd w;             ///< rows [m or m/s]
    Eigen::VectorXd mu;            ///< per contact [-], >= 0
    std::vector<ContactKind> kind; ///< per contact; empty: all frictional
    ContactLevel level = ContactLevel::position;
};

/// |M - M^T| / |M| above which M is refused; below it, its symmetric part is used (ratio).
constexpr double kMaxBodyAsymmetry = 1e-8;

/// Faults of the problem, empty if there are none. Whether M is positive definite is found only by
/// its factor, in CondensedProblem.
std::vector<Issue> issues(const GlobalProblem& problem);

/// How a global problem is condensed.
struct CondenseOptions {
    /// The form of W: chosen by size, or as given.
    enum class Form { automatic, matrix, matrix_free };
    Form form = Form::automatic;
    double dense_above = 0.35; ///< share of entries of W above which it is stored dense [-]
    double memory = 4e9;       ///< automatic: a larger matrix W is not formed [bytes]
};

/// A global problem condensed on its contacts: W = H^T M^-1 H, q = H^T M^-1 f + w.
///
/// W is sparse where bodies touch few others, dense where one body carries most contacts, and a
/// function (with the contacts' own blocks exact) where a matrix would need too much memory. The
/// share of entries is predicted from the connected components of M's graph, before anything is
/// factored.
class CondensedProblem {
public:
    /// @throws InputError  if the problem makes no sense or M is not positive definite
    /// Cost: one sparse factor of M, and for a matrix W the unknowns that contacts touch only.
    explicit CondensedProblem(const GlobalProblem& problem, const CondenseOptions& options = {});
    ~CondensedProblem();
    CondensedProblem(CondensedProblem&&) noexcept;
    CondensedProblem& operator=(CondensedProblem&&) noexcept;

    const ContactProblem& contact() const { return contact_; }
    /// v = M^-1 (H r + f), dofs. @param r  reaction, rows
    Eigen::VectorXd motion(const Eigen::VectorXd& r) const;

private:
    struct Factor; // hides the solver
    // Shared with the function that a matrix-free W is: std::function must be copyable.
    std::shared_ptr<const Factor> factor_;
    Eigen::SparseMatrix<double> H_;
    Eigen::VectorXd f_;
    ContactProblem contact_;
};

} // namespace amontons
