#pragma once

#include "contact/global_problem.hpp"

// Elastic bodies at rest, linear, in displacements: K v = H r + f, u = H^T v + w. Forces r [N],
// u [m].

namespace amontons {

/// A block of linear tetrahedra, held and moved at its top, pressed on a rigid plane.
struct ElasticBlock {
    int cells[3] = {6, 6, 3};
    Vec3 size{0.1, 0.1, 0.05}; ///< [m]
    double youngs_modulus = 1e6, poisson_ratio = 0.3;
    double contrast = 1;               ///< modulus of the lower half over that of the upper [-]
    double press = 1e-3, shear = 5e-4; ///< of the top: down, and along x [m]
    double crown = 0;                  ///< the bottom is curved: gap at its rim [m]
    double mu = 0.4;
};
GlobalProblem elastic_block(const ElasticBlock& b);

/// Two blocks on each other, node on node, the upper one stiffer or softer by `contrast`.
GlobalProblem elastic_stack(const ElasticBlock& b);

/// A clamped beam (Euler-Bernoulli, 6 unknowns a node) in a wavy tube: 4 contacts a node.
struct Catheter {
    int nodes = 20;
    double length = 0.5, radius = 5e-4, clearance = 1e-3, wave = 0.02; ///< [m]
    double youngs_modulus = 7e10;
    double tip_ratio = 1; ///< modulus at the tip over that at the base [-]
    double push = 1e-3;   ///< of the base, along the tube [m]
    double mu = 0.3;
};
GlobalProblem catheter(const Catheter& c);

/// A guidewire in a catheter in a tube: contacts between all of them.
struct CoaxialWires {
    Catheter outer;
    double inner_youngs_modulus = 1e11, inner_radius = 2e-4;
};
GlobalProblem coaxial_wires(const CoaxialWires& c);

/// side x side cantilever fibres in a square, pressed together from outside.
struct FibreBundle {
    int side = 4, nodes = 10;
    double length = 0.1, radius = 1e-3, youngs_modulus = 1e9;
    double load = 5;   ///< on every outer node [N]
    double gap = 1e-5; ///< between neighbours [m]
    double mu = 0.5;
};
GlobalProblem fibre_bundle(const FibreBundle& b);

} // namespace amontons
