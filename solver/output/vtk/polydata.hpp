#pragma once

#include <filesystem>
#include <string>

class vtkPolyData;
class vtkUnstructuredGrid;

namespace amontons::vtk_module {

/// Reads a .vtp with VTK's own reader.
/// @param error  everything VTK complained of, warnings too, or ""
/// @return       new, the caller's to Delete; null if the file cannot be read
vtkPolyData* read_polydata(const std::filesystem::path& vtp, std::string& error);

/// Reads a .vtu in the same way.
vtkUnstructuredGrid* read_grid(const std::filesystem::path& vtu, std::string& error);

} // namespace amontons::vtk_module
