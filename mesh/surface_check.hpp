#pragma once

#include "mesh/base/error.hpp"
#include "mesh/surface_mesh.hpp"

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace amontons {

/// An edge and the triangles on it. Indices count from 0, as in ParaView.
struct EdgeFault {
    /// The two vertices.
    std::array<std::int32_t, 2> vertices{};
    /// Triangles at the edge.
    std::vector<std::int32_t> triangles;
};

/// A hole: edges with one triangle, from vertex to vertex.
struct BoundaryLoop {
    std::vector<std::int32_t> vertices; ///< in order; each once
    Vec3 centre = Vec3::Zero();         ///< of the loop's length [m]
    double length = 0;                  ///< [m]
};

/// Properties and possible defects of a surface. None is an error by itself: see issues().
struct SurfaceReport {
    /// Counts.
    std::int64_t vertices = 0, triangles = 0;
    double diagonal = 0;        ///< of the bounding box of the vertices in use [m]
    int components = 0;         ///< parts of the surface that no edge connects
    double enclosed_volume = 0; ///< > 0 if normals point out of it; see orient_surface.hpp [m^3]
    std::vector<EdgeFault> non_manifold;  ///< edges with more than two triangles
    std::vector<EdgeFault> inconsistent;  ///< edges whose two triangles run along it the same way
    std::vector<BoundaryLoop> boundaries; ///< by length, the longest first
    std::vector<std::int32_t> degenerate; ///< triangles lower than 1e-12 of the diagonal
    /// Vertices at the same place, or nearer than 1e-9 of the diagonal to one before.
    std::vector<std::array<std::int32_t, 2>> coincident;
    std::vector<std::int32_t> unreferenced;                 ///< vertices of no triangle
    std::vector<std::array<std::int32_t, 2>> intersections; ///< the first 10 pairs of triangles
    std::int64_t intersection_count = 0;                    ///< of all pairs; see SelfIntersections

    /// Every edge has two triangles.
    bool closed() const { return triangles > 0 && boundaries.empty() && non_manifold.empty(); }
};

/// Determines everything in SurfaceReport. 100 000 triangles in 0.5 s.
/// @param mesh  indices within its points (else std::logic_error), finite coordinates
SurfaceReport check_surface(const SurfaceMesh& mesh);

/// What a use of a surface needs of it.
struct SurfaceRequirements {
    bool closed = false;            ///< no holes
    bool manifold = true;           ///< no edge with more than two triangles
    bool oriented = true;           ///< neighbours agree about the side
    bool simple = true;             ///< no self-intersections
    bool without_degenerate = true; ///< every triangle has a normal
};

/// What a surface has that its use does not allow. The first few faults of each kind are named
/// with triangle or vertices and coordinates; the rest is counted.
/// @param file  as the user wrote it
std::vector<Issue> issues(const SurfaceReport& report, const SurfaceMesh& mesh,
                          const SurfaceRequirements& required, const std::string& file);

} // namespace amontons
