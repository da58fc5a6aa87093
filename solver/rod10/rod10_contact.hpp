#pragma once

#include "mesh/surface_mesh.hpp"
#include "solver/rod10/rod10.hpp"

#include <optional>

// The contact of WSCG 2003, as published: to compare with, never to compute with. Penalty springs
// at test points of the rod, with the loads of the last frame: what it costs stands in
// docs/theory/rods.md.
// Source: as rod10.hpp, section 4, equations 5 to 7; sections 5 and 6.

namespace amontons {

/// A convex body at rest, inside a sphere.
class Rod10Object {
public:
    /// The nearest face of a point within the body.
    struct Face {
        Vec3 normal;      ///< out of the body
        double depth = 0; ///< of the point below its plane, >= 0 [m]
    };

    /// @throws InputError  unless the surface is closed, convex and its normals point out of it
    explicit Rod10Object(const SurfaceMesh& surface);

    /// The first level: whether x is within the bounding sphere.
    bool near(const Vec3& x) const { return (x - centre_).squaredNorm() <= radius_ * radius_; }
    /// The second: x against the planes of all faces.
    std::optional<Face> contains(const Vec3& x) const;

private:
    std::vector<Vec3> normals_;
    std::vector<double> offsets_;
    Vec3 centre_ = Vec3::Zero();
    double radius_ = 0;
};

/// Springs, dampers and limits of its contact.
struct Rod10ContactOptions {
    double stiffness = 1;          ///< K, of a test point [N/m]
    double attenuation = 0;        ///< B [N s/m]
    double frame = 1e-3;           ///< length of a frame [s]
    double largest_change = 1e300; ///< of the force on the hand from frame to frame [N]
};

/// A rod in the hand among objects, frame by frame.
///
/// Four lines along the rod's surface (beside, above, ...) are the edges of its elements, each
/// with four test points, the last of them at the element's second node. A point that is in an
/// object is pushed along the normal of the nearest face by K x - B v, with its depth x and its
/// velocity v along that normal; the force acts where the point is, its moment about the rod's axis
/// is left out. Where points are is known from the deflections of the frame before.
class Rod10Contact {
public:
    /// @param every  as Rod10Solver's
    /// @throws InputError  objects that are open, inside out or not convex; options out of range
    Rod10Contact(const Rod10& rod, std::vector<Rod10Object> objects, Rod10ContactOptions options,
                 int every = 1);

    /// State between two frames.
    struct Frame {
        Vec3 force = Vec3::Zero(); ///< of all test points on the rod, in space [N]
        Vec3 sent = Vec3::Zero();  ///< the part sent to the hand, after the limiter [N]
        int touching = 0;          ///< test points within objects
        double depth = 0;          ///< of the deepest of them [m]
    };

    /// @param hand    place of the clamped node [m]
    /// @param to_rod  rows: the rod's axes in space
    Frame frame(const Vec3& hand, const Mat3& to_rod);

    /// Of the last frame, in space.
    const std::vector<Rod10Node>& deflections() const { return deflections_; }

private:
    using TestPoint = Eigen::Matrix<double, 3, 10>; ///< displacement by those of the element

    Rod10 rod_;
    std::vector<Rod10Object> objects_;
    Rod10ContactOptions options_;
    Rod10Solver solver_;
    std::vector<Vec3> place_;      ///< of each test point of an element, from its first node [m]
    std::vector<TestPoint> shape_; ///< of the same points
    std::vector<Rod10Node> deflections_, loads_;
    Mat3 to_rod_ = Mat3::Identity(); ///< of the last frame
    std::vector<Vec3> before_;       ///< test points in the last frame [m]
    Vec3 sent_ = Vec3::Zero();
};

} // namespace amontons
