#pragma once

#include "mesh/base/text.hpp"
#include "mesh/surface_mesh.hpp"

#include <cstdint>
#include <string>
#include <vector>

namespace amontons {

/// Faces as a file gives them: any number of corners each.
struct PolygonList {
    std::vector<std::int64_t> corners; ///< of all faces, one after the other; from 0
    std::vector<std::size_t> ends;     ///< of each face in `corners`
    std::vector<std::size_t> places;   ///< where each face stands in the file
};

/// Names of the faces of a format in messages.
struct FaceWords {
    const char* place = "line";   ///< what PolygonList::places counts
    std::int64_t first_index = 0; ///< of the first vertex, as the format counts
};

/// Cuts faces into triangles of the same orientation and adds them to a mesh.
///
/// A quadrilateral is cut along its shorter diagonal that lies inside; larger polygons lose
/// ears, seen along their mean normal. Faces without area stay, as triangles without area.
/// Adds an Issue for a face of fewer than 3 or more than 1024 corners, or with a corner that is
/// not in mesh.points.
void append_faces(SurfaceMesh& mesh, const PolygonList& faces, const FaceWords& words,
                  FileIssues& issues);

/// Issue for a surface that has no triangle.
void refuse_empty(const SurfaceMesh& mesh, FileIssues& issues);

/// Scales a point read from a file and adds an Issue if a coordinate is not finite.
Vec3 finite_point(const Vec3& x, double scale, const std::string& place, FileIssues& issues);

} // namespace amontons
