#include "contact/linear/block_lu.hpp"

#include <Eigen/LU>
#include <Eigen/OrderingMethods>
#include <algorithm>
#include <cmath>

namespace amontons {
namespace {

constexpr int kNone = -1;

/// Fill-reducing order by approximate minimum degree.
std::vector<int> minimum_degree(int n, const std::vector<std::size_t>& start,
                                const std::vector<int>& neighbour)
{
    std::vector<Eigen::Triplet<double>> entries;
    for (int j = 0; j < n; ++j)
        for (std::size_t k = start[static_cast<std::size_t>(j)];
             k < start[static_cast<std::size_t>(j) + 1]; ++k)
            entries.emplace_back(neighbour[k], j, 1.0);
    Eigen::SparseMatrix<double> graph(n, n);
    graph.setFromTriplets(entries.begin(), entries.end());
    Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> permutation;
    Eigen::AMDOrdering<int>()(graph, permutation);
    const auto& indices = permutation.indices();
    return {indices.data(), indices.data() + n};
}

} // namespace

void BlockLu::analyse(const std::vector<std::size_t>& start, const std::vector<int>& neighbour)
{
    n_ = static_cast<int>(start.size()) - 1;
    const auto n = static_cast<std::size_t>(n_);
    order_ = minimum_degree(n_, start, neighbour);
    place_.resize(n);
    for (int k = 0; k < n_; ++k)
        place_[static_cast<std::size_t>(order_[static_cast<std::size_t>(k)])] = k;

    // The pattern of column k: its own below the diagonal, and that of its children in the
    // elimination tree. The parent of a column is its first row.
    std::vector<std::vector<int>> rows(n), children(n);
    std::vector<int> mark(n, kNone);
    first_.assign(1, 0);
    row_.clear();
    column_of_.clear();
    updates_.assign(n, {});
    work_ = 0;
    for (int k = 0; k < n_; ++k) {
        std::vector<int>& own = rows[static_cast<std::size_t>(k)];
        mark[static_cast<std::size_t>(k)] = k;
        const auto take = [&](int row) {
            if (row <= k || mark[static_cast<std::size_t>(row)] == k) return;
            mark[static_cast<std::size_t>(row)] = k;
            own.push_back(row);
        };
        const auto j = static_cast<std::size_t>(order_[static_cast<std::size_t>(k)]);
        for (std::size_t e = start[j]; e < start[j + 1]; ++e)
            take(place_[static_cast<std::size_t>(neighbour[e])]);
        for (int child : children[static_cast<std::size_t>(k)])
            for (int row : rows[static_cast<std::size_t>(child)])
                take(row);
        std::sort(own.begin(), own.end());
        if (!own.empty()) children[static_cast<std::size_t>(own.front())].push_back(k);
        for (int row : own) {
            updates_[static_cast<std::size_t>(row)].push_back(row_.size());
            row_.push_back(row);
            column_of_.push_back(k);
        }
        first_.push_back(row_.size());
        const auto m = static_cast<double>(own.size());
        work_ += m * (m + 1) + 2 * m + 1;
    }
    lower_.resize(row_.size());
    upper_.resize(row_.size());
    pivot_.resize(n);
    inverse_.resize(n);
}

void BlockLu::clear()
{
    std::fill(lower_.begin(), lower_.end(), Block{});
    std::fill(upper_.begin(), upper_.end(), Block{});
    std::fill(pivot_.begin(), pivot_.end(), Mat3::Zero());
}

std::size_t BlockLu::find(int row, int column) const
{
    const auto begin =
        row_.begin() + static_cast<std::ptrdiff_t>(first_[static_cast<std::size_t>(column)]);
    const auto end =
        row_.begin() + static_cast<std::ptrdiff_t>(first_[static_cast<std::size_t>(column) + 1]);
    return static_cast<std::size_t>(std::lower_bound(begin, end, row) - row_.begin());
}

void BlockLu::add(int i, int j, const Mat3& block)
{
    const int row = place_[static_cast<std::size_t>(i)],
              column = place_[static_cast<std::size_t>(j)];
    if (row == column) {
        pivot_[static_cast<std::size_t>(row)] += block;
        return;
    }
    Block& target = row > column ? lower_[find(row, column)] : upper_[find(column, row)];
    for (int c = 0; c < 3; ++c)
        for (int a = 0; a < 3; ++a)
            target.column[c][a] += row > column ? block(a, c) : block(c, a);
}

bool BlockLu::factorise()
{
    std::vector<std::size_t> at(static_cast<std::size_t>(n_)); // place of a row in this column
    // target -= a b^T, on padded blocks
    const auto subtract = [](Block& target, const Block& a, const Block& b) {
        for (int c = 0; c < 3; ++c)
            for (int k = 0; k < 3; ++k) {
                const double factor = b.column[k][c];
                for (int row = 0; row < 4; ++row)
                    target.column[c][row] -= a.column[k][row] * factor;
            }
    };
    for (int j = 0; j < n_; ++j) {
        const auto column = static_cast<std::size_t>(j);
        for (std::size_t e = first_[column]; e < first_[column + 1]; ++e)
            at[static_cast<std::size_t>(row_[e])] = e;
        Mat3& pivot = pivot_[column];
        for (std::size_t source : updates_[column]) {
            // Column k of L has row j: L(:, j) -= L(:, k) U(k, j), U(j, :) -= L(j, k) U(k, :).
            const Block l = lower_[source], u = upper_[source];
            Block product{};
            subtract(product, l, u);
            for (int c = 0; c < 3; ++c)
                for (int a = 0; a < 3; ++a)
                    pivot(a, c) += product.column[c][a];
            const std::size_t end = first_[static_cast<std::size_t>(column_of_[source]) + 1];
            for (std::size_t e = source + 1; e < end; ++e) {
                const std::size_t target = at[static_cast<std::size_t>(row_[e])];
                subtract(lower_[target], lower_[e], u);
                subtract(upper_[target], upper_[e], l);
            }
        }
        double determinant = 0;
        bool regular = false;
        pivot.computeInverseAndDetWithCheck(inverse_[column], determinant, regular, 0);
        if (!regular || !inverse_[column].allFinite()) return false;
        // Kept: L(i, j) = A(i, j) inverse(pivot), U(j, i) as it is.
        const Mat3& inverse = inverse_[column];
        for (std::size_t e = first_[column]; e < first_[column + 1]; ++e) {
            Block scaled{};
            for (int c = 0; c < 3; ++c)
                for (int k = 0; k < 3; ++k)
                    for (int a = 0; a < 4; ++a)
                        scaled.column[c][a] += lower_[e].column[k][a] * inverse(k, c);
            lower_[e] = scaled;
        }
    }
    return true;
}

void BlockLu::solve(Eigen::VectorXd& x) const
{
    Eigen::VectorXd y(x.size());
    for (int k = 0; k < n_; ++k)
        y.segment<3>(3 * k) = x.segment<3>(3 * order_[static_cast<std::size_t>(k)]);
    for (int j = 0; j < n_; ++j) {
        const Vec3 value = y.segment<3>(3 * j);
        for (std::size_t e = first_[static_cast<std::size_t>(j)];
             e < first_[static_cast<std::size_t>(j) + 1]; ++e) {
            const Block& l = lower_[e];
            double* target = y.data() + 3 * row_[e];
            for (int c = 0; c < 3; ++c)
                for (int a = 0; a < 3; ++a)
                    target[a] -= l.column[c][a] * value[c];
        }
    }
    for (int j = n_; j-- > 0;) {
        Vec3 value = y.segment<3>(3 * j);
        for (std::size_t e = first_[static_cast<std::size_t>(j)];
             e < first_[static_cast<std::size_t>(j) + 1]; ++e) {
            const Block& u = upper_[e]; // U(j, row)^T
            const double* other = y.data() + 3 * row_[e];
            for (int c = 0; c < 3; ++c)
                value[c] -= u.column[c][0] * other[0] + u.column[c][1] * other[1] +
                            u.column[c][2] * other[2];
        }
        y.segment<3>(3 * j) = inverse_[static_cast<std::size_t>(j)] * value;
    }
    for (int k = 0; k < n_; ++k)
        x.segment<3>(3 * order_[static_cast<std::size_t>(k)]) = y.segment<3>(3 * k);
}

} // namespace amontons
