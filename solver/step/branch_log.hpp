#pragma once

#include "solver/step/simulation.hpp"

#include <span>

namespace amontons {

/// The branch of the vessel in which the tip of a wire is, and in which it was when it was deepest.
/// Plain numbers, copied to checkpoints byte by byte.
struct BranchLog {
    int deepest = -1, deepest_wall = -1; ///< branch and obstacle; -1: none
    int place = -1, place_wall = -1;     ///< now
    double entered = 0;                  ///< depth of the tip when it entered the branch [m]

    /// Of a ball or a box a wire is beyond it once its tip has been in it, until the tip comes back
    /// or into another branch.
    /// @param walls    obstacles that the wire can touch; larger numbers are walls that are
    /// compliant
    /// @param depth    of the tip [m]
    /// @param is_most  it has never been deeper
    void note(const std::vector<Obstacle>& obstacles, std::span<const int> walls, const Vec3& tip,
              double depth, bool is_most);

    /// Name of the branch where the tip was deepest, or "".
    std::string name(const std::vector<Obstacle>& obstacles) const;
};

} // namespace amontons
