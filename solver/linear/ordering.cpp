#include "solver/linear/ordering.hpp"

#include "mesh/base/error.hpp"
#include "mesh/base/metis_lock.hpp"
#include "solver/linear/cholmod_api.hpp"

#include <algorithm>
#include <amd.h>
#include <cholmod.h>
#include <limits>
#include <metis.h>
#include <numeric>

namespace amontons {
namespace {

constexpr idx_t kSeed = 1; // METIS uses random numbers; with this seed the order is always the same
/// Orders differ by a tenth in the work of the factor, which takes far longer than they do on large
/// graphs: of as many the best.
constexpr idx_t kTries = 4;
constexpr std::size_t kManyNodes = 50000;

std::vector<std::int32_t> dissected(const Lists& graph, idx_t seed)
{
    std::vector<idx_t> starts(graph.starts.begin(), graph.starts.end()),
        neighbours(graph.items.begin(), graph.items.end()), order(graph.size()),
        place(graph.size());
    auto count = static_cast<idx_t>(graph.size());
    std::array<idx_t, METIS_NOPTIONS> options{};
    METIS_SetDefaultOptions(options.data());
    options[METIS_OPTION_SEED] = seed;
    options[METIS_OPTION_COMPRESS] = 0; // dofs of a node are one vertex already
    const std::lock_guard lock(metis_mutex());
    if (METIS_NodeND(&count, starts.data(), neighbours.data(), nullptr, options.data(),
                     order.data(), place.data()) != METIS_OK)
        throw std::runtime_error("METIS found no order of " + std::to_string(graph.size()) +
                                 " nodes");
    return {order.begin(), order.end()};
}

/// Operations of a factor in this order.
double work_of(const Lists& graph, std::vector<std::int32_t>& order)
{
    std::vector<std::int32_t> starts(graph.starts.begin(), graph.starts.end());
    cholmod_sparse view{};
    view.nrow = view.ncol = graph.size();
    view.nzmax = graph.items.size();
    view.p = starts.data();
    view.i = const_cast<std::int32_t*>(graph.items.data());
    view.stype = -1;
    view.itype = CHOLMOD_INT;
    view.xtype = CHOLMOD_PATTERN;
    view.dtype = CHOLMOD_DOUBLE;
    view.packed = 1;
    cholmod_common common;
    cholmod_api().start(&common);
    common.supernodal = CHOLMOD_SIMPLICIAL;
    common.nmethods = 1;
    common.method[0].ordering = CHOLMOD_GIVEN;
    cholmod_factor* L = cholmod_api().analyze_p(&view, order.data(), nullptr, 0, &common);
    const double work = L ? common.fl : std::numeric_limits<double>::infinity();
    cholmod_api().free_factor(&L, &common);
    cholmod_api().finish(&common);
    return work;
}

std::vector<std::int32_t> dissected(const Lists& graph)
{
    std::vector<std::int32_t> best = dissected(graph, kSeed);
    if (graph.size() < kManyNodes) return best;
    double least = work_of(graph, best);
    for (idx_t seed = kSeed + 1; seed < kSeed + kTries; ++seed) {
        std::vector<std::int32_t> order = dissected(graph, seed);
        if (const double work = work_of(graph, order); work < least) {
            least = work;
            best = std::move(order);
        }
    }
    return best;
}

std::vector<std::int32_t> of_minimum_degree(const Lists& graph)
{
    std::vector<std::int32_t> starts(graph.starts.begin(), graph.starts.end()), order(graph.size());
    if (amd_order(static_cast<std::int32_t>(graph.size()), starts.data(), graph.items.data(),
                  order.data(), nullptr, nullptr) < AMD_OK)
        throw std::runtime_error("AMD found no order of " + std::to_string(graph.size()) +
                                 " nodes");
    return order;
}

} // namespace

Lists node_graph(const Eigen::SparseMatrix<double>& A, std::span<const std::int32_t> node_of_dof)
{
    AMONTONS_ASSERT(A.rows() == A.cols() && std::size_t(A.cols()) == node_of_dof.size());
    std::int32_t nodes = 0;
    for (const std::int32_t node : node_of_dof) {
        AMONTONS_ASSERT(node >= 0);
        nodes = std::max(nodes, node + 1);
    }
    // Dofs of each node first, so that its neighbours are found in one pass; then every edge is
    // entered at both ends, as a matrix may hold one triangle only.
    std::vector<std::int64_t> begin(std::size_t(nodes) + 1, 0);
    for (const std::int32_t node : node_of_dof)
        ++begin[std::size_t(node) + 1];
    std::partial_sum(begin.begin(), begin.end(), begin.begin());
    std::vector<std::int32_t> dofs(node_of_dof.size());
    std::vector<std::int64_t> next(begin.begin(), begin.end() - 1);
    for (std::size_t k = 0; k < node_of_dof.size(); ++k)
        dofs[std::size_t(next[std::size_t(node_of_dof[k])]++)] = std::int32_t(k);

    std::vector<std::int32_t> seen(std::size_t(nodes), -1);
    const auto for_each_edge = [&](auto visit) {
        std::fill(seen.begin(), seen.end(), -1);
        for (std::int32_t j = 0; j < nodes; ++j)
            for (std::int64_t k = begin[std::size_t(j)]; k < begin[std::size_t(j) + 1]; ++k)
                for (Eigen::SparseMatrix<double>::InnerIterator it(A, dofs[std::size_t(k)]); it;
                     ++it) {
                    const std::int32_t i = node_of_dof[std::size_t(it.row())];
                    if (i == j || seen[std::size_t(i)] == j) continue;
                    seen[std::size_t(i)] = j;
                    visit(i, j);
                }
    };
    Lists graph;
    graph.starts.assign(std::size_t(nodes) + 1, 0);
    for_each_edge([&](std::int32_t i, std::int32_t j) {
        ++graph.starts[std::size_t(i) + 1];
        ++graph.starts[std::size_t(j) + 1];
    });
    std::partial_sum(graph.starts.begin(), graph.starts.end(), graph.starts.begin());
    graph.items.resize(std::size_t(graph.starts.back()));
    std::vector<std::int64_t> end(graph.starts.begin(), graph.starts.end() - 1);
    for_each_edge([&](std::int32_t i, std::int32_t j) {
        graph.items[std::size_t(end[std::size_t(i)]++)] = j;
        graph.items[std::size_t(end[std::size_t(j)]++)] = i;
    });
    // Both triangles there: every edge came twice.
    std::int64_t kept = 0;
    for (std::size_t j = 0; j < std::size_t(nodes); ++j) {
        const auto first = graph.items.begin() + graph.starts[j],
                   last = graph.items.begin() + end[j];
        std::sort(first, last);
        const auto unique_end = std::unique(first, last);
        graph.starts[j] = kept;
        kept = std::copy(first, unique_end, graph.items.begin() + kept) - graph.items.begin();
    }
    graph.starts.back() = kept;
    graph.items.resize(std::size_t(kept));
    return graph;
}

std::vector<std::int32_t> elimination_order(const Lists& graph, Ordering method)
{
    std::vector<std::int32_t> order(graph.size());
    std::iota(order.begin(), order.end(), 0);
    if (graph.items.empty() || method == Ordering::natural) return order; // METIS requires an edge
    if (method == Ordering::automatic)
        method = std::int64_t(graph.size()) < kDissectionNodes ? Ordering::minimum_degree
                                                               : Ordering::nested_dissection;
    return method == Ordering::minimum_degree ? of_minimum_degree(graph) : dissected(graph);
}

} // namespace amontons
