#pragma once

#include "solver/beam/wire_contact.hpp"

#include <Eigen/Core>
#include <vector>

// How contacts with walls that are compliant answer to a small motion of the wire: the whole
// derivative, with the places where forces act and the normals there. Theory:
// docs/theory/soft_vessels.md.

namespace amontons {

/// The undeformed wall at a point, or what becomes of it where it is compliant.
/// @param c  out: along and around, of a soft wall
WallSample sample_wall(const WireWall& wall, const Vec3& x, WallHint& hint, Candidate& c);

/// Displaces the soft wall w by the reactions, at the places and along the normals that it has
/// then: the two depend on each other.
/// @return  what they still disagree by [N]
double settle_wall(const Wire& wire, const std::vector<WireWall>& walls, std::size_t w,
                   std::vector<Proximity>& proximity, double covered);

/// Contacts in their frames (n, t1, t2), 3 numbers each. With X the motion of the wire's points and
/// rho the change of reactions, forces on the wire change by `follow` X + `share` rho, gaps and
/// slips by `motion` X + `give` rho (slips without the spin of the wire's section).
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
