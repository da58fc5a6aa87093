#include "solver/program/mesh_output.hpp"

#include "mesh/base/file.hpp"
#include "mesh/base/text.hpp"
#include "mesh/format/read_volume.hpp"
#include "solver/output/volume_vtu.hpp"
#include "solver/scene/json_text.hpp"

#include <CLI/CLI.hpp>
#include <array>
#include <fmt/format.h>

namespace amontons {
namespace {

std::array<std::int64_t, kElementKinds> counts_of(const VolumeMesh& mesh)
{
    std::array<std::int64_t, kElementKinds> counts{};
    for (const ElementBlock& block : mesh.blocks)
        counts[static_cast<std::size_t>(block.kind)] = static_cast<std::int64_t>(block.size());
    return counts;
}

const char* name_of(std::size_t kind)
{
    return shape_of(static_cast<ElementKind>(kind)).name;
}

} // namespace

void add_output(CLI::App& command, MeshOutput& to, const char* names)
{
    command.add_option(names, to.file, "Mesh to write: .msh .vtu .inp .nodes")
        ->type_name("FILE")
        ->required();
    command.add_option("--msh-version", to.version, "Of a .msh file: 4.1 or 2.2")
        ->check(CLI::IsMember({"4.1", "2.2"}));
    command.add_flag("--binary", to.binary, "A .msh file in binary");
}

void check_output(const MeshOutput& to)
{
    if (!lower_case(to.file).ends_with(".vtu")) check_volume_suffix(to.file);
}

void write_mesh(const MeshOutput& to, const VolumeMesh& mesh, std::vector<std::string>& notes)
{
    if (lower_case(to.file).ends_with(".vtu"))
        write_file(to.file, volume_vtu_bytes(mesh));
    else
        write_volume(to.file, mesh, {to.version == "2.2", to.binary}, &notes);
}

void add_counts(JsonText& json, const VolumeMesh& mesh)
{
    json.member("nodes", static_cast<std::int64_t>(mesh.nodes.size())).key("elements").open('{');
    const auto counts = counts_of(mesh);
    for (std::size_t k = 0; k < counts.size(); ++k)
        if (counts[k] > 0) json.member(name_of(k), counts[k]);
    json.close('}');
}

std::string counts_text(const VolumeMesh& mesh)
{
    std::string text = fmt::format("{} nodes", mesh.nodes.size());
    const auto counts = counts_of(mesh);
    for (std::size_t k = 0; k < counts.size(); ++k)
        if (counts[k] > 0) text += fmt::format(", {} {}", counts[k], name_of(k));
    return text;
}

void add_list(JsonText& json, const char* name, const std::vector<std::string>& lines)
{
    json.key(name).open('[');
    for (const std::string& line : lines)
        json.value(line);
    json.close(']');
}

} // namespace amontons
