#pragma once

#include "mesh/base/types.hpp"

#include <Eigen/SparseCore>

#include <functional>
#include <span>
#include <variant>
#include <vector>

namespace amontons {

/// W by its action r -> W r and its diagonal blocks.
struct MatrixFreeDelassus {
    /// Rows of W, three for each contact with friction.
    Eigen::Index rows = 0;
    /// out = W r; both have `rows` entries, out is sized already. Must not depend on state.
    std::function<void(const Eigen::VectorXd& r, Eigen::VectorXd& out)> apply;
    Eigen::SparseMatrix<double> blocks; ///< rows x rows: the contacts' own blocks, nothing else
};

/// W by its bodies: W = diag(compliance) + sum of G^T G over them, where G = L^-1 C of a body with
/// the matrix A = L L^T and its contacts' rows C. G of a rigid body has 6 rows for any number of
/// contacts: for piles far less memory than W.
struct DelassusOfBodies {
    /// One body: its rows of W and its share of W.
    struct Part {
        std::vector<int> rows; ///< of W, ascending; those of a contact follow each other
        Eigen::MatrixXd G;     ///< k x as many columns, in units whose product is that of W
    };
    std::vector<Part> parts;
    Eigen::VectorXd compliance; ///< what is added to the diagonal, rows

    /// Where a row of W is among the columns of a part.
    struct Place {
        /// Number of the part, and the column in its G.
        int part = 0, column = 0;
    };
    /// Where a row of W is. Known once a Delassus has been made of the parts.
    std::span<const Place> places(Eigen::Index row) const
    {
        const auto k = static_cast<std::size_t>(row);
        return std::span(place).subspan(static_cast<std::size_t>(first[k]),
                                        static_cast<std::size_t>(first[k + 1] - first[k]));
    }
    std::vector<int> first;   ///< of each row: its first entry in `place`; rows + 1
    std::vector<Place> place; ///< by rows
};

/// The Delassus operator W of a contact problem, rows x rows [m/N or 1/kg], in one of four forms.
/// Matrices convert implicitly; no form is ever made dense.
class Delassus {
public:
    using Sparse = Eigen::SparseMatrix<double>; ///< by columns
    using Block = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, 3, 3>;

    Delassus() = default;
    Delassus(Eigen::MatrixXd W) : form_(std::move(W)) {}
    Delassus(Sparse W); ///< compressed and, where its columns are not, sorted
    Delassus(MatrixFreeDelassus W) : form_(std::move(W)) {}
    Delassus(DelassusOfBodies W); ///< and the places of its rows

    /// True if W is stored as a dense matrix.
    bool is_dense() const { return std::holds_alternative<Eigen::MatrixXd>(form_); }
    /// True if W is stored as a sparse matrix.
    bool is_sparse() const { return std::holds_alternative<Sparse>(form_); }
    /// True if W is known by its products alone.
    bool is_matrix_free() const { return std::holds_alternative<MatrixFreeDelassus>(form_); }
    /// True if W is known by its bodies.
    bool is_of_bodies() const { return std::holds_alternative<DelassusOfBodies>(form_); }

    /// @throws std::bad_variant_access  if W has another form
    const Eigen::MatrixXd& dense() const { return std::get<Eigen::MatrixXd>(form_); }
    Eigen::MatrixXd& dense() { return std::get<Eigen::MatrixXd>(form_); }
    /// The sparse matrix; only if is_sparse().
    const Sparse& sparse() const { return std::get<Sparse>(form_); }
    /// The products; only if is_matrix_free().
    const MatrixFreeDelassus& matrix_free() const { return std::get<MatrixFreeDelassus>(form_); }
    /// The bodies; only if is_of_bodies().
    const DelassusOfBodies& of_bodies() const { return std::get<DelassusOfBodies>(form_); }

    /// A sparse W, or one of bodies summed up: for what is computed once.
    Sparse as_sparse() const;

    /// Number of rows.
    Eigen::Index rows() const;
    /// Number of columns, that of rows.
    Eigen::Index cols() const;

    /// out = W r; out is resized. One product: 2 flops for each stored number; none for r = 0.
    void apply(const Eigen::VectorXd& r, Eigen::VectorXd& out) const;
    /// out = W r + q with all sums in twice the digits of a double, rounded once: u to its last
    /// digit. A matrix-free W gives no more than its product.
    void apply_exactly(const Eigen::VectorXd& r, const Eigen::VectorXd& q,
                       Eigen::VectorXd& out) const;
    /// |W| r with r >= 0: the size of the terms in W r. Of a matrix-free W only a bound is
    /// available: sqrt(W_ii) (sum_j sqrt(W_jj) r_j), which bounds them for a semidefinite W; of
    /// bodies |G|^T |G| r.
    Eigen::VectorXd absolute_times(const Eigen::VectorXd& r) const;
    /// W^T r. A matrix-free W is taken as symmetric here.
    Eigen::VectorXd transpose_times(const Eigen::VectorXd& r) const;
    /// W(chosen, chosen) as a dense matrix; a matrix-free W costs a product per column.
    Eigen::MatrixXd part(const std::vector<Eigen::Index>& chosen) const;
    /// The block of a contact, size <= 3; no allocation.
    Block block(Eigen::Index first_row, int size) const;
    /// The diagonal of W, rows [m/N].
    Eigen::VectorXd diagonal() const;
    /// |W - W^T| / |W| in the Frobenius norm, 0 for W = 0, not finite if W is not [-].
    /// Matrix-free: estimated from two fixed products.
    double asymmetry() const;

    /// W r. A friend, so that products of plain matrices do not see it.
    friend Eigen::VectorXd operator*(const Delassus& W, const Eigen::VectorXd& r)
    {
        Eigen::VectorXd out;
        W.apply(r, out);
        return out;
    }

private:
    std::variant<Eigen::MatrixXd, Sparse, MatrixFreeDelassus, DelassusOfBodies> form_;
};

} // namespace amontons
