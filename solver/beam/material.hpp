#pragma once

#include "solver/beam/element.hpp"
#include "solver/scene/scene.hpp"

#include <array>
#include <vector>

namespace amontons {

/// Section of a wire at one place: stiffness and natural strain, in the order of ElementLaw.
struct Section {
    std::array<double, 6>
        stiffness{};                 ///< EA, GA, GA [N], GJ, EI across, EI [N m^2]; GA 0: no shear
    std::array<double, 6> natural{}; ///< 1, 0, 0, natural twist and curvatures [1/m]
};

/// A stretch of wire along which stiffness and natural strain are linear.
struct SectionStretch {
    double start = 0, end = 0; ///< [m]
    Section at_start, at_end;
    std::array<int, 2> segment{}; ///< numbers of the segments at its start and end
};

/// A place on the wire's surface where contact is searched for; it stays with the material.
struct MaterialPoint {
    double s = 0;      ///< from the base [m]
    int element = 0;   ///< between material nodes element, element + 1
    double xi = 0;     ///< place in that element, 0..1 (share)
    double radius = 0; ///< of the wire [m]
    int segment = 0;
    double spacing = 0; ///< length of wire that the point stands for [m]
};

/// Constant data of a wire: sections, nodes, contact points. s runs from the base (0) to the tip.
struct WireMaterial {
    double length = 0; ///< [m]
    std::vector<BeamSegment> segments;
    std::vector<double> segment_start; ///< s of each segment's start [m]
    std::vector<TableShare> table;     ///< of each segment, of no length; empty: all are linear
    /// The segments with their steps in stiffness and curvature spread over a wire radius: a
    /// step would give the sheath's end a force without a value there.
    std::vector<SectionStretch> stretch;
    std::vector<double> node;    ///< s of the nodes, increasing [m]
    std::vector<ElementLaw> law; ///< of the whole elements
    /// Least EI / l^3 of each element, l the larger of its length and 5 radii: the scale of forces,
    /// independent of the mesh where that is fine [N/m]
    std::vector<double> stiffness;
    std::vector<MaterialPoint> point;        ///< from the tip (0) towards the base
    std::vector<double> flexibility_axial;   ///< integral of ds/EA from 0 to each node [m/N]
    std::vector<double> flexibility_torsion; ///< integral of ds/GJ from 0 to each node [1/(N m)]
    std::vector<double> bending_energy; ///< integral of sum EI k0^2 / 2 from 0 to each node [J]
};

/// @param contact_spacing  distance of contact points [m]; 0: half the shortest element
WireMaterial make_material(const std::vector<BeamSegment>& segments, double contact_spacing);
/// Places contact points at this distance from one another, from the tip on [m]; data stored by
/// their numbers become invalid. With half the distance every point is kept: number k becomes 2 k.
void place_contact_points(WireMaterial& material, double spacing);
/// Number of contact points on a length at this spacing [m].
std::size_t contact_point_count(double length, double spacing);

/// Section at s.
/// @param s  arc length from the base [m]
Section section_at(const WireMaterial& m, double s);

/// Energy per length of a linear section that is straightened [J/m].
double straightening_energy(const Section& c);

/// Strains of the straight wire less its natural ones.
inline std::array<double, 6> straightened(const Section& c)
{
    return {0, 0, 0, 0, -c.natural[4], -c.natural[5]};
}

/// What tables add to the section at s: shares of one metre.
std::vector<TableShare> tables_at(const WireMaterial& m, double s);

/// Rescales the bending tables of shares to the curvature of the element: of sections in series the
/// stiffer one has less of the change of curvature.
void share_bending(std::vector<TableShare>& shares, const ElementLaw& law);

/// Law of the piece [a, b] of the wire as one element.
ElementLaw law_between(const WireMaterial& m, double a, double b);

/// Moves a node along the wire from a to b [m], each section with its natural strains.
/// @param more  strains beyond the natural ones, in the order of ElementLaw
void move_along_wire(BeamNode& node, const WireMaterial& m, double a, double b,
                     const std::array<double, 6>& more);

/// Sums from the base to s: flexibility and bending energy of the straightened wire.
struct HeldWire {
    double axial = 0;   ///< integral ds/EA [m/N]
    double torsion = 0; ///< integral ds/GJ [1/(N m)]
    double bending = 0; ///< integral sum EI k0^2/2 [J]
};
/// The wire between its base and the place s, held straight.
/// @param s  arc length from the base [m]
HeldWire held_between_base_and(const WireMaterial& m, double s);

} // namespace amontons
