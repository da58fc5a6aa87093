#pragma once

#include "mesh/surface_mesh.hpp"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

// A body with flat faces, prepared for contact: coplanar triangles are one face, and only real
// corners and edges are left.

namespace amontons {

/// Which corners, edges and faces belong together. Lists of lists are flat: those of i are
/// entries begin[i] to begin[i + 1].
struct PolyhedronTopology {
    /// An edge by its two vertices.
    struct Edge {
        std::array<std::int32_t, 2> vertex; ///< along runs from the first to the second
        std::array<std::int32_t, 2> face;   ///< the first has the edge counter-clockwise
        bool convex;
    };
    std::span<const Edge> edges;
    std::span<const std::int32_t> vertex_begin, vertex_edges; ///< edges at a vertex
    std::span<const std::int32_t> face_begin, face_edges;     ///< outline of a face
    std::span<const char> face_convex;                        ///< its outline is convex
    std::span<const std::int32_t> triangle_begin;             ///< triangles of a face, n + 1
};

/// Where an edge is.
struct PolyhedronEdge {
    Vec3 along = Vec3::UnitX(); ///< unit
    std::array<Vec3, 2> into;   ///< unit, normal to the edge, in its two faces
    double length = 0;          ///< [m]
};

/// A polyhedron in some frame. Borrowed: valid as long as what it was made of.
struct PolyhedronView {
    const PolyhedronTopology* topology = nullptr;
    std::span<const Vec3> vertices;  ///< [m]
    std::span<const Vec3> normals;   ///< of faces, unit, outwards
    std::span<const double> offsets; ///< normal . x of the points of a face [m]
    std::span<const PolyhedronEdge> edges;
    /// Corners of triangles, face by face, in the body's own frame [m]; empty if all outlines are
    /// convex.
    std::span<const std::array<Vec3, 3>> triangles;
    /// If set, the lists above are in the body's own frame, and the functions below put what they
    /// return into another, x -> turn x + shift: of a large body few features are needed.
    const Mat3* turn = nullptr;
    const Vec3* shift = nullptr; ///< set if `turn` is [m]

    /// Place of a vertex [m].
    Vec3 vertex(std::int32_t i) const
    {
        const Vec3& x = vertices[static_cast<std::size_t>(i)];
        return turn ? Vec3{*turn * x + *shift} : x;
    }
    /// Of a face, unit, outwards.
    Vec3 normal(std::int32_t i) const { return turned_(normals[static_cast<std::size_t>(i)]); }
    /// Normal . x of the points of a face [m].
    double offset(std::int32_t i) const
    {
        const double own = offsets[static_cast<std::size_t>(i)];
        return turn ? own + normal(i).dot(*shift) : own;
    }
    /// Of an edge, unit.
    Vec3 along(std::int32_t i) const { return turned_(edges[static_cast<std::size_t>(i)].along); }
    /// Unit, normal to an edge, in one of its two faces.
    Vec3 into(std::int32_t i, std::size_t face) const
    {
        return turned_(edges[static_cast<std::size_t>(i)].into[face]);
    }
    /// Of an edge [m].
    double length(std::int32_t i) const { return edges[static_cast<std::size_t>(i)].length; }

private:
    Vec3 turned_(const Vec3& x) const { return turn ? Vec3{*turn * x} : x; }
};

/// The polyhedron of a closed triangle surface.
struct Polyhedron {
    /// Of the body [m], and outward unit normals of the faces.
    std::vector<Vec3> vertices, normals;
    /// n . x of each face [m].
    std::vector<double> offsets;
    std::vector<PolyhedronEdge> edges;
    /// Of the surface, as corners [m].
    std::vector<std::array<Vec3, 3>> triangles;

    /// The vertices of each edge.
    std::vector<PolyhedronTopology::Edge> edge_ends;
    /// Where the lists of each vertex, face and triangle begin in the arrays beside them.
    std::vector<std::int32_t> vertex_begin, vertex_edges, face_begin, face_edges, triangle_begin;
    /// 1 where the outline of a face is convex.
    std::vector<char> face_convex;

    // From triangles of the mesh: what a search in its tree finds.
    std::vector<std::int32_t> face_of;                ///< per triangle
    std::vector<std::array<std::int32_t, 3>> edge_of; ///< per side of a triangle; -1: inside a face
    std::vector<std::int32_t> corner_of;              ///< per point of the mesh; -1: no corner
    std::vector<std::array<std::int32_t, 3>> neighbours; ///< triangle across each side
    std::vector<Vec3> triangle_normals, point_normals;   ///< unit; weighted by angle

    /// True if the whole body is convex.
    bool convex = false;
    double size = 0; ///< diagonal of the bounding box [m]

    /// Views of the lists above.
    PolyhedronTopology topology() const;
    /// A view of the body; it must not outlive it or `topology`.
    PolyhedronView view(const PolyhedronTopology& topology) const;
};

/// Triangles that lie in one plane within this part of the size are one face. Ratio.
constexpr double kFlat = 1e-7;

/// Merges triangles to faces and finds corners and edges. O(n log n).
/// @param mesh  closed, manifold, oriented, normals outwards (see make_triangle_shape)
Polyhedron make_polyhedron(const SurfaceMesh& mesh);

/// The unit vector along an axis, or against it.
inline Vec3 signed_axis(int k, bool forward)
{
    Vec3 axis = Vec3::Zero();
    axis[k] = forward ? 1 : -1;
    return axis;
}

/// A box around the origin, faces -x +x -y +y -z +z, vertex number = 1 (x > 0) + 2 (y > 0)
/// + 4 (z > 0). Nothing is allocated.
struct BoxPolyhedron {
    explicit BoxPolyhedron(const Vec3& half_extents);
    /// A view of the box; it must not outlive it.
    PolyhedronView view() const;

    /// The corners [m].
    std::array<Vec3, 8> vertices;
    /// Outward unit normals of the six faces.
    std::array<Vec3, 6> normals;
    /// n . x of each face [m].
    std::array<double, 6> offsets;
    /// The twelve edges.
    std::array<PolyhedronEdge, 12> edges;
};

} // namespace amontons
