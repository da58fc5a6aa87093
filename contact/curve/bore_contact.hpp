#pragma once

#include "contact/curve/curve_contact.hpp"

// Where a round curve touches the bore of another one that it lies in: a wire in a catheter.
//
// Contacts are those of the stations of the outer curve, its end included, with the nearest place
// of the inner one, and of the inner curve's end with the nearest place of the outer one: gap =
// radius of the bore - radius of the inner curve - distance of the middle lines.

namespace amontons {

/// Two curves that come out of one place: both are followed from there on.
struct BorePair {
    /// The curve with the bore.
    const Curve& outer;
    /// The curve in it.
    const Curve& inner;
    std::span<const double> bore; ///< radius of the bore on each piece of the outer curve [m]
    int first_outer = 0, first_inner = 0; ///< the pieces that come out there
};

/// The place of a curve at which its distance from x is least, searched from a piece on in the
/// direction in which it becomes less; nothing where that leads beyond an end of the curve.
/// @param piece  in: where the search begins; out: where it ended
/// @param first  pieces before it do not count
std::optional<CurvePlace> nearest_place(const Curve& curve, const Vec3& x, int first, int& piece);

/// Appends contacts of gap <= reach; a is the place on the outer curve, b that on the inner one.
/// @param stations  of the outer curve, ascending
/// @param reach     largest gap of a contact [m]
void touch_bore(const BorePair& pair, std::span<const CurvePlace> stations, double reach,
                std::vector<CurveContact>& out);

/// The deepest place of the inner curve in the wall of the bore, from its first piece to where it
/// leaves the outer curve's end; places are half a radius apart.
struct BoreOverlap {
    double depth = 0;          ///< > 0: it stands in the wall [m]
    Vec3 point = Vec3::Zero(); ///< on the inner middle line [m]
};
/// Of the inner curve's surface in the wall of the bore.
BoreOverlap bore_overlap(const BorePair& pair);

} // namespace amontons
