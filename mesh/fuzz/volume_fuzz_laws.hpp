#pragma once

#include "mesh/format/gmsh.hpp"
#include "mesh/fuzz/laws.hpp"
#include "mesh/volume_check.hpp"

namespace amontons {

/// Checks an accepted mesh of solids, and that it reads back as it was written.
/// @param reread  what the reader makes of the written mesh
template <class Reread> void obey_volume_laws(const VolumeMesh& mesh, Reread reread)
{
    AMONTONS_ASSERT(element_count(mesh) > 0);
    const VolumeReport report = check_volume(mesh); // asserts that indices are in range
    AMONTONS_ASSERT(report.not_finite.empty());
    errors_of(report, mesh, "file");
    warnings_of(report, mesh, "file");
    const auto count = static_cast<std::int32_t>(element_count(mesh));
    for (const FaceSet& set : mesh.face_sets)
        for (const FaceRef& face : set.members)
            face_nodes(mesh, face); // asserts that it exists
    for (const ElementSet& set : mesh.element_sets)
        for (const std::int32_t e : set.members)
            AMONTONS_ASSERT(e >= 0 && e < count);
    for (const NodeSet& set : mesh.node_sets)
        for (const std::int32_t n : set.members)
            AMONTONS_ASSERT(n >= 0 && static_cast<std::size_t>(n) < mesh.nodes.size());
    const VolumeMesh again = reread(mesh);
    AMONTONS_ASSERT(again.nodes == mesh.nodes && again.blocks.size() == mesh.blocks.size());
    for (std::size_t b = 0; b < mesh.blocks.size(); ++b)
        AMONTONS_ASSERT(again.blocks[b].nodes == mesh.blocks[b].nodes);
}

} // namespace amontons
