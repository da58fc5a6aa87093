#pragma once

#include "mesh/bounding_tree.hpp"
#include "solver/record/step_record.hpp"

#include <array>
#include <memory>
#include <vector>

namespace amontons {

/// The largest forces of a run on a wall, at the vertices of its surface.
struct WallForce {
    /// At each vertex, of clustered forces that have been assigned to one [N]; empty: none has.
    std::vector<double> largest;
    /// Place [m] and clustered force [N] of contacts that have not been: a wall's surface is made,
    /// and searched, where its forces are requested.
    using Touch = std::array<double, 4>;
    std::vector<Touch> pending;
    std::unique_ptr<BoundingTree> tree; ///< of the surface, made when forces are first assigned
};

/// Notes the contacts of an accepted step with a wall.
/// @param number    of the wall among the bodies
/// @param contacts  in a fixed order, wire by wire and along each
void note_forces(int number, const std::vector<ContactRecord>& contacts, WallForce& force);

/// True once the contacts that wait take more memory than a surface does.
bool many_pending(const WallForce& force);

/// Assigns what has been noted: each force counts at the nearest corner of the nearest triangle.
void assign_forces(const SurfaceMesh& surface, WallForce& force);

} // namespace amontons
