#pragma once

#include <cstddef>
#include <span>
#include <vector>

// Two LU decompositions without pivoting, for symmetric positive definite matrices: of a full
// matrix, and of one with a band. Plain loops, as in 2003: what is compared is the number of their
// operations.

namespace amontons {

/// A square matrix whose entries (i, j) with |i - j| > reach are 0. Stored: (2 reach + 1) x size.
class BandMatrix {
public:
    BandMatrix(int size, int reach)
        : size_(size)
        , reach_(reach)
        , values_(std::size_t(size) * std::size_t(2 * reach + 1), 0.0)
    {
    }
    int size() const { return size_; }
    int reach() const { return reach_; }
    /// Numbers stored.
    std::size_t stored() const { return values_.size(); }
    /// |i - j| <= reach
    double& operator()(int i, int j) { return values_[at(i, j)]; }
    double operator()(int i, int j) const { return values_[at(i, j)]; }

private:
    std::size_t at(int i, int j) const
    {
        return std::size_t(i) * std::size_t(2 * reach_ + 1) + std::size_t(j - i + reach_);
    }
    int size_, reach_;
    std::vector<double> values_;
};

/// A = L U in A's place, L with a unit diagonal. About 2 n m^2 operations of a reach m.
void factor_band(BandMatrix& A);
/// b <- U^-1 L^-1 b. About 4 n m operations.
void solve_band(const BandMatrix& LU, std::span<double> b);

/// A square matrix, row by row.
struct FullMatrix {
    /// Rows and columns.
    int size = 0;
    std::vector<double> values; ///< size^2
    explicit FullMatrix(int n) : size(n), values(std::size_t(n) * std::size_t(n), 0.0) {}
    double& operator()(int i, int j)
    {
        return values[std::size_t(i) * std::size_t(size) + std::size_t(j)];
    }
    double operator()(int i, int j) const
    {
        return values[std::size_t(i) * std::size_t(size) + std::size_t(j)];
    }
};

/// As of a band; about 2 n^3 / 3 and 2 n^2 operations.
void factor_full(FullMatrix& A);
/// Solves in place by the factor of factor_full().
void solve_full(const FullMatrix& LU, std::span<double> b);

} // namespace amontons
