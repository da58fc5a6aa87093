#pragma once

#include "solver/large/petsc/petsc_module.hpp"

#include <vector>

// A rank's share of a solid: its nodes, and every element that has one of them. Elements at a
// border are on both sides, so that each rank fills its own rows without communication.

namespace amontons {

/// New numbers of nodes: those of one rank follow each other.
struct Partition {
    std::vector<std::int32_t> number;  ///< of each node of the mesh: its new number
    std::vector<std::int32_t> rank_of; ///< of each node of the mesh
    std::vector<std::int32_t> first;   ///< ranks + 1: first new number of each
};

/// METIS's parts of the graph of nodes, as even as they get, for the first mesh.ranks ranks; a rank
/// may have none.
/// @throws std::runtime_error  if METIS fails
Partition make_partition(const AmontonsLargeMesh& mesh, int ranks);

struct Part {
    std::int32_t all_nodes = 0;       ///< of the whole mesh
    std::int32_t first = 0, own = 0;  ///< new numbers of this rank's nodes
    std::vector<std::int32_t> number; ///< new numbers of the nodes that are here, ascending
    std::vector<double> places;       ///< 3 of each [m]
    std::vector<std::int32_t> held;   ///< of each: bits of its held axes
    std::vector<std::int32_t> kind;   ///< of the blocks of elements
    std::vector<std::int32_t> count;  ///< of each block: its elements
    std::vector<std::int32_t> nodes;  ///< of the elements, as places in `number`
    std::vector<double> material;     ///< E, nu, density, of_mass, of_stiffness
};

/// The parts of all ranks.
std::vector<Part> make_parts(const AmontonsLargeMesh& mesh, const Partition& partition);

/// The rows of a rank, three of each node, as PETSc takes them.
struct OwnRows {
    std::vector<std::int32_t> start, column; ///< new numbers of degrees of freedom
    std::vector<double> value;
};
/// Rows of the stiffness of a rank's own nodes [N/m].
/// @throws std::runtime_error  more than 2^31 entries
OwnRows assemble_rows(const Part& part);

} // namespace amontons
