#pragma once

#include "solver/output/vtk/view_frame.hpp"
#include "solver/record/contact_bodies.hpp"
#include "solver/step/simulation.hpp"

#include <map>
#include <utility>

namespace amontons {

/// Turns what a step reports into frames for the window: walls and triangles once, places always.
class ViewMaker {
public:
    /// @param obstacles  outlive the maker
    ViewMaker(const std::vector<Obstacle>& obstacles, ContactBodies bodies)
        : obstacles_(obstacles)
        , bodies_(std::move(bodies))
    {
    }

    /// The frame of a step.
    /// @param time  of the step [s]
    ViewFrame frame(double time, const std::vector<BeamRecord>& beams,
                    const std::vector<BodyRecord>& bodies,
                    const std::vector<ContactRecord>& contacts);

private:
    struct Outside { ///< of a solid
        std::vector<std::int32_t> nodes;
        std::vector<std::int32_t> triangles;
        std::vector<std::int32_t> faces; ///< of each triangle
    };
    const Outside& outside_of(const BodyRecord& solid);

    const std::vector<Obstacle>& obstacles_;
    ContactBodies bodies_;
    std::map<std::string, Outside> outside_;
    bool begun_ = false;
};

} // namespace amontons
