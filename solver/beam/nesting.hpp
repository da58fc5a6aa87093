#pragma once

#include "solver/beam/wire_contact.hpp"

#include <vector>

// Instruments in one another: a wire in the bore of a catheter. Contacts are those of points of the
// outer one (including its tip) and of the tip of the inner one with the other's smooth centreline:
// gap = clearance - distance of the centrelines. Equations: docs/theory/beams.md.

namespace amontons {

/// One instrument in another. Both come out of the same introducer.
struct Nesting {
    /// The inner instrument.
    const Wire* inner = nullptr;
    /// The outer instrument.
    const Wire* outer = nullptr;
    double friction = 0;               ///< [-]
    std::vector<MaterialPoint> points; ///< of the outer from its tip, then the inner's tip
    std::vector<Reaction> reaction;    ///< on the inner, at the points

    /// Number of the contact point at the tip of the inner instrument.
    int inners_tip() const { return int(points.size()) - 1; }
};

/// True if an instrument of this radius has no clearance in a bore of this radius [m].
bool fills_bore(double radius, double bore);

/// @param spacing  of the outer's points [m]
Nesting make_nesting(const Wire& inner, const Wire& outer, double friction, double spacing);

/// Places the part of a wire that is out of the sheath along another's centreline, as a first guess
/// for both.
void lie_along(Wire& wire, const Wire& guide);

/// Part of a wire's length past the introducer that lies in another instrument [m]: up to the tip
/// of the outer one.
double nested_length(const Nesting& n);

/// A contact in the bore. `on_inner` has the force on the inner instrument and its rows; what acts
/// on the outer is the opposite. An instrument that fills the bore has two at a place: the one's
/// normal is along the reaction known so far, the other's across it and the bore.
struct NestedContact {
    /// The contact as the inner instrument's.
    Candidate on_inner;
    WirePlace outer;             ///< place on the outer's centreline
    Vec3 x_outer;                ///< [m]
    double bore = 0;             ///< radius [m]
    ContactRow hn, ht[2];        ///< derivatives of gap and slips with the outer's unknowns
    bool moves_on_inner = false; ///< the point is the outer's, its place on the inner moves
    bool across = false;         ///< the second of two: only its gap counts, no friction of its own
    double distance = 0;         ///< of the centrelines [m]
};

/// States of both instruments at the start of the step.
struct NestingStart {
    /// States at the start of the step.
    WireState inner, outer;
};

/// All contacts in the bore whose gap is below `reach` [m] or that carry a reaction.
void find_nested(const Nesting& n, const NestingStart& start, double reach,
                 std::vector<NestedContact>& contacts);

/// The second derivative of a contact's work, with the signs of a tangent: to be added in rows and
/// columns (inner a, inner b, outer a, outer b).
using NestedTangent = Eigen::Matrix<double, 24, 24>;
/// The second derivatives of a contact in a bore: docs/theory/beams.md.
NestedTangent nested_tangent(const Nesting& n, const NestedContact& c);

/// Moves the reactions with the outer's points when its base was moved by a length [m].
void shift_nested_reactions(Nesting& n, double shift);

/// Motion of the inner surface against the bore over the step at one of the points, for a contact
/// with a given normal [m]; zero where they do not face each other.
Vec3 nested_motion(const Nesting& n, const NestingStart& start, int k, const Vec3& normal);
/// The part of nested_motion() tangential to the contact [m].
Vec3 nested_slip(const Nesting& n, const NestingStart& start, int k, const Vec3& normal);

} // namespace amontons
