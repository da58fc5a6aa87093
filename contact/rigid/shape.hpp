#pragma once

#include "contact/rigid/polyhedron.hpp"
#include "mesh/base/error.hpp"
#include "mesh/bounding_tree.hpp"

#include <Eigen/Geometry>
#include <string>
#include <variant>

// What a rigid body may look like. Every shape has a frame of its own, put into space by a Pose.

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

/// A closed triangle surface; see make_triangle_shape.
struct TriangleShape {
    SurfaceMesh mesh;
    BoundingTree tree;
    Polyhedron polyhedron;
};

using RigidShape = std::variant<Box, Ball, Cylinder, Plane, TriangleShape>;

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

inline bool is_round(const RigidShape& shape)
{
    return std::holds_alternative<Ball>(shape) || std::holds_alternative<Cylinder>(shape);
}

/// Of a ball around the frame's origin that holds the shape [m]; infinite for a Plane.
double bounding_radius(const RigidShape& shape);

/// A box along the axes of space.
struct AxisBox {
    Vec3 low = Vec3::Zero(), high = Vec3::Zero(); ///< [m]
};

/// The smallest one that holds the shape (for triangles: that holds its corners); infinite for a
/// Plane but towards a free side that is along an axis.
AxisBox axis_box(const RigidShape& shape, const Pose& pose);

} // namespace amontons
