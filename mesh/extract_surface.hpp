#pragma once

#include "mesh/surface_mesh.hpp"
#include "mesh/volume_mesh.hpp"

namespace amontons {

/// The outside of solids: the faces that belong to one element, as they are seen from outside.
struct ExternalSurface {
    std::vector<FaceRef> faces;              ///< ascending
    std::vector<std::int64_t> starts;        ///< of each face in `nodes`, and the end
    std::vector<std::int32_t> nodes;         ///< nodes of the mesh: corners, then middle nodes
    std::vector<std::uint8_t> corners;       ///< of each face: 3 or 4
    std::vector<std::int32_t> used_nodes;    ///< nodes of the mesh that lie on it, ascending
    std::vector<std::int32_t> surface_nodes; ///< of each node of the mesh: in used_nodes, or -1

    /// Nodes of a face.
    std::span<const std::int32_t> face(std::size_t i) const
    {
        return std::span<const std::int32_t>(nodes).subspan(
            static_cast<std::size_t>(starts[i]),
            static_cast<std::size_t>(starts[i + 1] - starts[i]));
    }
};

/// The faces of a mesh that belong to one element only. O(n) for a bounded number of elements at a
/// node.
ExternalSurface extract_surface(const VolumeMesh& mesh);

/// Any faces of a mesh as a surface, for example those of a named set.
ExternalSurface surface_of(const VolumeMesh& mesh, std::span<const FaceRef> faces);

/// An edge between two faces of a surface.
struct SurfaceEdge {
    std::array<std::int32_t, 2> nodes{};       ///< of the mesh, ascending
    std::int32_t middle = -1;                  ///< node of the mesh between them, or -1
    std::array<std::int32_t, 2> faces{-1, -1}; ///< of the surface; the second -1 at a border
    /// Between the planes of the two faces' corners, on the side of the solid: pi where flat,
    /// less on a convex edge [rad]; 0 at a border.
    double angle = 0;
};

/// An edge of more than two faces.
struct CrowdedEdge {
    /// The two nodes.
    std::array<std::int32_t, 2> nodes{};
    /// Faces that share the edge.
    std::vector<std::int32_t> faces;
};

/// Edges of a surface and their faces.
struct SurfaceEdges {
    std::vector<SurfaceEdge> edges;   ///< by their nodes
    std::vector<CrowdedEdge> crowded; ///< not in `edges`
    std::int64_t borders = 0;         ///< edges of one face; a closed surface has none
    int parts = 0;                    ///< parts of the surface that no edge connects
    /// vertices - edges + faces, of the corners; 2 for each part that is a sphere
    std::int64_t euler_characteristic = 0;
};

/// The edges of a surface with the faces at each. O(n log n).
/// @param places  of all nodes of the mesh [m]
SurfaceEdges find_edges(const ExternalSurface& surface, std::span<const Vec3> places);

/// Integrals over a surface, exact for its curved faces (T10: quadratic; H8: bilinear).
struct SurfaceIntegrals {
    double area = 0;                 ///< [m^2]; by quadrature for curved faces
    Vec3 area_vector = Vec3::Zero(); ///< integral of the normal; 0 if closed [m^2]
    double volume = 0;               ///< integral of x . n / 3, enclosed if closed [m^3]
};
/// Area, area vector and enclosed volume of a surface.
SurfaceIntegrals integrate(const ExternalSurface& surface, const VolumeMesh& mesh);

/// The surface as flat triangles with the points `used_nodes`: four for a T10's face (through its
/// middle nodes), two for a quadrilateral (along its shorter diagonal).
struct TriangulatedSurface {
    SurfaceMesh mesh;
    std::vector<std::int32_t> faces; ///< of each triangle: the face of the surface
};
/// The surface as triangles; quadrilaterals and curved faces are divided.
TriangulatedSurface triangulate(const ExternalSurface& surface, const VolumeMesh& mesh);

} // namespace amontons
