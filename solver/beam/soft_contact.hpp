#pragma once

#include "solver/beam/wire_contact.hpp"

#include <Eigen/Core>
#include <vector>

// Linearisation of contacts with compliant walls: the full derivative by the motion of the wire,
// including the change of the places where forces act and of the normals there. Theory:
// docs/theory/soft_vessels.md.

namespace amontons {

/// Distance, normal and Hessian of a wall at a point; of a compliant wall, of its deformed shape.
/// @param c  out: along and around, of a soft wall
WallSample sample_wall(const WireWall& wall, const Vec3& x, WallHint& hint, Candidate& c);

/// Displaces the soft wall w by the reactions, which act at the places and along the normals of the
/// displaced wall, by a fixed-point iteration.
/// @return  remaining difference of the forces [N]
double settle_wall(const Wire& wire, const std::vector<WireWall>& walls, std::size_t w,
                   std::vector<Proximity>& proximity, double covered);

/// Contacts in their frames (n, t1, t2), 3 numbers each. With X the motion of the wire's points and
/// rho the change of reactions, forces on the wire change by `follow` X + `share` rho, gaps and
/// slips by `motion` X + `compliance` rho (slips without the spin of the wire's section).
struct CompliantContacts {
    std::vector<int> which;     ///< candidates
    Eigen::MatrixXd follow;     ///< [N/m]
    Eigen::MatrixXd share;      ///< [-]; 1 where walls are rigid
    Eigen::MatrixXd motion;     ///< [-]; 1 where walls are rigid
    Eigen::MatrixXd compliance; ///< [m/N]
    bool holds = true;          ///< false: the walls themselves are unstable under these forces
};

/// @param which  the candidates that matter, in order
/// @param proximity  of find_candidates
CompliantContacts linearise_walls(const std::vector<WireWall>& walls,
                                  const std::vector<Candidate>& candidates, std::vector<int> which,
                                  std::vector<Proximity>& proximity);

/// Displacements of the walls at candidates for forces there, 3n x 3n in space [m/N].
Eigen::MatrixXd compliance_of_walls(const std::vector<WireWall>& walls,
                                    const std::vector<Candidate>& candidates);

} // namespace amontons
