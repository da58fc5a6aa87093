#pragma once

#include "mesh/base/error.hpp"
#include "mesh/volume_mesh.hpp"
#include "solver/scene/scene.hpp"

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

namespace amontons {

/// The holds and loads of a scene's solid on the nodes and faces of its mesh. Points into the
/// input and the mesh it was found from.
struct SolidConditions {
    /// A prescribed degree of freedom.
    struct Held {
        /// Number of the degree of freedom.
        std::int32_t dof = 0;
        const CurvePoints* curve = nullptr; ///< null: 0, or given by the hold's turn or gradient
        std::size_t hold = 0;               ///< the first that names it
    };
    struct Load { ///< of each of the scene's
        const LoadInput* input = nullptr;
        /// Nodes on which the load acts.
        std::vector<std::int32_t> nodes;
        const FaceSet* faces = nullptr; ///< null: a set of nodes
        Eigen::VectorXd pressure;       ///< forces of 1 Pa, 3n [m^2]; empty: none requested
        Eigen::VectorXd traction;       ///< of 1 Pa, of each node along one axis, n [m^2]
    };
    struct Support { ///< of each of the scene's
        const SupportInput* input = nullptr;
        /// The faces.
        const FaceSet* faces = nullptr;
    };
    /// A hold that turns its set, or gives it a gradient.
    struct Affine {
        const HoldInput* input = nullptr; ///< null: neither
        Vec3 about = Vec3::Zero();        ///< in the mesh [m]
    };
    std::vector<Affine> affine; ///< of each hold
    std::vector<Held> held;
    std::vector<Support> supports;
    std::vector<Load> loads;
    std::vector<Issue> warnings; ///< of nodes that two holds take to different places
};

/// Degrees of freedom that are prescribed.
std::vector<std::int32_t> prescribed_dofs(const SolidConditions& conditions);
/// Displacement of each of `held` at a time, in the body's frame [m].
Eigen::VectorXd held_displacements(const SolidConditions& conditions, const VolumeMesh& mesh,
                                   double t);
/// Whether a prescribed degree of freedom varies in time.
bool moves(const SolidConditions& conditions, const SolidConditions::Held& held);

/// @throws InputError  sets that the mesh has not, or that cannot carry the prescribed conditions
SolidConditions find_conditions(const SolidInput& input, const VolumeMesh& mesh,
                                const std::string& file);

} // namespace amontons
