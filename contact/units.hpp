#pragma once

#include "contact/problem.hpp"

namespace amontons {

/// Units, powers of two, in which the numbers of a problem have squares and quotients that doubles
/// can hold: W = 2^W W', q = 2^q q', r = 2^(q - W) r'.
struct Units {
    /// Exponents: W = 2^W W', q = 2^q q'.
    int W = 0, q = 0;
    /// True if nothing is scaled.
    bool are_one() const { return W == 0 && q == 0; }
};

/// None (0, 0) where the largest numbers of the problem are within 1e-60 .. 1e60; else units in
/// which they are near one. O(rows) where the diagonal of a dense W is within.
Units units_of(const ContactProblem& problem);

/// x 2^exponent; infinite or zero where that leaves the range of doubles.
Eigen::VectorXd times_power(const Eigen::VectorXd& x, int exponent);

/// The same problem, W' and q'. Exact, but for numbers that become less than 1e-308.
ContactProblem in_units(const ContactProblem& problem, const Units& units);

/// Units of normal forces, powers of two <= 1 by rows (1 of all others), that leave no coefficient
/// of friction above `most`: with r = D r' and u' = D u the law is Coulomb's with D_n mu. Empty
/// where none is above, or W is matrix-free.
///
/// With a larger mu, r_n = |r_t| / mu of a sliding contact is small beside all other forces, but
/// the contact is open without it: smoothings lose it, and sweeps converge slowly.
Eigen::VectorXd normal_units(const ContactProblem& problem, double most);

/// The same problem, D W D, D q and D_n mu. Exact.
ContactProblem in_normal_units(const ContactProblem& problem, const Eigen::VectorXd& D);

} // namespace amontons
