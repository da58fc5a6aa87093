#pragma once

#include "mesh/base/late.hpp"
#include "mesh/bounding_tree.hpp"
#include "mesh/distance_field.hpp"
#include "mesh/generate/wall_seeds.hpp"
#include "mesh/swept_tube.hpp"

#include <algorithm>
#include <optional>
#include <vector>

namespace amontons {

/// Value, gradient and Hessian of an implicit function; > 0 in the free space.
struct ImplicitSample {
    double value = 0;             ///< [m]
    Vec3 gradient = Vec3::Zero(); ///< [-]
    Mat3 hessian = Mat3::Zero();  ///< [1/m]
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

    /// Hints of a previous query for each tube; like a WallHint they change no result.
    using Hints = std::vector<WallHint>;
    /// Hints for the first call.
    Hints no_hints() const { return Hints(tubes_.size()); }

    /// Signed distance at x [m].
    double value(const Vec3& x, Hints& hints) const;
    /// Signed distance and its gradient at x.
    ImplicitSample sample(const Vec3& x, Hints& hints) const;

    /// The point of the wall (value 0) that is found from x along the gradient [m].
    Vec3 project(const Vec3& x, Hints& hints) const;

    const std::vector<SweptTube>& tubes() const { return tubes_; }
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
    std::vector<Around> around_;
    double width_;
};

/// The true signed distance to a vessel's wall: the distance of one tube where no other has a
/// part in it, else the nearest point by Newton's method on (p - x + mu grad F, F), begun at
/// the nearest point of triangles.
class VesselDistance : public DistanceSource {
public:
    /// @param surface  triangles of the shape's wall, vertices on it
    VesselDistance(VesselShape shape, Late<SurfaceMesh> surface);
    /// With triangles of its own, made where they are needed.
    /// @param edge  of them [m]
    VesselDistance(VesselShape shape, const Vec3& origin, double edge);
    VesselDistance(const VesselDistance&) = delete;
    VesselDistance& operator=(const VesselDistance&) = delete;

    /// Farther from the wall than 12 steps the distance may be too small beside a junction.
    void sample_cube(const Vec3& corner, const Mat3& edges, int n, double* out) const override;

    /// The same at one point, without that exception [m].
    double distance(const Vec3& x) const;

private:
    /// Of the last point, which is probably near; it changes no result.
    struct Near {
        std::int32_t triangle = -1;
        WallSeeds::Near seeds;
        VesselShape::Hints hints;
    };
    double distance_(const Vec3& x, double band, Near& near) const;
    double near_junction_(const Vec3& x, double value, Near& near) const;

    VesselShape shape_;
    // Beside a junction alone: of all the surface, or of parts.
    Late<BoundingTree> tree_;
    std::optional<WallSeeds> seeds_;
};

} // namespace amontons
