#include "contact/solvers/shifted_delassus.hpp"

#include <algorithm>
#include <cmath>

namespace amontons {
namespace {

// GMRES ends here: a Newton direction needs no more.
constexpr double kGmresTolerance = 1e-6;
constexpr int kGmresSteps = 200;

} // namespace

ShiftedDelassus::ShiftedDelassus(const SolverWork& work)
    : problem_(work.problem)
    , columns_(work.columns)
    , scale_(work.scale)
{
    if (!problem_.W.is_sparse()) return;
    std::vector<std::size_t> start{0};
    std::vector<int> neighbour;
    for (int i = 0; i < contact_count(problem_); ++i) {
        neighbour.insert(neighbour.end(), columns_.neighbours_begin(i), columns_.neighbours_end(i));
        start.push_back(neighbour.size());
    }
    sparse_.analyse(start, neighbour);
    for (int j = 0; j < contact_count(problem_); ++j)
        for (const int* i = columns_.neighbours_begin(j); i != columns_.neighbours_end(j); ++i)
            places_.push_back(sparse_.place(*i, j));
}

double ShiftedDelassus::cost(Eigen::Index closed_rows) const
{
    if (problem_.W.is_sparse()) return sparse_.cost();
    const auto m = static_cast<double>(closed_rows);
    return 0.016 * m * m * m + 1.5 * m * m;
}

bool ShiftedDelassus::factorise(const std::vector<LinearisedLaw>& law, double shift)
{
    law_ = &law;
    shift_ = shift;
    if (problem_.W.is_sparse()) return factorise_sparse();
    if (problem_.W.is_dense())
        factorise_dense();
    else
        factorise_own_blocks();
    return true;
}

void ShiftedDelassus::solve(Eigen::VectorXd& x) const
{
    if (problem_.W.is_sparse())
        solve_sparse(x);
    else if (problem_.W.is_dense())
        solve_dense(x);
    else
        solve_by_gmres(x);
}

// ---- dense

void ShiftedDelassus::factorise_dense()
{
    const Eigen::MatrixXd& W = problem_.W.dense();
    closed_.clear();
    for (int i = 0; i < contact_count(problem_); ++i)
        if (!open(i))
            for (int a = 0; a < columns_.rows(i); ++a)
                closed_.push_back(columns_.first_row(i) + a);
    const auto m = static_cast<Eigen::Index>(closed_.size());
    matrix_.resize(W.rows(), W.cols());
    Eigen::Index k = 0;
    for (int j = 0; j < contact_count(problem_); ++j) {
        if (open(j)) continue;
        const LinearisedLaw& law = (*law_)[static_cast<std::size_t>(j)];
        const int rows = columns_.rows(j);
        for (int b = 0; b < rows; ++b) {
            const int column = columns_.first_row(j) + b;
            const double* source = W.data() + column * W.rows();
            double* target = matrix_.data() + (k + b) * matrix_.rows();
            for (Eigen::Index i = 0; i < m; ++i) {
                const int row = closed_[static_cast<std::size_t>(i)];
                target[i] = source[row] * scale_[row] * scale_[column];
            }
        }
        matrix_.block(k, k, rows, rows) += law.D.topLeftCorner(rows, rows);
        matrix_.diagonal().segment(k, rows).array() += shift_;
        k += rows;
    }
    dense_.reset();
    if (m > 0) {
        Eigen::Ref<Eigen::MatrixXd> corner(matrix_.topLeftCorner(m, m));
        dense_.emplace(corner);
    }
}

void ShiftedDelassus::solve_dense(Eigen::VectorXd& x) const
{
    if (!dense_) return;
    const Eigen::VectorXd b = x(closed_);
    const Eigen::VectorXd solution = dense_->solve(b);
    x(closed_) = solution;
}

// ---- sparse

bool ShiftedDelassus::factorise_sparse()
{
    sparse_.clear();
    Mat3 block;
    for (int j = 0; j < contact_count(problem_); ++j) {
        const LinearisedLaw& law = (*law_)[static_cast<std::size_t>(j)];
        if (law.open) {
            sparse_.add(j, j, Mat3::Identity());
            continue;
        }
        const int columns = columns_.rows(j);
        const double own = scale_[columns_.first_row(j)];
        const BlockLu::Place* const places =
            places_.data() + (columns_.neighbours_begin(j) - columns_.neighbours_begin(0));
        int k = 0;
        for (const int* i = columns_.neighbours_begin(j); i != columns_.neighbours_end(j);
             ++i, ++k) {
            if (open(*i)) continue;
            const int rows = columns_.rows(*i);
            const double scale = own * scale_[columns_.first_row(*i)];
            const double* value = columns_.neighbour_block(j, k);
            block.setZero();
            for (int c = 0; c < columns; ++c)
                for (int a = 0; a < rows; ++a)
                    block(a, c) = scale * *value++;
            if (*i == j) {
                block.topLeftCorner(rows, rows) += law.D.topLeftCorner(rows, rows);
                block.diagonal().array() += shift_;
                for (int a = rows; a < 3; ++a)
                    block(a, a) = 1; // a contact of one row is padded
            }
            sparse_.add_at(places[k], block);
        }
    }
    return sparse_.factorise();
}

void ShiftedDelassus::solve_sparse(Eigen::VectorXd& x) const
{
    const int n = contact_count(problem_);
    Eigen::VectorXd padded = Eigen::VectorXd::Zero(3 * n), correction = padded;
    const auto load = [&](const Eigen::VectorXd& from) {
        padded.setZero();
        for (int i = 0; i < n; ++i)
            if (!open(i))
                padded.segment(3 * i, columns_.rows(i)) =
                    from.segment(columns_.first_row(i), columns_.rows(i));
    };
    Eigen::VectorXd solution = x, residual(x.size()), product(x.size());
    load(x);
    sparse_.solve(padded);
    for (int i = 0; i < n; ++i)
        if (!open(i))
            solution.segment(columns_.first_row(i), columns_.rows(i)) =
                padded.segment(3 * i, columns_.rows(i));
    // No pivoting among blocks: one step of refinement pays for what that loses.
    multiply(solution, product);
    residual = x - product;
    load(residual);
    sparse_.solve(padded);
    for (int i = 0; i < n; ++i)
        if (!open(i))
            x.segment(columns_.first_row(i), columns_.rows(i)) =
                solution.segment(columns_.first_row(i), columns_.rows(i)) +
                padded.segment(3 * i, columns_.rows(i));
}

// ---- any form

void ShiftedDelassus::multiply(const Eigen::VectorXd& x, Eigen::VectorXd& y) const
{
    Eigen::VectorXd scaled = x.cwiseProduct(scale_);
    for (int i = 0; i < contact_count(problem_); ++i)
        if (open(i)) scaled.segment(columns_.first_row(i), columns_.rows(i)).setZero();
    problem_.W.apply(scaled, y);
    y.array() *= scale_.array();
    for (int i = 0; i < contact_count(problem_); ++i) {
        const int row = columns_.first_row(i), rows = columns_.rows(i);
        const LinearisedLaw& law = (*law_)[static_cast<std::size_t>(i)];
        if (law.open)
            y.segment(row, rows).setZero();
        else
            y.segment(row, rows) += law.D.topLeftCorner(rows, rows) * x.segment(row, rows) +
                                    shift_ * x.segment(row, rows);
    }
}

// ---- matrix-free

void ShiftedDelassus::factorise_own_blocks()
{
    const auto n = static_cast<std::size_t>(contact_count(problem_));
    preconditioner_.assign(n, Mat3::Identity());
    for (int i = 0; i < contact_count(problem_); ++i) {
        if (open(i)) continue;
        const int row = columns_.first_row(i), rows = columns_.rows(i);
        Mat3 block = Mat3::Identity();
        block.topLeftCorner(rows, rows) =
            scale_[row] * scale_[row] * problem_.W.block(row, rows) +
            (*law_)[static_cast<std::size_t>(i)].D.topLeftCorner(rows, rows);
        block.diagonal().head(rows).array() += shift_;
        const Mat3 inverse = block.inverse();
        if (inverse.allFinite()) preconditioner_[static_cast<std::size_t>(i)] = inverse;
    }
}

void ShiftedDelassus::solve_by_gmres(Eigen::VectorXd& x) const
{
    // GMRES on (matrix)(preconditioner) y = b, x = (preconditioner) y.
    const Eigen::Index rows = x.size();
    const auto precondition = [&](const Eigen::VectorXd& from) {
        Eigen::VectorXd to = Eigen::VectorXd::Zero(rows);
        for (int i = 0; i < contact_count(problem_); ++i) {
            const int row = columns_.first_row(i), size = columns_.rows(i);
            if (!open(i))
                to.segment(row, size) =
                    preconditioner_[static_cast<std::size_t>(i)].topLeftCorner(size, size) *
                    from.segment(row, size);
        }
        return to;
    };
    Eigen::VectorXd b = x;
    for (int i = 0; i < contact_count(problem_); ++i)
        if (open(i)) b.segment(columns_.first_row(i), columns_.rows(i)).setZero();
    const double size = b.norm();
    if (size == 0) {
        for (int i = 0; i < contact_count(problem_); ++i)
            if (!open(i)) x.segment(columns_.first_row(i), columns_.rows(i)).setZero();
        return;
    }
    const int steps = static_cast<int>(std::min<Eigen::Index>(kGmresSteps, rows));
    Eigen::MatrixXd basis(rows, steps + 1), H = Eigen::MatrixXd::Zero(steps + 1, steps);
    Eigen::VectorXd rotated = Eigen::VectorXd::Zero(steps + 1), cosine(steps), sine(steps);
    Eigen::VectorXd product(rows);
    basis.col(0) = b / size;
    rotated[0] = size;
    int k = 0;
    while (k < steps) {
        multiply(precondition(basis.col(k)), product);
        for (int i = 0; i <= k; ++i) {
            H(i, k) = basis.col(i).dot(product);
            product -= H(i, k) * basis.col(i);
        }
        H(k + 1, k) = product.norm();
        if (H(k + 1, k) > 0) basis.col(k + 1) = product / H(k + 1, k);
        for (int i = 0; i < k; ++i) {
            const double upper = cosine[i] * H(i, k) + sine[i] * H(i + 1, k);
            H(i + 1, k) = -sine[i] * H(i, k) + cosine[i] * H(i + 1, k);
            H(i, k) = upper;
        }
        const double length = std::hypot(H(k, k), H(k + 1, k));
        if (!(length > 0)) break;
        const bool closed = H(k + 1, k) == 0;
        cosine[k] = H(k, k) / length;
        sine[k] = H(k + 1, k) / length;
        H(k, k) = length;
        rotated[k + 1] = -sine[k] * rotated[k];
        rotated[k] *= cosine[k];
        ++k;
        if (closed || std::abs(rotated[k]) <= kGmresTolerance * size) break;
    }
    const Eigen::VectorXd y =
        H.topLeftCorner(k, k).triangularView<Eigen::Upper>().solve(rotated.head(k));
    const Eigen::VectorXd solution = precondition(basis.leftCols(k) * y);
    for (int i = 0; i < contact_count(problem_); ++i)
        if (!open(i)) {
            const int row = columns_.first_row(i), count = columns_.rows(i);
            x.segment(row, count) = solution.segment(row, count);
        }
}

} // namespace amontons
