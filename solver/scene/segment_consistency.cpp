#include "solver/scene/segment_consistency.hpp"

#include "solver/scene/section_layers.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace amontons {

namespace {

constexpr double kMostElements = 1e6; // of one beam: more is a slip of the unit, and 10 GB
constexpr double kSoftest = 1e-24;    // N m^2: less than a fibre of 10 nm has is a slip of the unit
// EA of EI / length^2: forces of a beam are known to some 2e-15 EA, and those of its bending are of
// the order of EI / length^2. A round wire of 1.6e6 radii.
constexpr double kStretching = 1e13;
constexpr double kHanging = 1e10; // of the loads: they are known to 2e-5, of a rope all that counts
constexpr double kDegrees = 180 / 3.14159265358979323846;
constexpr double kMostTurn = 2 * 3.14159265358979323846 / 3; // of an element [rad]

/// A table must begin at [0, 0], or lead through it, and rise.
/// @param linear  the stiffness beside it
void check_table(const CurvePoints& table, bool both_ways, const std::string& here,
                 const std::string& linear_place, double linear, Findings& findings)
{
    if (table.empty()) return;
    const char* zero = both_ways ? "a table through [0, 0]" : "a table from [0, 0] on";
    std::size_t at = 0;
    while (at < table.size() && table[at][0] != 0)
        ++at;
    if (at == table.size() || (at > 0 && !both_ways) || table[at][1] != 0)
        return findings.add({here},
                            at < table.size()
                                ? fmt::format("[{}, {}]", table[at][0], table[at][1])
                                : fmt::format("[{}, {}] first", table[0][0], table[0][1]),
                            zero);
    if (at + 1 == table.size())
        return findings.add({here}, fmt::format("{} point{}", table.size(), at ? "s" : ""),
                            "a point beyond [0, 0]");
    for (std::size_t i = 1; i < table.size(); ++i)
        if (!(table[i][1] > table[i - 1][1]))
            return findings.add({fmt::format("{}/{}", here, i)}, fmt::format("{}", table[i][1]),
                                fmt::format("> {}, the value before it: what yields as it "
                                            "is loaded has no balance",
                                            table[i - 1][1]));
    const double slope = table[at + 1][1] / table[at + 1][0];
    if (!(std::abs(linear / slope - 1) < 1e-6))
        findings.add({linear_place, here}, fmt::format("{}", linear),
                     fmt::format("nothing beside the table, or {:.9g}, its slope at 0", slope));
}

void check_layers(const BeamSegment& s, const std::string& here, Findings& findings)
{
    if (s.layers.empty()) return;
    const bool tapered = s.end_radius > 0 || std::ranges::any_of(s.layers, [](const auto& l) {
                             return l.end_inner_radius || l.end_outer_radius;
                         });
    const int ends = tapered ? 2 : 1;
    for (std::size_t i = 0; i < s.layers.size(); ++i) {
        const SectionLayer& l = s.layers[i];
        const std::string layer = fmt::format("{}/layers/{}", here, i);
        for (int end = 0; end < ends; ++end) {
            const auto [inner, outer] = radii_of(l, end);
            const std::string at = end == 1 ? "end_" : "",
                              inside =
                                  layer + "/" + (l.end_inner_radius ? at : "") + "inner_radius",
                              outside =
                                  layer + "/" + (l.end_outer_radius ? at : "") + "outer_radius";
            const bool cone = end == 1 && s.end_radius > 0;
            const double radius = cone ? s.end_radius : s.radius;
            if (!(inner < outer * (1 - kInputRoundOff)))
                findings.add({inside, outside}, fmt::format("{}", inner),
                             fmt::format("< {} [m], its outer radius, by more than {} of it", outer,
                                         kInputRoundOff));
            if (outer > radius * (1 + kInputRoundOff))
                findings.add({outside, here + (cone ? "/end_radius" : "/radius")},
                             fmt::format("{}", outer),
                             fmt::format("<= {} [m], the segment's radius", radius));
            if (inner < s.inner_radius * (1 - kInputRoundOff))
                findings.add({inside, here + "/inner_radius"}, fmt::format("{}", inner),
                             fmt::format(">= {} [m], the segment's bore", s.inner_radius));
            if (l.pitch > 0 && l.pitch < (outer - inner) * (1 - kInputRoundOff))
                findings.add({layer + "/pitch", layer}, fmt::format("{}", l.pitch),
                             fmt::format(">= {} [m], as thick as its wire is", outer - inner));
            if (l.pitch > 0 && !(inner > 0))
                findings.add({inside, layer}, fmt::format("{}", inner), "> 0 of a coil");
            for (std::size_t j = 0; j < i; ++j) {
                const auto [from, to] = radii_of(s.layers[j], end);
                if (inner < to * (1 - kInputRoundOff) && from < outer * (1 - kInputRoundOff))
                    findings.add({layer}, fmt::format("{} to {}", inner, outer),
                                 fmt::format("a place beside layer {}, {} to {}", j, from, to));
            }
        }
    }
    for (std::size_t end = 0; end < 2 && s.bending.empty(); ++end) {
        const double EI = stiffness_of(s.layers, double(end)).EI;
        if (std::abs(s.EI[end] / EI - 1) < 1e-6) continue;
        findings.add({here + "/EI", here + "/layers"}, fmt::format("{}", s.EI[end]),
                     fmt::format("nothing beside layers, or {:.9g}, their own", EI));
        break;
    }
    if (!s.bending.empty())
        findings.add({here + "/bending", here + "/layers"}, "a table", "nothing beside layers");
}

/// The length of the elements that a segment is divided into [m].
double element_of(const BeamSegment& s)
{
    return s.length / std::max(1.0, std::round(s.length / s.element));
}

/// Stiffnesses whose sizes no beam has, alone or together.
/// @param length  of the whole beam [m]
/// @param load  what acts on all of it, at least: a rope's forces are those of its tension [N]
void check_stiffness(const BeamSegment& s, const std::string& here, double length, double load,
                     Findings& findings)
{
    for (const auto& [value, name] :
         {std::pair{s.EI, "/EI"}, {s.EI_across, "/EI_across"}, {s.GJ, "/GJ"}})
        for (const double v : value)
            if (v > 0 && v < kSoftest) {
                findings.add({here + name, here + "/radius"}, fmt::format("{}", v),
                             fmt::format("0, or >= {} [N m^2]", kSoftest));
                break;
            }
    for (std::size_t end = 0; end < 2; ++end) {
        const double most = std::max(kStretching * s.EI[end] / (length * length), kHanging * load);
        if (!(s.EI[end] >= kSoftest) || !(s.EA[end] > most)) continue;
        findings.add(
            {here + "/EA", here + "/radius", here + "/EI"}, fmt::format("{:.6g}", s.EA[end]),
            fmt::format("<= {:.6g} [N], {:.0e} EI / length^2: beyond it the round-off of "
                        "stretching hides bending. Without \"EA\" it follows from the radius; a "
                        "smaller one changes nothing that can be seen",
                        most, kStretching));
        break;
    }
}

/// @param stiff  what EI and GJ must be; empty for what may be 0
/// @param length  of the whole beam [m]
/// @param load  as of check_stiffness
void check_segment(const BeamSegment& s, const std::string& here, const std::string& stiff,
                   double length, double load, const Scene& scene, Findings& findings)
{
    if (s.length > 0 && s.element > s.length * (1 + kInputRoundOff))
        findings.add({here + "/element", here + "/length"}, fmt::format("{}", s.element),
                     fmt::format("<= {} [m], the segment's length", s.length));
    if (s.end_radius > 0) {
        constexpr double kSlope = 0.1; // the sides' slope is left out where they touch
        if (std::abs(s.end_radius - s.radius) > kSlope * s.length)
            findings.add(
                {here + "/end_radius", here + "/length"}, fmt::format("{}", s.end_radius),
                fmt::format("{:.6g} to {:.6g} [m], at most {} of the length from the radius",
                            std::max(0.0, s.radius - kSlope * s.length),
                            s.radius + kSlope * s.length, kSlope));
        if (s.inner_radius >= s.end_radius * (1 - kInputRoundOff))
            findings.add({here + "/end_radius", here + "/inner_radius"},
                         fmt::format("{}", s.end_radius),
                         fmt::format("> {} [m], the bore's radius, by more than {} of it",
                                     s.inner_radius, kInputRoundOff));
        for (const auto& [given, name] : {std::pair{!s.bending.empty(), "bending"},
                                          std::pair{!s.stretching.empty(), "stretching"}})
            if (given)
                findings.add({here + "/end_radius", here + "/" + name}, "a cone",
                             fmt::format("no end_radius beside \"{}\"", name));
    }
    if (s.inner_radius > 0 && s.inner_radius >= s.radius * (1 - kInputRoundOff))
        findings.add(
            {here + "/inner_radius", here + "/radius"}, fmt::format("{}", s.inner_radius),
            fmt::format("< {} [m], the radius, by more than {} of it", s.radius, kInputRoundOff));
    const double thickest = std::max(s.radius, s.end_radius);
    if (std::abs(s.curvature) * thickest >= 1)
        findings.add(
            {here + "/curvature", here + "/radius"}, fmt::format("{}", s.curvature),
            fmt::format("less than {:.6g} [1/m], or the bend is tighter than the wire's own radius",
                        1 / thickest));
    const double turn = element_of(s) * std::hypot(s.curvature, s.twist);
    if (turn > kMostTurn)
        findings.add({here + "/element", here + (s.curvature != 0 ? "/curvature" : "/twist")},
                     fmt::format("{}: an element turns by {:.4g} degrees when free of loads",
                                 s.element, turn * kDegrees),
                     fmt::format("<= {:.6g} [m]: an element carries a turn of {:.3g} degrees",
                                 kMostTurn / std::hypot(s.curvature, s.twist),
                                 kMostTurn * kDegrees));
    check_stiffness(s, here, length, load, findings);
    if (s.radius > 0 && !(s.EA[0] > 0 && s.EA[1] > 0))
        findings.add({here + "/EA", here + "/EI", here + "/radius"}, "nothing",
                     "a number > 0 [N] where EI is 0");
    if (!stiff.empty() && s.EI[0] * s.EI[1] == 0) findings.add({here + "/EI"}, "0", stiff);
    if (s.EI_across[0] > 0)
        for (const auto& [given, name] : {std::pair{s.EI[0] * s.EI[1] == 0, "EI"},
                                          {!s.layers.empty(), "layers"},
                                          {!s.bending.empty(), "bending"}})
            if (given)
                findings.add({here + "/EI_across", here + "/" + name},
                             fmt::format("{}", s.EI_across[0]),
                             std::string("nothing beside ") +
                                 (std::string("EI") == name ? "a cable's EI of 0" : name));
    if (!stiff.empty() && s.GJ[0] * s.GJ[1] == 0)
        findings.add({here + "/GJ", here + "/EI"}, "0", stiff);
    check_layers(s, here, findings);
    check_table(s.bending, false, here + "/bending", here + "/EI", s.EI[0], findings);
    check_table(s.stretching, true, here + "/stretching", here + "/EA", s.EA[0], findings);
    if (!s.bending.empty() && s.EI[0] != s.EI[1])
        findings.add({here + "/EI", here + "/bending"}, fmt::format("[{}, {}]", s.EI[0], s.EI[1]),
                     "nothing beside a table");
    if (scene.time.kind == "dynamic" && !(s.density > 0))
        findings.add({here + "/density", "/time/kind"}, "nothing",
                     "a number > 0 [kg/m^3]: time.kind is \"dynamic\"");
}

} // namespace

