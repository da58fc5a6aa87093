#pragma once

#include "contact/rigid/shape.hpp"
#include "mesh/extract_surface.hpp"

namespace amontons {

/// A shape as triangles in its own frame, normals outwards, for pictures: round ones by facets, a
/// plane by none.
SurfaceMesh surface_of(const RigidShape& shape);

/// The flat ends of a cylinder as polygons of 64 corners on its rims, fanned: 0.2 % of their area are
/// left out.
SurfaceMesh flat_ends(const Cylinder& cylinder);

/// A triangle mesh as a surface of faces.
ExternalSurface surface_of_triangles(const SurfaceMesh& mesh);

} // namespace amontons
