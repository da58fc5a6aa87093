#pragma once

#include "solver/output/vtk/render_data.hpp"

class vtkUnstructuredGrid;

namespace amontons::vtk_module {

/// The faces that belong to one element only, as triangles (through the middles of edges too,
/// where elements are quadratic), and their edges as polylines. Point arrays are kept.
/// @param grid  of T4, T10 and H8
/// @throws std::runtime_error  if it holds other cells
Poly outer_surface(vtkUnstructuredGrid* grid);

} // namespace amontons::vtk_module
