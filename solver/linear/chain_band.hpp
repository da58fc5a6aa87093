#pragma once

#include "solver/linear/block_tridiagonal.hpp"

#include <vector>

namespace amontons {

/// LU decomposition of a block-tridiagonal matrix one unknown after the other, without pivoting.
/// BlockTridiagonal multiplies by inverses of its blocks, and so its error grows with the square of
/// their condition number (stretching against bending: 1e11 in a rod 1e5 radii long). The error of
/// this one grows with the condition number of the matrix only, if that is symmetric and positive
/// definite. O(n) time and memory.
class ChainBand {
public:
    /// Blocks of a chain's nodes: of node i with itself, with the next and of the next with it,
    /// each so many blocks behind that of node i - 1.
    struct Blocks {
        const Block6* diagonal; ///< of the first node with itself
        const Block6* upper;    ///< of the first node with the next
        const Block6* lower;    ///< of the second node with the first
        int stride = 1;         ///< from a node's block to the next node's [blocks]
        int size = 0;           ///< number of nodes
    };
    /// @param first  nodes before it take no part
    /// @return  number of pivots that are not positive (of a symmetric matrix: of eigenvalues)
    int factor(const BlockTridiagonal& chain, int first);
    /// @param from  nodes before it keep their earlier factors: neither their blocks nor those that
    ///              couple them with `from` have changed
    int factor(const Blocks& chain, int first, int from);
    /// Of the last factor(): nodes whose pivots have a negative product. Unlike their signs, of an
    /// unsymmetric matrix, it does not depend on the axes of a node's unknowns.
    int negative_determinants() const { return odd_.empty() ? 0 : odd_.back(); }
    /// Solves in place with the last factors.
    void solve(std::vector<Node6>& x) const;

private:
    int first_ = 0, rows_ = 0;
    std::vector<double> rows_of_band_; // kWidth numbers a row
    std::vector<int> negative_, odd_;  // pivots of nodes before i, and nodes with an odd number
};

} // namespace amontons
