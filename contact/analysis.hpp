#pragma once

#include "contact/problem.hpp"

namespace amontons {

/// What W is like, beyond what a solve needs to know.
struct DelassusAnalysis {
    bool known = false;          ///< false for a matrix-free W: nothing else is then stated
    bool rank_deficient = false; ///< some reaction is not felt: solutions are not unique
    bool indefinite = false;     ///< W has a negative eigenvalue beyond round-off: no theory holds
};

/// Cost: two Cholesky factors, O(rows^3) for a dense W.
DelassusAnalysis analyse(const ContactProblem& problem);

} // namespace amontons
