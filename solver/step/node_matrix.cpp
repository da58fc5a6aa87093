#include "solver/step/node_matrix.hpp"

#include "solver/beam/rod_matrix.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace amontons {
namespace {

constexpr double kDear = 5e6; // of an elimination, as BlockLu estimates it [ns]

} // namespace

void NodeMatrix::set_chain(int nodes)
{
    symmetric_ = true;
    factor_ = Factor::none;
    if (chain_ && nodes == size()) return;
    chain_ = true;
    start_.assign(1, 0);
    row_.clear();
    for (int j = 0; j < nodes; ++j) {
        for (int i = std::max(j - 1, 0); i <= std::min(j + 1, nodes - 1); ++i)
            row_.push_back(i);
        start_.push_back(row_.size());
    }
    analysed_lu_ = analysed_cholesky_ = false;
    block_.assign(row_.size(), Block6{});
    indefinite_ = false;
}

void NodeMatrix::set_pattern(int nodes, std::vector<std::array<int, 2>> coupled)
{
    if (std::ranges::all_of(coupled, [](const std::array<int, 2>& pair) {
            return std::abs(pair[0] - pair[1]) <= 1;
        })) {
        set_chain(nodes);
        return set_zero();
    }
    chain_ = false;
    const std::size_t given = coupled.size();
    for (std::size_t k = 0; k < given; ++k)
        coupled.push_back({coupled[k][1], coupled[k][0]});
    for (int i = 0; i < nodes; ++i)
        coupled.push_back({i, i});
    std::sort(coupled.begin(), coupled.end()); // by column, then row
    coupled.erase(std::unique(coupled.begin(), coupled.end()), coupled.end());
    std::vector<std::size_t> start(std::size_t(nodes) + 1, 0);
    std::vector<int> row;
    for (const auto& [j, i] : coupled) {
        ++start[std::size_t(j) + 1];
        row.push_back(i);
    }
    for (std::size_t j = 0; j < std::size_t(nodes); ++j)
        start[j + 1] += start[j];
    if (start != start_ || row != row_) {
        start_ = std::move(start);
        row_ = std::move(row);
        analysed_lu_ = analysed_cholesky_ = false;
    }
    block_.resize(row_.size());
    indefinite_ = false;
    set_zero();
}

std::size_t NodeMatrix::at(int row, int col) const
{
    // Each node's own block, that of the next with it, and of it with the next.
    if (chain_) return std::size_t(row < col ? 3 * row + 2 : 2 * col + row);
    const auto first = row_.begin() + std::ptrdiff_t(start_[std::size_t(col)]),
               last = row_.begin() + std::ptrdiff_t(start_[std::size_t(col) + 1]);
    return std::size_t(std::lower_bound(first, last, row) - row_.begin());
}

void NodeMatrix::add(int row, int col, const Column6& f, const Node6& h, double s)
{
    Block6& b = block_[at(row, col)];
    const Column6 sf = f * splat6(s);
    for (int j = 0; j < 6; ++j)
        b.column[j] += sf * splat6(h.value[j]);
}

void NodeMatrix::set_zero()
{
    std::fill(block_.begin(), block_.end(), Block6{});
    symmetric_ = true;
    factor_ = Factor::none;
}

void NodeMatrix::copy_values(const NodeMatrix& other, int from)
{
    const auto first = std::ptrdiff_t(chain_ ? at(from, from) : 0);
    std::copy(other.block_.begin() + first, other.block_.end(), block_.begin() + first);
    symmetric_ = other.symmetric_;
    factor_ = Factor::none;
}

void NodeMatrix::take_symmetric_part()
{
    for (int j = 0; j < size(); ++j)
        for (std::size_t k = start_[std::size_t(j)]; k < start_[std::size_t(j) + 1]; ++k) {
            if (row_[k] < j) continue;
            const Mat6 below = dense(block_[k]), above = dense(block(j, row_[k]));
            const Mat6 mean = 0.5 * (below + above.transpose());
            set_block(block_[k], mean);
            set_block(block(j, row_[k]), mean.transpose());
        }
    symmetric_ = true;
    factor_ = Factor::none;
}

int NodeMatrix::factor(int from)
{
    factor_ = Factor::none;
    if (chain_) {
        const int last = size() - 1;
        const int negative = band_.factor(
            {&block_[0], &block_[last > 0 ? 2 : 0], &block_[last > 0 ? 1 : 0], 3, size()}, 0, from);
        return guarded ? negative : 0;
    }
    if (!guarded) return 0;
    if (!symmetric_) return 1;
    if (!cholesky()) return 1;
    factor_ = Factor::cholesky;
    return 0;
}

