#include "mesh/renumber.hpp"

#include "mesh/base/error.hpp"
#include "mesh/base/metis_lock.hpp"
#include "mesh/neighbours.hpp"

#include <algorithm>
#include <metis.h>
#include <numeric>

namespace amontons {
namespace {

constexpr idx_t kSeed = 1; // METIS uses random numbers; with this seed the order is always the same

std::vector<std::int32_t> inverse(const std::vector<std::int32_t>& order)
{
    std::vector<std::int32_t> out(order.size());
    for (std::size_t i = 0; i < order.size(); ++i)
        out[static_cast<std::size_t>(order[i])] = static_cast<std::int32_t>(i);
    return out;
}

template <class T>
std::vector<T> permuted(const std::vector<T>& values, const std::vector<std::int32_t>& old_number)
{
    std::vector<T> out;
    out.reserve(values.size());
    if (!values.empty())
        for (const std::int32_t old : old_number)
            out.push_back(values[static_cast<std::size_t>(old)]);
    return out;
}

template <class Set> void map_set(Set& set, const std::vector<std::int32_t>& new_number)
{
    for (auto& m : set.members)
        m = new_number[static_cast<std::size_t>(m)];
    std::sort(set.members.begin(), set.members.end());
}

} // namespace

Renumbering nested_dissection(const VolumeMesh& mesh)
{
    Renumbering order;
    const auto n = mesh.nodes.size();
    {
        const Lists graph = nodes_at_nodes(mesh);
        std::vector<idx_t> starts(graph.starts.begin(), graph.starts.end()),
            neighbours(graph.items.begin(), graph.items.end()), old_of_new(n), new_of_old(n);
        auto count = static_cast<idx_t>(n);
        std::array<idx_t, METIS_NOPTIONS> options{};
        METIS_SetDefaultOptions(options.data());
        options[METIS_OPTION_SEED] = kSeed;
        const std::lock_guard lock(metis_mutex());
        if (neighbours.empty()) { // METIS requires an edge
            std::iota(old_of_new.begin(), old_of_new.end(), idx_t{0});
        } else if (METIS_NodeND(&count, starts.data(), neighbours.data(), nullptr, options.data(),
                                old_of_new.data(), new_of_old.data()) != METIS_OK) {
            throw std::runtime_error("METIS found no order of " + std::to_string(n) + " nodes");
        }
        order.old_node.assign(old_of_new.begin(), old_of_new.end());
    }
    order.new_node = inverse(order.old_node);

    std::vector<std::pair<std::int64_t, std::int32_t>> elements; // kind and lowest node, number
    for_each_element(mesh, [&](std::int32_t e, ElementKind kind, auto nodes) {
        std::int32_t lowest = order.new_node[static_cast<std::size_t>(nodes[0])];
        for (const std::int32_t i : nodes)
            lowest = std::min(lowest, order.new_node[static_cast<std::size_t>(i)]);
        elements.emplace_back(static_cast<std::int64_t>(kind) << 32 | lowest, e);
    });
    std::sort(elements.begin(), elements.end());
    for (const auto& [key, e] : elements)
        order.old_element.push_back(e);
    order.new_element = inverse(order.old_element);
    return order;
}

VolumeMesh renumbered(const VolumeMesh& mesh, const Renumbering& order)
{
    AMONTONS_ASSERT(order.old_node.size() == mesh.nodes.size());
    AMONTONS_ASSERT(order.old_element.size() == element_count(mesh));
    VolumeMesh out;
    out.first_label = mesh.first_label;
    out.nodes = permuted(mesh.nodes, order.old_node);
    const auto labels = [&](std::vector<std::int64_t> all, std::size_t n) {
        if (all.empty()) {
            all.resize(n);
            std::iota(all.begin(), all.end(), mesh.first_label);
        }
        return all;
    };
    out.node_labels = permuted(labels(mesh.node_labels, mesh.nodes.size()), order.old_node);
    out.element_labels =
        permuted(labels(mesh.element_labels, order.old_element.size()), order.old_element);
    for (const ElementBlock& block : mesh.blocks) {
        out.blocks.push_back({block.kind, {}});
        out.blocks.back().nodes.reserve(block.nodes.size());
    }
    for (const std::int32_t old : order.old_element) {
        const ElementView element = element_of(mesh, old);
        const auto block =
            std::find_if(out.blocks.begin(), out.blocks.end(),
                         [&](const ElementBlock& b) { return b.kind == element.kind; });
        for (const std::int32_t n : element.nodes)
            block->nodes.push_back(order.new_node[static_cast<std::size_t>(n)]);
    }
    out.node_sets = mesh.node_sets;
    out.element_sets = mesh.element_sets;
    out.face_sets = mesh.face_sets;
    for (NodeSet& set : out.node_sets)
        map_set(set, order.new_node);
    for (ElementSet& set : out.element_sets)
        map_set(set, order.new_element);
    for (FaceSet& set : out.face_sets) {
        for (FaceRef& face : set.members)
            face.element = order.new_element[static_cast<std::size_t>(face.element)];
        std::sort(set.members.begin(), set.members.end());
    }
    return out;
}

} // namespace amontons
