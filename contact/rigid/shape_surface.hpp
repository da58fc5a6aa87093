#pragma once

#include "contact/rigid/shape.hpp"

namespace amontons {

/// A shape as triangles in its own frame, normals outwards, for pictures: round ones by facets, a
/// plane by none.
SurfaceMesh surface_of(const RigidShape& shape);

} // namespace amontons
