#pragma once

#include "mesh/base/error.hpp"
#include "mesh/base/text.hpp"

#include <initializer_list>
#include <string>
#include <string_view>

// Readers choose the format by the suffix of a file's name; for .cpp files alone.

namespace amontons {

/// True if a path ends with the suffix, in any case.
inline bool has_suffix(const std::string& path, std::string_view suffix)
{
    return lower_case(path).ends_with(suffix);
}

/// Advice on how to convert a file of another format into one that can be read, for the end of a
/// message; "" where none is known.
/// @param solid  true for a mesh of solids, false for a surface
inline std::string suffix_hint(const std::string& path, bool solid)
{
    const auto any = [&](std::initializer_list<const char*> suffixes) {
        for (const char* s : suffixes)
            if (has_suffix(path, s)) return true;
        return false;
    };
    if (any({".step", ".stp", ".iges", ".igs", ".brep"}))
        return "; Gmsh meshes this shape: gmsh " + quoted_text(path) +
               (solid ? " -3 -order 2 -o part.msh" : " -2 -o part.stl") +
               " (lengths are then millimetres mostly: \"scale\": 0.001)";
    if (any({".sldprt", ".x_t", ".x_b", ".ipt", ".catpart", ".3dm", ".fcstd", ".dwg", ".dxf"}))
        return "; export it from its program as " +
               std::string(solid
                               ? ".step, which Gmsh meshes: gmsh part.step -3 -order 2 -o part.msh"
                               : ".stl");
    if (any({".nii", ".nii.gz", ".nrrd", ".mha", ".mhd", ".dcm", ".seg.nrrd"}))
        return "; an image: 3D Slicer's Segment Editor makes a surface of it, exported as .stl";
    if (any({".vtk"})) return std::string("; ParaView saves it as ") + (solid ? ".vtu" : ".vtp");
    if (any({".off", ".3mf", ".gltf", ".glb", ".wrl", ".dae", ".amf"}))
        return "; MeshLab or Blender export it as .stl or .ply";
    if (solid && any({".stl", ".obj", ".ply", ".vtp"}))
        return "; a closed surface is filled with tetrahedra by: amontons mesh tetrahedralise " +
               quoted_text(path) + " part.msh";
    if (solid && any({".med", ".bdf", ".nas", ".unv", ".cdb", ".k", ".exo", ".e"}))
        return "; meshio converts it: meshio convert " + quoted_text(path) + " part.msh";
    if (!solid && any({".vtu", ".msh", ".inp", ".nodes"}))
        return "; its outside as triangles: amontons mesh surface " + quoted_text(path) +
               " -o part.stl";
    return "";
}

/// Throws an InputError: the suffix is none of those allowed.
[[noreturn]] inline void refuse_suffix(const std::string& path, const std::string& allowed)
{
    const std::size_t dot = path.find_last_of("./");
    const bool has_dot = dot != std::string::npos && path[dot] == '.';
    FileIssues(path).fatal(
        "", has_dot ? "suffix " + quoted_text(path.substr(dot)) : "a name without suffix", allowed);
}

} // namespace amontons
