#pragma once

#include "mesh/volume_mesh.hpp"

#include <string>
#include <vector>

namespace CLI {
class App;
}

// What the commands that make meshes of solids share.

namespace amontons {

class JsonText;

/// Where a mesh is, and how.
struct MeshOutput {
    std::string file;            ///< .msh .vtu .inp .nodes
    std::string version = "4.1"; ///< of a .msh file
    bool binary = false;         ///< a .msh file
};

/// The options of a MeshOutput. @param names  of that of the file, as CLI11 takes them
void add_output(CLI::App& command, MeshOutput& to, const char* names);

/// Whether the suffix is one of them: before the work, not after it.
/// @throws InputError
void check_output(const MeshOutput& to);

/// @param notes  what the format could not hold as it was is added
/// @throws InputError, WriteError
void write_mesh(const MeshOutput& to, const VolumeMesh& mesh, std::vector<std::string>& notes);

/// "nodes": n, "elements": {"T10": n}
void add_counts(JsonText& json, const VolumeMesh& mesh);
/// "12 nodes, 3 T10"
std::string counts_text(const VolumeMesh& mesh);

/// `name`: the lines
void add_list(JsonText& json, const char* name, const std::vector<std::string>& lines);

} // namespace amontons
