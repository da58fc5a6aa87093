#include "contact/solvers/shifted_delassus.hpp"

#include <algorithm>
#include <cmath>

namespace amontons {
namespace {

// GMRES ends here: a Newton direction needs no more.
constexpr double kGmresTolerance = 1e-6;
constexpr int kGmresSteps = 200;
// Refinement of a factor without pivoting ends when it is this good, or no longer gets better.
constexpr double kRefined = 1e-12, kRefining = 0.5;
constexpr int kRefinements = 6;
/// Of a W of bodies, whose W x costs as much as the factor's x: a direction needs no more.
constexpr double kRefinedOfBodies = 1e-5;
/// Not good enough for a Newton direction: a dense factor, which pivots, is taken from then on...
constexpr double kPoor = 1;
/// ... up to this many rows.
constexpr Eigen::Index kDistrusted = 600;
/// Least shift of a W of bodies, whose factor divides by it.
constexpr double kLeastOfBodies = 1e-8;

} // namespace

ShiftedDelassus::ShiftedDelassus(const SolverWork& work)
    : problem_(work.problem)
    , columns_(work.columns)
    , scale_(work.scale)
    , bodies_(work.problem, work.columns, work.scale)
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
    return 0.008 * m * m * m * (1 + m / 2400) + 1.5 * m * m; // large ones leave the cache
}

} // namespace

double ShiftedDelassus::cost(Eigen::Index closed_rows)
{
    analyse();
    if (problem_.W.is_matrix_free()) return 0;
    if (problem_.W.is_dense()) return dense_cost(closed_rows);
    if (problem_.W.is_of_bodies()) {
        bodies_.analyse();
        return 1.3 * bodies_.cost() + bodies_.filling_cost();
    }
    // Filling in and refining cost as much as small factors do.
    return std::min(1.3 * sparse_.cost() + filling_cost(), dense_cost(closed_rows));
}

double ShiftedDelassus::filling_cost() const
{
    return 100 * static_cast<double>(columns_.blocks());
}

bool ShiftedDelassus::costs_at_least(double limit, Eigen::Index closed_rows)
{
    if (problem_.W.is_of_bodies() && bodies_.filling_cost() >= limit) return true;
    if (problem_.W.is_sparse() && std::min(filling_cost(), dense_cost(closed_rows)) >= limit)
        return true;
    return cost(closed_rows) >= limit;
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
    const bool few = rows <= kDistrusted || problem_.W.is_dense();
    if (problem_.W.is_of_bodies()) {
        factor_ = Factor::bodies;
        shift_ = std::max(shift, kLeastOfBodies);
        return bodies_.factorise(law, shift_);
    }
    if (distrusted_ && few) {
        factorise_with_pivots();
        return true;
    }
    if (problem_.W.is_sparse() && dense_cost(rows) > sparse_.cost()) return factorise_sparse();
    return factorise_dense();
}

bool ShiftedDelassus::solve(const Eigen::VectorXd& b, Eigen::VectorXd& x, Eigen::VectorXd& product)
{
    if (problem_.W.is_matrix_free()) {
        apply(x, product);
        Eigen::VectorXd right(b.size());
        right = b - product;
        solve_by_gmres(right, x);
        apply(x, product);
        return true;
    }
    const Eigen::VectorXd given = x;
    if (refine(b, x, product) <= kPoor || factor_ == Factor::pivoted) return true;
    if (factor_ == Factor::bodies) return false;
    distrusted_ = true;
    if (static_cast<Eigen::Index>(closed_.size()) > kDistrusted && !problem_.W.is_dense())
        return false;
    factorise_with_pivots();
    x = given;
    refine(b, x, product);
    return true;
}

