#include "contact/surface/fixed_shape.hpp"

#include "mesh/base/error.hpp"

#include <algorithm>

namespace amontons {
namespace {

BoundingBox box_of_places(std::span<const Vec3> places, std::span<const std::int32_t> nodes)
{
    BoundingBox box;
    for (const std::int32_t node : nodes)
        box.add(places[std::size_t(node)]);
    return box;
}

std::vector<BoundingBox> boxes_of_nodes(std::span<const Vec3> places,
                                        std::span<const std::int32_t> nodes)
{
    std::vector<BoundingBox> boxes(nodes.size());
    for (std::size_t i = 0; i < nodes.size(); ++i)
        boxes[i].add(places[std::size_t(nodes[i])]);
    return boxes;
}

std::vector<BoundingBox> boxes_of_pieces(const SharpSurface& s, std::size_t begin, std::size_t end)
{
    std::vector<BoundingBox> boxes;
    boxes.reserve(end - begin);
    for (std::size_t i = begin; i < end; ++i)
        boxes.push_back(piece_box(s, s.features.pieces[i], 0));
    return boxes;
}

} // namespace

FixedShape::FixedShape(const ExternalSurface& of, const SharpFeatures& features,
                       std::span<const Vec3> at)
    : surface(of)
    , sharp(features)
    , places(at)
    , box(box_of_places(at, of.used_nodes))
    , faces(facets_of(of, at))
    , normals(of, at)
    , sharp_nodes(boxes_of_nodes(at, features.nodes))
    , sharp_pieces(boxes_of_pieces({of, features, at}, 0, features.sharp))
    , other_pieces(boxes_of_pieces({of, features, at}, features.sharp, features.pieces.size()))
    , directions(chain_directions({of, features, at}))
{
    for (std::size_t f = 0; f < of.faces.size(); ++f)
        AMONTONS_ASSERT(of.face(f).size() == 3);
}

std::optional<Vec3> smooth_normal_at(const FixedShape& shape, const FacetedSurface& flat,
                                     std::int32_t face, const TrianglePoint& place)
{
    if (!shape.normals.has(face)) return {};
    const FacetedSurface::Triangle& t = flat.triangles()[std::size_t(face)];
    const SmoothGroups& groups = shape.sharp.smooth;
    const auto group_at = [&](std::int32_t f, std::int32_t node) {
        const auto nodes = shape.surface.face(std::size_t(f));
        return groups.group(shape.surface, f,
                            std::size_t(std::ranges::find(nodes, node) - nodes.begin()));
    };
    const auto shared = [&](std::int32_t other, std::int32_t node) {
        return group_at(other, node) == group_at(face, node);
    };
    const int feature = int(place.feature);
    if (feature >= int(TriangleFeature::vertex0)) {
        const std::int32_t node = t.nodes[std::size_t(feature - int(TriangleFeature::vertex0))];
        for (const std::int32_t other : flat.around(node))
            if (!shared(other, node)) return {};
    } else if (feature >= int(TriangleFeature::edge0)) {
        const auto k = std::size_t(feature - int(TriangleFeature::edge0));
        const std::int32_t other = t.beside[k];
        if (other < 0 || !shared(other, t.nodes[k]) || !shared(other, t.nodes[(k + 1) % 3]))
            return {};
    }
    PerNode values = PerNode::Zero();
    values.head<3>() = place.weights;
    return shape.normals.normal(face, values);
}

} // namespace amontons
