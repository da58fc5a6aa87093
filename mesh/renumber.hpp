#pragma once

#include "mesh/volume_mesh.hpp"

namespace amontons {

/// An order of a mesh's nodes and elements, and the way back.
struct Renumbering {
    std::vector<std::int32_t> old_node;    ///< of each new node: its number before
    std::vector<std::int32_t> new_node;    ///< of each old node: its number now
    std::vector<std::int32_t> old_element; ///< of each new element
    std::vector<std::int32_t> new_element; ///< of each old element
};

/// Nodes by nested dissection, so that a sparse factor fills in little; elements of each kind by
/// their lowest node, so that neighbours lie near in memory. The same for the same mesh, always.
/// Source: METIS_NodeND of METIS 5 (Karypis & Kumar), on the graph of nodes that share an element.
/// @throws std::runtime_error  if METIS fails (not enough memory)
Renumbering nested_dissection(const VolumeMesh& mesh);

/// The mesh in another order. Sets are carried over. Labels stay with their nodes and elements.
VolumeMesh renumbered(const VolumeMesh& mesh, const Renumbering& order);

} // namespace amontons
