#pragma once

#include "solver/beam/rod_matrix.hpp"

#include <array>
#include <string>
#include <vector>

// Couplings in the contact problem of rods alone: rows that always hold, on one node of each side.

namespace amontons {

struct BodyRef;
struct Coupling;
struct CouplingRow;

/// One row of a coupling in the sparse matrix of the rods.
struct RodJoint {
    std::array<int, 2> on{-1, -1}; ///< rods, of all bodies; -1: what stands still
    std::array<int, 2> node{0, 0}; ///< of each
    /// Derivative of the value by the node's motion, place and turn.
    std::array<Vec6, 2> row{Vec6::Zero(), Vec6::Zero()};
    /// Second derivative of the value, on both nodes.
    Eigen::Matrix<double, 12, 12> bend = Eigen::Matrix<double, 12, 12>::Zero();
    double value = 0;      ///< at the iterate [m]; of turn springs [rad]
    double force = 0;      ///< known, along the row [N]; of turn springs [N m]
    double compliance = 0; ///< of a spring, 1 / stiffness; 0: rigid [m/N]
};

/// @param rows   of the couplings at the iterate
/// @param force  of each row, as it is known [N]
std::vector<RodJoint> rod_joints(const std::vector<BodyRef>& bodies,
                                 const std::vector<Coupling>& couplings,
                                 const std::vector<CouplingRow>& rows,
                                 const std::vector<double>& force);

/// A rigid motion of rods that is not prevented by their holds and couplings: the body that moves
/// most and its motion, "turn about (1, 0, 0)". Bodies other than rods count as held.
struct FreeMotion {
    int body = -1; ///< -1: there is none
    std::string motion;
};
/// The free motion of rods with couplings, contacts not considered.
FreeMotion free_motion_of_rods(const std::vector<BodyRef>& bodies,
                               const std::vector<Coupling>& couplings);

} // namespace amontons
