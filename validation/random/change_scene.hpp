#pragma once

#include "validation/random/kinds.hpp"

#include <map>
#include <optional>
#include <string>

// The same problem as another scene: turned, with other names, in another order, in other units.

namespace amontons::validation {

/// Everything turned by q and then shifted. Holds along single axes can be turned by whole axes
/// only.
/// @return nothing where the scene cannot be turned so (a curve from a file)
std::optional<Json> turned_scene(const Json& scene, const Mat3& q, const Vec3& shift);
/// Whether a solid's set is moved or held along the world's axes, not only held altogether.
bool holds_along_axes(const Json& scene);
/// Whether turned_scene can move the axes of all solids by their meshes, without a turn of where
/// they begin.
bool meshes_move_with_axes(const Json& scene);
/// The name of a face set of a block after its axes moved on: "x_min" is "y_min"; others stay.
std::string moved_set(const std::string& set);
/// x -> y -> z -> x
Mat3 axes_moved_on();

Json renamed_scene(const Json& scene, const std::map<std::string, std::string>& names);
/// Bodies and pairs in the opposite order, the bodies of each pair as well.
Json reordered_scene(const Json& scene);

/// What a unit of length, force and time of the scene is in the other one.
struct OtherUnits {
    double length = 1, force = 1, time = 1;
};
/// @return nothing where a field's unit is not known here, or a file has lengths
std::optional<Json> scene_in_units(const Json& scene, const OtherUnits& units);
/// The factor of a unit as it stands in history.csv; 0: not known here.
double factor_of(const std::string& unit, const OtherUnits& units);

} // namespace amontons::validation
