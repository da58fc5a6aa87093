#include "solver/linear/supernodes.hpp"

#include "mesh/base/error.hpp"
#include "solver/linear/cholmod_api.hpp"

#include <algorithm>
#include <numeric>

// A block of right-hand sides by rows, k of them, is to BLAS the transposed block by columns, k
// high. So L Y = B reads Y^T L^T = B^T, and the products have Y^T on the left.

namespace amontons {
namespace {

constexpr double kOne = 1, kZero = 0, kMinusOne = -1;
constexpr int kStep = 1;

/// Y <- D^-1 Y (transposed: D^-T Y) with D the diagonal block.
void solve_diagonal(const Supernodes& L, std::int32_t s, bool transposed, double* Y, int k)
{
    const int width = L.width(s), height = L.height(s);
    if (k == 1)
        cholmod_api().dtrsv("L", transposed ? "T" : "N", "N", &width, L.block(s), &height, Y,
                            &kStep);
    else
        cholmod_api().dtrsm("R", "L", transposed ? "N" : "T", "N", &k, &width, &kOne, L.block(s),
                            &height, Y, &k);
}

/// T = B Y with B the block below the diagonal block.
void multiply_below(const Supernodes& L, std::int32_t s, const double* Y, int k, double* T)
{
    const int width = L.width(s), height = L.height(s), below = height - width;
    if (k == 1)
        cholmod_api().dgemv("N", &below, &width, &kOne, L.block(s) + width, &height, Y, &kStep,
                            &kZero, T, &kStep);
    else
        cholmod_api().dgemm("N", "T", &k, &below, &width, &kOne, Y, &k, L.block(s) + width, &height,
                            &kZero, T, &k);
}

/// Y <- Y - B^T T.
void subtract_from_below(const Supernodes& L, std::int32_t s, const double* T, int k, double* Y)
{
    const int width = L.width(s), height = L.height(s), below = height - width;
    if (k == 1)
        cholmod_api().dgemv("T", &below, &width, &kMinusOne, L.block(s) + width, &height, T, &kStep,
                            &kOne, Y, &kStep);
    else
        cholmod_api().dgemm("N", "N", &k, &width, &below, &kMinusOne, T, &k, L.block(s) + width,
                            &height, &kOne, Y, &k);
}

double* sized(std::vector<double>& work, std::size_t size)
{
    if (work.size() < size) work.resize(size);
    return work.data();
}

} // namespace

bool is_consistent(const Supernodes& L)
{
    if (L.first.size() < 2 || L.row_start.size() != L.first.size() ||
        L.start.size() != L.first.size() || L.first[0] != 0 || L.row_start[0] != 0 ||
        L.start[0] != 0)
        return false;
    const std::int32_t n = L.size();
    for (std::size_t s = 0; s + 1 < L.first.size(); ++s) {
        const std::int64_t width = std::int64_t(L.first[s + 1]) - L.first[s],
                           height = std::int64_t(L.row_start[s + 1]) - L.row_start[s],
                           entries = std::int64_t(L.start[s + 1]) - L.start[s];
        if (width < 1 || L.first[s + 1] > n || height < width || entries != width * height ||
            std::size_t(L.row_start[s + 1]) > L.row.size())
            return false;
    }
    if (std::size_t(L.row_start.back()) != L.row.size() ||
        std::size_t(L.start.back()) != L.value.size())
        return false;
    for (std::int32_t s = 0; s < L.count(); ++s) {
        const std::int32_t* const rows = L.row.data() + L.row_start[std::size_t(s)];
        for (int r = 0; r < L.height(s); ++r) {
            if (r < L.width(s) ? rows[r] != L.first[std::size_t(s)] + r : rows[r] <= rows[r - 1])
                return false;
            if (rows[r] >= n) return false;
        }
    }
    std::vector<std::int32_t> of_column(static_cast<std::size_t>(n));
    for (std::int32_t s = 0; s < L.count(); ++s)
        std::fill(of_column.begin() + L.first[std::size_t(s)],
                  of_column.begin() + L.first[std::size_t(s) + 1], s);
    for (std::int32_t s = 0; s < L.count(); ++s) {
        const std::int32_t *below = L.rows_below(s), *const end =
                                                         below + (L.height(s) - L.width(s));
        if (below == end) continue;
        const std::int32_t parent = of_column[std::size_t(*below)];
        const std::int32_t* const theirs = L.row.data() + L.row_start[std::size_t(parent)];
        if (!std::includes(theirs, theirs + L.height(parent), below, end)) return false;
    }
    return true;
}

void forward(const Supernodes& L, std::span<const char> taking_part, RowBlock& Y,
             std::vector<double>& work)
{
    const auto k = static_cast<int>(Y.cols());
    if (k == 0) return;
    for (std::int32_t s = 0; s < L.count(); ++s) {
        if (!taking_part.empty() && !taking_part[std::size_t(s)]) continue;
        double* const own = Y.data() + std::ptrdiff_t(L.first[std::size_t(s)]) * k;
        // Where forces act on few nodes most of it stays 0.
        if (std::all_of(own, own + std::ptrdiff_t(L.width(s)) * k, [](double y) { return y == 0; }))
            continue;
        solve_diagonal(L, s, false, own, k);
        const int below = L.height(s) - L.width(s);
        if (below == 0) continue;
        double* const T = sized(work, std::size_t(below) * std::size_t(k));
        multiply_below(L, s, own, k, T);
        const std::int32_t* const rows = L.rows_below(s);
        for (int r = 0; r < below; ++r) {
            double* const to = Y.data() + std::ptrdiff_t(rows[r]) * k;
            const double* const from = T + std::ptrdiff_t(r) * k;
            for (int c = 0; c < k; ++c)
                to[c] -= from[c];
        }
    }
}

void backward(const Supernodes& L, std::span<const char> taking_part, RowBlock& Y,
              std::vector<double>& work)
{
    const auto k = static_cast<int>(Y.cols());
    if (k == 0) return;
    for (std::int32_t s = L.count() - 1; s >= 0; --s) {
        if (!taking_part.empty() && !taking_part[std::size_t(s)]) continue;
        double* const own = Y.data() + std::ptrdiff_t(L.first[std::size_t(s)]) * k;
        const int below = L.height(s) - L.width(s);
        if (below > 0) {
            double* const T = sized(work, std::size_t(below) * std::size_t(k));
            const std::int32_t* const rows = L.rows_below(s);
            for (int r = 0; r < below; ++r)
                std::copy_n(Y.data() + std::ptrdiff_t(rows[r]) * k, k, T + std::ptrdiff_t(r) * k);
            subtract_from_below(L, s, T, k, own);
        }
        solve_diagonal(L, s, true, own, k);
    }
}

// With L L^T = A and Y = L^-1 C, W = Y^T Y is the sum over supernodes of Y_s^T Y_s. Column j of Y
// is 0 but in the supernodes on the ways from C's entries up to the root: each supernode keeps the
// list of the columns that reach it, and no more of Y. As ancestors are reached by all that reach
// their descendants, lists only grow upwards. Rows of Y wait in their supernode's block from the
// first contribution of a descendant until it is its turn; then they are used and forgotten.
void tree_compliance(const Supernodes& L, const Eigen::SparseMatrix<double>& C,
                     std::span<const std::int32_t> place, Eigen::MatrixXd& W)
{
    const auto columns = static_cast<std::int32_t>(C.cols());
    W.setZero(columns, columns);
    const auto supernodes = std::size_t(L.count());

    // ---- Entries of C by supernode
    struct Entry {
        std::int32_t row, column;
        double value;
    };
    std::vector<std::vector<std::int32_t>> reached_by(supernodes);
    std::vector<std::int32_t> last(supernodes, -1);
    std::vector<std::size_t> entry_start(supernodes + 1, 0);
    for (std::int32_t j = 0; j < columns; ++j)
        for (Eigen::SparseMatrix<double>::InnerIterator it(C, j); it; ++it) {
            std::int32_t s = L.of_column[std::size_t(place[std::size_t(it.row())])];
            ++entry_start[std::size_t(s) + 1];
            for (; s >= 0 && last[std::size_t(s)] != j; s = L.parent[std::size_t(s)]) {
                last[std::size_t(s)] = j;
                reached_by[std::size_t(s)].push_back(j);
            }
        }
    std::partial_sum(entry_start.begin(), entry_start.end(), entry_start.begin());
    std::vector<Entry> entries(entry_start.back());
    std::vector<std::size_t> next(entry_start.begin(), entry_start.end() - 1);
    for (std::int32_t j = 0; j < columns; ++j)
        for (Eigen::SparseMatrix<double>::InnerIterator it(C, j); it; ++it) {
            const std::int32_t row = place[std::size_t(it.row())];
            const std::int32_t s = L.of_column[std::size_t(row)];
            entries[next[std::size_t(s)]++] = {row - L.first[std::size_t(s)], j, it.value()};
        }

    // ---- From the leaves to the root
    std::vector<std::vector<double>> waiting(supernodes); // width x reached_by, by rows
    const auto block_of = [&](std::int32_t s) {
        std::vector<double>& Y = waiting[std::size_t(s)];
        if (Y.empty()) Y.assign(std::size_t(L.width(s)) * reached_by[std::size_t(s)].size(), 0);
        return Y.data();
    };
    std::vector<std::int32_t> column_in(std::size_t(columns), 0); // a column's place in a list
    std::vector<std::int32_t> target;
    std::vector<double> work, product;
    for (std::int32_t s = 0; s < L.count(); ++s) {
        std::vector<std::int32_t>& mine = reached_by[std::size_t(s)];
        if (mine.empty()) continue;
        const auto k = static_cast<int>(mine.size());
        const int width = L.width(s), below = L.height(s) - width;
        double* const Y = block_of(s);
        for (int c = 0; c < k; ++c)
            column_in[std::size_t(mine[std::size_t(c)])] = c;
        for (std::size_t e = entry_start[std::size_t(s)]; e < entry_start[std::size_t(s) + 1]; ++e)
            Y[std::ptrdiff_t(entries[e].row) * k + column_in[std::size_t(entries[e].column)]] +=
                entries[e].value;
        solve_diagonal(L, s, false, Y, k);

        if (k == columns) {
            cholmod_api().dsyrk("L", "N", &k, &width, &kOne, Y, &k, &kOne, W.data(), &k);
        } else {
            double* const P = sized(product, std::size_t(k) * std::size_t(k));
            cholmod_api().dsyrk("L", "N", &k, &width, &kOne, Y, &k, &kZero, P, &k);
            for (int b = 0; b < k; ++b) {
                double* const to = W.data() + std::ptrdiff_t(mine[std::size_t(b)]) * columns;
                for (int a = b; a < k; ++a)
                    to[mine[std::size_t(a)]] += P[std::ptrdiff_t(b) * k + a];
            }
        }

        if (below > 0) {
            double* const T = sized(work, std::size_t(below) * std::size_t(k));
            multiply_below(L, s, Y, k, T);
            const std::int32_t* const rows = L.rows_below(s);
            for (int r = 0; r < below;) { // rows of one ancestor at a time
                const std::int32_t up = L.of_column[std::size_t(rows[r])];
                const std::int32_t begin = L.first[std::size_t(up)],
                                   end = L.first[std::size_t(up) + 1];
                double* const to = block_of(up);
                const std::vector<std::int32_t>& theirs = reached_by[std::size_t(up)];
                const auto stride = static_cast<std::ptrdiff_t>(theirs.size());
                target.resize(std::size_t(k));
                for (std::size_t c = 0, t = 0; c < mine.size(); ++c, ++t) {
                    while (theirs[t] != mine[c])
                        ++t;
                    target[c] = std::int32_t(t);
                }
                for (; r < below && rows[r] < end; ++r) {
                    double* const row = to + (rows[r] - begin) * stride;
                    const double* const from = T + std::ptrdiff_t(r) * k;
                    if (stride == k)
                        for (int c = 0; c < k; ++c)
                            row[c] -= from[c];
                    else
                        for (int c = 0; c < k; ++c)
                            row[target[std::size_t(c)]] -= from[c];
                }
            }
        }
        std::vector<double>().swap(waiting[std::size_t(s)]);
        std::vector<std::int32_t>().swap(mine);
    }
    W.triangularView<Eigen::StrictlyUpper>() = W.transpose();
}

} // namespace amontons
