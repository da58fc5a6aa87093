#pragma once

#include "mesh/base/types.hpp"

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

// Solids as elements between nodes. The order of an element's nodes is VTK's (readers and writers
// convert); (a,b) is the node in the middle of the edge from a to b:
//
//   T4   0 1 2 3, where 3 lies on the side that the triangle 0 1 2 faces (counter-clockwise)
//   T10  T4, then (0,1) (1,2) (2,0) (0,3) (1,3) (2,3)
//   H8   0 1 2 3 around one face, 4 5 6 7 above them: 0 1 2 3 is counter-clockwise seen from 4
//
// The faces of an element have VTK's order too, their nodes are counter-clockwise seen from
// outside; the middle nodes of a T10's face follow its corners: (a,b) (b,c) (c,a).

namespace amontons {

/// Elements of solids.
enum class ElementKind : std::uint8_t { T4, T10, H8 };
/// Number of kinds.
constexpr int kElementKinds = 3;
constexpr int kMostElementNodes = 20; ///< of a kind that may come (H20)
constexpr int kMostFaceNodes = 8;

/// A face of an element: local node numbers, corners first, counter-clockwise seen from outside.
struct LocalFace {
    /// Corners, and all nodes of the face.
    int corners = 0, count = 0;
    /// Local numbers; the first `count` are used.
    std::array<std::int8_t, kMostFaceNodes> node{};
    /// Those in use.
    std::span<const std::int8_t> nodes() const
    {
        return {node.data(), static_cast<std::size_t>(count)};
    }
};

/// Two corners, and the node between them or -1.
struct LocalEdge {
    /// Local numbers of its ends, and of its middle (-1: none).
    std::int8_t begin = 0, end = 0, middle = -1;
};

/// What all elements of a kind share.
struct ElementShape {
    const char* name = "";
    /// Corners, and all nodes of the element.
    int corners = 0, nodes = 0;
    std::span<const LocalFace> faces;
    std::span<const LocalEdge> edges;
};

/// Faces, edges and names of a kind of element.
const ElementShape& shape_of(ElementKind kind);

/// Elements of one kind.
struct ElementBlock {
    ElementKind kind = ElementKind::T4;
    std::vector<std::int32_t> nodes; ///< shape_of(kind).nodes of each, element by element

    /// Number of elements.
    std::size_t size() const;
    /// Nodes of element i.
    std::span<const std::int32_t> element(std::size_t i) const;
};

/// A face of a mesh: element (counted through all blocks) and its local face.
struct FaceRef {
    /// Number of the element in the mesh.
    std::int32_t element = 0;
    /// Number of the face in the element.
    std::int32_t face = 0;
    auto operator<=>(const FaceRef&) const = default;
};

/// A part of a mesh with a name; members in ascending order, each once.
template <class Member> struct NamedSet {
    std::string name;
    std::vector<Member> members;
    bool operator==(const NamedSet&) const = default;
};

/// A named set of nodes.
using NodeSet = NamedSet<std::int32_t>;
using ElementSet = NamedSet<std::int32_t>; ///< elements counted through all blocks
using FaceSet = NamedSet<FaceRef>;

/// Solid bodies as elements. Names are unique among the sets of one type.
struct VolumeMesh {
    std::vector<Vec3> nodes;          ///< 3 x n [m]
    std::vector<ElementBlock> blocks; ///< at most one of a kind, in the order of ElementKind
    std::vector<NodeSet> node_sets;
    std::vector<ElementSet> element_sets;
    std::vector<FaceSet> face_sets;
    /// The numbers that the file gave, for messages; empty if it counts on from first_label.
    std::vector<std::int64_t> node_labels, element_labels;
    std::int64_t first_label = 1;
};

/// Number of elements of all blocks.
std::size_t element_count(const VolumeMesh& mesh);

/// An element by its number through all blocks.
struct ElementView {
    ElementKind kind = ElementKind::T4;
    /// Its nodes, corners first.
    std::span<const std::int32_t> nodes;
};
/// An element by its number in the mesh.
ElementView element_of(const VolumeMesh& mesh, std::int32_t element);

/// Corners and middle nodes of a face, as they lie on it seen from outside.
struct FaceNodes {
    /// Corners, and all nodes of the face.
    int corners = 0, count = 0;
    /// Numbers in the mesh; the first `count` are used.
    std::array<std::int32_t, kMostFaceNodes> node{};
    /// Those in use.
    std::span<const std::int32_t> nodes() const
    {
        return {node.data(), static_cast<std::size_t>(count)};
    }
};
/// Nodes of a local face of an element.
FaceNodes face_nodes(const ElementView& element, int face);
FaceNodes face_nodes(const VolumeMesh& mesh, FaceRef face);

/// Calls visit(std::int32_t number, ElementKind, std::span<const std::int32_t> nodes) for all.
template <class Visit> void for_each_element(const VolumeMesh& mesh, Visit visit)
{
    std::int32_t number = 0;
    for (const ElementBlock& block : mesh.blocks) {
        const auto n = static_cast<std::size_t>(shape_of(block.kind).nodes);
        for (std::size_t i = 0; i + n <= block.nodes.size(); i += n)
            visit(number++, block.kind, std::span<const std::int32_t>(&block.nodes[i], n));
    }
}

/// "node 17", "element 3": by the number that the file gave.
std::string node_place(const VolumeMesh& mesh, std::int32_t node);
/// An element and its middle in words, for messages.
std::string element_place(const VolumeMesh& mesh, std::int32_t element);

/// All nodes of a set of faces, ascending.
std::vector<std::int32_t> nodes_of(const VolumeMesh& mesh, const FaceSet& faces);

/// The set of a name, or nullptr.
template <class Member>
const NamedSet<Member>* find_set(const std::vector<NamedSet<Member>>& sets, std::string_view name)
{
    for (const NamedSet<Member>& set : sets)
        if (set.name == name) return &set;
    return nullptr;
}

} // namespace amontons