double length_of(const std::vector<BeamSegment>& segments)
{
    double length = 0;
    for (const BeamSegment& s : segments)
        length += s.length;
    return length;
}

void check_segments(const std::vector<BeamSegment>& segments, const std::string& place, bool cables,
                    const Scene& scene, Findings& findings, double load)
{
    const bool cable =
        cables && std::all_of(segments.begin(), segments.end(), [](const BeamSegment& s) {
            return s.EI[0] == 0 && s.EI[1] == 0 && s.GJ[0] == 0 && s.GJ[1] == 0;
        });
    std::string stiff = cables ? "a number > 0 [N m^2], or EI and GJ 0 everywhere"
                               : "a number > 0 [N m^2] of a rod";
    if (cable) stiff.clear();
    // A beam that is thicker than it is long is a slip of the unit.
    const double length = length_of(segments);
    for (std::size_t i = 0; i < segments.size() && length > 0; ++i)
        if (const double thickest = std::max(segments[i].radius, segments[i].end_radius);
            thickest > length)
            findings.add({fmt::format("{}/segments/{}/radius", place, i), place + "/segments"},
                         fmt::format("{}", thickest),
                         fmt::format("<= {} [m], the length of the beam", length));
    // Next to an element that short round-off hides the bending of all others. Of a wire half of it
    // is also the way from contact point to contact point: there are a million of them.
    const double share = cables ? 2e-6 : 1e-5;
    for (std::size_t i = 0; i < segments.size(); ++i)
        if (const double h = element_of(segments[i]);
            h > 0 && h < share * length * (1 - kInputRoundOff))
            findings.add(
                {fmt::format("{}/segments/{}/element", place, i), place + "/segments"},
                fmt::format("{:.6g} m an element", h),
                fmt::format(">= {:.6g} [m], {:g} of the length of the beam: beside shorter "
                            "ones round-off hides bending",
                            share * length, share));
    double elements = 0;
    for (std::size_t i = 0; i < segments.size(); ++i) {
        check_segment(segments[i], fmt::format("{}/segments/{}", place, i), stiff,
                      length_of(segments), load, scene, findings);
        const std::string here = fmt::format("{}/segments/{}", place, i);
        if (cables && !segments[i].stretching.empty())
            findings.add({here + "/stretching"}, "a table",
                         "nothing: what is in an introducer stretches by EA");
        if (cables && segments[i].twist != 0)
            findings.add({here + "/twist"}, fmt::format("{}", segments[i].twist),
                         "0: what is in an introducer has no twist of its own");
        if (segments[i].element > 0) elements += segments[i].length / segments[i].element;
    }
    if (elements > kMostElements)
        findings.add({place + "/segments"}, fmt::format("{:.3g} elements", elements),
                     fmt::format("<= {:.3g} elements of one beam", kMostElements));
}

void check_contact_spacing(double spacing, const std::vector<BeamSegment>& segments,
                           const std::string& place, Findings& findings)
{
    constexpr double kMost = 1e6; // points: more is a slip of the unit
    const double length = length_of(segments);
    if (spacing > 0 && length / spacing > kMost)
        findings.add({place + "/contact_spacing", place + "/segments"}, fmt::format("{}", spacing),
                     fmt::format(">= {:.3g} [m]", length / kMost));
}

} // namespace amontons
