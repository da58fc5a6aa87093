#pragma once

#include "mesh/bounding_tree.hpp"
#include "mesh/generate/surface_nets.hpp"
#include "mesh/sample_file.hpp"

#include <functional>
#include <memory>

namespace amontons {

/// Triangles of a wall from where its nearest points are searched for, made cube by cube where a
/// search comes: of a vessel that a wire passes through they are needed beside few junctions.
///
/// What is found depends on the place that is searched from, and on `near`, alone: not on the
/// cubes that are there already. For several threads.
class WallSeeds {
public:
    /// @param surface  gives the wall's functions, for one thread at a time
    /// @param origin   a corner of a cube [m]
    /// @param edge     of the triangles [m]
    WallSeeds(std::function<ImplicitSurface()> surface, const Vec3& origin, double edge);
    ~WallSeeds();

    /// What was found before: makes the next search fast.
    struct Near {
        /// Its cube.
        BrickKey cube{0, 0, 0};
        std::int32_t triangle = -1; ///< its number there; -1: none
    };
    /// The triangle nearest to x, or one farther by `slack` of the distance.
    /// @param reach  about the distance of the wall [m]
    /// @return  triangle -1: no wall within 16 times of it
    NearestTriangle nearest(const Vec3& x, double reach, double slack, Near& near) const;

private:
    struct Cubes;
    std::unique_ptr<Cubes> cubes_;
};

} // namespace amontons
