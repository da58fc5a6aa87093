#include "mesh/read_volume.hpp"

#include "mesh/base/file.hpp"
#include "mesh/format/abaqus.hpp"
#include "mesh/format/plain.hpp"
#include "mesh/format/vtu.hpp"

#include <cmath>

namespace amontons {
namespace {

constexpr std::string_view kNodes = ".nodes";

bool has_suffix(const std::string& path, std::string_view suffix)
{
    return lower_case(path).ends_with(suffix);
}

[[noreturn]] void refuse_suffix(const std::string& path, const char* allowed)
{
    const std::size_t dot = path.find_last_of("./");
    const bool has_dot = dot != std::string::npos && path[dot] == '.';
    FileIssues(path).fatal(
        "", has_dot ? "suffix " + quoted_text(path.substr(dot)) : "a name without suffix", allowed);
}

} // namespace

std::string elements_path(const std::string& nodes_path)
{
    return nodes_path.substr(0, nodes_path.size() - kNodes.size()) + ".elements";
}

VolumeFile read_volume(const std::string& path, double scale)
{
    if (!(scale > 0 && std::isfinite(scale)))
        FileIssues(path).fatal("", "scale " + number_text(scale), "> 0 and finite [m per unit]");
    if (has_suffix(path, ".msh")) return parse_gmsh(read_file(path), path, scale);
    if (has_suffix(path, ".vtu")) return parse_vtu(read_file(path), path, scale);
    if (has_suffix(path, ".inp")) return parse_abaqus(read_file(path), path, scale);
    if (has_suffix(path, kNodes)) {
        const std::string elements = elements_path(path);
        return parse_plain(read_file(path), read_file(elements), path, elements, scale);
    }
    refuse_suffix(path, ".msh, .vtu, .inp or .nodes (with .elements beside it)");
}

void check_volume_suffix(const std::string& path)
{
    if (!has_suffix(path, ".msh") && !has_suffix(path, ".inp") && !has_suffix(path, kNodes))
        refuse_suffix(path, ".msh, .vtu, .inp or .nodes");
}

void write_volume(const std::string& path, const VolumeMesh& mesh, const GmshOptions& gmsh,
                  std::vector<std::string>* notes)
{
    check_volume_suffix(path);
    if (has_suffix(path, ".msh")) {
        write_file(path, gmsh_bytes(mesh, gmsh));
    } else if (has_suffix(path, ".inp")) {
        write_file(path, abaqus_text(mesh, notes));
    } else {
        const PlainText text = plain_text(mesh);
        write_file(elements_path(path), text.elements);
        write_file(path, text.nodes);
    }
}

} // namespace amontons