ShiftedDelassus::Response ShiftedDelassus::response(const std::vector<int>& contacts) const
{
    Response answer;
    answer.motions = bodies_.response(contacts);
    answer.reactions.setIdentity(answer.motions.rows(), answer.motions.cols());
    const Eigen::VectorXd& compliance = problem_.W.of_bodies().compliance;
    Eigen::Index row = 0;
    for (const int i : contacts) {
        const int rows = columns_.rows(i), first = columns_.first_row(i);
        auto motions = answer.motions.middleRows(row, rows);
        auto reactions = answer.reactions.middleRows(row, rows);
        reactions -= bodies_.inverse(i).topLeftCorner(rows, rows) * motions;
        motions += scale_[first] * scale_[first] * compliance.segment(first, rows).asDiagonal() *
                   reactions;
        row += rows;
    }
    return answer;
}

double ShiftedDelassus::refine(const Eigen::VectorXd& b, Eigen::VectorXd& x,
                               Eigen::VectorXd& product)
{
    Eigen::VectorXd residual(x.size()), correction(x.size()), next_product(x.size());
    apply(x, product);
    for (int i = 0; i < contact_count(problem_); ++i) {
        const int row = columns_.first_row(i), rows = columns_.rows(i);
        if (open(i))
            residual.segment(row, rows).setZero();
        else
            residual.segment(row, rows) = b.segment(row, rows) - product.segment(row, rows);
    }
    const double size = residual.norm();
    if (size == 0) return 0;
    const double refined = factor_ == Factor::bodies ? kRefinedOfBodies : kRefined;
    double last = std::numeric_limits<double>::infinity();
    for (int k = 0; k <= kRefinements; ++k) {
        solve_once(residual, correction);
        correction += x;
        apply(correction, next_product);
        subtract(b, correction, next_product, residual);
        const double left = residual.norm();
        if (!(left < kRefining * last) && k > 0) break;
        x.swap(correction);
        product.swap(next_product);
        last = left;
        if (last <= refined * size || !std::isfinite(last)) break;
    }
    return last / size;
}

void ShiftedDelassus::solve_once(const Eigen::VectorXd& b, Eigen::VectorXd& x) const
{
    if (factor_ == Factor::bodies) {
        bodies_.solve(b, x);
        return;
    }
    x.setZero(b.size());
    if (factor_ == Factor::blocks) {
        const int n = contact_count(problem_);
        Eigen::VectorXd padded = Eigen::VectorXd::Zero(3 * n);
        for (int i = 0; i < n; ++i)
            if (!open(i))
                for (int a = 0; a < columns_.rows(i); ++a)
                    padded[3 * i + a] = b[columns_.first_row(i) + a];
        sparse_.solve(padded);
        for (int i = 0; i < n; ++i)
            if (!open(i))
                for (int a = 0; a < columns_.rows(i); ++a)
                    x[columns_.first_row(i) + a] = padded[3 * i + a];
        return;
    }
    if (closed_.empty()) return;
    Eigen::VectorXd part = b(closed_);
    if (factor_ == Factor::dense)
        dense_.solve(part);
    else
        part = pivoted_->solve(part).eval();
    x(closed_) = part;
}

// ---- dense

