#pragma once

#include "mesh/bounding_tree.hpp"
#include "mesh/distance_field.hpp"
#include "mesh/swept_tube.hpp"

#include <vector>

namespace amontons {

/// Value, gradient and Hessian of an implicit function; > 0 in the free space.
struct ImplicitSample {
    double value = 0;             ///< [m]
    Vec3 gradient = Vec3::Zero(); ///< [-]
    Mat3 hessian = Mat3::Zero();  ///< [1/m]
};

/// The free space of several tubes joined into one, the edges where they meet rounded.
///
/// With f_i the distances of the tubes, two values closer than k are joined by
///   max(a, b) + (k - |a - b|)^2 / (4 k),  k = sqrt(2) times the blend radius,
/// a fillet of about that radius where tubes cross at right angles, and the plain tubes
/// wherever their distances differ by more than k.
class VesselShape {
public:
    VesselShape(std::vector<SweptTube> tubes, double blend_radius);

    double value(const Vec3& x) const;
    ImplicitSample sample(const Vec3& x) const;

    /// The zero of the function that is found from x along its gradient.
    Vec3 project(const Vec3& x) const;

    const std::vector<SweptTube>& tubes() const { return tubes_; }
    double blend_width() const { return width_; } ///< k [m]

    /// No less than the distance of tube i at x, in a few operations [m].
    double upper_bound(std::size_t i, const Vec3& x) const
    {
        return balls_[i].radius - (x - balls_[i].centre).norm();
    }

private:
    struct Ball { // around a tube
        Vec3 centre;
        double radius;
    };
    std::vector<SweptTube> tubes_;
    std::vector<Ball> balls_;
    double width_;
};

/// The true signed distance to a vessel's wall: the distance of one tube where no other has a
/// part in it, else the nearest point by Newton's method on (p - x + mu grad F, F), begun at
/// the nearest point of a triangulated surface.
class VesselDistance : public DistanceSource {
public:
    /// @param surface  triangles of the shape's wall, vertices on it
    VesselDistance(VesselShape shape, const SurfaceMesh& surface);

    /// Farther from the wall than 12 h the distance may be too small beside a junction.
    void sample_cube(const Vec3& corner, double h, int n, double* out) const override;

    /// The same at one point, without that exception [m].
    double distance(const Vec3& x) const;

private:
    double distance_(const Vec3& x, double band, std::int32_t& near) const;
    double near_junction_(const Vec3& x, double sign, std::int32_t& near) const;

    VesselShape shape_;
    BoundingTree tree_;
};

} // namespace amontons
