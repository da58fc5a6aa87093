#pragma once

#include "contact/delassus.hpp"
#include "mesh/base/error.hpp"

#include <vector>

// The abstract contact problem: no bodies, no meshes. Find reactions r and
//   u = W r + q    such that every contact obeys its law.

namespace amontons {

/// The law of a contact and its number of rows.
enum class ContactKind {
    frictional,   ///< 3 rows (n, t1, t2): Signorini and Coulomb
    frictionless, ///< 1 row (n): Signorini, 0 <= u ⟂ r >= 0
    bilateral     ///< 1 row: u = 0 whatever the sign of r (glue, joint, prescribed motion)
};

/// Units of u and r: gap and slip [m] with forces [N], or velocities [m/s] with impulses [N s].
enum class ContactLevel { position, velocity };

/// Number of rows that a contact has in W and q.
inline int rows_of(ContactKind kind)
{
    return kind == ContactKind::frictional ? 3 : 1;
}

/// W, q, mu: the letters are those of FCLib. The rows follow the contacts in order.
struct ContactProblem {
    Delassus W;                    ///< rows x rows [m/N or 1/kg], in any form of Delassus; may be
                                   ///< semidefinite, and unsymmetric up to kMaxAsymmetry
    Eigen::VectorXd q;             ///< gap and slip of the free motion, rows [m or m/s]
    Eigen::VectorXd mu;            ///< friction coefficient per contact, n [-], >= 0
    std::vector<ContactKind> kind; ///< per contact; empty: all frictional
    ContactLevel level = ContactLevel::position; ///< sets the units; the algebra is the same
};

/// |W - W^T| / |W| (Delassus::asymmetry) above which W is refused: reciprocity is then violated by
/// more than the round-off of a condensation (ratio).
constexpr double kMaxAsymmetry = 1e-2;

/// Number of contacts.
inline int contact_count(const ContactProblem& problem)
{
    return static_cast<int>(problem.mu.size());
}

/// The kind of a contact of a problem.
inline ContactKind kind_of(const ContactProblem& problem, int contact)
{
    return problem.kind.empty() ? ContactKind::frictional
                                : problem.kind[static_cast<std::size_t>(contact)];
}

/// First row of each contact, and the number of rows as last entry: n + 1.
std::vector<int> row_offsets(const ContactProblem& problem);

/// Faults of the problem: sizes that differ, numbers that are not
/// finite, mu < 0, W too unsymmetric. Empty if it can be solved. Zero contacts are valid.
std::vector<Issue> issues(const ContactProblem& problem);

} // namespace amontons
