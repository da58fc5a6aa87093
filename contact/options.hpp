#pragma once

#include "contact/certificate.hpp"

#include <atomic>
#include <limits>
#include <string>
#include <vector>

namespace amontons {

/// How a contact problem is solved. The defaults suit a step of a simulation.
struct SolverOptions {
    ContactSolver solver = ContactSolver::automatic;
    double tolerance = 1e-8; ///< natural-map error, in [0, 1); 0: down to round-off [-]
    /// `auto` searches for no further ways to the tolerance when the usual ones have left an error
    /// of at most this [-].
    double acceptable = 0;
    ErrorScope scope = ErrorScope::all_rows;
    int max_iterations = 100'000; ///< sweeps or projections, >= 0
    /// Wall time, >= 0 [s]. Examined between iterations; a Newton step that should end after twice
    /// this time is not begun. Checks and certificate, a few products with W, come on top.
    double max_seconds = std::numeric_limits<double>::infinity();
    /// Set from outside, it ends the solve as if max_seconds were over; none if null.
    const std::atomic<bool>* stop = nullptr;
    /// Ends as stagnated when this many iterations (`auto`: five times as many, for it has several
    /// ways to try) have not lowered the best error by a tenth:
    /// at that rate max_iterations would not bring one more digit.
    int patience = 2000;
    /// Groups of contacts that W does not couple are solved side by side, and so are those in a
    /// sweep of a large W of bodies: the same bits for any number; >= 1.
    int threads = 1;
    /// Also determine whether W is singular or indefinite: as much work as a Newton step. Not
    /// counted in the certificate's seconds.
    bool analyse = false;
    /// Of several reactions, return the one of least norm (up to the tolerance): a second solve,
    /// with W + alpha, alpha so small that the answer solves the problem as it is.
    bool least_norm = false;

    /// Options of block Gauss-Seidel and its acceleration.
    struct Nsgs {
        /// symmetric: every second sweep runs backwards. Forward took 70 sweeps where symmetric
        /// took 226, on stacked elastic layers (docs/theory/contact.md).
        enum class Order { forward, symmetric };
        Order order = Order::forward;
        /// A contact whose residual is below this times the worst one is left out of the sweep;
        /// in [0, 1), 0 visits all [-]. The error always counts all contacts. Measured: up to 0.3
        /// a sweep gets cheaper and their number stays.
        double freeze = 0.3;
    } nsgs;

    /// Options of the predictor and projection.
    struct Uzawa {
        /// own_block: one rho per contact, the inverse of its block's norm, contact after contact.
        /// adaptive: all contacts at once, a common factor on rho that follows the rate.
        enum class Rho { own_block, adaptive };
        Rho rho = Rho::own_block;
        double factor = 1; ///< on the initial rho, in (0, 2) [-]
    } uzawa;
};

/// What is wrong with the options; empty if nothing.
std::vector<Issue> issues(const SolverOptions& options);

/// The solver of that name.
/// @throws InputError  if there is none; states the names that there are
ContactSolver contact_solver(const std::string& name);

} // namespace amontons
