#include "solver/scene/vessel_consistency.hpp"

#include "mesh/base/text.hpp"

#include <algorithm>
#include <fmt/format.h>

namespace amontons {
namespace {

bool is_constant(const CurvePoints& curve)
{
    return std::all_of(curve.begin(), curve.end(),
                       [&](const auto& p) { return p[1] == curve.front()[1]; });
}

void check_vessel(const SolidInput& b, const Scene& scene, Findings& findings)
{
    const std::string place = "/bodies/" + b.name;
    if (b.mesh.generate != "tube") {
        findings.add({place + "/mesh/generate"},
                     b.mesh.generate.empty() ? "a file" : quoted_text(b.mesh.generate),
                     "\"tube\": beside beams a solid is the wall of a vessel");
        return;
    }
    if (b.mesh.element == "T4")
        findings.add({place + "/mesh/element"}, "\"T4\"",
                     "\"H8\" or \"T10\": a thin wall of T4 is many times too stiff");
    if (b.motion == "corotational")
        findings.add({place + "/motion"}, quoted_text(b.motion),
                     "\"linear\" or \"hyperelastic\" of a wall that a beam touches");
    if (b.start.place != Vec3::Zero() || b.start.turn != Vec3::Zero())
        findings.add({place + "/start"}, "a wall that is moved first",
                     "none: its centreline specifies where it is");
    if (b.drive.given)
        findings.add({place + "/drive"}, "a wall that is driven", "one that is held");
    if (b.hold.empty())
        findings.add({place + "/hold"}, "nothing",
                     "a set that holds it, such as {\"set\": \"start\"} and {\"set\": \"end\"}");
    for (std::size_t i = 0; i < b.hold.size(); ++i)
        if (b.hold[i].affine())
            findings.add({fmt::format("{}/hold/{}", place, i)}, "a turn or a gradient",
                         "none: the wall that a beam touches is held at rest");
    for (std::size_t i = 0; i < b.hold.size(); ++i)
        for (const CurvePoints* c : {&b.hold[i].x, &b.hold[i].y, &b.hold[i].z})
            for (const auto& p : *c)
                if (p[1] != 0) {
                    findings.add({fmt::format("{}/hold/{}", place, i)},
                                 fmt::format("a displacement of {}", p[1]),
                                 "0 [m]: the wall that a beam touches is held at rest");
                    break;
                }
    for (std::size_t i = 0; i < b.loads.size(); ++i)
        for (const CurvePoints* c : {&b.loads[i].pressure, &b.loads[i].over})
            if (!is_constant(*c))
                findings.add({fmt::format("{}/loads/{}", place, i)}, "a load that changes",
                             "a constant one: it is there when the beam comes");
    for (std::size_t i = 0; i < b.loads.size(); ++i)
        if (!b.loads[i].volume.empty())
            findings.add({fmt::format("{}/loads/{}/volume", place, i)}, "a volume",
                         "a pressure, a traction or a force");
    int pairs = 0;
    for (std::size_t i = 0; i < scene.contact.size(); ++i) {
        const ContactLaw& law = scene.contact[i];
        for (std::size_t side = 0; side < 2; ++side) {
            if (law.between[side] != b.name) continue;
            const std::string where = fmt::format("/contact/{}/between", i);
            const std::string& other = law.between[1 - side];
            if (body_named(scene.beams, other))
                ++pairs;
            else if (other != b.name)
                findings.add({where}, quoted_text(b.name) + " and " + quoted_text(other),
                             "the wall of a vessel and a beam");
            if (pairs > 1)
                findings.add({where}, quoted_text(b.name) + " and a second beam",
                             "one beam in a wall that is compliant");
            if (const std::string& set = law.surfaces[side]; !set.empty() && set != "inner")
                findings.add({fmt::format("/contact/{}/surfaces/{}", i, side)}, quoted_text(set),
                             "\"inner\" or \"\"");
        }
    }
}

} // namespace

void check_vessels(const Scene& scene, Findings& findings)
{
    if (scene.beams.empty() || scene.solids.empty()) return;
    for (const SolidInput& b : scene.solids)
        check_vessel(b, scene, findings);
    if (scene.time.kind == "dynamic")
        findings.add({"/time/kind"}, "\"dynamic\"",
                     "\"quasi_static\": walls that are compliant have no inertia yet");
    for (std::size_t i = 0; i < scene.contact.size(); ++i)
        if (body_named(scene.beams, scene.contact[i].between[0]) &&
            body_named(scene.beams, scene.contact[i].between[1]))
            findings.add({fmt::format("/contact/{}/between", i)}, "instruments in one another",
                         "one beam: instruments in one another need rigid walls");
}

} // namespace amontons
