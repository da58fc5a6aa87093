#pragma once

#include "contact/curve/curve_contact.hpp"
#include "contact/surface/sharp_contacts.hpp"

#include <array>
#include <limits>

// Where a round curve touches the outside of a solid that bends.
//
// On faces wider across the curve than 0.7 of its radius the curve acts as a line: contacts are at
// its stations, and where it bends over sharp edges, and distribute their force to the nodes of the
// face. Finer faces resolve the width of the contact: there contacts are at the nodes that carry
// the solid's multipliers, with the curve's round surface, as with any smooth wall.

namespace amontons {

/// A contact of a curve (a) with nodes of a solid (b).
struct CurveOnFaces {
    CurveContact curve;                 ///< b is unused
    std::array<StencilEntry, 4> node{}; ///< of the solid's mesh; weights sum to 1
    int nodes = 0;
    double area = 0; ///< of a node's multiplier [m^2]; 0: unknown
};

/// A place of a curve at which contact with the faces below it is searched for.
struct FaceStation {
    CurvePlace place;
    /// Distance between the stations of the next coarser set [m]: where faces are longer along the
    /// curve, those suffice and this one is left out. inf: it never is.
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
