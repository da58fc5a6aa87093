#include "contact/solvers/shifted_delassus.hpp"

#include <algorithm>
#include <cmath>

namespace amontons {
namespace {

// GMRES ends here: a Newton direction needs no more.
constexpr double kGmresTolerance = 1e-6;
constexpr int kGmresSteps = 200;
// Refinement of a factor without pivoting ends when it is this good, or no longer gets better.
constexpr double kRefined = 1e-9, kRefining = 0.5;
constexpr int kRefinements = 6;
/// Not good enough for a Newton direction: a dense factor, which pivots, is taken from then on...
constexpr double kPoor = 1;
/// ... up to this many rows.
constexpr Eigen::Index kDistrusted = 600;

} // namespace

ShiftedDelassus::ShiftedDelassus(const SolverWork& work)
    : problem_(work.problem)
    , columns_(work.columns)
    , scale_(work.scale)
{
}

void ShiftedDelassus::analyse()
{
    if (analysed_ || !problem_.W.is_sparse()) return;
    analysed_ = true;
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

namespace {

double dense_cost(Eigen::Index rows)
{
    const auto m = static_cast<double>(rows);
    return 0.016 * m * m * m + 1.5 * m * m;
}

} // namespace

double ShiftedDelassus::cost(Eigen::Index closed_rows)
{
    analyse();
    if (problem_.W.is_matrix_free()) return 0;
    if (problem_.W.is_dense()) return dense_cost(closed_rows);
    // Filling in and refining cost as much as small factors do.
    const double whole = 1.3 * sparse_.cost() + 100 * static_cast<double>(columns_.blocks());
    return std::min(whole, dense_cost(closed_rows));
}

bool ShiftedDelassus::factorise(const std::vector<LinearisedLaw>& law, double shift)
{
    analyse();
    law_ = &law;
    shift_ = shift;
    if (problem_.W.is_matrix_free()) {
        factorise_own_blocks();
        return true;
    }
    closed_.clear();
    for (int i = 0; i < contact_count(problem_); ++i)
        if (!open(i))
            for (int a = 0; a < columns_.rows(i); ++a)
                closed_.push_back(columns_.first_row(i) + a);
    const auto rows = static_cast<Eigen::Index>(closed_.size());
    by_blocks_ = problem_.W.is_sparse() && dense_cost(rows) > sparse_.cost() &&
                 !(distrusted_ && rows <= kDistrusted);
    if (by_blocks_) return factorise_sparse();
    factorise_dense();
    return true;
}

bool ShiftedDelassus::solve(Eigen::VectorXd& x)
{
    if (problem_.W.is_matrix_free()) {
        solve_by_gmres(x);
    } else if (!by_blocks_) {
        solve_dense(x);
    } else if (!solve_sparse(x)) {
        distrusted_ = true;
        if (static_cast<Eigen::Index>(closed_.size()) > kDistrusted) return false;
        by_blocks_ = false;
        factorise_dense();
        solve_dense(x);
    }
    return true;
}

// ---- dense

/// Fills the closed rows of one column of S W S.
void ShiftedDelassus::gather_dense(int contact, Eigen::Index first)
{
    const Eigen::MatrixXd& W = problem_.W.dense();
    for (int b = 0; b < columns_.rows(contact); ++b) {
        const int column = columns_.first_row(contact) + b;
        const double* source = W.data() + column * W.rows();
        double* target = matrix_.data() + (first + b) * matrix_.rows();
        for (std::size_t i = 0; i < closed_.size(); ++i)
            target[i] = source[closed_[i]] * scale_[closed_[i]] * scale_[column];
    }
}

void ShiftedDelassus::gather_sparse(int contact, Eigen::Index first,
                                    const std::vector<Eigen::Index>& place)
{
    const int columns = columns_.rows(contact);
    matrix_.middleCols(first, columns).setZero();
    int k = 0;
    for (const int* i = columns_.neighbours_begin(contact); i != columns_.neighbours_end(contact);
         ++i, ++k) {
        if (open(*i)) continue;
        const double scale = scale_[columns_.first_row(contact)] * scale_[columns_.first_row(*i)];
        const double* value = columns_.neighbour_block(contact, k);
        for (int c = 0; c < columns; ++c)
            for (int a = 0; a < columns_.rows(*i); ++a)
                matrix_(place[static_cast<std::size_t>(*i)] + a, first + c) = scale * *value++;
    }
}

void ShiftedDelassus::factorise_dense()
{
    std::vector<Eigen::Index> place(static_cast<std::size_t>(contact_count(problem_)), -1);
    Eigen::Index rows = 0;
    for (int i = 0; i < contact_count(problem_); ++i)
        if (!open(i)) {
            place[static_cast<std::size_t>(i)] = rows;
            rows += columns_.rows(i);
        }
    dense_.reset();
    if (matrix_.rows() != rows) matrix_.resize(rows, rows);
    if (rows == 0) return;
    for (int j = 0; j < contact_count(problem_); ++j) {
        if (open(j)) continue;
        const Eigen::Index k = place[static_cast<std::size_t>(j)];
        if (problem_.W.is_dense())
            gather_dense(j, k);
        else
            gather_sparse(j, k, place);
        const int size = columns_.rows(j);
        matrix_.block(k, k, size, size) +=
            (*law_)[static_cast<std::size_t>(j)].D.topLeftCorner(size, size);
        matrix_.diagonal().segment(k, size).array() += shift_;
    }
    Eigen::Ref<Eigen::MatrixXd> in_place(matrix_);
    dense_.emplace(in_place);
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

bool ShiftedDelassus::solve_sparse(Eigen::VectorXd& x) const
{
    const int n = contact_count(problem_);
    Eigen::VectorXd padded(3 * n);
    const auto solve = [&](const Eigen::VectorXd& b) {
        padded.setZero();
        for (int i = 0; i < n; ++i)
            if (!open(i))
                padded.segment(3 * i, columns_.rows(i)) =
                    b.segment(columns_.first_row(i), columns_.rows(i));
        sparse_.solve(padded);
        Eigen::VectorXd result = Eigen::VectorXd::Zero(x.size());
        for (int i = 0; i < n; ++i)
            if (!open(i))
                result.segment(columns_.first_row(i), columns_.rows(i)) =
                    padded.segment(3 * i, columns_.rows(i));
        return result;
    };
    Eigen::VectorXd b = x, product(x.size());
    for (int i = 0; i < n; ++i)
        if (open(i)) b.segment(columns_.first_row(i), columns_.rows(i)).setZero();

    // No pivoting among blocks: refinement pays for what that loses.
    Eigen::VectorXd solution = solve(b), best = solution;
    double last = std::numeric_limits<double>::infinity();
    for (int k = 0;; ++k) {
        multiply(solution, product);
        const Eigen::VectorXd residual = b - product;
        const double size = residual.norm();
        if (!(size < kRefining * last)) break;
        best = solution;
        last = size;
        if (k == kRefinements || size <= kRefined * b.norm()) break;
        solution += solve(residual);
    }
    for (int i = 0; i < n && last <= kPoor * b.norm(); ++i)
        if (!open(i))
            x.segment(columns_.first_row(i), columns_.rows(i)) =
                best.segment(columns_.first_row(i), columns_.rows(i));
    return last <= kPoor * b.norm();
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
