#pragma once

#include "contact/surface/contact_points.hpp"
#include "contact/surface/polygon.hpp"
#include "mesh/extract_surface.hpp"
#include "mesh/face_shape.hpp"

#include <algorithm>
#include <cmath>

namespace amontons {

/// How a face falls into flat triangles, by its own nodes.
struct FlatParts {
    /// The triangles of a face, as corners of its nodes.
    std::span<const std::array<int, 3>> triangles;
    std::span<const Vec2> xi; ///< of the nodes on the reference face
    std::span<const std::array<int, 2>> edges;
};
/// @param nodes  3, 4 (two triangles) or 6 (four, through the middle nodes)
FlatParts flat_parts(std::size_t nodes);

/// The flat triangles of a surface and what lies around each. Made once; places come with every
/// measurement.
class FacetedSurface {
public:
    /// A flat triangle of a face.
    struct Triangle {
        std::array<std::int32_t, 3> nodes{};            ///< of the mesh
        std::int32_t face = 0;                          ///< of the surface
        std::array<Vec2, 3> xi;                         ///< of the nodes on the reference face
        std::array<std::int32_t, 3> beside{-1, -1, -1}; ///< across edge k to k + 1; -1: a border
    };
    struct Edge {
        /// Its two nodes.
        std::array<std::int32_t, 2> nodes{};
        std::int32_t face = 0; ///< one of those that have it
    };

    FacetedSurface() = default;
    /// @param surface  outlives it
    explicit FacetedSurface(const ExternalSurface& surface);

    const ExternalSurface& surface() const { return *surface_; }
    const std::vector<Triangle>& triangles() const { return triangles_; }
    const std::vector<Edge>& edges() const { return edges_; }      ///< of the faces, each once
    std::span<const std::int32_t> around(std::int32_t node) const; ///< triangles
    /// Those of a face follow one another.
    std::span<const Triangle> of_face(std::size_t face) const
    {
        return std::span(triangles_).subspan(first_[face], first_[face + 1] - first_[face]);
    }

private:
    const ExternalSurface* surface_ = nullptr;
    std::vector<Triangle> triangles_;
    std::vector<std::size_t> first_; // of each face, and the end
    std::vector<Edge> edges_;
    std::vector<std::size_t> begin_; // of each node of the mesh in around_, and the end
    std::vector<std::int32_t> around_;
};

/// A surface where it is now.
struct PlacedSurface {
    /// The flat triangles.
    const FacetedSurface& facets;
    std::span<const Vec3> places; ///< of all nodes of the mesh [m]
    /// Of a part of a body's outside: what is behind it down to this depth is in the body [m]. 0:
    /// all of the outside.
    double thickness = 0;
    std::span<const Vec3> at_rest; ///< without strain [m]; empty: not known

    /// The surface without strain, where that is known.
    PlacedSurface without_strain() const
    {
        return {facets, at_rest.empty() ? places : at_rest, 0, {}};
    }
};

/// A place on a surface by its nodes; weights sum to 1.
struct SurfacePlace {
    /// Number of nodes.
    int count = 0;
    /// Nodes and weights; the first `count` are used.
    std::array<StencilEntry, kMostSolidFaceNodes> node{};

    /// Those in use.
    std::span<const StencilEntry> nodes() const
    {
        return std::span(node).first(std::size_t(count));
    }
};

/// A place on a face by the nodes that count there.
/// @param values  shape functions of the face's nodes
template <class Values>
SurfacePlace place_on_face(std::span<const std::int32_t> nodes, const Values& values)
{
    SurfacePlace p;
    for (std::size_t k = 0; k < nodes.size(); ++k)
        if (std::abs(values[Eigen::Index(k)]) > 1e-14)
            p.node[std::size_t(p.count++)] = {nodes[k], values[Eigen::Index(k)]};
    std::sort(p.node.begin(), p.node.begin() + p.count,
              [](const StencilEntry& a, const StencilEntry& b) { return a.node < b.node; });
    return p;
}

} // namespace amontons
