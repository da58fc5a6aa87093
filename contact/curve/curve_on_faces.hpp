#pragma once

#include "contact/curve/curve_contact.hpp"
#include "contact/surface/sharp_contacts.hpp"

#include <array>
#include <limits>

// Where a round curve touches the outside of a solid that bends.
//
// Faces that reach farther across the curve than 0.7 of its radius see no more of it than a line:
// stations of the curve, and places where it bends over sharp edges, are over faces and share
// their force out to the nodes there. Faces that are finer resolve the width on which the two
// touch: there the nodes that carry the solid's multipliers meet the curve's round surface, as they
// meet any smooth one.

namespace amontons {

/// A contact of a curve (a) with nodes of a solid (b).
struct CurveOnFaces {
    CurveContact curve;                 ///< b of no meaning
    std::array<StencilEntry, 4> node{}; ///< of the solid's mesh; weights sum to 1
    int nodes = 0;
    double area = 0; ///< of a node's multiplier [m^2]; 0: unknown
};

/// A place of a curve that meets the faces which it is over.
struct FaceStation {
    CurvePlace place;
    /// The way between coarser stations [m]: where that is no longer than faces are along the
    /// curve they are enough, and this one is left out. inf: it never is.
    double coarser = std::numeric_limits<double>::infinity();
};

/// Stations of halved pieces, so many that none of a surface's faces is left out: a row of faces
/// that nothing presses on would stand up between two that are pressed down.
/// @param places  of all nodes of the mesh [m]
std::vector<FaceStation> face_stations(const Curve& a, const ExternalSurface& surface,
                                       std::span<const Vec3> places);
/// Given places, all of which always count.
std::vector<FaceStation> face_stations(std::span<const CurvePlace> places);

/// Appends contacts of gap <= reach.
/// @param stations  one: nothing but that place, an end of the curve, touches
/// @param at_rest   of all nodes of b's mesh: where its edges are sharp or not [m]
/// @param known     ids that were found before, ascending
void touch_faces(const Curve& a, std::span<const FaceStation> stations, const SharpSurface& b,
                 std::span<const Vec3> at_rest, double reach, std::span<const std::int64_t> known,
                 std::vector<CurveOnFaces>& out);

/// True if the curve's middle line passes through a face, or nearer than half the radius to a sharp
/// edge, between `before` and `now`, all places moving in straight lines.
/// @param places_before  of b's nodes [m]
bool pass_through_faces(const Curve& before, const Curve& now, std::span<const Vec3> places_before,
                        const SharpSurface& b);

} // namespace amontons
