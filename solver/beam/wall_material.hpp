#pragma once

#include "solver/solid/assembly.hpp"
#include "solver/solid/hyperelastic.hpp"

#include <memory>
#include <string>
#include <vector>

// A vessel's wall of hyperelastic material: its law and pressures, and its equilibrium. Theory:
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

/// State of a displaced wall, evaluated by its material's law.
struct WallState {
    Eigen::VectorXd u;                       ///< 3 nodes [m]
    std::vector<HyperelasticState> elements; ///< there
    Eigen::VectorXd off;                     ///< loads less inner forces, 3 nodes [N]
    double energy = 0;                       ///< elastic energy less the loads' work [J]
    /// u less the linear response to the contact forces f: u = offset + K^-1 f [m].
    Eigen::VectorXd offset;
    /// Where that tangent is taken [m].
    std::shared_ptr<const Eigen::VectorXd> tangent_at;
};

/// Evaluates the material of a wall at the displacement state.u: inner forces, loads and energy.
/// @param dead   loads of fixed direction, 3 nodes [N]
/// @param state  in: u, and elements to start from, or none; out: all but the offset
/// @returns  "", or the reason if the material cannot be evaluated there
std::string find_balance(const VolumeMesh& mesh, const WallMaterial& material,
                         const Eigen::VectorXd& dead, WallState& state);

/// The derivative of inner forces less loads, its symmetric part.
/// @param state  that find_balance has answered
void assemble_wall_tangent(const VolumeMesh& mesh, const SolidPattern& pattern,
                           const WallMaterial& material, const WallState& state, SparseMatrix& K);

} // namespace amontons
