#pragma once

#include "mesh/volume_mesh.hpp"

#include <array>
#include <functional>
#include <vector>

namespace amontons {

/// Cuts each hexahedron of a mesh into six tetrahedra that fit to those of its neighbours.
///
/// Every face is cut along the diagonal through its node of lowest number, so both sides cut it
/// alike; within a hexahedron all tetrahedra share its node of lowest number. Tetrahedra are not
/// inverted if the hexahedron's faces are nearly flat. Sets are carried over; labels are dropped.
/// @param mesh  H8 alone
VolumeMesh tetrahedra_of(const VolumeMesh& mesh);

/// The tetrahedra that fill one element, by its corners; a hexahedron is cut as above.
void append_tetrahedra(const ElementView& element, std::vector<std::array<std::int32_t, 4>>& out);

/// Where the middle node of an edge lies; nodes of the mesh.
using MiddlePlace = std::function<Vec3(std::int32_t begin, std::int32_t end)>;

/// T10 from T4: a node on every edge, numbered after the corners. Sets are carried over; a middle
/// node is in a node set if both its ends are. Labels are dropped.
/// @param mesh   T4 alone
/// @param place  default: half-way
VolumeMesh with_middle_nodes(const VolumeMesh& mesh, const MiddlePlace& place = {});

/// Hexahedra as they are, or cut into tetrahedra with or without middle nodes.
/// @param hexahedra  H8 alone
/// @param place      of middle nodes, by the nodes of the hexahedra
VolumeMesh as_kind(VolumeMesh hexahedra, ElementKind kind, const MiddlePlace& place = {});

} // namespace amontons
