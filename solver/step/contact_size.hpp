#pragma once

#include "mesh/base/types.hpp"

#include <map>
#include <vector>

namespace amontons {

struct BodyStepReport;
struct BodySystem;

/// Size of the contact area of a pair, to be compared with the faces that resolve it.
struct ContactSize {
    /// Number of the pair.
    int pair = 0;
    double force = 0;       ///< sum of its normal forces [N]
    double indentation = 0; ///< by which the two would overlap without strain, at the most [m]
    double width = 0; ///< 2 sqrt(indentation / curvature), by Hertz; infinite between flats [m]
    double face = 0;  ///< the larger of the faces there [m]
    /// Where the face is too large [m].
    Vec3 point = Vec3::Zero();
};

/// The sizes, in an accepted step, of the pairs of solids (with any body but a rod) that are in
/// contact.
/// @param known  by pair: only contacts with a larger force are examined
/// Cost: one sum over the stencils of the contacts.
/// Source: Hertz 1881 (half-width sqrt(R d) of a ball that approaches by d).
std::vector<ContactSize> contact_sizes(const BodySystem& system, const BodyStepReport& step,
                                       const std::map<int, ContactSize>& known = {});

} // namespace amontons
