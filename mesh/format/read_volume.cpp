#include "mesh/format/read_volume.hpp"

#include "mesh/base/file.hpp"
#include "mesh/format/abaqus.hpp"
#include "mesh/format/plain.hpp"
#include "mesh/format/vtu.hpp"
#include "mesh/suffix.hpp"

#include <cmath>

namespace amontons {
namespace {

constexpr std::string_view kNodesSuffix = ".nodes";

} // namespace

std::string elements_path(const std::string& nodes_path)
{
    return nodes_path.substr(0, nodes_path.size() - kNodesSuffix.size()) + ".elements";
}

VolumeFile read_volume(const std::string& path, double scale)
{
    if (!(scale > 0 && std::isfinite(scale)))
        FileIssues(path).fatal("", "scale " + number_text(scale), "> 0 and finite [m per unit]");
    if (has_suffix(path, ".msh")) return parse_gmsh(read_file(path), path, scale);
    if (has_suffix(path, ".vtu")) return parse_vtu(read_file(path), path, scale);
    if (has_suffix(path, ".inp")) return parse_abaqus(read_file(path), path, scale);
    if (has_suffix(path, kNodesSuffix)) {
        const std::string elements = elements_path(path);
        return parse_plain(read_file(path), read_file(elements), path, elements, scale);
    }
    refuse_suffix(path, ".msh, .vtu, .inp or .nodes (with .elements beside it)" +
                            suffix_hint(path, true));
}

void check_volume_suffix(const std::string& path)
{
    if (!has_suffix(path, ".msh") && !has_suffix(path, ".inp") && !has_suffix(path, kNodesSuffix))
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
