#include "solver/scene/consistency.hpp"

#include "solver/scene/body_consistency.hpp"
#include "solver/scene/haptic_fields.hpp"
#include "solver/scene/instrument_rods.hpp"
#include "solver/scene/rod_fields.hpp"
#include "solver/scene/segment_consistency.hpp"
#include "solver/scene/vessel_consistency.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <set>

namespace amontons {
namespace {

constexpr double kMostSteps = 1e8; // of a run: more is a slip of the unit

void check_centreline(const CentrelineInput& c, const std::string& place, Findings& findings)
{
    const bool file = !c.file.empty(), pieces = !c.pieces.empty();
    if (file == pieces)
        findings.add({place}, file ? "a file and pieces" : "neither file nor pieces",
                     "either \"file\" or \"pieces\"");
    if (pieces && !(c.direction.normalized().cross(c.normal.normalized()).norm() > kInputRoundOff))
        findings.add({place + "/normal", place + "/direction"}, "parallel to direction",
                     "another direction than the start's");
    for (std::size_t i = 0; i < c.pieces.size(); ++i) {
        const CentrelinePiece& p = c.pieces[i];
        const std::string here = fmt::format("{}/pieces/{}", place, i);
        const bool straight = p.length > 0 && p.radius == 0 && p.angle == 0;
        const bool arc = p.length == 0 && p.radius > 0 && p.angle > 0;
        if (!straight && !arc)
            findings.add({here},
                         fmt::format("length {}, radius {}, angle {}", p.length, p.radius, p.angle),
                         "a length > 0 [m], or a radius > 0 [m] and an angle > 0 [rad]");
    }
}

void check_named_branches(const SurfaceInput& s, const std::string& place, Findings& findings)
{
    std::set<std::string> names;
    for (std::size_t i = 0; i < s.named_branches.size(); ++i) {
        const NamedBranchInput& b = s.named_branches[i];
        const std::string here = fmt::format("{}/branches/{}", place, i);
        const int ways = int(b.has_line()) + b.ball.given + b.box.given;
        if (ways != 1)
            findings.add({here}, ways == 0 ? "no place" : fmt::format("{} places", ways),
                         "one of \"centreline\", \"ball\", \"box\"");
        if (b.box.given && !((b.box.to - b.box.from).cwiseAbs().minCoeff() > 0))
            findings.add({here + "/box"}, "a flat box", "a box that holds a place");
        if (b.has_line()) check_centreline(b.centreline, here + "/centreline", findings);
        if (!names.insert(b.name).second)
            findings.add({here + "/name"}, quoted_text(b.name) + " again", "another name");
    }
}

void check_obstacle(const ObstacleInput& o, Findings& findings)
{
    const SurfaceInput& s = o.surface;
    const std::string place = "/bodies/" + o.name + "/surface";
    check_named_branches(s, place, findings);
    if (s.generate == "tube") {
        check_centreline(s.centreline, place + "/centreline", findings);
        if (s.radius == 0 && !s.centreline.pieces.empty())
            findings.add({place + "/radius", place + "/centreline"}, "nothing",
                         "a number > 0 [m] (pieces carry no radius of their own)");
        for (std::size_t i = 0; i < s.centreline.pieces.size(); ++i) {
            const CentrelinePiece& p = s.centreline.pieces[i];
            if (p.radius > 0 && s.radius >= p.radius)
                findings.add(
                    {place + "/radius", fmt::format("{}/centreline/pieces/{}/radius", place, i)},
                    fmt::format("{}", s.radius),
                    fmt::format("< {} [m], the radius of the bend (pieces/{})", p.radius, i));
        }
    }
    const bool lumen = s.generate == "tube" || s.generate == "vessel";
    if ((lumen && o.side == "outside") || (s.generate == "plane" && !o.side.empty()))
        findings.add({"/bodies/" + o.name + "/side"}, quoted_text(o.side),
                     lumen ? "\"inside\", or nothing: a " + s.generate + " is hollow"
                           : "nothing: the free space of a plane is where its normal points");
    if (s.generate == "vessel") {
        const double widest = std::max(s.arch_diameter[0], s.arch_diameter[1]) / 2;
        if (s.arch_radius > 0 && widest >= s.arch_radius)
            findings.add({place + "/arch_diameter", place + "/arch_radius"},
                         fmt::format("{}", 2 * widest),
                         fmt::format("< {} [m], twice the arch's radius", 2 * s.arch_radius));
        if (!(s.axis.normalized().cross(s.arch_towards.normalized()).norm() > kInputRoundOff))
            findings.add({place + "/arch_towards", place + "/axis"}, "parallel to axis",
                         "another direction than the axis");
        std::set<std::string> names;
        const double arch = s.arch_radius * s.arch_angle;
        for (std::size_t i = 0; i < s.branches.size(); ++i) {
            const BranchInput& b = s.branches[i];
            const std::string here = fmt::format("{}/branches/{}", place, i);
            if (!b.name.empty() && !names.insert(b.name).second)
                findings.add({here + "/name"}, "\"" + b.name + "\" again", "another name");
            if (b.at > arch && arch > 0)
                findings.add({here + "/at", place + "/arch_radius", place + "/arch_angle"},
                             fmt::format("{}", b.at),
                             fmt::format("<= {:.6g} [m], the length of the arch", arch));
        }
    }
}

void check_introducer(const BeamInput& b, const Scene& scene, Findings& findings)
{
    const IntroducerInput& i = b.introducer;
    const std::string place = "/bodies/" + b.name + "/introducer";
    if (!i.branch.empty() && !i.centreline.file.empty())
        findings.add({place + "/branch", place + "/centreline"}, "a branch and a centreline",
                     "either \"branch\" or \"centreline\"");
    const char* by = i.branch.empty() ? "\"centreline\"" : "\"branch\"";
    if (i.placed() && i.at_given)
        findings.add({place + "/at"}, fmt::format("a place beside {}, which gives it", by), "one");
    if (i.placed() && i.direction_given)
        findings.add({place + "/direction"},
                     fmt::format("a direction beside {}, which gives it", by), "one");
    if (!i.placed() && !i.end.empty())
        findings.add({place + "/end"}, quoted_text(i.end),
                     "nothing without \"centreline\" or \"branch\"");
    if (i.centreline.reverse && i.end == "start")
        findings.add({place + "/end", place + "/centreline/reverse"},
                     "\"start\" of a line in reverse", "\"end\", or no \"reverse\"");
    if (i.branch.empty()) return;
    std::vector<std::string> names;
    for (const ObstacleInput& o : scene.obstacles) {
        for (const BranchInput& n : o.surface.branches)
            names.push_back(n.name);
        for (const NamedBranchInput& n : o.surface.named_branches) {
            names.push_back(n.name);
            if (n.name == i.branch && !n.has_line())
                findings.add({place + "/branch"}, quoted_text(i.branch) + ", a ball or a box",
                             "a branch with a \"centreline\"");
        }
    }
    const auto count = std::count(names.begin(), names.end(), i.branch);
    if (count == 1) return;
    std::string list;
    for (const std::string& n : names)
        list += (list.empty() ? "one of " : ", ") + quoted_text(n);
    findings.add({place + "/branch"},
                 quoted_text(i.branch) + (count > 1 ? ", a branch of two obstacles" : ""),
                 count > 1       ? "names that distinguish branches"
                 : names.empty() ? "a branch of an obstacle, which has none"
                                 : list);
}

void check_beam(const BeamInput& b, const Scene& scene, Findings& findings)
{
    const std::string place = "/bodies/" + b.name;
    const std::string segments = place + "/segments";
    check_segments(b.segments, place, true, scene, findings);

    const double length = length_of(b.segments);
    double deepest = 0;
    for (const auto& p : b.insertion)
        deepest = std::max(deepest, p[1]);
    // Something of the wire must stay in the sheath's rigid part: its compliance is the drive's.
    const double most = length - b.introducer.fade;
    if (!b.segments.empty() && most > 0 && deepest >= most * (1 - kInputRoundOff))
        findings.add({place + "/drive/insertion", segments, place + "/introducer/fade"},
                     fmt::format("{}", deepest),
                     fmt::format("< {:.6g} [m], the length of the wire{}", most,
                                 b.introducer.fade > 0 ? " less the introducer's fade" : ""));
    const bool own = b.introducer.length > 0;
    const double sheath = own ? b.introducer.length : length;
    if (!b.segments.empty() && b.introducer.fade >= sheath * (own ? 1 + kInputRoundOff : 1))
        findings.add({place + "/introducer/fade", own ? place + "/introducer/length" : segments},
                     fmt::format("{}", b.introducer.fade),
                     fmt::format("{} {:.6g} [m], the length of the {}", own ? "<=" : "<", sheath,
                                 own ? "introducer" : "wire"));
    check_introducer(b, scene, findings);
    if (b.introducer.normal && !b.introducer.placed() &&
        !(b.introducer.direction.normalized().cross(b.introducer.normal->normalized()).norm() >
          kInputRoundOff))
        findings.add({place + "/introducer/normal", place + "/introducer/direction"},
                     "parallel to direction", "another direction than the introducer's");
    if (b.plane && !b.introducer.placed() &&
        std::abs(b.introducer.direction.normalized().dot(b.plane->normalized())) > kInputRoundOff)
        findings.add({place + "/plane", place + "/introducer/direction"},
                     "a plane that the introducer leaves",
                     "a normal across the introducer's direction");
    check_contact_spacing(b.contact_spacing, b.segments, place, findings);
    if (!b.hold.given) return;
    for (const auto& p : b.insertion)
        if (!(p[1] > 0)) {
            findings.add({place + "/drive/insertion", place + "/hold"}, fmt::format("{}", p[1]),
                         "> 0 [m] at all times: a tip that is held is out of its introducer");
            break;
        }
    const CurvePoints* along[] = {&b.hold.x, &b.hold.y, &b.hold.z};
    for (std::size_t k = 0; k < 3; ++k) {
        const std::string here = place + "/hold/" + "xyz"[k];
        if (!along[k]->empty() && along[k]->front()[1] != 0)
            findings.add({here}, fmt::format("{} at its start", along[k]->front()[1]),
                         "0 [m]: displacements count from where the tip begins");
        if (b.plane && std::abs(b.plane->normalized()[Eigen::Index(k)]) > kInputRoundOff)
            for (const auto& p : *along[k])
                if (p[1] != 0) {
                    findings.add({here, place + "/plane"}, fmt::format("{}", p[1]),
                                 "0: along an axis that leads out of `plane`");
                    break;
                }
    }
}

/// Conditions for a contact law between a wire and an obstacle.
void check_fit(const BeamInput& b, const ObstacleInput& o, Findings& findings)
{
    const SurfaceInput& s = o.surface;
    const std::string surface = "/bodies/" + o.name + "/surface";
    double narrowest = 0, bend = 0; // 0: not known from the scene alone
    if (s.generate == "tube") {
        narrowest = s.radius;
        for (const CentrelinePiece& p : s.centreline.pieces)
            if (p.radius > 0) bend = bend > 0 ? std::min(bend, p.radius) : p.radius;
    }
    if (s.generate == "vessel") bend = s.arch_radius;
    for (std::size_t i = 0; i < b.segments.size(); ++i) {
        const BeamSegment& seg = b.segments[i];
        const std::string here = fmt::format("/bodies/{}/segments/{}", b.name, i);
        const double thickest = std::max(seg.radius, seg.end_radius);
        if (narrowest > 0 && thickest >= narrowest)
            findings.add({here + "/radius", surface + "/radius"}, fmt::format("{}", thickest),
                         fmt::format("< {} [m], the radius of \"{}\"", narrowest, o.name));
        if (bend > 0 && seg.element > bend)
            findings.add(
                {here + "/element", surface}, fmt::format("{}", seg.element),
                fmt::format("<= {} [m]: a longer element does not follow the bends of \"{}\"", bend,
                            o.name));
    }
}

/// Two beams of a pair that come out of one introducer slide in each other.
void check_nesting(const BeamInput& a, const BeamInput& b, const Scene& scene,
                   const std::string& pair, Findings& findings)
{
    const std::string one = "/bodies/" + a.name, other = "/bodies/" + b.name;
    for (const BeamInput* w : {&a, &b})
        if (w->hold.given)
            findings.add({"/bodies/" + w->name + "/hold", pair},
                         "a tip that is held, of instruments in one another",
                         "no \"hold\": what nested instruments share along their length has no "
                         "held tip yet");
    if (a.segments.empty() || b.segments.empty()) return; // an issue of its own
    if (!fits_in(a, b) && !fits_in(b, a)) {
        // Of the two, the one with a bore is meant to be outside.
        const auto bore = [](const BeamInput& w) {
            double least = std::numeric_limits<double>::infinity();
            for (const BeamSegment& s : w.segments)
                least = std::min(least, s.inner_radius);
            return least;
        };
        const BeamInput& outer = bore(a) > bore(b) ? a : b;
        const BeamInput& inner = bore(a) > bore(b) ? b : a;
        double widest = 0;
        for (const BeamSegment& s : inner.segments)
            widest = std::max({widest, s.radius, s.end_radius});
        findings.add({pair, one + "/segments", other + "/segments"},
                     fmt::format("\"{}\" of radius {} in the bore of \"{}\", radius {}", inner.name,
                                 widest, outer.name, bore(outer)),
                     "an instrument that fits in the other: radius <= inner_radius [m]");
    }
    for (const BeamInput* w : {&a, &b}) {
        const std::string place = "/bodies/" + w->name;
        if (w->plane)
            findings.add({place + "/plane", pair}, "a plane",
                         "nothing: instruments in one another move in space");
        if (w->introducer.fade > 0)
            findings.add({place + "/introducer/fade", pair}, fmt::format("{}", w->introducer.fade),
                         "0: instruments in one another leave a rigid end");
        for (const BeamSegment& s : w->segments)
            if (s.EI[0] == 0) {
                findings.add({place + "/segments", pair}, "a cable",
                             "EI > 0: instruments in one another bend");
                break;
            }
    }
}

/// Of a contact law between a body and itself.
void check_self(const Scene& scene, const ContactLaw& law, const std::string& place,
                const std::string& pair, Findings& findings)
{
    if (body_named(scene.rods, law.between[0])) return;
    const SolidInput* solid = body_named(scene.solids, law.between[0]);
    const std::string with = pair + ", a body and itself";
    if (!solid || !is_hyperelastic(*solid))
        findings.add({place}, with,
                     "two bodies, a rod and itself, or a hyperelastic solid and itself");
    else if (law.discretisation == "nodal")
        findings.add({place}, with + ", \"discretisation\": \"nodal\"", "\"mortar\"");
    else if (law.sliding == "small")
        findings.add({place}, with + ", \"sliding\": \"small\"", "\"finite\"");
}

/// Of a contact law whose obstacle is springs.
void check_foundation(const Scene& scene, const ContactLaw& law, std::size_t i, Findings& findings)
{
    if (!(law.foundation > 0)) return;
    const std::string place = fmt::format("/contact/{}/foundation", i);
    const std::string found = fmt::format("{} N/m^2", law.foundation);
    const auto& [a, b] = law.between;
    if (!(body_named(scene.beams, a) && body_named(scene.obstacles, b)) &&
        !(body_named(scene.beams, b) && body_named(scene.obstacles, a)))
        findings.add({place}, found, "nothing here: springs lie below obstacles that beams touch");
    else if (scene.time.kind == "dynamic")
        findings.add({place, "/time/kind"}, found + ", dynamic",
                     "\"quasi_static\": springs have no inertia");
    else if (scene.haptic.given)
        findings.add({place, "/haptic"}, found + ", in the hand", "rigid obstacles");
    else if (std::any_of(scene.contact.begin(), scene.contact.end(), [&](const ContactLaw& other) {
                 return body_named(scene.beams, other.between[0]) &&
                        body_named(scene.beams, other.between[1]);
             }))
        findings.add({place}, found + ", and instruments in one another",
                     "one beam: instruments in one another need rigid obstacles");
}

void check_pairs(const Scene& scene, Findings& findings)
{
    std::set<std::set<std::string>> seen;
    const bool rods = instruments_are_rods(scene);
    for (std::size_t i = 0; i < scene.contact.size(); ++i) {
        const ContactLaw& law = scene.contact[i];
        const std::string place = fmt::format("/contact/{}/between", i);
        const auto& [a, b] = law.between;
        check_foundation(scene, law, i, findings);
        bool known = true;
        for (std::size_t k = 0; k < 2; ++k) {
            const std::string& name = law.between[k];
            if (name == "*" && (scene.beams.empty() || rods)) {
                if (!law.surfaces[k].empty())
                    findings.add({fmt::format("/contact/{}/surfaces/{}", i, k)},
                                 quoted_text(law.surfaces[k]), "\"\" where the body is \"*\"");
                known = false; // stands for many pairs: checked when they are made
                continue;
            }
            if (std::find(scene.order.begin(), scene.order.end(), name) != scene.order.end())
                continue;
            const std::string near = nearest_name(name, scene.order);
            std::string names;
            for (const std::string& n : scene.order)
                names += (names.empty() ? "one of " : ", ") + quoted_text(n);
            if (names.empty()) names = "a body of the scene, which has none";
            findings.add({fmt::format("{}/{}", place, k)}, quoted_text(name),
                         near.empty() ? names : quoted_text(near) + " (nearest name)");
            known = false;
        }
        if (!known) continue;
        const std::string pair = fmt::format("[{}, {}]", quoted_text(a), quoted_text(b));
        const bool obstacles = body_named(scene.obstacles, a) && body_named(scene.obstacles, b);
        const bool beams = body_named(scene.beams, a) && body_named(scene.beams, b);
        if (obstacles)
            findings.add({place}, pair + ", two obstacles", "at least one body that moves");
        else if (!seen.insert({a, b}).second)
            findings.add({place}, pair + " again", "each pair once");
        if (a == b && !obstacles && !beams) check_self(scene, law, place, pair, findings);
        const std::string& beam = body_named(scene.beams, a) ? a : b;
        const BeamInput* wire = body_named(scene.beams, beam);
        const ObstacleInput* wall = body_named(scene.obstacles, beam == a ? b : a);
        if (wire && wall) check_fit(*wire, *wall, findings);
        if (beams && a != b && !rods &&
            share_introducer(*body_named(scene.beams, a), *body_named(scene.beams, b)))
            check_nesting(*body_named(scene.beams, a), *body_named(scene.beams, b), scene, place,
                          findings);
    }
}

} // namespace

bool fits_in(const BeamInput& inner, const BeamInput& outer)
{
    double widest = 0, narrowest = std::numeric_limits<double>::infinity();
    for (const BeamSegment& s : inner.segments)
        widest = std::max({widest, s.radius, s.end_radius});
    for (const BeamSegment& s : outer.segments)
        narrowest = std::min(narrowest, s.inner_radius);
    return widest <= narrowest;
}

void check_consistency(const Scene& scene, std::vector<Issue>& issues)
{
    Findings findings(scene.file, issues);
    for (const ObstacleInput& o : scene.obstacles)
        check_obstacle(o, findings);
    for (const BeamInput& b : scene.beams)
        check_beam(b, scene, findings);
    if (scene.beams.empty() && scene.solids.empty() && scene.rigids.empty() && scene.rods.empty())
        findings.add({"/bodies"}, "no body that moves",
                     "at least one of kind \"beam\", \"rod\", \"solid\" or \"rigid\"");
    check_bodies(scene, findings);
    if (instruments_are_rods(scene))
        check_instrument_rods(scene, findings);
    else
        check_vessels(scene, findings);
    check_rods(scene, findings);
    check_pairs(scene, findings);
    check_haptic(scene, findings);
    if (scene.time.smallest_step > scene.time.step)
        findings.add({"/time/smallest_step", "/time/step"},
                     fmt::format("{}", scene.time.smallest_step),
                     fmt::format("<= {} [s], the longest step", scene.time.step));
    if (scene.time.step > 0 && scene.time.end / scene.time.step > kMostSteps)
        findings.add({"/time/step", "/time/end"},
                     fmt::format("{:.3g} steps", scene.time.end / scene.time.step),
                     fmt::format("<= {:.3g} steps", kMostSteps));
    if (scene.time.balance != "mean" && (scene.beams.empty() || scene.time.kind == "dynamic"))
        findings.add({"/time/balance", "/time/kind"}, quoted_text(scene.time.balance),
                     scene.beams.empty() ? "\"mean\": the scene has no wire"
                                         : "\"mean\", or \"kind\": \"quasi_static\"");
    if (scene.time.damping > 0 && scene.time.kind != "dynamic")
        findings.add({"/time/damping", "/time/kind"}, fmt::format("{}", scene.time.damping),
                     "0, or \"kind\": \"dynamic\"");
    const std::string& linear = scene.solver.linear;
    if (linear != "auto" && linear != "direct" && (!scene.beams.empty() || scene.solids.empty()))
        findings.add({"/solver/linear"}, quoted_text(linear),
                     std::string("\"auto\" or \"direct\": ") +
                         (scene.beams.empty()
                              ? "the scene has no solid whose system could be iterated on"
                              : "beams, and a vessel's wall beside them, have factors only"));
}

} // namespace amontons
