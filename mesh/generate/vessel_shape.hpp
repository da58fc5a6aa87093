#pragma once

#include "mesh/generate/vessel_tube.hpp"
#include "mesh/swept_tube.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace amontons {

/// Of each tube of a vessel the part where the points of a ball have their nearest points: what
/// makes evaluations there quicker.
struct VesselParts {
    /// Of the ball [m].
    Vec3 centre = Vec3::Zero();
    double squared = -1; ///< of its radius [m^2]
    std::vector<TubePart> part = {};

    /// That of tube i at x.
    TubePart of(std::size_t i, const Vec3& x) const
    {
        return (x - centre).squaredNorm() <= squared ? part[i] : TubePart{};
    }
};

/// The free space of several tubes joined into one, the edges between them rounded.
///
/// With f_i the distances of the tubes, two values closer than k are joined by
///   max(a, b) + (k - |a - b|)^2 / (4 k),  k = sqrt(2) times the blend radius,
/// a fillet of about that radius where tubes cross at right angles, and the plain tubes
/// wherever their distances differ by more than k.
class VesselShape {
public:
    VesselShape(std::vector<SweptTube> tubes, double blend_radius);

    /// Those of a ball.
    /// @param radius  of the ball [m]
    VesselParts parts_around(const Vec3& centre, double radius) const;

    /// Signed distance at x [m].
    double value(const Vec3& x, const VesselParts& near = {}) const;
    /// Signed distance and its gradient at x.
    ImplicitSample sample(const Vec3& x, const VesselParts& near = {}) const;

    /// How near to a joint of tubes a point is.
    struct Junction {
        double value = 0; ///< of the two tubes with the largest distances, joined [m]
        double apart = 0; ///< between those distances: joined below blend_width() [m]
    };
    /// The same at x.
    Junction junction(const Vec3& x, const VesselParts& near = {}) const;

    /// What two tubes give together [m].
    double joined(double a, double b) const
    {
        const double left = width_ - std::abs(a - b), most = std::max(a, b);
        return left > 0 ? most + left * left / (4 * width_) : most;
    }

    /// The point of the wall (value 0) that is found from x along the gradient [m].
    Vec3 project(const Vec3& x, const VesselParts& near = {}) const;

    const std::vector<SweptTube>& tubes() const { return tubes_; }
    /// The same for many evaluations.
    const std::vector<VesselTube>& fast() const { return fast_; }
    double blend_width() const { return width_; } ///< k [m]

    /// An upper bound of the distance of tube i at x, in a few operations [m].
    double upper_bound(std::size_t i, const Vec3& x) const
    {
        const Around& a = around_[i];
        const Vec3 e = x - a.start;
        const double along = std::clamp(e.dot(a.along), 0.0, a.length);
        const double depth = a.radius - (e - along * a.along).norm();
        return depth > 0 ? depth : depth / a.steepness;
    }

private:
    struct Around { // all balls of a tube: they are within `radius` of a line
        Vec3 start, along;
        double length, radius;
        double steepness; // the gap to the tube over its distance is no more than that
    };
    static Around around(const SweptTube& tube);

    std::vector<SweptTube> tubes_;
    std::vector<VesselTube> fast_;
    std::vector<Around> around_;
    double width_;
};

} // namespace amontons
