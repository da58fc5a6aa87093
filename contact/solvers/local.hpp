#pragma once

#include "mesh/base/types.hpp"

// One frictional contact alone: u = A r + b with a 3 x 3 block A, solved exactly.

namespace amontons {

/// The state in which a contact was solved.
enum class LocalState {
    open,    ///< r = 0, u_n >= 0
    stick,   ///< u = 0, r inside the cone
    slip,    ///< u_n = 0, u_t = -s r_t with s > 0, r on the cone
    unsolved ///< the block alone has no solution, or none that is finite in doubles
};

/// Solution of one contact with all others fixed.
struct LocalReaction {
    /// Its reaction [N].
    Vec3 r = Vec3::Zero();
    LocalState state = LocalState::unsolved; ///< r is finite in every state, 0 if unsolved
    double multiplier = 0; ///< s of u_t = -s r_t where it slips: the next guess [m/N]
};

/// A prepared block: its Schur complement on the normal, in the basis where that is diagonal.
struct LocalBlock {
    double normal = 0;                 ///< A_nn [m/N]
    Eigen::Vector2d to_normal{0, 0};   ///< A_nt in the basis: u_n due to r_t
    Eigen::Vector2d from_normal{0, 0}; ///< A_tn in the basis: u_t due to r_n
    double large = 0, small = 0;       ///< eigenvalues of the symmetric part, large >= small [m/N]
    double skew = 0;                   ///< skew part, S = [[large, skew], [-skew, small]]
    double inverse_normal = 0;         ///< of A_nn > 0 [N/m]
    double inverse_large = 0, inverse_small = 0; ///< of eigenvalues > 0 [N/m]
    double coupling = 0;                         ///< |to_normal| / normal (ratio)
    double cosine = 1, sine = 0; ///< basis: first axis in (t1, t2) (cosine and sine)
    bool solvable = false;       ///< A_nn > 0 beyond round-off
};

/// @param A  block of the contact, positive semidefinite up to round-off; small unsymmetry is
///           kept, not averaged away
LocalBlock prepare(const Mat3& A);

/// r with r in K_mu, u = A r + b, u_n >= 0, Signorini and Coulomb; backward stable.
///
/// Enumerates open, stick and slip; slip is one root in the multiplier s of u_t = -s r_t,
/// bracketed from the start, so that the iteration cannot fail. Derivation: docs/theory/contact.md.
/// A positive definite block always has a solution; if several, the first in this order.
/// @param b      u without this contact's own reaction, 3
/// @param guess  s near the solution, e.g. |u_t| / |r_t| of the last one; 0 if unknown
/// @param loose  slip may end after one step of Newton's method from a near guess, as neighbours
///               will change again: r is on the cone, u_n in error by second order in that step
/// Cost: 10 to 100 ns; no allocation.
LocalReaction solve_local(const LocalBlock& block, double mu, const Vec3& b, double guess = 0,
                          bool loose = false);

} // namespace amontons
