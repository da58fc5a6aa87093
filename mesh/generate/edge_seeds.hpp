#pragma once

#include "mesh/generate/vessel_shape.hpp"

#include <limits>
#include <memory>
#include <vector>

namespace amontons {

/// Points of a vessel's wall where tubes join, from where nearest points are searched for, made
/// cube by cube where a search comes: of a vessel that a wire passes through few junctions are
/// needed.
///
/// What is found depends on the place that is searched from alone. For several threads.
class EdgeSeeds {
public:
    /// @param shape   must outlive this
    /// @param origin  a corner of a cube [m]
    /// @param edge    about the distance between two points [m]
    EdgeSeeds(const VesselShape& shape, const Vec3& origin, double edge);
    ~EdgeSeeds();

    /// Neighbouring points in a box.
    struct Group {
        /// Corners of the box [m].
        Eigen::Array3d low = Eigen::Array3d::Constant(std::numeric_limits<double>::infinity()),
                       high = -low;
        std::vector<Vec3> point; ///< [m]
    };
    struct Near {
        double squared = 0; ///< of the distance of its box [m^2]
        const Group* group = nullptr;
    };
    /// The groups that reach into a ball, the nearest to its centre first.
    /// @param radius  of the ball [m]
    std::vector<Near> around(const Vec3& centre, double radius) const;

    /// The nearest point of such groups that is nearer than `squared`.
    /// @param near     of a ball around `centre`
    /// @param squared  of a distance [m^2]; that of the point, where there is one
    /// @return         nullptr: none
    static const Vec3* nearest(const Vec3& x, const Vec3& centre, const std::vector<Near>& near,
                               double& squared);

private:
    struct Cubes;
    std::unique_ptr<Cubes> cubes_;
};

} // namespace amontons
