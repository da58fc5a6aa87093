#pragma once

#include "mesh/rounded_solid.hpp"
#include "mesh/volume_mesh.hpp"

#include <string>
#include <vector>

// What tetrahedralise needs beside CGAL where a surface is rounded before it is filled.

namespace amontons {

/// Of its triangles.
std::vector<Vec3> middles(const SurfaceMesh& mesh);

/// Turns parts that pass through others so that their normals point outwards: what they enclose
/// together is filled. (Which part lies within which has no answer for them.)
/// @param surface  closed, neighbours agree about the side
/// @return         parts that were turned
std::int64_t turn_crossing_parts(SurfaceMesh& surface);

/// Memory that a RoundedSolid's samples take when all of its surface is sampled [bytes].
double rounded_memory(const SurfaceMesh& surface, double width);

/// Places on the rounded surface, in every cube of edge `spacing` that the surface's vertices and
/// middles of triangles lie in, and one of each part at least, where it did not vanish.
/// @param spacing  [m]
std::vector<Vec3> places_on(const RoundedSolid& solid, const SurfaceMesh& surface, double spacing);

/// Face sets face_1, face_2, ... of an outer face's nearest triangle: the parts of the surface
/// between edges whose normals differ by more than `feature_angle` [rad].
void add_face_sets(VolumeMesh& mesh, const SurfaceMesh& surface, double feature_angle);

/// States where the surface and the mesh's are farther from each other than 1.5 widths, both ways.
/// @param outside  of the mesh
/// @return         a sentence for each way that has such places; one at least
/// @param width  of the rounding [m]
std::vector<std::string> repair_notes(const SurfaceMesh& surface, const SurfaceMesh& outside,
                                      double width);

} // namespace amontons
