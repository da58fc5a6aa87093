#pragma once

#include "mesh/base/types.hpp"
#include "mesh/volume_mesh.hpp"

#include <array>
#include <span>
#include <string>

namespace amontons {

/// The largest rotations and strains to which a solid's linear theory was applied: a rotation by w
/// causes errors of the order of w, with a spurious extension of w^2/2.
struct LinearLimit {
    double rotation = 0; ///< of an element, relative to the body's rigid motion [rad]
    double strain = 0;   ///< largest principal one of an element [-]
    std::array<double, 3> rotated_at{},
        strained_at{};                          ///< middles of those elements, undeformed [m]
    double rotated_when = 0, strained_when = 0; ///< [s]

    /// @param places  of the nodes, now [m]
    /// @param turn    of the body's rigid motion
    /// Cost: O(elements).
    void note(const VolumeMesh& mesh, std::span<const Vec3> places, const Mat3& turn, double time);

    /// Warning about a body that exceeded 0.1 rad or 10 % of strain; "" if it did not.
    std::string warning(const std::string& body) const;
};

} // namespace amontons
