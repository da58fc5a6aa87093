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
    struct Held {
        std::int32_t dof = 0;
        const CurvePoints* curve = nullptr; ///< null: 0
        std::size_t hold = 0;               ///< the first that names it
    };
    struct Load { ///< of each of the scene's
        const LoadInput* input = nullptr;
        std::vector<std::int32_t> nodes;
        const FaceSet* faces = nullptr; ///< null: a set of nodes
        Eigen::VectorXd pressure;       ///< forces of 1 Pa, 3n [m^2]; empty: none asked
        Eigen::VectorXd traction;       ///< of 1 Pa, of each node along one axis, n [m^2]
    };
    std::vector<Held> held;
    std::vector<Load> loads;
    std::vector<Issue> warnings; ///< of nodes that two holds take to different places
};

/// @throws InputError  sets that the mesh has not, or that cannot carry what is asked of them
SolidConditions find_conditions(const SolidInput& input, const VolumeMesh& mesh,
                                const std::string& file);

} // namespace amontons
