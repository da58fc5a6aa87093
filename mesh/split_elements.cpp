#include "mesh/split_elements.hpp"

#include "mesh/base/error.hpp"

#include <algorithm>
#include <map>
#include <tuple>

namespace amontons {
namespace {

using SharedTriangle = std::array<std::int32_t, 3>;

/// A quadrilateral, cut through its lowest node; both triangles keep its direction.
std::array<SharedTriangle, 2> cut(const FaceNodes& face)
{
    const auto first = static_cast<std::size_t>(
        std::min_element(face.node.begin(), face.node.begin() + 4) - face.node.begin());
    const auto at = [&](std::size_t i) { return face.node[(first + i) % 4]; };
    return {{{at(0), at(1), at(2)}, {at(0), at(2), at(3)}}};
}

std::int32_t face_of(std::span<const std::int32_t> tetra, SharedTriangle corners)
{
    std::sort(corners.begin(), corners.end());
    for (std::int32_t f = 0; f < 4; ++f) {
        const FaceNodes face = face_nodes(ElementView{ElementKind::T4, tetra}, f);
        SharedTriangle other{face.node[0], face.node[1], face.node[2]};
        std::sort(other.begin(), other.end());
        if (other == corners) return f;
    }
    return -1;
}

} // namespace

void append_tetrahedra(const ElementView& element, std::vector<std::array<std::int32_t, 4>>& out)
{
    const auto n = element.nodes;
    if (element.kind != ElementKind::H8) {
        out.push_back({n[0], n[1], n[2], n[3]});
        return;
    }
    const std::int32_t lowest = *std::min_element(n.begin(), n.end());
    for (int f = 0; f < 6; ++f) {
        const FaceNodes face = face_nodes(element, f);
        if (std::find(face.node.begin(), face.node.begin() + 4, lowest) != face.node.begin() + 4)
            continue;
        for (const auto& [a, b, c] : cut(face)) // outward, so the lowest lies behind it
            out.push_back({a, c, b, lowest});
    }
}

VolumeMesh tetrahedra_of(const VolumeMesh& mesh)
{
    AMONTONS_ASSERT(mesh.blocks.size() == 1 && mesh.blocks[0].kind == ElementKind::H8);
    const ElementBlock& hexes = mesh.blocks[0];
    VolumeMesh out;
    out.nodes = mesh.nodes;
    out.node_sets = mesh.node_sets;
    std::vector<std::int32_t> nodes;
    nodes.reserve(24 * hexes.size());
    std::vector<std::array<std::int32_t, 4>> tetras;
    for (std::size_t h = 0; h < hexes.size(); ++h) {
        tetras.clear();
        append_tetrahedra({ElementKind::H8, hexes.element(h)}, tetras);
        for (const auto& t : tetras)
            nodes.insert(nodes.end(), t.begin(), t.end());
    }
    out.blocks.push_back({ElementKind::T4, std::move(nodes)});
    for (const ElementSet& set : mesh.element_sets) {
        ElementSet all{set.name, {}};
        for (const std::int32_t h : set.members)
            for (std::int32_t k = 0; k < 6; ++k)
                all.members.push_back(6 * h + k);
        out.element_sets.push_back(std::move(all));
    }
    for (const FaceSet& set : mesh.face_sets) {
        FaceSet all{set.name, {}};
        for (const FaceRef& ref : set.members)
            for (const SharedTriangle& triangle : cut(face_nodes(mesh, ref)))
                for (std::int32_t t = 6 * ref.element; t < 6 * ref.element + 6; ++t)
                    if (const std::int32_t f =
                            face_of(out.blocks[0].element(static_cast<std::size_t>(t)), triangle);
                        f >= 0)
                        all.members.push_back({t, f});
        std::sort(all.members.begin(), all.members.end());
        out.face_sets.push_back(std::move(all));
    }
    return out;
}

VolumeMesh with_middle_nodes(const VolumeMesh& mesh, const MiddlePlace& place)
{
    AMONTONS_ASSERT(mesh.blocks.size() == 1 && mesh.blocks[0].kind == ElementKind::T4);
    const ElementBlock& tetras = mesh.blocks[0];
    const ElementShape& shape = shape_of(ElementKind::T10);

    struct Side {
        std::int32_t low, high;
        std::size_t at; // of its node in the new connectivity
    };
    std::vector<Side> sides;
    sides.reserve(6 * tetras.size());
    ElementBlock block{ElementKind::T10, std::vector<std::int32_t>(10 * tetras.size())};
    for (std::size_t t = 0; t < tetras.size(); ++t) {
        const auto corners = tetras.element(t);
        std::copy(corners.begin(), corners.end(), &block.nodes[10 * t]);
        for (const LocalEdge& e : shape.edges) {
            const auto [low, high] = std::minmax(corners[static_cast<std::size_t>(e.begin)],
                                                 corners[static_cast<std::size_t>(e.end)]);
            sides.push_back({low, high, 10 * t + static_cast<std::size_t>(e.middle)});
        }
    }
    std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
        return std::tie(a.low, a.high, a.at) < std::tie(b.low, b.high, b.at);
    });

    VolumeMesh out;
    out.nodes = mesh.nodes;
    out.node_sets = mesh.node_sets;
    out.element_sets = mesh.element_sets;
    out.face_sets = mesh.face_sets; // the faces of a T10 are those of its T4
    std::vector<std::array<std::int32_t, 2>> ends;
    for (std::size_t i = 0, j = 0; i < sides.size(); i = j) {
        const auto& [low, high, first] = sides[i];
        const auto number = static_cast<std::int32_t>(out.nodes.size());
        for (; j < sides.size() && sides[j].low == low && sides[j].high == high; ++j)
            block.nodes[sides[j].at] = number;
        const Vec3 half = 0.5 * (mesh.nodes[static_cast<std::size_t>(low)] +
                                 mesh.nodes[static_cast<std::size_t>(high)]);
        out.nodes.push_back(place ? place(low, high) : half);
        ends.push_back({low, high});
    }
    for (NodeSet& set : out.node_sets) {
        std::vector<bool> in(mesh.nodes.size());
        for (const std::int32_t n : set.members)
            in[static_cast<std::size_t>(n)] = true;
        for (std::size_t k = 0; k < ends.size(); ++k)
            if (in[static_cast<std::size_t>(ends[k][0])] &&
                in[static_cast<std::size_t>(ends[k][1])])
                set.members.push_back(static_cast<std::int32_t>(mesh.nodes.size() + k));
    }
    out.blocks.push_back(std::move(block));
    return out;
}

VolumeMesh as_kind(VolumeMesh hexahedra, ElementKind kind, const MiddlePlace& place)
{
    if (kind == ElementKind::H8) return hexahedra;
    VolumeMesh tetrahedra = tetrahedra_of(hexahedra);
    return kind == ElementKind::T4 ? tetrahedra : with_middle_nodes(tetrahedra, place);
}

} // namespace amontons
