#pragma once

#include "contact/problem.hpp"

namespace amontons {

/// Rank and definiteness of W, which a solve does not need.
struct DelassusAnalysis {
    bool known = false; ///< false for a matrix-free W: nothing else is then stated
    /// W has an eigenvalue below 1e-10 (rows scaled to a unit diagonal): reactions along it cause
    /// no motion, and a solution need not be the only one.
    bool rank_deficient = false;
    /// W has an eigenvalue below -1e-10, so scaled: neither existence nor convergence is assured.
    bool indefinite = false;
};

/// Of the symmetric part of W. Cost: two Cholesky factors, O(rows^3) for a dense W.
DelassusAnalysis analyse(const ContactProblem& problem);

} // namespace amontons
