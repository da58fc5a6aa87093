#pragma once

#include "mesh/base/types.hpp"

#include <span>
#include <vector>

// Contacts between the surfaces of two bodies, or of one and an obstacle, ready for any solid: a
// contact is a frame and weights on the nodes of both bodies. With the displacements x of nodes,
//
//   u = (n, t1, t2)^T ( sum_j d_j x_j - sum_l m_l x_l ),
//
// and a reaction r acts on node j with d_j (n, t1, t2) r, on node l with the opposite of
// m_l (n, t1, t2) r.

namespace amontons {

/// A node of a surface and its weight.
struct StencilEntry {
    std::int32_t node = 0; ///< of the body's mesh
    double weight = 0;     ///< [-]
};

/// One multiplier. Weights on each side sum to 1; an obstacle has none.
struct SurfaceContact {
    std::int64_t id = 0;         ///< the slave's node that carries the multiplier, if one does
    Vec3 point = Vec3::Zero();   ///< weighted place on the slave [m]
    Vec3 normal = Vec3::UnitZ(); ///< unit, from the master into the slave
    Vec3 t1 = Vec3::UnitX();     ///< see set_tangents
    Vec3 t2 = Vec3::UnitY();     ///< normal x t1
    double area = 0;             ///< integral of the multiplier's function [m^2]
    double gap = 0;              ///< < 0 where bodies overlap [m]
    std::int32_t slave_begin = 0, slave_end = 0; ///< ranges in SurfaceContacts::stencil
    std::int32_t master_begin = 0, master_end = 0;
};

/// Contacts by their id, ascending; weights of a side by their node, ascending.
struct SurfaceContacts {
    std::vector<SurfaceContact> contact;
    /// The nodes and weights of all contacts, one after another.
    std::vector<StencilEntry> stencil;

    /// Nodes and weights of the slave side.
    std::span<const StencilEntry> slave(const SurfaceContact& c) const
    {
        return range_(c.slave_begin, c.slave_end);
    }
    /// Nodes and weights of the master side.
    std::span<const StencilEntry> master(const SurfaceContact& c) const
    {
        return range_(c.master_begin, c.master_end);
    }

private:
    std::span<const StencilEntry> range_(std::int32_t begin, std::int32_t end) const
    {
        return std::span<const StencilEntry>(stencil).subspan(
            static_cast<std::size_t>(begin), static_cast<std::size_t>(end - begin));
    }
};

/// Tangents of a contact's normal: t1 is the x axis projected, or the y axis where the normal is
/// within 1e-3 of x; t2 = normal x t1.
void set_tangents(SurfaceContact& contact);

/// sum of weights times places, or displacements [m].
Vec3 weighted(std::span<const StencilEntry> side, std::span<const Vec3> places);

} // namespace amontons
