#pragma once

#include "mesh/base/types.hpp"

#include <Eigen/LU>

#include <vector>

namespace amontons {

/// A = L U for a matrix of 3 x 3 blocks, without exchanging blocks.
///
/// For W + D with W semidefinite and D's blocks of positive definite symmetric part: every pivot
/// is then regular. Other matrices may fail, or lose digits: examine the residual.
/// The pattern is analysed once: minimum degree, then columns of equal or nearly equal pattern are
/// joined to supernodes, which are dense panels; rows are exchanged only inside the diagonal block
/// of one. A new factor with the same pattern allocates nothing of its own.
/// One object serves one thread at a time: solve() too works in its workspace.
class BlockLu {
public:
    /// Where a block of the matrix lies: entry (a, c) is value[offset + a row_step + c
    /// column_step].
    struct Place {
        /// Of the block's first number in the array of values.
        std::size_t offset = 0;
        /// Distance of neighbouring rows and columns in that array.
        int row_step = 0, column_step = 0;
    };

    /// @param start, neighbour  the pattern by columns: block rows of column j are
    ///                          neighbour[start[j]] .. neighbour[start[j + 1] - 1]; what is
    ///                          missing for it to be symmetric is added
    void analyse(const std::vector<std::size_t>& start, const std::vector<int>& neighbour);

    /// Opens a new matrix of the analysed pattern, all zero. The first one takes the memory.
    void clear();
    /// A(i, j) += block; (i, j) must be in the pattern.
    void add(int i, int j, const Mat3& block) { add_at(place(i, j), block); }
    /// The place of (i, j), which must be in the pattern; valid until the next analyse().
    Place place(int i, int j) const;
    /// What add() does, without the search.
    void add_at(const Place& place, const Mat3& block)
    {
        double* target = value_.data() + place.offset;
        for (int c = 0; c < 3; ++c)
            for (int a = 0; a < 3; ++a)
                target[a * place.row_step + c * place.column_step] += block(a, c);
    }
    /// @returns false if a pivot is zero or not finite
    bool factorise();
    /// x <- A^-1 x, 3 n.
    void solve(Eigen::VectorXd& x) const;
    /// C^T A^-1 C for a C with few rows other than zero: all its columns at once, and only along
    /// the branches of the elimination tree that lead from those rows to its root.
    /// @param blocks  block rows of C that may be other than zero, each once
    /// @param C       3 rows for each of them
    Eigen::MatrixXd between(const std::vector<int>& blocks, const Eigen::MatrixXd& C) const;

    /// Blocks of L, the diagonal blocks of the supernodes included.
    std::size_t fill() const { return fill_; }
    /// What one factorise() takes [ns on one core of 2024 with AVX-512]: an estimate from the
    /// sizes of the supernodes; 0.7 to 2.2 times what was measured on seven problems.
    double cost() const { return cost_; }

private:
    // Columns first .. first + width - 1 of the factor, and the block rows below them. In value_:
    // [diagonal block; L] from `panel`, 3 (width + below) x 3 width; then U^T, 3 below x 3 width.
    struct Supernode {
        int first = 0, width = 0, below = 0;
        std::size_t panel = 0;   // in value_
        std::size_t inverse = 0; // of the diagonal block, in inverse_
        std::size_t row = 0;     // first of its rows below, in row_
        int dense = -1;          // in dense_, if it is wide
        int lower_stride() const { return 3 * (width + below); }
        int upper_stride() const { return 3 * below; }
        std::size_t lower() const { return panel + 3 * static_cast<std::size_t>(width); }
        std::size_t upper() const
        {
            return panel +
                   9 * static_cast<std::size_t>(width) * static_cast<std::size_t>(width + below);
        }
    };
    // Rows begin .. end - 1 of supernode `source` are columns of the one it updates.
    struct Update {
        int source, begin, end;
    };
    /// From supernodes in order of elimination, numbered as in order_, to the final order_.
    void lay_out(const std::vector<std::vector<int>>& columns,
                 const std::vector<const std::vector<int>*>& rows);
    void apply(const Update& update, const Supernode& target);
    bool invert(const Supernode& s);
    void scale_panel(const Supernode& s);
    void divide(const Supernode& s, double* y) const;
    Eigen::Map<const Eigen::MatrixXd> inverse_of(const Supernode& s) const
    {
        return {inverse_.data() + s.inverse, 3 * s.width, 3 * s.width};
    }

    int n_ = 0;
    std::size_t fill_ = 0;
    double cost_ = 0;
    std::vector<int> order_, place_; // order_[k]: block that is eliminated k-th; its inverse
    std::vector<Supernode> supernodes_;
    std::vector<int> supernode_of_; // each column
    std::vector<int> row_;          // rows below, ascending in each supernode
    std::vector<Update> updates_;   // by target: from first_update_[target]
    std::vector<std::size_t> first_update_;
    std::size_t values_ = 0, inverses_ = 0; // numbers in value_ and inverse_
    std::vector<double> value_, inverse_;
    std::vector<Eigen::PartialPivLU<Eigen::MatrixXd>> dense_; // of wide diagonal blocks
    std::vector<int> at_, part_at_;        // workspace: places of rows in the supernode at hand
    std::vector<double> scratch_;          // workspace: products and copies of panels
    mutable std::vector<double> x_, part_; // workspace: right-hand side in order_, rows of a panel
};

} // namespace amontons
