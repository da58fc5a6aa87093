#pragma once

#include "mesh/bounding_tree.hpp"
#include "solver/record/step_record.hpp"

#include <memory>
#include <vector>

namespace amontons {

/// The largest forces of a run on a wall, at the vertices of its surface.
struct WallForce {
    std::vector<double> largest; ///< at each vertex, of clustered forces [N]; empty: no contact yet

    /// Where a contact of the last record was: the next is probably near.
    struct Found {
        int body = 0;               ///< that touches the wall
        Vec3 point = Vec3::Zero();  ///< of the contact [m]
        std::int32_t triangle = -1; ///< of the wall's file; -1: none
    };
    std::vector<Found> last;            ///< in the order of the contacts
    std::unique_ptr<BoundingTree> tree; ///< of the surface, made when a contact first needs it
};

/// Updates the largest forces with the contacts of an accepted step: each counts at the nearest
/// corner of the nearest triangle. The places of earlier contacts only make the search faster.
/// @param number   of the wall among the bodies
/// @param contacts  in a fixed order, wire by wire and along each
void note_forces(const SurfaceMesh& surface, int number, const std::vector<ContactRecord>& contacts,
                 WallForce& force);

} // namespace amontons
