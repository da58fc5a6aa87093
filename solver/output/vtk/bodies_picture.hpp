#pragma once

#include "solver/output/vtk/render_data.hpp"

class vtkRenderWindow;

namespace amontons::vtk_module {

/// Fills the window with the page of a run of solids and rigid bodies: the end large, earlier
/// instants small, seen from an angle with z up.
/// @throws std::runtime_error  if all bodies are points
void add_bodies_page(vtkRenderWindow* window, const RenderData& result);

} // namespace amontons::vtk_module
