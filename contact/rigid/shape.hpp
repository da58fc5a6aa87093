#pragma once

#include "contact/rigid/polyhedron.hpp"
#include "mesh/base/error.hpp"
#include "mesh/bounding_tree.hpp"

#include <Eigen/Geometry>
#include <array>
#include <string>
#include <variant>

// Shapes of rigid bodies. Every shape has a frame of its own, put into space by a Pose.

namespace amontons {

/// Around the origin, edges along the axes.
struct Box {
    Vec3 half_extents = Vec3::Ones(); ///< [m], > 0
    /// > 0: a face that lies on a plane (within 1e-3 rad) touches it at the centres of at least so
    /// many equal cells of its area, not at its corners: for friction under spin.
    int spread = 0;
};

/// Around the origin.
struct Ball {
    double radius = 1; ///< [m], > 0
};

/// Around the origin, its axis along z.
struct Cylinder {
    double radius = 1;      ///< [m], > 0
    double half_length = 1; ///< [m], > 0
    int spread = 0;         ///< of its flat ends; see Box
};

/// The half-space z <= 0: a body at rest or moved, without mass properties.
struct Plane {};

/// Around the origin, its axes along the frame's.
struct Ellipsoid {
    Vec3 radii = Vec3::Ones(); ///< half axes [m], > 0

    /// The point of it that is farthest along a direction that is not zero.
    Vec3 support(const Vec3& direction) const;
};

/// All points within a distance of a segment: a cylinder with half balls at its ends. Around the
/// origin, along z.
struct Capsule {
    double radius = 1;      ///< [m], > 0
    double half_length = 1; ///< of the segment [m], > 0
};

/// A closed triangle surface; see make_triangle_shape.
struct TriangleShape {
    SurfaceMesh mesh;
    BoundingTree tree;
    Polyhedron polyhedron;
};

/// All shapes of rigid bodies.
using RigidShape = std::variant<Box, Ball, Cylinder, Plane, TriangleShape, Ellipsoid, Capsule>;

/// Where a body's frame is: x in space = place + turn * x in the frame.
struct Pose {
    Vec3 place = Vec3::Zero();                                ///< [m]
    Eigen::Quaterniond turn = Eigen::Quaterniond::Identity(); ///< unit
};

/// @param mesh  closed, oriented, normals outwards, without self-intersections. Coplanar
///              neighbours become one face.
/// @param file  as the user wrote it, for messages
/// @throws InputError  naming every fault
TriangleShape make_triangle_shape(SurfaceMesh mesh, const std::string& file = "");

/// A polygon in the plane of x and y, extruded along z by half the length to both sides.
/// @param polygon  its corners in order, either way round; [m]
/// @throws InputError  fewer than 3 corners, corners on each other or on a line, sides that cross
TriangleShape make_wedge(std::vector<std::array<double, 2>> polygon, double length);

/// Sizes that are not positive and finite, spread < 0; empty if the shape is fine.
std::vector<Issue> issues(const RigidShape& shape);

/// Of a body of uniform density, in the shape's frame.
struct MassProperties {
    double mass = 0;             ///< [kg]
    Vec3 centre = Vec3::Zero();  ///< of mass [m]
    Mat3 inertia = Mat3::Zero(); ///< about the centre of mass [kg m^2]
};

/// Closed forms; for triangles the exact integrals over the solid they enclose. All zero for a
/// Plane.
/// @param density  [kg/m^3]
/// Source: divergence theorem; a tetrahedron's second moments as in Tonon 2004, J. Math. Stat. 1.
MassProperties mass_properties(const RigidShape& shape, double density);

/// Is its surface smooth and curved (ball, cylinder's side, ellipsoid, capsule), with normals in
/// closed form?
inline bool is_round(const RigidShape& shape)
{
    return std::holds_alternative<Ball>(shape) || std::holds_alternative<Cylinder>(shape) ||
           std::holds_alternative<Ellipsoid>(shape) || std::holds_alternative<Capsule>(shape);
}

/// Radius of the smallest ball around the frame's origin that contains the shape [m]; infinite for
/// a Plane.
double bounding_radius(const RigidShape& shape);

/// A box along the axes of space.
struct AxisBox {
    Vec3 low = Vec3::Zero(), high = Vec3::Zero(); ///< [m]
};

/// The smallest one that holds the shape (for triangles: that holds its corners); infinite for a
/// Plane but towards a free side that is along an axis.
AxisBox axis_box(const RigidShape& shape, const Pose& pose);

} // namespace amontons
