#pragma once

#include "solver/scene/scene.hpp"

#include <string>
#include <vector>

namespace amontons {

/// The bodies that contacts number (ContactRecord::body_a, body_b).
struct ContactBodies {
    /// Names of bodies, by number.
    std::vector<std::string> names;
    std::vector<std::string> kinds; ///< "obstacle" | "beam" | "solid" | "rigid" | "rod"
};
/// Numbers and names of a scene's bodies in contact files.
ContactBodies contact_bodies(const Scene& scene);

} // namespace amontons
