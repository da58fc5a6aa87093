#pragma once

#include "mesh/size_field.hpp"

#include <string>
#include <vector>

namespace amontons {

/// A feature of a surface that is smaller than the elements requested there.
struct SmallFeature {
    const char* what = "";  ///< "a wall", "a gap", "a sharp edge"
    Vec3 at = Vec3::Zero(); ///< [m]
    double extent = 0;      ///< thickness, width or length [m]
    double size = 0;        ///< of elements there [m]
};

/// Walls thinner than the size, gaps between opposite parts narrower than it, and chains of sharp
/// edges between corners (or around) shorter than it.
///
/// Thickness is measured from points of every triangle along its normal, to where the surface faces
/// the other way within 18 degrees: a wedge is no thin wall.
/// @param surface        closed, oriented outwards
/// @param feature_angle  between normals above which an edge is sharp [rad]
/// Cost: two rays, as long as the size, from each triangle and from each piece of it that is about
/// as long as the size, or as what is thinner; from a few million places at the most.
std::vector<SmallFeature> find_small_features(const SurfaceMesh& surface, const SizeField& size,
                                              double feature_angle);

/// Sources that make elements as small as these features, at most one in each cube of their extent.
std::vector<SizeSource> sources_of(const std::vector<SmallFeature>& features);

} // namespace amontons
