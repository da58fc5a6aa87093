#pragma once

#include "solver/linear/ordering.hpp"

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <array>
#include <functional>
#include <memory>
#include <span>
#include <vector>

namespace amontons {

/// How a sparse factor is made.
struct SupernodalOptions {
    Ordering ordering = Ordering::automatic;
    /// A permutation of the nodes, first to be eliminated first; empty: found by `ordering`. May
    /// name nodes that have no degree of freedom here, so that one order serves a mesh whatever is
    /// prescribed.
    std::vector<std::int32_t> node_order;
    /// Columns up to which supernodes are joined at the cost of some zeros; CHOLMOD's own are 4,
    /// 16, 48. Wider ones suit large unstructured meshes (docs/theory/compliance.md).
    std::array<std::int32_t, 3> relax{16, 64, 192};
    /// Most columns of one supernode: wider ones are cut, as half of their square blocks are zeros
    /// that take memory, and updates of a whole one need as much again.
    std::int32_t widest = 512;
    /// Threads of BLAS; results may differ in the last bits between numbers of threads.
    int threads = 1;
};

/// Result of a factorisation; converts to true if it succeeded.
struct FactorResult {
    /// True if all pivots were numbers > 0.
    bool positive_definite = false;
    /// The degree of freedom whose pivot was not > 0, or -1. The cause lies there or in degrees of
    /// freedom coupled with it.
    std::int64_t failed_dof = -1;
    explicit operator bool() const { return positive_definite; }
};

/// The arrays of a factor, for storing it; their layout is in solver/linear/supernodes.hpp.
template <class Int, class Real> struct FactorArraysOf {
    /// Order, supernodes and their rows, as CHOLMOD stores them.
    std::span<Int> permutation, first, row_start, start, row;
    /// Numbers of all supernodes, column by column.
    std::span<Real> value;
};
/// The arrays of a double factor.
using FactorArrays = FactorArraysOf<const std::int32_t, const double>;
using FactorSpace = FactorArraysOf<std::int32_t, double>; ///< to be filled
struct FactorSizes {
    std::int64_t rows = 0;        ///< n
    std::int64_t supernodes = 0;  ///< `first`, `row_start` and `start` have one more
    std::int64_t listed_rows = 0; ///< of all supernodes
    std::int64_t entries = 0;     ///< of L, as stored
};

/// P A P^T = L L^T of a sparse symmetric positive definite matrix, in dense blocks (supernodes).
///
/// Only the lower triangle of A (row >= column) is read; the upper one may be there or not. Order
/// and pattern are found once, the numbers again and again. At most 2^31 - 1 entries in L (16 GiB).
/// One object serves one thread at a time: what is const works in its workspace too.
/// Source: CHOLMOD (Chen, Davis, Hager & Rajamanickam, ACM TOMS 35 (2008) 22); compliance():
/// docs/theory/compliance.md.
class SupernodalFactor {
public:
    SupernodalFactor();
    ~SupernodalFactor();
    SupernodalFactor(SupernodalFactor&&) noexcept;
    SupernodalFactor& operator=(SupernodalFactor&&) noexcept;

    /// Finds the order and the pattern of L. Degrees of freedom of one node stay together.
    /// @param A            n x n, compressed; its values do not matter
    /// @param node_of_dof  n, each >= 0
    /// @throws std::runtime_error  if L would be too large; std::bad_alloc
    void analyse(const Eigen::SparseMatrix<double>& A, std::span<const std::int32_t> node_of_dof,
                 const SupernodalOptions& options = {});

    /// Factors a matrix of the analysed pattern. The first call reserves L; later ones only the
    /// dense workspace of the largest update.
    /// @throws std::bad_alloc
    FactorResult factor(const Eigen::SparseMatrix<double>& A);
    /// The same, from the values alone: those of A, both triangles if A had both. Not after
    /// restore().
    FactorResult refactor(std::span<const double> values);

    /// First half of factor(): copies the values of A, which may then be freed before L is
    /// allocated.
    void take(const Eigen::SparseMatrix<double>& A);
    /// The same with entry k of A = values[where[k]]: for A a part of a larger matrix, so that A
    /// itself need not be formed. Not after restore() or drop_matrix().
    void take(std::span<const double> values, std::span<const std::int32_t> where);
    /// Second half of factor(): factors the values given to take().
    FactorResult factor_taken();
    /// Frees the copy of the matrix, about the size of A's lower triangle: for factors that are
    /// kept. Another matrix of the pattern may still be factored, but not by refactor().
    void drop_matrix();

    /// X <- A^-1 X, n x any number.
    void solve(Eigen::Ref<Eigen::MatrixXd> X) const;
    /// A^-1 b.
    Eigen::VectorXd solved(const Eigen::VectorXd& b) const;

    /// W = C^T A^-1 C, symmetric to the last bit. Only the part of L that C reaches is worked on,
    /// and L^-1 C is never there as a whole.
    /// @param C  n x any number
    /// @param W  resized
    void compliance(const Eigen::SparseMatrix<double>& C, Eigen::MatrixXd& W) const;

    /// Entries (rows, columns) of A^-1. Each block of 48 columns is the work of one thread, so that
    /// any number of them gives the same bits.
    /// @param out  rows x columns
    void inverse_part(std::span<const std::int32_t> rows, std::span<const std::int32_t> columns,
                      Eigen::Ref<Eigen::MatrixXd> out, int threads = 1) const;

    /// Floating-point operations of compliance(), and of inverse_part() for each column that is
    /// among the rows (an upper bound).
    double compliance_flops(const Eigen::SparseMatrix<double>& C) const;
    /// Operations of inverse_part() for these rows.
    double inverse_part_flops(std::span<const std::int32_t> rows) const;

    /// The arrays of the factor, valid until it changes. Only if is_factored().
    FactorArrays arrays() const;
    /// Makes a factor of arrays kept before, without analysis. Another matrix of the same pattern
    /// may be factored afterwards.
    /// @param sizes  each > 0 and < 2^31
    /// @param fill   writes the arrays into the spaces it is given; false if it cannot
    /// @returns false if `fill` does or the arrays are no factor; is_factored() is then false
    bool restore(const FactorSizes& sizes, const std::function<bool(const FactorSpace&)>& fill,
                 const SupernodalOptions& options = {});

    Eigen::Index size() const; ///< n
    /// True after a successful factor().
    bool is_factored() const;
    /// The dof at each place of the order.
    std::span<const std::int32_t> permutation() const;
    std::int64_t stored_entries() const; ///< of L, zeros of the blocks included
    double flops() const;                ///< of one factor()
    /// (smallest / largest pivot), no less than the reciprocal condition number of A: near 1e-16,
    /// A is singular to the last digit. 0 without a factor.
    double pivot_ratio() const;

private:
    struct Parts;
    std::unique_ptr<Parts> parts_;
};

} // namespace amontons
