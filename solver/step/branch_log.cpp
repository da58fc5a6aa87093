#include "solver/step/branch_log.hpp"

namespace amontons {

void BranchLog::note(const std::vector<Obstacle>& obstacles, std::span<const int> walls,
                     const Vec3& tip, double depth, bool is_most)
{
    int branch = -1, wall = -1;
    for (const int o : walls) {
        if (std::size_t(o) >= obstacles.size()) continue;
        const WallModel& m = obstacles[std::size_t(o)].model;
        if (m.branches.empty()) continue;
        if (const int at = branch_number_at(m, tip); at >= 0) branch = at, wall = o;
    }
    bool beyond = false;
    if (branch < 0 && place >= 0) {
        const Branch::Kind kind =
            obstacles[std::size_t(place_wall)].model.branches[std::size_t(place)].kind;
        beyond = (kind == Branch::ball || kind == Branch::box) && depth >= entered;
    }
    if (!beyond) {
        if (branch != place || wall != place_wall) entered = depth;
        place = branch;
        place_wall = wall;
    }
    if (!is_most) return;
    deepest = place;
    deepest_wall = place_wall;
}

std::string BranchLog::name(const std::vector<Obstacle>& obstacles) const
{
    return deepest < 0
               ? ""
               : obstacles[std::size_t(deepest_wall)].model.branches[std::size_t(deepest)].name;
}

} // namespace amontons
