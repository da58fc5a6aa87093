#include "solver/scene/segment_fields.hpp"

#include "solver/scene/declare.hpp"
#include "solver/scene/scene.hpp"
#include "solver/scene/section_layers.hpp"

#include <algorithm>

namespace amontons {
namespace {

using namespace declare;

void complete_segment(void* object, const std::function<bool(const char*)>& given)
{
    constexpr double kTorsionOfBending = 0.77; // GJ / EI of a round wire with nu = 0.3
    auto& s = *static_cast<BeamSegment*>(object);
    // Of tables the stiffness at rest: where they are not as they must be, consistency.cpp reports
    // it.
    const auto at_rest = [](const CurvePoints& table) {
        for (std::size_t i = 0; i + 1 < table.size(); ++i)
            if (table[i][0] == 0)
                return (table[i + 1][1] - table[i][1]) / (table[i + 1][0] - table[i][0]);
        return 0.0;
    };
    if (!s.layers.empty()) {
        const SectionStiffness from = stiffness_of(s.layers), to = stiffness_of(s.layers, 1);
        if (!given("EI") && s.bending.empty()) s.EI = {from.EI, to.EI};
        if (!given("GJ")) s.GJ = {from.GJ, to.GJ};
        if (!given("EA") && s.stretching.empty()) s.EA = {from.EA, to.EA};
    }
    if (!given("EI") && !s.bending.empty()) s.EI.fill(at_rest(s.bending));
    if (!given("EA") && !s.stretching.empty()) s.EA.fill(at_rest(s.stretching));
    for (std::size_t end = 0; end < 2; ++end) {
        // Of a flattened wire, an ellipse as wide as the radius.
        const double EI = s.EI[end], across = given("EI_across") ? s.EI_across[end] : EI;
        if (!given("GJ") && s.layers.empty() && EI > 0)
            s.GJ[end] = kTorsionOfBending * EI * (2 * across / (EI + across));
        if (!given("EA") && s.stretching.empty() && s.layers.empty() && s.radius > 0) {
            const double radius = end == 1 && s.end_radius > 0 ? s.end_radius : s.radius;
            s.EA[end] =
                4 * std::max(EI, across) / (radius * radius + s.inner_radius * s.inner_radius);
        }
    }
}

} // namespace

ObjectDeclaration declare_layer()
{
    using L = SectionLayer;
    return {
        "Layer of a section: a tube, or a coil of round wire",
        {field<&L::inner_radius>("inner_radius", "m", at_least(0),
                                 "Where it begins; 0: in the middle."),
         required(field<&L::outer_radius>("outer_radius", "m", positive(), "Where it ends.")),
         fallback("inner_radius",
                  field<&L::end_inner_radius>("end_inner_radius", "m", at_least(0),
                                              "The same at the segment's end; in between it "
                                              "varies linearly.")),
         fallback("outer_radius", field<&L::end_outer_radius>("end_outer_radius", "m", positive(),
                                                              "The same at the segment's "
                                                              "end.")),
         required(
             field<&L::youngs_modulus>("youngs_modulus", "Pa", positive(), "Young's modulus E.")),
         field<&L::poisson_ratio>("poisson_ratio", "", above(-1, 0.5), "Poisson's ratio nu."),
         fallback("a tube",
                  field<&L::pitch>("pitch", "m", at_least(0),
                                   "Of a coil: way along the wire from turn to turn; its own "
                                   "wire is as thick as the layer. 0: a tube."))},
        "",
        {},
        defaults_of<L>()};
}

ObjectDeclaration declare_segment(const ObjectDeclaration& layer)
{
    using B = BeamSegment;
    ObjectDeclaration d{
        "Segment of a beam, from its base towards its tip",
        {required(field<&B::length>("length", "m", between(1e-9, 1e9), "Length.")),
         required(
             field<&B::radius>("radius", "m", between(1e-9, 1e6), "Radius of the round surface.")),
         fallback("radius", field<&B::end_radius>(
                                "end_radius", "m", between(1e-9, 1e6),
                                "Of a cone: its radius at the segment's end. Stiffnesses of two "
                                "values follow powers of the radius between its ends.")),
         fallback("solid", field<&B::inner_radius>("inner_radius", "m", at_least(0),
                                                   "Radius of the bore that another instrument "
                                                   "can slide in; 0: solid.")),
         required_unless({"bending", "layers"},
                         field<&B::EI>("EI", "N m^2", between(0, 1e24),
                                       "Bending stiffness, 1e-24 at least; 0 makes a cable (EA "
                                       "is needed then).")),
         fallback("EI", field<&B::EI_across>(
                            "EI_across", "N m^2", positive(),
                            "Of a flattened wire or a ribbon: bending stiffness across the plane "
                            "of a curvature at angle 0, EI being that in it. GJ and EA that are "
                            "not given are an ellipse's as wide as the radius.")),
         no_fewer(1, list<&B::layers>("layers", layer,
                                      "Of tubes and coils one in another, which bend and "
                                      "stretch as one: EI, GJ and EA where these are not given.")),
         fallback("0.77 EI; with EI_across 1.54 / (1 / EI + 1 / EI_across)",
                  field<&B::GJ>("GJ", "N m^2", between(0, 1e24),
                                "Torsional stiffness, 1e-24 at least or 0 as EI.")),
         fallback("4 EI / (radius^2 + inner_radius^2), of the larger EI",
                  field<&B::EA>("EA", "N", between(1e-18, 1e36),
                                "Axial stiffness; at most 1e13 EI / (length of the beam)^2 or, "
                                "of a rod, 1e10 times its weight and loads, or round-off of "
                                "stretching hides bending.")),
         fallback("no shear deformation",
                  field<&B::GA>("GA", "N", at_least(0), "Shear stiffness; 0: rigid in shear.")),
         fallback("linear, EI", table<&B::bending>("bending", "curvature", "1/m", "N m",
                                                   "Moment over the change of curvature, in any "
                                                   "direction, from [0, 0] on; elastic.")),
         fallback("linear, EA", table<&B::stretching>("stretching", "strain", "", "N",
                                                      "Axial force over strain, through [0, 0]; "
                                                      "elastic; of a rod.")),
         field<&B::curvature>("curvature", "1/m", kAny,
                              "Curvature when free of loads; with `twist` an element's turn is 120 "
                              "degrees at most."),
         field<&B::curvature_angle>("curvature_angle", "rad", kAny,
                                    "Turns the plane of the curvature about the wire."),
         field<&B::twist>("twist", "rad/m", kAny,
                          "Twist when free of loads: turns that plane along the wire; of a rod."),
         required(field<&B::element>(
             "element", "m", between(1e-9, 1e9),
             "Length of its elements; of a rod 1e-5 of its whole length at least, of a "
             "wire 2e-6.")),
         fallback("the pair's", field<&B::friction>("friction", "", at_least(0),
                                                    "Coulomb's coefficient of this segment.")),
         fallback("none (dynamics needs it)",
                  field<&B::density>("density", "kg/m^3", positive(), "Mass per volume."))},
        "",
        {},
        defaults_of<B>()};
    d.complete = complete_segment;
    return d;
}

} // namespace amontons
