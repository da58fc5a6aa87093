#pragma once

#include "solver/beam/element.hpp"
#include "solver/beam/material.hpp"

// The part of a wire that a straight frictionless sheath holds, and the element that grows out of
// it. The held part is not meshed: it is stretched and twisted as one spring, by its length.

namespace amontons {

/// How a wire is held at its base.
struct HeldBase {
    const WireMaterial& material;
    double next = 0;            ///< place along the wire of the first node out of the sheath [m]
    double inserted = 0;        ///< length of wire past the sheath's end [m]
    double inserted_rest = 0;   ///< low-order part of `inserted`, as BeamNode::rest [m]
    double base_insertion = 0;  ///< given [m]
    double rotation = 0;        ///< of the section at the sheath's end about the axis [rad]
    double base_twist = 0;      ///< given [rad]
    double compliance = 0;      ///< of a spring along the wire at its base [m/N]
    double turn_compliance = 0; ///< ... about it [rad/(N m)]

    double end() const { return material.length - inserted; } ///< place at the sheath's end [m]
    double stretch() const { return (inserted - base_insertion) + inserted_rest; } ///< [m]
};

/// Energy per length of the wire at s when it is straight [J/m].
double straight_energy(const WireMaterial& m, double s);

/// Compliances and bending energy of the wire between its base and the place `end` [m], the springs
/// at the base included.
HeldWire held_part(const HeldBase& base, double end);

/// Law of the element at the sheath's end if the wire were `further` out [m].
ElementLaw law_at_end(const HeldBase& base, double further);

/// Derivatives with respect to the length that is out of the sheath, with the nodes fixed.
struct Growth {
    double slope = 0;              ///< of the energy of the first element and the held part [N]
    std::array<double, 6> tau{};   ///< of the first element's section forces
    double force = 0, torque = 0;  ///< in the held part [N], [N m]
    double axial = 0, torsion = 0; ///< its compliances [m/N], [rad/(N m)]
};

/// @param a, b     the nodes of the first element
/// @param law      its own
/// @param further  where to take them, off the base's own length [m]
Growth growth(const HeldBase& base, const BeamNode& a, const BeamNode& b, const ElementLaw& law,
              double further);

/// Second derivative of the energy with the length that is out [N/m], by differences of fourth
/// order: the section changes fast where a step of curvature leaves the sheath, and there it is
/// stiffer than the held part. In an unconstrained wire the terms EA/l have to cancel to round-off.
double growth_stiffness(const HeldBase& base, const BeamNode& a, const BeamNode& b);

} // namespace amontons
