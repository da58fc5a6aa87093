#pragma once

#include "mesh/neighbours.hpp"

#include <Eigen/SparseCore>

namespace amontons {

/// How the unknowns of a sparse matrix are ordered before it is factored.
enum class Ordering {
    automatic,         ///< nested dissection from kDissectionNodes on, minimum degree below
    nested_dissection, ///< METIS_NodeND (Karypis & Kumar)
    minimum_degree,    ///< AMD (Amestoy, Davis & Duff)
    natural,           ///< as they are
};

/// Number of nodes at which ordering and one factorisation together take the same time by both:
/// AMD orders twice as fast, its factor takes 1.4 times as long here and 2 times at 9000 nodes
/// (docs/theory/compliance.md).
constexpr std::int32_t kDissectionNodes = 2000;

/// For each node those that the matrix couples with it (degrees of freedom of both share an
/// entry), itself left out.
/// @param A            square; its pattern is read as if it were symmetric
/// @param node_of_dof  one of each row, >= 0; node numbers need not be dense
Lists node_graph(const Eigen::SparseMatrix<double>& A, std::span<const std::int32_t> node_of_dof);

/// An order of elimination with little fill: a permutation of the graph's nodes, first to last.
/// The same for the same graph, always.
/// @throws std::runtime_error  if METIS or AMD fails (not enough memory)
std::vector<std::int32_t> elimination_order(const Lists& graph,
                                            Ordering method = Ordering::automatic);

} // namespace amontons
