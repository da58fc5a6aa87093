#include "contact/delassus.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>

namespace amontons {
namespace {

struct Squares {
    double difference = 0; ///< of |W - W^T|^2
    double size = 0;       ///< of |W|^2
};

/// By tiles that stay in cache together with their mirror image.
Squares squares(const Eigen::MatrixXd& W)
{
    constexpr Eigen::Index kTile = 32;
    Squares s;
    for (Eigen::Index j = 0; j < W.cols(); j += kTile)
        for (Eigen::Index i = j; i < W.rows(); i += kTile) {
            const Eigen::Index rows = std::min(kTile, W.rows() - i);
            const Eigen::Index columns = std::min(kTile, W.cols() - j);
            const auto lower = W.block(i, j, rows, columns);
            const auto upper = W.block(j, i, columns, rows);
            const double twice = i == j ? 0.5 : 1; // a diagonal tile is its own mirror image
            s.difference += 2 * twice * (lower - upper.transpose()).squaredNorm();
            s.size += twice * (lower.squaredNorm() + upper.squaredNorm());
        }
    return s;
}

/// Column by column. Below the diagonal of column j, row i coincides with its mirror image in
/// column i at row j: as j grows, the meetings in each column come in the order in which it is
/// stored.
Squares squares(const Delassus::Sparse& W)
{
    const int* const start = W.outerIndexPtr();
    const int* const row = W.innerIndexPtr();
    const double* const value = W.valuePtr();
    const auto columns = static_cast<int>(W.cols());
    std::vector<int> next(start, start + columns); // of each column: what has not been found yet
    Squares s;
    const auto add_alone = [&](double a) { s.difference += 2 * a * a; };
    for (int j = 0; j < columns; ++j) {
        for (int k = start[j]; k < start[j + 1]; ++k) {
            const double a = value[k];
            s.size += a * a;
            const int i = row[k];
            if (i <= j || i >= columns) continue;
            int& mirror = next[static_cast<std::size_t>(i)];
            for (; mirror < start[i + 1] && row[mirror] < j; ++mirror)
                add_alone(value[mirror]);
            const bool found = mirror < start[i + 1] && row[mirror] == j;
            add_alone(found ? a - value[mirror] : a);
            mirror += found;
        }
    }
    for (int j = 0; j < columns; ++j)
        for (int k = next[static_cast<std::size_t>(j)]; k < start[j + 1] && row[k] < j; ++k)
            add_alone(value[k]);
    return s;
}

Eigen::Index column_end(const Delassus::Sparse& W, Eigen::Index column)
{
    const int* const count = W.innerNonZeroPtr(); // null if it is compressed
    return count ? W.outerIndexPtr()[column] + count[column] : W.outerIndexPtr()[column + 1];
}

/// The first entry of a sorted column that is in this row or below.
Eigen::Index place_in_column(const Delassus::Sparse& W, Eigen::Index row, Eigen::Index column)
{
    const int* const begin = W.innerIndexPtr() + W.outerIndexPtr()[column];
    const int* const end = W.innerIndexPtr() + column_end(W, column);
    return std::lower_bound(begin, end, static_cast<int>(row)) - W.innerIndexPtr();
}

double largest(const Eigen::MatrixXd& W)
{
    return W.size() > 0 ? W.cwiseAbs().maxCoeff() : 0;
}

double largest(const Delassus::Sparse& W)
{
    return W.nonZeros() > 0 ? W.coeffs().abs().maxCoeff() : 0;
}

template <class Matrix> double asymmetry_of(const Matrix& W)
{
    Squares s = squares(W);
    if (std::isnormal(s.size) && std::isfinite(s.difference))
        return std::sqrt(s.difference / s.size);
    // The squares left the range of doubles, or W is zero, or not finite.
    const double scale = largest(W);
    if (scale == 0) return 0;
    s = squares(Matrix(W / scale));
    return std::sqrt(s.difference / s.size);
}

/// x . W y - y . W x over |W y| |x|, for fixed vectors of random numbers.
double asymmetry_of(const MatrixFreeDelassus& W)
{
    std::mt19937 random{1};
    std::normal_distribution<double> normal;
    Eigen::VectorXd x(W.rows), y(W.rows), Wx(W.rows), Wy(W.rows);
    for (Eigen::Index i = 0; i < W.rows; ++i) {
        x[i] = normal(random);
        y[i] = normal(random);
    }
    W.apply(x, Wx);
    W.apply(y, Wy);
    const double size = Wx.norm() * y.norm() + Wy.norm() * x.norm();
    if (size == 0) return 0;
    // x . A y of a random antisymmetric A is about |A|, while |W y| |x| is about |W| sqrt(rows).
    return std::abs(x.dot(Wy) - y.dot(Wx)) / size * std::sqrt(static_cast<double>(W.rows));
}

/// G^T G is symmetric; what may not be finite is in its diagonal.
double asymmetry_of(const DelassusOfBodies& W)
{
    double size = W.compliance.squaredNorm();
    for (const DelassusOfBodies::Part& part : W.parts)
        size += part.G.squaredNorm();
    return std::isfinite(size) ? 0 : std::numeric_limits<double>::quiet_NaN();
}

/// out += G^T f(G) r of every body.
template <class Entry>
void add_bodies(const DelassusOfBodies& W, const Eigen::VectorXd& r, Eigen::VectorXd& out,
                const Entry& entry)
{
    Eigen::VectorXd own, moved;
    for (const DelassusOfBodies::Part& part : W.parts) {
        own = r(part.rows);
        if (own.isZero(0)) {
            continue;
        }
        moved.noalias() = entry(part.G) * own;
        own.noalias() = entry(part.G).transpose() * moved;
        for (std::size_t i = 0; i < part.rows.size(); ++i)
            out[part.rows[i]] += own[static_cast<Eigen::Index>(i)];
    }
}

/// The places of rows in the parts, and what is missing of the diagonal.
void index(DelassusOfBodies& W)
{
    const auto rows = static_cast<std::size_t>(W.compliance.size());
    W.first.assign(rows + 1, 0);
    for (const DelassusOfBodies::Part& part : W.parts)
        for (const int row : part.rows)
            ++W.first[static_cast<std::size_t>(row) + 1];
    std::partial_sum(W.first.begin(), W.first.end(), W.first.begin());
    W.place.resize(static_cast<std::size_t>(W.first.back()));
    std::vector<int> next(W.first.begin(), W.first.end() - 1);
    for (std::size_t p = 0; p < W.parts.size(); ++p)
        for (std::size_t c = 0; c < W.parts[p].rows.size(); ++c)
            W.place[static_cast<std::size_t>(
                next[static_cast<std::size_t>(W.parts[p].rows[c])]++)] = {static_cast<int>(p),
                                                                          static_cast<int>(c)};
}

} // namespace

Delassus::Delassus(DelassusOfBodies W)
{
    index(W);
    form_ = std::move(W);
}

Delassus::Sparse Delassus::as_sparse() const
{
    if (is_sparse()) return sparse();
    const DelassusOfBodies& W = of_bodies();
    Delassus::Sparse sum(rows(), rows());
    Eigen::VectorXd column = Eigen::VectorXd::Zero(rows());
    std::vector<int> found;
    for (Eigen::Index j = 0; j < rows(); ++j) {
        found.assign(W.compliance[j] != 0 ? 1 : 0, static_cast<int>(j));
        column[j] = W.compliance[j];
        for (const DelassusOfBodies::Place& at : W.places(j)) {
            const DelassusOfBodies::Part& part = W.parts[static_cast<std::size_t>(at.part)];
            const Eigen::VectorXd own = part.G.transpose() * part.G.col(at.column);
            for (std::size_t i = 0; i < part.rows.size(); ++i)
                column[part.rows[i]] += own[static_cast<Eigen::Index>(i)];
            found.insert(found.end(), part.rows.begin(), part.rows.end());
        }
        std::sort(found.begin(), found.end());
        found.erase(std::unique(found.begin(), found.end()), found.end());
        sum.startVec(j);
        for (const int i : found) {
            sum.insertBack(i, j) = column[i];
            column[i] = 0;
        }
    }
    sum.finalize();
    return sum;
}

Delassus::Delassus(Delassus::Sparse W)
{
    W.makeCompressed();
    const auto sorted = [&](Eigen::Index j) {
        const int* row = W.innerIndexPtr();
        return std::is_sorted(row + W.outerIndexPtr()[j], row + W.outerIndexPtr()[j + 1]);
    };
    for (Eigen::Index j = 0; j < W.cols(); ++j)
        if (!sorted(j)) { // entries would not be found; transposing sorts
            const Delassus::Sparse mirrored = W.transpose();
            W = mirrored.transpose();
            break;
        }
    form_ = std::move(W);
}

Eigen::Index Delassus::rows() const
{
    return is_dense()       ? dense().rows()
           : is_sparse()    ? sparse().rows()
           : is_of_bodies() ? of_bodies().compliance.size()
                            : matrix_free().rows;
}

Eigen::Index Delassus::cols() const
{
    return is_dense() ? dense().cols() : is_sparse() ? sparse().cols() : rows();
}

void Delassus::apply(const Eigen::VectorXd& r, Eigen::VectorXd& out) const
{
    out.resize(rows());
    if (r.isZero(0)) {
        out.setZero();
    } else if (is_dense()) {
        out.noalias() = dense() * r;
    } else if (is_sparse()) {
        out.noalias() = sparse() * r;
    } else if (is_of_bodies()) {
        out = of_bodies().compliance.cwiseProduct(r);
        add_bodies(
            of_bodies(), r, out, [](const Eigen::MatrixXd& G) -> const auto& { return G; });
    } else {
        matrix_free().apply(r, out);
    }
}

Eigen::VectorXd Delassus::absolute_times(const Eigen::VectorXd& r) const
{
    if (is_matrix_free()) {
        const Eigen::VectorXd root = diagonal().cwiseAbs().cwiseSqrt();
        return root * root.dot(r);
    }
    Eigen::VectorXd out = Eigen::VectorXd::Zero(rows());
    if (is_of_bodies()) {
        out = of_bodies().compliance.cwiseAbs().cwiseProduct(r);
        add_bodies(of_bodies(), r, out, [](const Eigen::MatrixXd& G) { return G.cwiseAbs(); });
    } else if (is_dense()) {
        for (Eigen::Index j = 0; j < r.size(); ++j)
            if (r[j] != 0) out += r[j] * dense().col(j).cwiseAbs();
    } else {
        for (Eigen::Index j = 0; j < r.size(); ++j)
            if (r[j] != 0)
                for (Delassus::Sparse::InnerIterator it(sparse(), j); it; ++it)
                    out[it.row()] += r[j] * std::abs(it.value());
    }
    return out;
}

Eigen::VectorXd Delassus::transpose_times(const Eigen::VectorXd& r) const
{
    if (is_dense()) return dense().transpose() * r;
    if (is_sparse()) return sparse().transpose() * r;
    return *this * r;
}

Eigen::MatrixXd Delassus::part(const std::vector<Eigen::Index>& chosen) const
{
    if (is_dense()) return dense()(chosen, chosen);
    const auto n = static_cast<Eigen::Index>(chosen.size());
    Eigen::MatrixXd out = Eigen::MatrixXd::Zero(n, n);
    if (is_sparse()) {
        std::vector<Eigen::Index> place(static_cast<std::size_t>(rows()), -1);
        for (std::size_t k = 0; k < chosen.size(); ++k)
            place[static_cast<std::size_t>(chosen[k])] = static_cast<Eigen::Index>(k);
        for (Eigen::Index j = 0; j < n; ++j)
            for (Delassus::Sparse::InnerIterator it(sparse(), chosen[static_cast<std::size_t>(j)]);
                 it; ++it)
                if (const Eigen::Index i = place[static_cast<std::size_t>(it.row())]; i >= 0)
                    out(i, j) = it.value();
        return out;
    }
    Eigen::VectorXd unit = Eigen::VectorXd::Zero(rows()), column(rows());
    for (Eigen::Index j = 0; j < n; ++j) {
        const Eigen::Index row = chosen[static_cast<std::size_t>(j)];
        unit[row] = 1;
        apply(unit, column);
        unit[row] = 0;
        out.col(j) = column(chosen);
    }
    return out;
}

Delassus::Block Delassus::block(Eigen::Index first_row, int size) const
{
    if (is_dense()) return dense().block(first_row, first_row, size, size);
    Block out = Block::Zero(size, size);
    if (is_of_bodies()) {
        const DelassusOfBodies& W = of_bodies();
        for (int j = 0; j < size; ++j) {
            out(j, j) += W.compliance[first_row + j];
            for (const DelassusOfBodies::Place& a : W.places(first_row + j))
                for (int i = 0; i < size; ++i)
                    for (const DelassusOfBodies::Place& b : W.places(first_row + i)) {
                        if (a.part != b.part) continue;
                        const Eigen::MatrixXd& G = W.parts[static_cast<std::size_t>(a.part)].G;
                        out(i, j) += G.col(b.column).dot(G.col(a.column));
                    }
        }
        return out;
    }
    const Delassus::Sparse& stored = is_sparse() ? sparse() : matrix_free().blocks;
    for (int j = 0; j < size; ++j)
        for (Eigen::Index k = place_in_column(stored, first_row, first_row + j);
             k < column_end(stored, first_row + j) && stored.innerIndexPtr()[k] < first_row + size;
             ++k)
            out(stored.innerIndexPtr()[k] - first_row, j) = stored.valuePtr()[k];
    return out;
}

Eigen::VectorXd Delassus::diagonal() const
{
    if (is_dense()) return dense().diagonal();
    if (is_of_bodies()) {
        Eigen::VectorXd sum = of_bodies().compliance;
        for (const DelassusOfBodies::Part& part : of_bodies().parts)
            for (std::size_t i = 0; i < part.rows.size(); ++i)
                sum[part.rows[i]] += part.G.col(static_cast<Eigen::Index>(i)).squaredNorm();
        return sum;
    }
    const Delassus::Sparse& stored = is_sparse() ? sparse() : matrix_free().blocks;
    Eigen::VectorXd out = Eigen::VectorXd::Zero(std::min(stored.rows(), stored.cols()));
    for (Eigen::Index j = 0; j < out.size(); ++j)
        if (const Eigen::Index k = place_in_column(stored, j, j);
            k < column_end(stored, j) && stored.innerIndexPtr()[k] == j)
            out[j] = stored.valuePtr()[k];
    return out;
}

double Delassus::asymmetry() const
{
    return std::visit([](const auto& W) { return asymmetry_of(W); }, form_);
}

} // namespace amontons
