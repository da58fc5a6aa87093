#pragma once

#include "contact/linear/block_lu.hpp"
#include "solver/linear/chain_band.hpp"
#include "solver/linear/supernodal.hpp"

#include <array>
#include <vector>

namespace amontons {

/// A x = b for a sparse A of 6x6 blocks, in one of two formats, chosen by its pattern. It has the
/// operations that pivoting::solve needs.
///
/// A chain, whose nodes are coupled with their neighbours only (rods that touch no other rod):
/// block elimination (ChainBand), repeated only from the first changed node on, with the signs of
/// its pivots. Any other pattern (rods in contact with one another): Cholesky's method where A is
/// symmetric and positive definite, else elimination without exchange of blocks, always of the
/// whole matrix.
class NodeMatrix {
public:
    /// @param coupled  pairs of nodes, in any order, also more than once; the blocks of both orders
    ///                 are there, and those of each node with itself. All are zero.
    void set_pattern(int nodes, std::vector<std::array<int, 2>> coupled);
    /// The pattern of one chain: each node with itself and its neighbours. Blocks of a chain that
    /// was as long keep their values.
    void set_chain(int nodes);

    bool guarded = true; ///< false: factor() treats every matrix as definite
    /// Number of nodes.
    int size() const { return int(start_.size()) - 1; }
    /// Only neighbours are coupled: nodes before one that has not changed need no new factors.
    bool is_chain() const { return chain_; }
    /// The block of two nodes; it must be in the pattern.
    Block6& block(int row, int col) { return block_[at(row, col)]; }
    const Block6& block(int row, int col) const { return block_[at(row, col)]; }
    /// A += s f h^T in one block, s a factor.
    void add(int row, int col, const Column6& f, const Node6& h, double s);
    /// States that blocks are added that are not symmetric.
    void set_unsymmetric() { symmetric_ = false; }

    /// (A + A^T) / 2.
    void take_symmetric_part();

    /// Sets all blocks to zero.
    void set_zero();
    /// Copies the values of a matrix of the same pattern; of a chain the blocks of nodes before
    /// `from`, and their coupling with it, are unchanged.
    void copy_values(const NodeMatrix& other, int from = 0);

    /// @param from  of a chain: nodes before it keep their earlier factors
    /// @return  0 if positive definite; of a chain the number of negative pivots, else 1 if it is
    ///          not, or not symmetric
    int factor(int from);
    /// Of a chain's last factors: see ChainBand. 1 (not known) of other matrices, 0 if not
    /// `guarded`.
    int negative_determinants() const
    {
        return !guarded ? 0 : chain_ ? band_.negative_determinants() : 1;
    }
    /// x <- A^-1 x; not finite where there is no factor.
    void solve(std::vector<Node6>& x);

private:
    std::size_t at(int row, int col) const;
    bool cholesky();
    bool is_symmetric() const;
    void analyse_elimination();
    bool eliminate();

    bool chain_ = false;
    ChainBand band_;
    std::vector<std::size_t> start_; // of each column's blocks
    std::vector<int> row_;           // of each block, ascending in a column
    std::vector<Block6> block_;
    bool symmetric_ = true;
    enum class Factor { none, cholesky, lu, failed } factor_ = Factor::none;

    bool analysed_lu_ = false, analysed_cholesky_ = false;
    bool indefinite_ = false; ///< a matrix of this pattern was
    BlockLu lu_;
    std::vector<std::array<BlockLu::Place, 4>> place_; // of each block's quarters
    SupernodalFactor supernodal_;
    Eigen::SparseMatrix<double> lower_;
};

} // namespace amontons
