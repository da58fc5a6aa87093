#include "solver/large/petsc/part.hpp"

#include "solver/solid/element.hpp"

#include <algorithm>
#include <metis.h>
#include <stdexcept>

namespace amontons {

Partition make_partition(const AmontonsLargeMesh& mesh, int ranks)
{
    const auto n = std::size_t(mesh.nodes);
    Partition p;
    p.rank_of.assign(n, 0);
    p.number.resize(n);
    p.first.assign(std::size_t(ranks) + 1, 0);
    if (mesh.ranks > 1 && n > 0) {
        std::vector<idx_t> start(n + 1, 0), graph, part(n);
        for (std::size_t i = 0; i < n; ++i) {
            for (std::int32_t k = mesh.graph_start[i]; k < mesh.graph_start[i + 1]; ++k)
                if (mesh.graph[k] != std::int32_t(i)) graph.push_back(mesh.graph[k]);
            start[i + 1] = idx_t(graph.size());
        }
        idx_t nodes = idx_t(n), weights = 1, parts = idx_t(mesh.ranks), cut = 0;
        idx_t options[METIS_NOPTIONS];
        METIS_SetDefaultOptions(options);
        options[METIS_OPTION_SEED] = 1;
        if (METIS_PartGraphKway(&nodes, &weights, start.data(), graph.data(), nullptr, nullptr,
                                nullptr, &parts, nullptr, nullptr, options, &cut,
                                part.data()) != METIS_OK)
            throw std::runtime_error("METIS cannot partition the mesh");
        for (std::size_t i = 0; i < n; ++i)
            p.rank_of[i] = std::int32_t(part[i]);
    }
    for (const std::int32_t r : p.rank_of)
        ++p.first[std::size_t(r) + 1];
    for (std::size_t r = 0; r < std::size_t(ranks); ++r)
        p.first[r + 1] += p.first[r];
    std::vector<std::int32_t> next(p.first.begin(), p.first.end() - 1);
    for (std::size_t i = 0; i < n; ++i)
        p.number[i] = next[std::size_t(p.rank_of[i])]++;
    return p;
}

std::vector<Part> make_parts(const AmontonsLargeMesh& mesh, const Partition& partition)
{
    const std::size_t ranks = partition.first.size() - 1;
    std::vector<Part> parts(ranks);
    for (std::size_t r = 0; r < ranks; ++r) {
        Part& p = parts[r];
        p.all_nodes = std::int32_t(mesh.nodes);
        p.first = partition.first[r];
        p.own = partition.first[r + 1] - p.first;
        p.material = {mesh.youngs_modulus, mesh.poisson_ratio, mesh.density, mesh.of_mass,
                      mesh.of_stiffness};
        p.number.reserve(std::size_t(p.own));
        for (std::int32_t k = 0; k < p.own; ++k)
            p.number.push_back(p.first + k);
    }
    // Elements first with the mesh's numbers, each to all ranks of its nodes.
    for (int b = 0; b < mesh.blocks; ++b) {
        const AmontonsElements& block = mesh.block[b];
        const auto size = std::size_t(shape_of(ElementKind(block.kind)).nodes);
        for (Part& p : parts) {
            p.kind.push_back(block.kind);
            p.count.push_back(0);
        }
        std::vector<std::int32_t> owners;
        for (std::int64_t e = 0; e < block.count; ++e) {
            const std::int32_t* nodes = block.nodes + std::size_t(e) * size;
            owners.clear();
            for (std::size_t i = 0; i < size; ++i)
                owners.push_back(partition.rank_of[std::size_t(nodes[i])]);
            std::sort(owners.begin(), owners.end());
            owners.erase(std::unique(owners.begin(), owners.end()), owners.end());
            for (const std::int32_t r : owners) {
                Part& p = parts[std::size_t(r)];
                ++p.count.back();
                for (std::size_t i = 0; i < size; ++i)
                    p.nodes.push_back(partition.number[std::size_t(nodes[i])]);
            }
        }
    }
    std::vector<std::int32_t> old_number(std::size_t(mesh.nodes));
    for (std::size_t i = 0; i < old_number.size(); ++i)
        old_number[std::size_t(partition.number[i])] = std::int32_t(i);
    std::vector<std::int32_t> held(std::size_t(mesh.nodes), 0);
    for (std::int64_t k = 0; k < mesh.held_count; ++k)
        held[std::size_t(mesh.held[k] / 3)] |= 1 << (mesh.held[k] % 3);
    std::vector<std::int32_t> place(std::size_t(mesh.nodes), -1); // of a new number in `number`
    for (Part& p : parts) {
        for (const std::int32_t node : p.nodes)
            if (node < p.first || node >= p.first + p.own) p.number.push_back(node);
        std::sort(p.number.begin(), p.number.end());
        p.number.erase(std::unique(p.number.begin(), p.number.end()), p.number.end());
        for (std::size_t k = 0; k < p.number.size(); ++k)
            place[std::size_t(p.number[k])] = std::int32_t(k);
        for (std::int32_t& node : p.nodes)
            node = place[std::size_t(node)];
        for (const std::int32_t number : p.number) {
            const std::size_t node = std::size_t(old_number[std::size_t(number)]);
            p.places.insert(p.places.end(), mesh.places + 3 * node, mesh.places + 3 * node + 3);
            p.held.push_back(held[node]);
        }
    }
    return parts;
}

namespace {

/// visit(kind, nodes as places in part.number) of each element.
template <class Visit> void for_each(const Part& part, Visit visit)
{
    std::size_t at = 0;
    for (std::size_t b = 0; b < part.kind.size(); ++b) {
        const auto size = std::size_t(shape_of(ElementKind(part.kind[b])).nodes);
        for (std::int32_t e = 0; e < part.count[b]; ++e, at += size)
            visit(ElementKind(part.kind[b]), std::span(part.nodes).subspan(at, size));
    }
}

} // namespace

OwnRows assemble_rows(const Part& part)
{
    const auto own = std::size_t(part.own);
    // Where the own nodes are among those that are here: they follow each other.
    const auto begin = std::size_t(
        std::lower_bound(part.number.begin(), part.number.end(), part.first) - part.number.begin());
    const auto mine = [&](std::int32_t k) {
        return std::size_t(k) >= begin && std::size_t(k) < begin + own;
    };

    // ---- Neighbours of each node
    // Neighbours of each own node.
    std::vector<std::size_t> upper(own + 1, 0);
    for_each(part, [&](ElementKind, std::span<const std::int32_t> nodes) {
        for (const std::int32_t k : nodes)
            if (mine(k)) upper[std::size_t(k) - begin + 1] += nodes.size();
    });
    for (std::size_t i = 0; i < own; ++i)
        upper[i + 1] += upper[i] + 1; // and itself, should it be of no element
    std::vector<std::int32_t> neighbour(upper[own]);
    std::vector<std::size_t> next(upper.begin(), upper.end() - 1);
    for (std::size_t i = 0; i < own; ++i)
        neighbour[next[i]++] = std::int32_t(begin + i);
    for_each(part, [&](ElementKind, std::span<const std::int32_t> nodes) {
        for (const std::int32_t k : nodes)
            if (mine(k))
                for (const std::int32_t j : nodes)
                    neighbour[next[std::size_t(k) - begin]++] = j;
    });

    // ---- Pattern of the rows
    std::vector<std::size_t> start(own + 1, 0); // of the neighbours, each once
    for (std::size_t i = 0; i < own; ++i) {
        const auto from = neighbour.begin() + std::ptrdiff_t(upper[i]),
                   to = neighbour.begin() + std::ptrdiff_t(upper[i + 1]);
        std::sort(from, to);
        const auto end = std::unique(from, to);
        std::copy(from, end, neighbour.begin() + std::ptrdiff_t(start[i]));
        start[i + 1] = start[i] + std::size_t(end - from);
    }
    neighbour.resize(start[own]);
    if (9 * start[own] > 2147483647u)
        throw std::runtime_error("a rank's rows have more than 2^31 entries: use more ranks");

    OwnRows rows;
    rows.start.resize(3 * own + 1, 0);
    rows.column.resize(9 * start[own]);
    rows.value.assign(9 * start[own], 0);
    for (std::size_t i = 0; i < own; ++i) {
        const std::size_t count = start[i + 1] - start[i];
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const std::size_t at = 9 * start[i] + 3 * axis * count;
            rows.start[3 * i + axis + 1] = std::int32_t(at + 3 * count);
            for (std::size_t k = 0; k < count; ++k)
                for (std::size_t c = 0; c < 3; ++c)
                    rows.column[at + 3 * k + c] = std::int32_t(
                        3 * std::size_t(part.number[std::size_t(neighbour[start[i] + k])]) + c);
        }
    }

