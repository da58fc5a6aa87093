#pragma once

#include "contact/solvers/work.hpp"

namespace amontons {

/// Uzawa on the bipotential augmented Lagrangian: predict, then project.
///
/// r_i <- proj_Kmu(r_i - rho_i (u_i + mu_i |u_it| n)): separation, stick and slip in one closed
/// form. options.uzawa states how rho is chosen. Cheap and robust to 1e-4; slow where blocks are
/// anisotropic or contacts strongly coupled: the reference, not the default.
/// Cost: as a sweep of nsgs without the local solve (own_block), or one product with W (adaptive).
/// The method of De Saxcé & Feng (1998); derivation: docs/theory/contact.md.
void solve_uzawa(SolverWork& work);

} // namespace amontons
