#include "solver/output/volume_vtu.hpp"

#include "mesh/format/vtu.hpp"
#include "solver/output/vtk_writer.hpp"

#include <algorithm>

namespace amontons {
namespace {

std::string xml_text(const std::string& text)
{
    std::string out;
    for (const char c : text)
        switch (c) {
        case '&':
            out += "&amp;";
            break;
        case '<':
            out += "&lt;";
            break;
        case '>':
            out += "&gt;";
            break;
        case '"':
            out += "&quot;";
            break;
        default:
            out += static_cast<unsigned char>(c) < ' ' ? '_' : c;
        }
    return out;
}

} // namespace

std::string volume_vtu_bytes(const VolumeMesh& mesh)
{
    std::vector<std::int32_t> connectivity, offsets;
    std::vector<std::uint8_t> types;
    const auto add = [&](std::span<const std::int32_t> nodes, std::uint8_t type) {
        connectivity.insert(connectivity.end(), nodes.begin(), nodes.end());
        offsets.push_back(static_cast<std::int32_t>(connectivity.size()));
        types.push_back(type);
    };
    for_each_element(
        mesh, [&](std::int32_t, ElementKind kind, auto nodes) { add(nodes, vtk_type(kind)); });
    const std::size_t elements = types.size();
    std::vector<FaceRef> faces; // of all sets, each once
    for (const FaceSet& set : mesh.face_sets)
        faces.insert(faces.end(), set.members.begin(), set.members.end());
    std::sort(faces.begin(), faces.end());
    faces.erase(std::unique(faces.begin(), faces.end()), faces.end());
    for (const FaceRef& face : faces)
        add(face_nodes(mesh, face).nodes(), vtk_face_type(element_of(mesh, face.element).kind));

    std::vector<std::vector<double>> values; // the arrays refer to them
    const std::size_t sets =
        mesh.node_sets.size() + mesh.element_sets.size() + mesh.face_sets.size();
    values.reserve(sets);
    UnstructuredGrid grid{mesh.nodes, connectivity, offsets, types, {}, {}};
    const auto array = [&](const char* prefix, const std::string& name, std::size_t n) {
        values.emplace_back(n, 0.0);
        return VtkArray{prefix + xml_text(name), "", 1, values.back(), Stored::int32};
    };
    for (const NodeSet& set : mesh.node_sets) {
        grid.point_arrays.push_back(array(kVtuNodeSet, set.name, mesh.nodes.size()));
        for (const std::int32_t n : set.members)
            values.back()[static_cast<std::size_t>(n)] = 1;
    }
    for (const ElementSet& set : mesh.element_sets) {
        grid.cell_arrays.push_back(array(kVtuElementSet, set.name, types.size()));
        for (const std::int32_t e : set.members)
            values.back()[static_cast<std::size_t>(e)] = 1;
    }
    for (const FaceSet& set : mesh.face_sets) {
        grid.cell_arrays.push_back(array(kVtuFaceSet, set.name, types.size()));
        for (const FaceRef& face : set.members) {
            const auto at = std::lower_bound(faces.begin(), faces.end(), face) - faces.begin();
            values.back()[elements + static_cast<std::size_t>(at)] = 1;
        }
    }
    return vtu_bytes(grid, 0);
}

} // namespace amontons