void ShiftedDelassus::gather(int contact, const std::vector<Eigen::Index>& place, double* target,
                             std::ptrdiff_t stride) const
{
    const int columns = columns_.rows(contact), first = columns_.first_row(contact);
    if (problem_.W.is_dense()) {
        const Eigen::MatrixXd& W = problem_.W.dense();
        for (int c = 0; c < columns; ++c) {
            const double* const source = W.data() + (first + c) * W.rows();
            double* const to = target + c * stride;
            const double own = scale_[first + c];
            for (std::size_t i = 0; i < closed_.size(); ++i)
                to[i] = source[closed_[i]] * scale_[closed_[i]] * own;
        }
    } else {
        for (int c = 0; c < columns; ++c)
            std::fill_n(target + c * stride, closed_.size(), 0.0);
        int k = 0;
        for (const int* i = columns_.neighbours_begin(contact);
             i != columns_.neighbours_end(contact); ++i, ++k) {
            if (open(*i)) continue;
            const double scale = scale_[first] * scale_[columns_.first_row(*i)];
            const double* const value = columns_.neighbour_block(contact, k);
            double* const to = target + place[static_cast<std::size_t>(*i)];
            for (int c = 0; c < columns; ++c)
                for (int a = 0; a < columns_.rows(*i); ++a)
                    to[c * stride + a] = scale * value[Columns::kStride * c + a];
        }
    }
    double* const own = target + place[static_cast<std::size_t>(contact)];
    const LinearisedLaw& law = (*law_)[static_cast<std::size_t>(contact)];
    for (int c = 0; c < columns; ++c) {
        for (int a = 0; a < columns; ++a)
            own[c * stride + a] += law.D(a, c);
        own[c * stride + c] += shift_;
    }
}

std::vector<Eigen::Index> ShiftedDelassus::places() const
{
    std::vector<Eigen::Index> place(static_cast<std::size_t>(contact_count(problem_)), -1);
    Eigen::Index rows = 0;
    for (int i = 0; i < contact_count(problem_); ++i)
        if (!open(i)) {
            place[static_cast<std::size_t>(i)] = rows;
            rows += columns_.rows(i);
        }
    return place;
}

bool ShiftedDelassus::factorise_dense()
{
    factor_ = Factor::dense;
    const std::vector<Eigen::Index> place = places();
    dense_.open(static_cast<int>(closed_.size()));
    for (int j = 0; j < contact_count(problem_); ++j)
        if (const Eigen::Index k = place[static_cast<std::size_t>(j)]; k >= 0)
            gather(j, place, dense_.column(static_cast<int>(k)), dense_.stride());
    return dense_.factorise();
}

void ShiftedDelassus::factorise_with_pivots()
{
    factor_ = Factor::pivoted;
    const std::vector<Eigen::Index> place = places();
    const auto rows = static_cast<Eigen::Index>(closed_.size());
    pivoted_.reset();
    if (matrix_.rows() != rows) matrix_.resize(rows, rows);
    if (rows == 0) return;
    for (int j = 0; j < contact_count(problem_); ++j)
        if (const Eigen::Index k = place[static_cast<std::size_t>(j)]; k >= 0)
            gather(j, place, matrix_.data() + k * rows, rows);
    Eigen::Ref<Eigen::MatrixXd> in_place(matrix_);
    pivoted_.emplace(in_place);
}

// ---- sparse

bool ShiftedDelassus::factorise_sparse()
{
    factor_ = Factor::blocks;
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
                    block(a, c) = scale * value[Columns::kStride * c + a];
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

// ---- any form

void ShiftedDelassus::apply(const Eigen::VectorXd& x, Eigen::VectorXd& product) const
{
    problem_.W.apply(x.cwiseProduct(scale_), product);
    product.array() *= scale_.array();
}

void ShiftedDelassus::subtract(const Eigen::VectorXd& b, const Eigen::VectorXd& x,
                               const Eigen::VectorXd& product, Eigen::VectorXd& residual) const
{
    for (int i = 0; i < contact_count(problem_); ++i) {
        const int row = columns_.first_row(i), rows = columns_.rows(i);
        if (open(i)) {
            residual.segment(row, rows).setZero();
            continue;
        }
        const Mat3& D = (*law_)[static_cast<std::size_t>(i)].D;
        for (int a = 0; a < rows; ++a) {
            double sum = b[row + a] - product[row + a] - shift_ * x[row + a];
            for (int c = 0; c < rows; ++c)
                sum -= D(a, c) * x[row + c];
            residual[row + a] = sum;
        }
    }
}

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

void ShiftedDelassus::solve_by_gmres(const Eigen::VectorXd& right, Eigen::VectorXd& x) const
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
    Eigen::VectorXd b = right;
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
