#pragma once

#include <filesystem>
#include <string>

class vtkPolyData;

namespace amontons::vtk_module {

/// Reads a .vtp with VTK's own reader.
/// @param error  everything VTK complained of, warnings too, or ""
/// @return       new, the caller's to Delete; null if the file cannot be read
vtkPolyData* read_polydata(const std::filesystem::path& vtp, std::string& error);

} // namespace amontons::vtk_module
