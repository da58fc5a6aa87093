#pragma once

#include "mesh/volume_mesh.hpp"

#include <cstdint>
#include <string>
#include <string_view>

// What the names in Abaqus' files mean to us.

namespace amontons {

/// One of S1 to S6, sides of a solid, as a local face of ours, or -1.
std::int32_t abaqus_face(ElementKind kind, std::string_view label);

/// What an element type of Abaqus is to us.
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
