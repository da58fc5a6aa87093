#pragma once

#include "solver/step/wire_newton.hpp"

namespace amontons {

/// Solves the linearised Signorini-Coulomb problem of one Newton iterate, by pivoting the
/// contacts between open, stick and slip. Leaves the increment and the reactions in `work`.
/// @param shift  in: where to begin; out: what was added to the diagonal to make the wire
///               stable on the motions that contact leaves free [N/m]; 0 if nothing
void solve_linearised(const Wire& wire, NewtonWorkspace& work, const Residual& residual,
                      const NewtonOptions& options, double& shift, NewtonReport& report);

/// Closes what the last linear solve left open of the active rows' gaps, exactly.
/// @param force  reactions below it do not count [N]
void close_active_rows(const Wire& wire, NewtonWorkspace& work, double force);

} // namespace amontons