    // ---- Stiffness and mass of the elements
    const Mat6 C = elasticity_matrix({part.material[0], part.material[1], part.material[2]});
    const double of_mass = part.material[3], of_stiffness = part.material[4];
    ElementMatrix K, M;
    Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, kMostSolidNodes> X;
    for_each(part, [&](ElementKind kind, std::span<const std::int32_t> nodes) {
        X.resize(3, Eigen::Index(nodes.size()));
        for (std::size_t i = 0; i < nodes.size(); ++i)
            for (int axis = 0; axis < 3; ++axis)
                X(axis, Eigen::Index(i)) =
                    part.places[3 * std::size_t(nodes[i]) + std::size_t(axis)];
        solid_stiffness(kind, X, C, K);
        K *= of_stiffness;
        if (of_mass != 0) {
            solid_mass(kind, X, part.material[2], M);
            for (Eigen::Index j = 0; j < M.cols(); ++j)
                for (Eigen::Index i = 0; i < M.rows(); ++i)
                    for (int axis = 0; axis < 3; ++axis)
                        K(3 * i + axis, 3 * j + axis) += of_mass * M(i, j);
        }
        for (std::size_t a = 0; a < nodes.size(); ++a) {
            if (!mine(nodes[a])) continue;
            const std::size_t i = std::size_t(nodes[a]) - begin, count = start[i + 1] - start[i];
            const auto from = neighbour.begin() + std::ptrdiff_t(start[i]),
                       to = neighbour.begin() + std::ptrdiff_t(start[i + 1]);
            const int row_held = part.held[std::size_t(nodes[a])];
            for (std::size_t b = 0; b < nodes.size(); ++b) {
                const auto k = std::size_t(std::lower_bound(from, to, nodes[b]) - from);
                const int column_held = part.held[std::size_t(nodes[b])];
                for (std::size_t r = 0; r < 3; ++r)
                    for (std::size_t c = 0; c < 3; ++c) {
                        const bool held = (row_held >> r & 1) || (column_held >> c & 1);
                        if (held && !(a == b && r == c)) continue;
                        rows.value[9 * start[i] + 3 * r * count + 3 * k + c] +=
                            K(Eigen::Index(3 * a + r), Eigen::Index(3 * b + c));
                    }
            }
        }
    });
    // A node of no element has no stiffness; its row must still be one.
    for (std::size_t i = 0; i < own; ++i)
        if (start[i + 1] - start[i] == 1)
            for (std::size_t r = 0; r < 3; ++r) {
                double& diagonal = rows.value[9 * start[i] + 3 * r + r];
                if (diagonal == 0) diagonal = 1;
            }
    return rows;
}

} // namespace amontons
