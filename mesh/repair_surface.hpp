#pragma once

#include "mesh/surface_check.hpp"

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace amontons {

/// What repair_surface and close_holes changed.
struct SurfaceRepair {
    std::int64_t merged = 0;       ///< vertices that were at the place of another
    std::int64_t collapsed = 0;    ///< triangles with a vertex twice, left out
    std::int64_t flat = 0;         ///< triangles without area, their neighbour divided instead
    std::int64_t repeated = 0;     ///< triangles that were there before, left out
    std::int64_t turned = 0;       ///< triangles that faced the other side than their neighbours
    std::int64_t unused = 0;       ///< vertices of no triangle, left out
    std::int64_t turned_parts = 0; ///< parts whose every triangle faced the wrong side
    bool turned_around = false;    ///< turned_parts are all parts of the surface
    std::int64_t closed_holes = 0; ///< by close_holes
};

/// A sentence for each kind of change, for messages; empty if nothing was changed.
std::vector<std::string> sentences(const SurfaceRepair& repair);

/// Mends what has one meaning only: vertices at the same place (exactly, or nearer than 1e-9 of
/// the diagonal), triangles with a vertex twice, without area or repeated (both are removed if they lie
/// back to back and belong to nothing else), triangles that face the other side than their
/// neighbours, vertices of no triangle; a closed surface then faces outwards, around a cavity into
/// it. Holes, edges of many triangles and self-intersections stay: see check_surface.
SurfaceRepair repair_surface(SurfaceMesh& mesh);

/// Fills each hole with triangles between its border and the border's centre, so that the surface
/// becomes closed; the border stays an edge. The caller decides which holes are intended.
/// @param mesh   of repair_surface
/// @param which  holes to be closed; null: all
/// @return       holes that were closed
std::int64_t close_holes(SurfaceMesh& mesh,
                         const std::function<bool(const BoundaryLoop&)>& which = {});

/// Whether a hole is probably a defect of the mesh, not an opening: it has at most four edges, or a
/// length of at most `longest` [m].
bool is_small_hole(const BoundaryLoop& hole, double longest);

} // namespace amontons
