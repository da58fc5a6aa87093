#pragma once

#include "mesh/base/error.hpp"
#include "mesh/extract_surface.hpp"
#include "solver/scene/scene.hpp"

#include <string>
#include <vector>

namespace amontons {

/// Gives a mesh the sets that a scene describes by their place.
/// @param outside  of the mesh
/// @param file     the scene's, for messages
/// @throws InputError  sets that are empty, that lie beside the body or bear a name of the mesh's
/// own
void add_sets(const SolidInput& input, VolumeMesh& mesh, const ExternalSurface& outside,
              const std::string& file);

/// A set that holds, loads and contacts can name, and how large it is.
struct SetSize {
    std::string name;
    std::int64_t faces = 0; ///< 0 of a set of nodes
    std::int64_t nodes = 0;
    double area = 0; ///< [m^2]
};
/// Names and sizes of the sets of a mesh.
std::vector<SetSize> set_sizes(const VolumeMesh& mesh);

} // namespace amontons
