#include "solver/scene/segment_consistency.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace amontons {

namespace {

constexpr double kMostElements = 1e6; // of one beam: more is a slip of the unit, and 10 GB
constexpr double kRoundOff = 1e-9;    // of lengths that are meant to be the same, relative

/// @param stiff  what EI and GJ must be; empty for what may be 0
void check_segment(const BeamSegment& s, const std::string& here, const std::string& stiff,
                   const Scene& scene, Findings& findings)
{
    if (s.length > 0 && s.element > s.length * (1 + kRoundOff))
        findings.add({here + "/element", here + "/length"}, fmt::format("{}", s.element),
                     fmt::format("<= {} [m], the segment's length", s.length));
    if (s.inner_radius > 0 && s.inner_radius >= s.radius)
        findings.add({here + "/inner_radius", here + "/radius"}, fmt::format("{}", s.inner_radius),
                     fmt::format("< {} [m], the radius", s.radius));
    if (std::abs(s.curvature) * s.radius >= 1)
        findings.add(
            {here + "/curvature", here + "/radius"}, fmt::format("{}", s.curvature),
            fmt::format("less than {:.6g} [1/m], or the bend is tighter than the wire's own radius",
                        1 / s.radius));
    if (s.radius > 0 && !(s.EA[0] > 0 && s.EA[1] > 0))
        findings.add({here + "/EA", here + "/EI", here + "/radius"}, "nothing",
                     "a number > 0 [N] where EI is 0");
    if (!stiff.empty() && s.EI[0] * s.EI[1] == 0) findings.add({here + "/EI"}, "0", stiff);
    if (!stiff.empty() && s.GJ[0] * s.GJ[1] == 0)
        findings.add({here + "/GJ", here + "/EI"}, "0", stiff);
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
                    const Scene& scene, Findings& findings)
{
    const bool cable =
        cables && std::all_of(segments.begin(), segments.end(), [](const BeamSegment& s) {
            return s.EI[0] == 0 && s.EI[1] == 0 && s.GJ[0] == 0 && s.GJ[1] == 0;
        });
    std::string stiff = cables ? "a number > 0 [N m^2], or EI and GJ 0 everywhere"
                               : "a number > 0 [N m^2] of a rod";
    if (cable) stiff.clear();
    double elements = 0;
    for (std::size_t i = 0; i < segments.size(); ++i) {
        check_segment(segments[i], fmt::format("{}/segments/{}", place, i), stiff, scene, findings);
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
