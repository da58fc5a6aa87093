#pragma once

#include "validation/random/written_files.hpp"

#include <Eigen/Geometry>

#include <array>
#include <functional>
#include <string>
#include <vector>

// Shapes, surfaces and depths in closed form or by brute force, for bodies of some hundred faces.
// Nothing of it is shared with what a run computes with.

namespace amontons::validation {

/// x -> turn x + shift
struct RigidMotion {
    Mat3 turn = Mat3::Identity();
    Vec3 shift = Vec3::Zero();

    Vec3 apply(const Vec3& x) const { return turn * x + shift; }
    Vec3 back(const Vec3& y) const { return turn.transpose() * (y - shift); }
};

Mat3 turn_by(const Vec3& rotation_vector);
/// Where "start" of a body puts it.
RigidMotion start_of(const Json& body);
/// The rigid motion between two sets of places (Kabsch 1976). @param miss  gets the largest
/// distance left [m]
RigidMotion fit_motion(const WrittenArray& from, const WrittenArray& to, double& miss);
/// Where a rigid body is in a frame, from its own axes.
RigidMotion pose_in(const WrittenRun& run, const std::string& body, const WrittenFrame& frame);

/// A place on a body's surface.
struct SurfacePlace {
    Vec3 at = Vec3::Zero();
    double face = 0;  ///< longest edge of its face [m]; 0: no face
    double round = 0; ///< radius of the ball about it that belongs to the body [m]
};

/// What a place outside a body has to it, and how the body is there.
struct Depth {
    double distance = 0; ///< signed, negative inside [m]
    double face = 0;     ///< longest edge of the nearest face [m]; 0: no face
};

/// A body at one moment, as others see it.
struct PlacedBody {
    std::string name, kind; ///< kind: "solid", "rigid", "obstacle", "rod", "beam"
    std::vector<SurfacePlace> places;
    /// Of a place, as far as `within` from it [m]: beyond, no less than that. Empty: it has none
    /// (rods).
    std::function<Depth(const Vec3&, double within)> depth;
    double thickness = 0; ///< [m]; 0: endless
    double curvature = 0; ///< largest of its surface free of load [1/m]
};

/// @throws std::runtime_error  if the shape is none that is known here
PlacedBody place_body(const WrittenRun& run, const std::string& body, const WrittenFrame& frame);

/// Where two bodies stand deepest in each other.
struct DeepestPlace {
    double depth = 0; ///< [m], <= 0: nowhere
    Vec3 at = Vec3::Zero();
    double face = 0; ///< the smaller face there [m]
};
DeepestPlace deepest_place(const PlacedBody& a, const PlacedBody& b);

/// A triangle of a mesh's outside.
struct OuterTriangle {
    std::array<Vec3, 3> corner;
    double face = 0; ///< longest edge of the face that it is part of [m]
    int cuts = 4;    ///< of its edges, where places are measured
};
/// Quadratic faces bend: they are cut in sixteen.
std::vector<OuterTriangle> outside_of(const VtkText& solid);
/// Volumes of the cells [m^3], displaced or as they were: x - share x displacement.
std::vector<double> cell_volumes(const VtkText& solid, bool undeformed);

/// Mass and moments of inertia about its own axes, of a rigid body by its shape. @return false:
/// unknown
bool rigid_mass(const Json& body, double& mass, Vec3& inertia);

} // namespace amontons::validation
