#include "mesh/neighbours.hpp"

#include "mesh/base/error.hpp"

#include <algorithm>
#include <tuple>

namespace amontons {
namespace {

// Lists from (owner, item) pairs that `emit` gives twice in the same order: once to count, once to
// fill. No sorting of all pairs, no list of lists.
template <class Emit> Lists lists_of(std::size_t n, Emit emit)
{
    Lists lists;
    lists.starts.assign(n + 1, 0);
    emit([&](std::int32_t owner, std::int32_t) {
        ++lists.starts[static_cast<std::size_t>(owner) + 1];
    });
    for (std::size_t i = 0; i < n; ++i)
        lists.starts[i + 1] += lists.starts[i];
    lists.items.resize(static_cast<std::size_t>(lists.starts[n]));
    std::vector<std::int64_t> next(lists.starts.begin(), lists.starts.end() - 1);
    emit([&](std::int32_t owner, std::int32_t item) {
        lists.items[static_cast<std::size_t>(next[static_cast<std::size_t>(owner)]++)] = item;
    });
    return lists;
}

SortedFace sorted_face(ElementKind kind, std::span<const std::int32_t> nodes, FaceRef face)
{
    const LocalFace& local = shape_of(kind).faces[static_cast<std::size_t>(face.face)];
    SortedFace out{{-1, -1, -1, -1}, face};
    for (int i = 0; i < local.corners; ++i)
        out.corners[static_cast<std::size_t>(i)] =
            nodes[static_cast<std::size_t>(local.node[static_cast<std::size_t>(i)])];
    sort_few(std::span(out.corners).first(static_cast<std::size_t>(local.corners)));
    return out;
}

} // namespace

Lists elements_at_nodes(const VolumeMesh& mesh)
{
    return lists_of(mesh.nodes.size(), [&](auto add) {
        for_each_element(mesh, [&](std::int32_t e, ElementKind, auto nodes) {
            for (std::size_t i = 0; i < nodes.size(); ++i) // a node that is there twice counts once
                if (std::find(nodes.begin(), nodes.begin() + static_cast<std::ptrdiff_t>(i),
                              nodes[i]) == nodes.begin() + static_cast<std::ptrdiff_t>(i))
                    add(nodes[i], e);
        });
    });
}

Lists nodes_at_nodes(const VolumeMesh& mesh)
{
    const Lists elements = elements_at_nodes(mesh);
    Lists lists;
    lists.starts.assign(mesh.nodes.size() + 1, 0);
    std::vector<std::int32_t> seen_by(mesh.nodes.size(), -1);
    for (std::size_t i = 0; i < mesh.nodes.size(); ++i) {
        const auto node = static_cast<std::int32_t>(i);
        seen_by[i] = node;
        const std::size_t start = lists.items.size();
        for (const std::int32_t e : elements.of(node))
            for (const std::int32_t other : element_of(mesh, e).nodes)
                if (std::int32_t& seen = seen_by[static_cast<std::size_t>(other)]; seen != node) {
                    seen = node;
                    lists.items.push_back(other);
                }
        std::sort(lists.items.begin() + static_cast<std::ptrdiff_t>(start), lists.items.end());
        lists.starts[i + 1] = static_cast<std::int64_t>(lists.items.size());
    }
    return lists;
}

std::vector<SortedFace> sorted_faces(const VolumeMesh& mesh)
{
    // Into buckets by the lowest corner, then a sort of each short bucket.
    std::vector<std::size_t> starts(mesh.nodes.size() + 1, 0);
    const auto emit = [&](auto add) {
        for_each_element(mesh, [&](std::int32_t e, ElementKind kind, auto nodes) {
            for (std::size_t f = 0; f < shape_of(kind).faces.size(); ++f)
                add(sorted_face(kind, nodes, {e, static_cast<std::int32_t>(f)}));
        });
    };
    emit([&](const SortedFace& face) { ++starts[static_cast<std::size_t>(face.corners[0]) + 1]; });
    for (std::size_t i = 0; i + 1 < starts.size(); ++i)
        starts[i + 1] += starts[i];
    std::vector<SortedFace> faces(starts.back());
    std::vector<std::size_t> next(starts.begin(), starts.end() - 1);
    emit([&](const SortedFace& face) {
        faces[next[static_cast<std::size_t>(face.corners[0])]++] = face;
    });
    for (std::size_t i = 0; i + 1 < starts.size(); ++i)
        std::sort(faces.begin() + static_cast<std::ptrdiff_t>(starts[i]),
                  faces.begin() + static_cast<std::ptrdiff_t>(starts[i + 1]),
                  [](const SortedFace& a, const SortedFace& b) {
                      return std::tie(a.corners, a.face) < std::tie(b.corners, b.face);
                  });
    return faces;
}

Lists elements_at_faces(const VolumeMesh& mesh)
{
    Lists lists;
    lists.starts.push_back(0);
    for_each_element(mesh, [&](std::int32_t, ElementKind kind, auto) {
        lists.starts.push_back(lists.starts.back() +
                               static_cast<std::int64_t>(shape_of(kind).faces.size()));
    });
    lists.items.assign(static_cast<std::size_t>(lists.starts.back()), -1);
    const auto beyond = [&](const FaceRef& face) -> std::int32_t& {
        return lists.items[static_cast<std::size_t>(
            lists.starts[static_cast<std::size_t>(face.element)] + face.face)];
    };
    for_each_face(sorted_faces(mesh), [&](std::span<const SortedFace> same) {
        if (same.size() != 2) return;
        beyond(same[0].face) = same[1].face.element;
        beyond(same[1].face) = same[0].face.element;
    });
    return lists;
}

} // namespace amontons
