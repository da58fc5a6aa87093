#pragma once

#include "validation/random/kinds.hpp"

#include <string>
#include <utility>
#include <vector>

// Parts that scenes are put together from.

namespace amontons::validation {

constexpr double kGravity = 9.81; ///< [m/s^2]

using NamedBodies = std::vector<std::pair<std::string, Json>>;

Json list_of(const Vec3& v);
/// [[0, 0], [end, value]]
Json ramp(double value, double end = 1);

/// A block of cells, its middle at `centre`.
Json box_mesh(const Vec3& size, const std::array<int, 3>& cells, const char* element,
              const Vec3& centre);
Json elastic(Json mesh, double youngs_modulus, double poisson_ratio);
Json neo_hooke(Json mesh, double youngs_modulus, double poisson_ratio);
Json held(const char* set);
Json held(const char* set, Json x, Json y, Json z);

Json rigid_box(const Vec3& size, const Vec3& place);
Json rigid_ball(double radius, const Vec3& place);
Json rigid_cylinder(double radius, double length, const Vec3& place);
/// Driven along z from rest at t = 0 to `by` at t = 1; x and y stand.
void drive_down(Json& body, double by);

Json rod(const Json& segments, const Json& shape);
/// Two points of a rod's shape.
Json points(const Vec3& a, const Vec3& b);
/// A tube with one bend, and the part before it.
Json bent_tube(Draw& draw, double radius, double before, double bend, double angle, double after);

/// An instrument of one segment that comes out of a straight sheath at `at`.
/// @param insertion  [[time, length], ...]
Json instrument(double length, double radius, double ei, double element, const Vec3& at,
                const Vec3& direction, Json insertion);
/// A straight rod of one segment.
Json straight_rod(const Vec3& from, const Vec3& to, double radius, double ei, int elements,
                  double density = 0);
/// A coupling that begins at a place. @param b  a body or "world"
Json joint(const char* kind, const std::string& a, const std::string& b, const Vec3& at,
           const Vec3& axis = Vec3(0, 0, 1));

/// Of meshes this coarse: what they leave of forces, by either side's multipliers
/// (RandomScene::order).
constexpr double kEitherSide = 0.02;

Json plane(const Vec3& at, const Vec3& normal);
Json pair(const std::string& a, const std::string& b, double friction = 0);
/// All pairs of bodies but those that a coupling joins, and obstacles with each other.
Json all_pairs(const NamedBodies& bodies, const Json& couplings, double friction);
Json quasi_static(double step, double end = 1);
Json dynamic(double step, double end);
Json scene_of(const NamedBodies& bodies, Json contact, Json time);

const char* any_element(Draw& draw);
/// Of an elastic body: any size, stiffness, Poisson's ratio.
struct Matter {
    double size = 1, youngs_modulus = 1, poisson_ratio = 0;
};
Matter any_matter(Draw& draw);

/// The contact force of a pair at the end, along an axis [N].
double pair_force(const WrittenRun& run, const std::string& a, const std::string& b, int axis);
/// "" or that a number is not between two.
std::string between(const std::string& what, double value, double low, double high);

} // namespace amontons::validation
