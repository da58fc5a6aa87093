#pragma once

#include "mesh/volume_mesh.hpp"

#include <cstdint>
#include <string>
#include <string_view>

// Names of element types and of their faces in Abaqus' files.

namespace amontons {

/// The local face (mesh/volume_mesh.hpp) of a side label S1 to S6 of a solid, or -1.
std::int32_t abaqus_face(ElementKind kind, std::string_view label);

/// The meaning of an element type of Abaqus in a VolumeMesh.
struct AbaqusType {
    /// What a cell is used for.
    enum class Use { solid, other_solid, facet, line } use = Use::line;
    ElementKind kind = ElementKind::T4;
    std::size_t nodes = 0; ///< 0: as many as the record has
    /// Corners of a cell.
    std::size_t corners = 0;
};

/// @param name  upper case
AbaqusType abaqus_type(const std::string& name);

} // namespace amontons
