#pragma once

#include "solver/solid/assembly.hpp"
#include "solver/solid/hyperelastic.hpp"

#include <memory>
#include <string>
#include <vector>

// A vessel's wall of hyperelastic material: what it is made of, and its true balance. Theory:
// docs/theory/soft_vessels.md.

namespace amontons {

/// A pressure that follows its faces.
struct WallPressure {
    /// Faces on which the pressure acts.
    std::vector<FaceRef> faces;
    double pressure = 0; ///< [Pa], > 0 pushes into the wall
};

/// The wall's hyperelastic material and pressures.
struct WallMaterial {
    /// The law and its constants.
    Hyperelastic law;
    std::vector<HyperelasticElement> elements; ///< of the mesh, in its order
    std::vector<WallPressure> pressures;
};

/// A displaced wall, as its material answers to it.
struct WallState {
    Eigen::VectorXd u;                       ///< 3 nodes [m]
    std::vector<HyperelasticState> elements; ///< there
    Eigen::VectorXd off;                     ///< loads less inner forces, 3 nodes [N]
    double energy = 0;                       ///< stored, less the loads' work [J]
    /// Of u, what is not the tangent's answer to contact forces: u = offset + K^-1 f [m].
    Eigen::VectorXd offset;
    /// Where that tangent is taken [m].
    std::shared_ptr<const Eigen::VectorXd> tangent_at;
};

/// @param dead   3 nodes [N]
/// @param state  in: u, and elements to start from, or none; out: all but the offset
/// @returns  "", or what the wall does instead of answering
std::string find_balance(const VolumeMesh& mesh, const WallMaterial& material,
                         const Eigen::VectorXd& dead, WallState& state);

/// The derivative of inner forces less loads, its symmetric part.
/// @param state  that find_balance has answered
void assemble_wall_tangent(const VolumeMesh& mesh, const SolidPattern& pattern,
                           const WallMaterial& material, const WallState& state, SparseMatrix& K);

} // namespace amontons
