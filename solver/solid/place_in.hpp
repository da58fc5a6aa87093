#pragma once

#include "mesh/box_tree.hpp"
#include "solver/solid/assembly.hpp"

#include <vector>

namespace amontons {

/// Where a place is in an element, and how far outside, in its own coordinates (<= 0: inside).
struct PlaceIn {
    Vec3 xi = Vec3::Zero();                                   ///< on the reference element
    double outside = std::numeric_limits<double>::infinity(); ///< beyond its border [-]
};
/// Newton's method from the middle; `outside` is infinite where it finds nothing.
/// @param X  of the element's nodes [m]
PlaceIn place_in(ElementKind kind, const ElementPlaces& X, const Vec3& x);

/// The elements of a mesh where its nodes are now, to find those around a place.
class PlacedElements {
public:
    /// @param mesh, places  outlive it; places of all its nodes [m]
    PlacedElements(const VolumeMesh& mesh, std::span<const Vec3> places);

    /// Whether a place is in an element that has none of some nodes, or on its border.
    bool hold_without(const Vec3& x, std::span<const std::int32_t> nodes) const;

private:
    struct Element {
        ElementKind kind;
        std::span<const std::int32_t> nodes;
    };
    std::span<const Vec3> places_;
    std::vector<Element> elements_;
    BoxTree tree_;
};

} // namespace amontons
