#pragma once

#include "mesh/wall.hpp"

#include <string>

namespace amontons {

/// An obstacle, ready for contact.
struct Obstacle {
    std::string name;
    WallModel model;

    /// The same for another simulation, which may be on another thread.
    Obstacle share() const { return {name, model.share()}; }
};

} // namespace amontons
