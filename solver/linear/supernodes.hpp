#pragma once

#include <Eigen/SparseCore>
#include <cstdint>
#include <span>
#include <vector>

// The structure of a supernodal factor, and operations on it. A supernode is a run of columns
// of L with (nearly) the same rows below; it is stored as one dense block by columns:
//
//      width
//     +------+
//     |\     |  its own columns (only the lower triangle means anything)
//     | \    |  height
//     +------+
//     |      |  rows below, which belong to its ancestors in the elimination tree
//     +------+
//
// Here numbers are those of the elimination order.

namespace amontons {

/// Columns of L with a common set of rows below.
struct Supernodes {
    std::span<const std::int32_t> first;     ///< supernodes + 1: first column
    std::span<const std::int32_t> row_start; ///< supernodes + 1: where its rows begin in `row`
    std::span<const std::int32_t> start;     ///< supernodes + 1: where its block begins in `value`
    std::span<const std::int32_t> row;       ///< its own columns, then those below, ascending
    std::span<const double> value;

    std::span<const std::int32_t> of_column; ///< of each column: its supernode
    std::span<const std::int32_t> parent;    ///< in the elimination tree, or -1

    /// Number of supernodes.
    std::int32_t count() const { return std::int32_t(first.size()) - 1; }
    /// Number of unknowns.
    std::int32_t size() const { return first.empty() ? 0 : first.back(); }
    /// Columns of supernode s.
    int width(std::int32_t s) const { return first[std::size_t(s) + 1] - first[std::size_t(s)]; }
    /// Rows of supernode s, its square block included.
    int height(std::int32_t s) const
    {
        return row_start[std::size_t(s) + 1] - row_start[std::size_t(s)];
    }
    /// Its numbers, column by column.
    const double* block(std::int32_t s) const { return value.data() + start[std::size_t(s)]; }
    /// Its rows below the square block.
    const std::int32_t* rows_below(std::int32_t s) const
    {
        return row.data() + row_start[std::size_t(s)] + width(s);
    }
};

/// Whether the arrays are those of a factor, the tree apart: every index in range, blocks without
/// gaps, rows ascending, and what lies below a supernode and its parent's columns is among its
/// parent's rows. For factors that come from outside; O(rows).
bool is_consistent(const Supernodes& L);

/// Right-hand sides, row by row, so that the rows of a supernode are one block.
using RowBlock = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Y <- L^-1 Y over the supernodes with taking_part (all if empty), which must hold every ancestor
/// of a row that is not 0.
/// @param Y     size x k
/// @param work  grows as needed
void forward(const Supernodes& L, std::span<const char> taking_part, RowBlock& Y,
             std::vector<double>& work);
/// Y <- L^-T Y; rows of supernodes that take no part are not touched, and not read by the others if
/// with each its ancestors take part.
void backward(const Supernodes& L, std::span<const char> taking_part, RowBlock& Y,
              std::vector<double>& work);

/// W = C^T (L L^T)^-1 C. C by columns, rows in the elimination order; W is symmetric to the last
/// bit. Derivation: docs/theory/compliance.md.
void tree_compliance(const Supernodes& L, const Eigen::SparseMatrix<double>& C,
                     std::span<const std::int32_t> place, Eigen::MatrixXd& W);

} // namespace amontons
