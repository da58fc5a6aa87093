#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <memory>
#include <vector>

namespace amontons {

// GCC warns that a vector wider than the registers is passed in memory, which would change the ABI;
// all functions with such arguments are inlined here.
#pragma GCC diagnostic ignored "-Wpsabi"

/// Vector of 8 doubles; lanes 6 and 7 pad a column of 6 to one cache line.
typedef double Column6 __attribute__((vector_size(64), aligned(64)));

using Vec6 = Eigen::Matrix<double, 6, 1>;
using Mat6 = Eigen::Matrix<double, 6, 6>;

/// A column with all numbers s.
inline Column6 splat6(double s)
{
    return Column6{s, s, s, s, s, s, s, s};
}

/// A 6x6 block, column by column; the padding rows stay zero.
struct alignas(64) Block6 {
    Column6 column[6];

    double& operator()(int row, int col) { return reinterpret_cast<double*>(&column[col])[row]; }
    double operator()(int row, int col) const
    {
        return reinterpret_cast<const double*>(&column[col])[row];
    }
};

/// Column of 6 unknowns or right-hand sides of a node.
union alignas(64) Node6 {
    Column6 column;
    double value[8];
};

/// A x = b for a block-tridiagonal A with 6x6 blocks, by block elimination from the first
/// node to the last, without pivoting: for matrices whose symmetric part is positive definite
/// or nearly so. O(n) time and memory.
///
/// Nodes are numbered 0..size-1; only [first, size) take part, so that a chain can grow and
/// shrink at its front without a copy.
class BlockTridiagonal {
public:
    explicit BlockTridiagonal(int size);

    int size() const { return size_; }
    int first() const { return first_; }
    /// Block rows before this one are left out.
    void set_first(int first) { first_ = first; }

    /// Block of node i with itself, with the next, and of the next with it.
    Block6& diagonal(int i) { return diagonal_[i]; }
    /// Block of node i with the next.
    Block6& upper(int i) { return upper_[i]; }
    /// Block of the next node with node i.
    Block6& lower(int i) { return lower_[i]; }
    const Block6& diagonal(int i) const { return diagonal_[i]; }
    const Block6& upper(int i) const { return upper_[i]; }
    const Block6& lower(int i) const { return lower_[i]; }

    /// Sets all blocks to zero.
    void set_zero();
    /// Copies the blocks of nodes from..size-1 and the couplings behind them.
    void copy_from(const BlockTridiagonal& other, int from);

    /// Factors; blocks before node `from` keep their earlier factors.
    /// @return number of negative pivots (for a symmetric matrix: of negative eigenvalues);
    ///         a vanishing pivot counts as negative
    int factor(int from);
    /// Of the last factor(): blocks of the elimination whose determinant is negative. Unlike the
    /// pivots' signs of an unsymmetric matrix it does not depend on the axes of a node's unknowns.
    int negative_determinants() const { return odd_[static_cast<std::size_t>(size_)]; }

    /// Solves in place with the last factors.
    /// @param x  size() nodes; those before first() are not touched
    void solve(std::vector<Node6>& x) const;
    /// As solve, for a right-hand side that is zero before node `from`.
    void solve_from(std::vector<Node6>& x, int from) const;

private:
    struct Free {
        void operator()(Block6* p) const;
    };
    using Blocks = std::unique_ptr<Block6[], Free>;
    static Blocks allocate(int size);

    int size_;
    int first_ = 0;
    Blocks diagonal_, upper_, lower_;
    Blocks inverse_, eliminated_; // S_i^-1 and S_i^-1 U_i
    std::vector<int> negative_;   // negative pivots of nodes up to i
    std::vector<int> odd_;        // nodes up to i with an odd number of them
};

/// out = A x for one block.
inline Column6 multiply(const Block6& a, const Node6& x)
{
    return a.column[0] * x.value[0] + a.column[1] * x.value[1] + a.column[2] * x.value[2] +
           a.column[3] * x.value[3] + a.column[4] * x.value[4] + a.column[5] * x.value[5];
}

} // namespace amontons
