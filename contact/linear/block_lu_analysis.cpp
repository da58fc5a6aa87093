#include "contact/linear/block_lu.hpp"

#include "contact/linear/block_lu_sizes.hpp"

#include <Eigen/OrderingMethods>
#include <algorithm>
#include <cmath>

// The part of BlockLu that depends on the pattern alone. Which columns are joined to supernodes is
// decided by the estimate of time below: a few explicit zeros are cheaper than many small products.

namespace amontons {
namespace {

using namespace block_lu;

// Estimates [ns], fitted to measurements.

/// Products of `tiles` tiles (kTileBlocks block rows, one block column) that hold `blocks` blocks.
double product_cost(double tiles, double blocks, double depth)
{
    return tiles * (10 + 5 * depth) + 3 * blocks;
}

/// Everything that supernode (width, below) causes: its diagonal block, panels, and updates.
double supernode_cost(int width, int below)
{
    const double w = width, m = below, tiles = std::ceil(m / kTileBlocks);
    double pivot = 15;
    if (width > kNarrow)
        pivot = below > 0 ? 2 * w * w * w + 80 * w * w : 0.6 * w * w * w + 40 * w * w;
    else if (width > 1)
        pivot = 3 * w * (25 + 10 * w);
    double panels = 0;
    if (below > 0) // the updates have m, m - 1, .. trailing rows, for L and for U
        panels = product_cost(tiles * w, m * w, w) + 20 * m +
                 product_cost(m * (m + kTileBlocks) / kTileBlocks, m * m, w);
    return 20 + pivot + panels + 0.3 * 9 * w * (w + 2 * m);
}

/// Fill-reducing order by approximate minimum degree.
std::vector<int> minimum_degree(int n, const std::vector<std::size_t>& start,
                                const std::vector<int>& neighbour)
{
    std::vector<Eigen::Triplet<double>> entries;
    for (int j = 0; j < n; ++j)
        for (std::size_t k = start[size(j)]; k < start[size(j) + 1]; ++k)
            entries.emplace_back(neighbour[k], j, 1.0);
    Eigen::SparseMatrix<double> graph(n, n);
    graph.setFromTriplets(entries.begin(), entries.end());
    Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> permutation;
    Eigen::AMDOrdering<int>()(graph, permutation);
    const auto& indices = permutation.indices();
    return {indices.data(), indices.data() + n};
}

/// Rows below the diagonal of each column of the factor, ascending: the column's own, those that
/// mirror its row, and those of its children in the elimination tree. The parent of a column is
/// its first row.
std::vector<std::vector<int>> factor_pattern(const std::vector<int>& place,
                                             const std::vector<std::size_t>& start,
                                             const std::vector<int>& neighbour)
{
    const int n = static_cast<int>(place.size());
    std::vector<std::vector<int>> rows(place.size()), children(place.size());
    for (int j = 0; j < n; ++j)
        for (std::size_t e = start[size(j)]; e < start[size(j) + 1]; ++e) {
            const int row = place[size(neighbour[e])], column = place[size(j)];
            if (row != column) rows[size(std::min(row, column))].push_back(std::max(row, column));
        }
    std::vector<int> mark(place.size(), -1);
    for (int k = 0; k < n; ++k) {
        std::vector<int> own;
        const auto take = [&](int row) {
            if (row <= k || mark[size(row)] == k) return;
            mark[size(row)] = k;
            own.push_back(row);
        };
        for (int row : rows[size(k)])
            take(row);
        for (int child : children[size(k)])
            for (int row : rows[size(child)])
                take(row);
        std::sort(own.begin(), own.end());
        if (!own.empty()) children[size(own.front())].push_back(k);
        rows[size(k)] = std::move(own);
    }
    return rows;
}

/// Groups of columns, each named by its last column, whose rows below are those of the group.
struct ColumnGroups {
    std::vector<int> width;                 // 0: joined to another
    std::vector<std::vector<int>> joined;   // the groups that a group has taken in
    std::vector<std::vector<int>> children; // groups whose parent is a column of this one
};

/// Joins children to their parents where that is cheaper: only without zeros, or with some.
void join(ColumnGroups& groups, const std::vector<std::vector<int>>& rows, bool with_zeros)
{
    const int n = static_cast<int>(rows.size());
    for (int parent = 0; parent < n; ++parent) {
        if (groups.width[size(parent)] == 0) continue;
        const int below = static_cast<int>(rows[size(parent)].size());
        int& width = groups.width[size(parent)];
        std::vector<int> kept, candidates = groups.children[size(parent)];
        // Fewest zeros first: w (w_parent + m_parent - m) of them.
        std::stable_sort(candidates.begin(), candidates.end(),
                         [&](int a, int b) { return rows[size(a)].size() > rows[size(b)].size(); });
        for (int child : candidates) {
            const int own = groups.width[size(child)];
            const int child_below = static_cast<int>(rows[size(child)].size());
            const bool equal = child_below == width + below;
            if ((!equal && !with_zeros) ||
                supernode_cost(own + width, below) >=
                    supernode_cost(own, child_below) + supernode_cost(width, below)) {
                kept.push_back(child);
                continue;
            }
            width += own;
            groups.width[size(child)] = 0;
            groups.joined[size(parent)].push_back(child);
            kept.insert(kept.end(), groups.children[size(child)].begin(),
                        groups.children[size(child)].end());
        }
        groups.children[size(parent)] = std::move(kept);
    }
}

} // namespace

void BlockLu::analyse(const std::vector<std::size_t>& start, const std::vector<int>& neighbour)
{
    n_ = static_cast<int>(start.size()) - 1;
    order_ = minimum_degree(n_, start, neighbour);
    place_.resize(size(n_));
    for (int k = 0; k < n_; ++k)
        place_[size(order_[size(k)])] = k;
    const std::vector<std::vector<int>> rows = factor_pattern(place_, start, neighbour);

    ColumnGroups groups{std::vector<int>(size(n_), 1), std::vector<std::vector<int>>(size(n_)),
                        std::vector<std::vector<int>>(size(n_))};
    for (int k = 0; k < n_; ++k)
        if (!rows[size(k)].empty()) groups.children[size(rows[size(k)].front())].push_back(k);
    join(groups, rows, false);
    join(groups, rows, true);

    // Supernodes in postorder of their tree: descendants first, and those of one branch together.
    std::vector<std::vector<int>> columns;
    std::vector<const std::vector<int>*> below;
    std::vector<int> stack, postorder;
    for (int k = n_; k-- > 0;)
        if (groups.width[size(k)] > 0 && rows[size(k)].empty()) stack.push_back(k);
    while (!stack.empty()) {
        const int group = stack.back();
        stack.pop_back();
        postorder.push_back(group);
        for (int child : groups.children[size(group)])
            stack.push_back(child);
    }
    for (auto group = postorder.rbegin(); group != postorder.rend(); ++group) {
        std::vector<int> own{*group};
        for (std::size_t k = 0; k < own.size(); ++k)
            own.insert(own.end(), groups.joined[size(own[k])].begin(),
                       groups.joined[size(own[k])].end());
        std::sort(own.begin(), own.end());
        columns.push_back(std::move(own));
        below.push_back(&rows[size(*group)]);
    }
    lay_out(columns, below);
}

/// From supernodes in the order of elimination, numbered as in order_, to the final order_.
void BlockLu::lay_out(const std::vector<std::vector<int>>& columns,
                      const std::vector<const std::vector<int>*>& rows)
{
    std::vector<int> order, renumbered(size(n_));
    supernodes_.clear();
    supernode_of_.clear();
    for (const std::vector<int>& own : columns) {
        Supernode s;
        s.first = static_cast<int>(order.size());
        s.width = static_cast<int>(own.size());
        for (int column : own) {
            renumbered[size(column)] = static_cast<int>(order.size());
            order.push_back(order_[size(column)]);
            supernode_of_.push_back(static_cast<int>(supernodes_.size()));
        }
        supernodes_.push_back(s);
    }
    order_ = std::move(order);
    for (int k = 0; k < n_; ++k)
        place_[size(order_[size(k)])] = k;

    row_.clear();
    dense_.clear();
    fill_ = 0;
    cost_ = 0;
    std::size_t values = 0, inverses = 0, scratch = 0, part = 0;
    std::vector<std::vector<Update>> updates(supernodes_.size());
    for (std::size_t k = 0; k < supernodes_.size(); ++k) {
        Supernode& s = supernodes_[k];
        s.below = static_cast<int>(rows[k]->size());
        s.row = row_.size();
        for (int row : *rows[k])
            row_.push_back(renumbered[size(row)]);
        std::sort(row_.begin() + static_cast<std::ptrdiff_t>(s.row), row_.end());
        s.panel = values;
        s.inverse = inverses;
        values += 9 * size(s.width) * size(s.width + 2 * s.below);
        if (s.width > kNarrow) {
            s.dense = static_cast<int>(dense_.size());
            dense_.emplace_back();
        }
        if (s.width <= kNarrow || s.below > 0) inverses += 9 * size(s.width) * size(s.width);
        fill_ += size(s.width) * size(s.width + s.below);
        cost_ += supernode_cost(s.width, s.below);
        part = std::max(part, size(3 * std::max(s.below, s.width)));
        scratch = std::max(scratch, 9 * size(s.below) * size(s.width));
        for (int begin = 0; begin < s.below;) {
            const int target = supernode_of_[size(row_[s.row + size(begin)])];
            int end = begin + 1;
            while (end < s.below && supernode_of_[size(row_[s.row + size(end)])] == target)
                ++end;
            updates[size(target)].push_back({static_cast<int>(k), begin, end});
            scratch = std::max(scratch, 9 * size(s.below - begin) * size(end - begin));
            begin = end;
        }
    }
    updates_.clear();
    first_update_.assign(1, 0);
    for (const std::vector<Update>& own : updates) {
        updates_.insert(updates_.end(), own.begin(), own.end());
        first_update_.push_back(updates_.size());
    }
    values_ = values + kSlack;
    value_.clear();
    inverses_ = inverses + kSlack;
    inverse_.clear();
    at_.assign(size(n_), 0);
    part_at_.assign(size(n_), 0);
    scratch_.assign(scratch + kSlack, 0);
    x_.assign(3 * size(n_) + kSlack, 0);
    part_.assign(part + kSlack, 0);
}

} // namespace amontons
