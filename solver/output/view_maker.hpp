#pragma once

#include "solver/output/view_frame.hpp"
#include "solver/step/simulation.hpp"

#include <map>

namespace amontons {

/// Turns what a step tells into frames for the window: walls and triangles once, places always.
class ViewMaker {
public:
    /// @param obstacles  outlive the maker
    explicit ViewMaker(const std::vector<Obstacle>& obstacles) : obstacles_(obstacles) {}

    ViewFrame frame(double time, const std::vector<BeamRecord>& beams,
                    const std::vector<BodyRecord>& bodies,
                    const std::vector<ContactRecord>& contacts);

private:
    struct Outside { ///< of a solid
        std::vector<std::int32_t> nodes;
        std::vector<std::int32_t> triangles;
    };
    const Outside& outside_of(const BodyRecord& solid);

    const std::vector<Obstacle>& obstacles_;
    std::map<std::string, Outside> outside_;
    bool begun_ = false;
};

} // namespace amontons
