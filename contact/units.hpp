#pragma once

#include "contact/problem.hpp"

namespace amontons {

/// Units, powers of two, in which the numbers of a problem have squares and quotients that doubles
/// can hold: W = 2^W W', q = 2^q q', r = 2^(q - W) r'.
struct Units {
    int W = 0, q = 0;
    bool are_one() const { return W == 0 && q == 0; }
};

/// Those of the problem itself where its largest numbers are within 1e-60 .. 1e60; else units in
/// which they are near one. O(rows) where the diagonal of a
/// dense W is within.
Units units_of(const ContactProblem& problem);

/// x 2^exponent; infinite or zero where that leaves the range of doubles.
Eigen::VectorXd times_power(const Eigen::VectorXd& x, int exponent);

/// The same problem, W' and q'. Exact, but for numbers that become less than 1e-308.
ContactProblem in_units(const ContactProblem& problem, const Units& units);

} // namespace amontons
