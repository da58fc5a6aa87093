#include "mesh/volume_mesh.hpp"

#include "mesh/base/error.hpp"

#include <algorithm>

namespace amontons {
namespace {

constexpr LocalFace kT4Faces[] = {
    {3, 3, {0, 1, 3}}, {3, 3, {1, 2, 3}}, {3, 3, {2, 0, 3}}, {3, 3, {0, 2, 1}}};
constexpr LocalEdge kT4Edges[] = {{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}};

constexpr LocalFace kT10Faces[] = {{3, 6, {0, 1, 3, 4, 8, 7}},
                                   {3, 6, {1, 2, 3, 5, 9, 8}},
                                   {3, 6, {2, 0, 3, 6, 7, 9}},
                                   {3, 6, {0, 2, 1, 6, 5, 4}}};
constexpr LocalEdge kT10Edges[] = {{0, 1, 4}, {1, 2, 5}, {2, 0, 6},
                                   {0, 3, 7}, {1, 3, 8}, {2, 3, 9}};

constexpr LocalFace kH8Faces[] = {{4, 4, {0, 4, 7, 3}}, {4, 4, {1, 2, 6, 5}}, {4, 4, {0, 1, 5, 4}},
                                  {4, 4, {3, 7, 6, 2}}, {4, 4, {0, 3, 2, 1}}, {4, 4, {4, 5, 6, 7}}};
constexpr LocalEdge kH8Edges[] = {{0, 1}, {1, 2}, {3, 2}, {0, 3}, {4, 5}, {5, 6},
                                  {7, 6}, {4, 7}, {0, 4}, {1, 5}, {3, 7}, {2, 6}};

const ElementShape kShapes[] = {{"T4", 4, 4, kT4Faces, kT4Edges},
                                {"T10", 4, 10, kT10Faces, kT10Edges},
                                {"H8", 8, 8, kH8Faces, kH8Edges}};
static_assert(std::size(kShapes) == kElementKinds);

std::int64_t label(const std::vector<std::int64_t>& labels, std::int64_t first, std::int32_t i)
{
    return labels.empty() ? first + i : labels[static_cast<std::size_t>(i)];
}

} // namespace

const ElementShape& shape_of(ElementKind kind)
{
    return kShapes[static_cast<std::size_t>(kind)];
}

std::size_t ElementBlock::size() const
{
    return nodes.size() / static_cast<std::size_t>(shape_of(kind).nodes);
}

std::span<const std::int32_t> ElementBlock::element(std::size_t i) const
{
    const auto n = static_cast<std::size_t>(shape_of(kind).nodes);
    return std::span<const std::int32_t>(nodes).subspan(i * n, n);
}

std::size_t element_count(const VolumeMesh& mesh)
{
    std::size_t count = 0;
    for (const ElementBlock& block : mesh.blocks)
        count += block.size();
    return count;
}

ElementView element_of(const VolumeMesh& mesh, std::int32_t element)
{
    AMONTONS_ASSERT(element >= 0);
    auto i = static_cast<std::size_t>(element);
    for (const ElementBlock& block : mesh.blocks) {
        if (i < block.size()) return {block.kind, block.element(i)};
        i -= block.size();
    }
    assertion_failed("the element is in the mesh", __FILE__, __LINE__);
}

FaceNodes face_nodes(const ElementView& element, int face)
{
    const ElementShape& shape = shape_of(element.kind);
    AMONTONS_ASSERT(face >= 0 && static_cast<std::size_t>(face) < shape.faces.size());
    const LocalFace& local = shape.faces[static_cast<std::size_t>(face)];
    FaceNodes out{local.corners, local.count, {}};
    std::transform(local.nodes().begin(), local.nodes().end(), out.node.begin(),
                   [&](std::int8_t i) { return element.nodes[static_cast<std::size_t>(i)]; });
    return out;
}

FaceNodes face_nodes(const VolumeMesh& mesh, FaceRef face)
{
    return face_nodes(element_of(mesh, face.element), face.face);
}

std::string node_place(const VolumeMesh& mesh, std::int32_t node)
{
    return "node " + std::to_string(label(mesh.node_labels, mesh.first_label, node));
}

std::string element_place(const VolumeMesh& mesh, std::int32_t element)
{
    return "element " + std::to_string(label(mesh.element_labels, mesh.first_label, element));
}

std::vector<std::int32_t> nodes_of(const VolumeMesh& mesh, const FaceSet& faces)
{
    std::vector<std::int32_t> nodes;
    for (const FaceRef& face : faces.members) {
        const FaceNodes on = face_nodes(mesh, face);
        nodes.insert(nodes.end(), on.nodes().begin(), on.nodes().end());
    }
    std::sort(nodes.begin(), nodes.end());
    nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
    return nodes;
}

} // namespace amontons
