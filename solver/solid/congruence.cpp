#include "solver/solid/congruence.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

namespace amontons {
namespace {

using Index = Eigen::Index;

constexpr int kTogether = 3; // columns of a group
constexpr Index kChunk = 16; // rows summed in registers

/// Up to three columns of C that follow each other, with the rows of A that any of them has.
struct Group {
    Index first = 0;
    int columns = 0;
    std::vector<Index> row;
    std::vector<std::array<double, kTogether>> weight; // 0: not of that column
};

std::vector<Group> group_columns(const Eigen::SparseMatrix<double>& C, std::span<const Index> place,
                                 Index rows_of_A)
{
    const auto* const outer = C.outerIndexPtr();
    const double* const value = C.valuePtr();
    std::vector<Group> groups;
    std::vector<Index> at(std::size_t(rows_of_A), -1); // of a row in the group
    for (Index j = 0; j < C.cols();) {
        Group& g = groups.emplace_back();
        g.first = j;
        std::size_t most = 0;
        for (; g.columns < kTogether && j < C.cols(); ++g.columns, ++j) {
            const std::size_t before = g.row.size();
            for (auto k = std::size_t(outer[j]); k < std::size_t(outer[j + 1]); ++k)
                if (at[std::size_t(place[k])] < 0) {
                    at[std::size_t(place[k])] = Index(g.row.size());
                    g.row.push_back(place[k]);
                }
            // Another contact's: its rows would be read for nothing.
            const auto own = std::size_t(outer[j + 1] - outer[j]);
            most = std::max(most, own);
            if (g.columns > 0 && g.row.size() > 3 * most) {
                for (std::size_t k = before; k < g.row.size(); ++k)
                    at[std::size_t(g.row[k])] = -1;
                g.row.resize(before);
                break;
            }
        }
        g.weight.assign(g.row.size(), {});
        for (int c = 0; c < g.columns; ++c)
            for (auto k = std::size_t(outer[g.first + c]); k < std::size_t(outer[g.first + c + 1]);
                 ++k)
                g.weight[std::size_t(at[std::size_t(place[k])])][std::size_t(c)] += value[k];
        for (const Index r : g.row)
            at[std::size_t(r)] = -1;
    }
    return groups;
}

/// out(from.., c) = sum of weight(c) X(from.., row): three columns of a product.
void multiply(const Eigen::MatrixXd& X, Index from, const Group& g, double* const* out)
{
    const Index n = X.rows();
    const std::size_t count = g.row.size();
    for (Index i = from; i < n; i += kChunk) {
        const Index size = std::min(kChunk, n - i);
        double sum[kTogether][kChunk] = {};
        if (size == kChunk)
            for (std::size_t k = 0; k < count; ++k) {
                const double* const x = X.data() + g.row[k] * n + i;
                const auto [a, b, c] = g.weight[k];
                for (Index t = 0; t < kChunk; ++t) {
                    sum[0][t] += a * x[t];
                    sum[1][t] += b * x[t];
                    sum[2][t] += c * x[t];
                }
            }
        else
            for (std::size_t k = 0; k < count; ++k) {
                const double* const x = X.data() + g.row[k] * n + i;
                for (Index t = 0; t < size; ++t)
                    for (std::size_t c = 0; c < kTogether; ++c)
                        sum[c][t] += g.weight[k][c] * x[t];
            }
        for (int c = 0; c < g.columns; ++c)
            std::copy_n(sum[c], size, out[c] + i);
    }
}

} // namespace

void congruence(const Eigen::MatrixXd& A, const Eigen::SparseMatrix<double>& C,
                std::span<const Index> place, Eigen::MatrixXd& W)
{
    const Index columns = C.cols();
    const std::vector<Group> groups = group_columns(C, place, A.rows());
    Eigen::MatrixXd moved(A.rows(), columns); // A C
    const auto into = [](Eigen::MatrixXd& M, const Group& g) {
        std::array<double*, kTogether> to{};
        for (int c = 0; c < g.columns; ++c)
            to[std::size_t(c)] = M.data() + (g.first + c) * M.rows();
        return to;
    };
    for (const Group& g : groups)
        multiply(A, 0, g, into(moved, g).data());
    const Eigen::MatrixXd across = moved.transpose(); // so that its columns are read, too
    W.resize(columns, columns);
    for (const Group& g : groups)
        multiply(across, g.first, g, into(W, g).data());
    W.triangularView<Eigen::StrictlyUpper>() = W.transpose();
}

} // namespace amontons