bool NodeMatrix::cholesky()
{
    const auto entries = [&](auto&& visit) {
        for (int j = 0; j < size(); ++j)
            for (int c = 0; c < 6; ++c)
                for (std::size_t k = start_[std::size_t(j)]; k < start_[std::size_t(j) + 1]; ++k)
                    for (int r = row_[k] == j ? c : 0; row_[k] >= j && r < 6; ++r)
                        visit(6 * row_[k] + r, 6 * j + c, k, r, c);
    };
    if (!analysed_cholesky_) {
        std::vector<Eigen::Triplet<double>> triplets;
        entries([&](int i, int j, std::size_t, int, int) { triplets.emplace_back(i, j, 1); });
        lower_.resize(6 * size(), 6 * size());
        lower_.setFromTriplets(triplets.begin(), triplets.end());
        std::vector<std::int32_t> node(std::size_t(6 * size()));
        for (std::size_t i = 0; i < node.size(); ++i)
            node[i] = std::int32_t(i / 6);
        supernodal_ = SupernodalFactor();
        supernodal_.analyse(lower_, node);
        analysed_cholesky_ = true;
    }
    double* value = lower_.valuePtr();
    entries([&](int, int, std::size_t k, int r, int c) { *value++ = block_[k](r, c); });
    return bool(supernodal_.factor(lower_));
}

bool NodeMatrix::is_symmetric() const
{
    constexpr double kRoundOff = 1e-12;
    double most = 0, differs = 0;
    for (int j = 0; j < size(); ++j)
        for (std::size_t k = start_[std::size_t(j)]; k < start_[std::size_t(j) + 1]; ++k) {
            if (row_[k] < j) continue;
            const Block6 &a = block_[k], &b = block(j, row_[k]);
            for (int c = 0; c < 6; ++c)
                for (int r = 0; r < 6; ++r) {
                    most = std::max(most, std::abs(a(r, c)));
                    differs = std::max(differs, std::abs(a(r, c) - b(c, r)));
                }
        }
    return differs <= kRoundOff * most;
}

void NodeMatrix::analyse_elimination()
{
    if (!analysed_lu_) { // each node's places and turns as two nodes of the pattern
        std::vector<std::size_t> start{0};
        std::vector<int> neighbour;
        for (int j = 0; j < 2 * size(); ++j) {
            for (std::size_t k = start_[std::size_t(j / 2)]; k < start_[std::size_t(j / 2) + 1];
                 ++k)
                neighbour.insert(neighbour.end(), {2 * row_[k], 2 * row_[k] + 1});
            start.push_back(neighbour.size());
        }
        lu_.analyse(start, neighbour);
        place_.clear();
        for (int j = 0; j < size(); ++j)
            for (std::size_t k = start_[std::size_t(j)]; k < start_[std::size_t(j) + 1]; ++k) {
                const int i = row_[k];
                place_.push_back({lu_.place(2 * i, 2 * j), lu_.place(2 * i + 1, 2 * j),
                                  lu_.place(2 * i, 2 * j + 1), lu_.place(2 * i + 1, 2 * j + 1)});
            }
        analysed_lu_ = true;
    }
}

bool NodeMatrix::eliminate()
{
    lu_.clear();
    Mat3 part;
    for (std::size_t k = 0; k < block_.size(); ++k)
        for (int q = 0; q < 4; ++q) {
            const int row = 3 * (q % 2), col = 3 * (q / 2);
            for (int c = 0; c < 3; ++c)
                for (int r = 0; r < 3; ++r)
                    part(r, c) = block_[k](row + r, col + c);
            lu_.add_at(place_[k][std::size_t(q)], part);
        }
    return lu_.factorise();
}

void NodeMatrix::solve(std::vector<Node6>& x)
{
    if (chain_) return band_.solve(x);
    if (factor_ == Factor::none) {
        // Of much fill Cholesky's method is several times as quick, where the matrix is positive
        // definite.
        analyse_elimination();
        if (symmetric_ && !indefinite_ && lu_.cost() > kDear && is_symmetric()) {
            if (cholesky())
                factor_ = Factor::cholesky;
            else
                indefinite_ = true;
        }
        if (factor_ == Factor::none) factor_ = eliminate() ? Factor::lu : Factor::failed;
    }
    Eigen::VectorXd v(6 * size());
    for (int i = 0; i < size(); ++i)
        for (int k = 0; k < 6; ++k)
            v[6 * i + k] = x[std::size_t(i)].value[k];
    if (factor_ == Factor::cholesky)
        v = supernodal_.solved(v);
    else if (factor_ == Factor::lu)
        lu_.solve(v);
    else
        v.setConstant(std::numeric_limits<double>::quiet_NaN());
    for (int i = 0; i < size(); ++i)
        for (int k = 0; k < 6; ++k)
            x[std::size_t(i)].value[k] = v[6 * i + k];
}

} // namespace amontons
