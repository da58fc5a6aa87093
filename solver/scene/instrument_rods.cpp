#include "solver/scene/instrument_rods.hpp"

#include "solver/scene/rod_fields.hpp"
#include "solver/scene/segment_consistency.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <fmt/format.h>
#include <limits>

namespace amontons {
namespace {

struct Line {
    Vec3 from, to;
};

double distance(const Vec3& x, const Line& line)
{
    const Vec3 along = line.to - line.from;
    const double t = std::clamp((x - line.from).dot(along) / along.squaredNorm(), 0.0, 1.0);
    return (line.from + t * along - x).norm();
}

/// Least distance of two straight lines [m]: at an end of one, or between their insides.
double distance(const Line& a, const Line& b)
{
    const double at_ends =
        std::min({distance(a.from, b), distance(a.to, b), distance(b.from, a), distance(b.to, a)});
    const Vec3 u = a.to - a.from, v = b.to - b.from, w = b.from - a.from, n = u.cross(v);
    const double n2 = n.squaredNorm();
    if (!(n2 > kInputRoundOff * u.squaredNorm() * v.squaredNorm())) return at_ends; // parallel
    const double s = w.cross(v).dot(n) / n2, t = w.cross(u).dot(n) / n2;
    const bool inside = s > 0 && s < 1 && t > 0 && t < 1;
    return inside ? std::min(at_ends, std::abs(w.dot(n)) / std::sqrt(n2)) : at_ends;
}

/// Where a beam lies before it comes out.
Line sheath_of(const BeamInput& b)
{
    const IntroducerInput& in = b.introducer;
    const double length = in.length > 0 ? in.length : length_of(b.segments);
    return {in.at - length * in.direction.normalized(), in.at};
}

double widest(const std::vector<BeamSegment>& segments)
{
    double radius = 0;
    for (const BeamSegment& s : segments)
        radius = std::max({radius, s.radius, s.end_radius});
    return radius;
}

double narrowest_bore(const std::vector<BeamSegment>& segments)
{
    double radius = std::numeric_limits<double>::infinity();
    for (const BeamSegment& s : segments)
        radius = std::min(radius, s.inner_radius);
    return radius;
}

RodInput rod_of(const BeamInput& b)
{
    RodInput rod;
    rod.name = b.name;
    rod.instrument = true;
    rod.segments = b.segments;
    const IntroducerInput& in = b.introducer;
    const Vec3 along = in.direction.normalized();
    const double out = b.insertion.empty() ? 0 : b.insertion.front()[1]; // when the run begins
    rod.shape.points.resize(2);
    rod.shape.points[0].at = in.at - (length_of(b.segments) - out) * along;
    rod.shape.points[1].at = in.at + out * along;
    rod.shape.normal = introducer_normal(in, b.plane);
    rod.shape.stress_free = false;
    rod.plane = b.plane;
    rod.fed = b.insertion;
    if (rod.fed.empty()) rod.fed = {{0, 0}};
    RodHold& base = rod.hold.emplace_back();
    base.set = "start";
    base.turns = "held";
    base.axis = along;
    base.angle = b.twist;
    if (b.hold.given) {
        RodHold& tip = rod.hold.emplace_back();
        tip.set = "end";
        // A tip is held along all three; of a rod's hold those without a curve are free.
        const CurvePoints stays{{0, 0}};
        tip.x = b.hold.x.empty() ? stays : b.hold.x;
        tip.y = b.hold.y.empty() ? stays : b.hold.y;
        tip.z = b.hold.z.empty() ? stays : b.hold.z;
        tip.turns = b.hold.turns;
    }
    rod.contact_spacing = b.contact_spacing;
    if (rod.contact_spacing == 0) {
        rod.contact_spacing = length_of(b.segments);
        for (const BeamSegment& s : b.segments)
            rod.contact_spacing = std::min(rod.contact_spacing, 0.5 * s.element);
    }
    return rod;
}

} // namespace

bool share_introducer(const BeamInput& a, const BeamInput& b)
{
    const IntroducerInput &p = a.introducer, &q = b.introducer;
    const double scale = p.at.norm() + length_of(a.segments);
    return (p.at - q.at).norm() <= kInputRoundOff * scale &&
           (p.direction.normalized() - q.direction.normalized()).norm() <= kInputRoundOff &&
           p.centreline.file == q.centreline.file && p.centreline.along == q.centreline.along &&
           p.branch == q.branch && p.end == q.end;
}

namespace {

/// Of two instruments that come out of one introducer and touch each other.
void check_bore(const Scene& scene, const BeamInput& a, const BeamInput& b, const std::string& why,
                Findings& findings)
{
    if (!share_introducer(a, b)) return;
    const auto names = [](const ContactLaw& law, const std::string& one, const std::string& two) {
        return (law.between[0] == one || law.between[0] == "*") &&
               (law.between[1] == two || law.between[1] == "*");
    };
    const auto law = std::ranges::find_if(scene.contact, [&](const ContactLaw& l) {
        return names(l, a.name, b.name) || names(l, b.name, a.name);
    });
    if (law == scene.contact.end()) return;
    const std::string pair = fmt::format("/contact/{}/between", law - scene.contact.begin());
    const double a_in_b = narrowest_bore(b.segments) - widest(a.segments),
                 b_in_a = narrowest_bore(a.segments) - widest(b.segments);
    const BeamInput &inner = a_in_b > b_in_a ? a : b, &outer = a_in_b > b_in_a ? b : a;
    if (!(std::max(a_in_b, b_in_a) > 1e-9 * narrowest_bore(outer.segments)))
        findings.add(
            {pair, "/bodies/" + inner.name + "/segments", "/bodies/" + outer.name + "/segments"},
            fmt::format("\"{}\" of radius {} in the bore of \"{}\", radius {}", inner.name,
                        widest(inner.segments), outer.name, narrowest_bore(outer.segments)),
            "an instrument with clearance in the other: radius < inner_radius [m]" + why);
    for (const BeamInput* w : {&a, &b}) {
        if (w->plane)
            findings.add({"/bodies/" + w->name + "/plane", pair}, "a plane",
                         "nothing: instruments in one another move in space");
        if (w->hold.given)
            findings.add({"/bodies/" + w->name + "/hold", pair},
                         "a tip that is held, of instruments in one another", "no \"hold\"");
    }
}

bool has_weight(const Scene& scene)
{
    return !scene.gravity.isZero() && std::ranges::any_of(scene.beams, [](const BeamInput& b) {
        return std::ranges::any_of(b.segments, [](const BeamSegment& s) { return s.density > 0; });
    });
}

/// Where an instrument lies when the run begins.
Line first_line(const RodInput& rod)
{
    return {rod.shape.points[0].at, rod.shape.points[1].at};
}

} // namespace

bool slide_in_one_another(const RodInput& a, const RodInput& b)
{
    if (!a.instrument || !b.instrument || a.name == b.name) return false;
    const Line one = first_line(a), other = first_line(b);
    const double scale = one.to.norm() + other.to.norm() + length_of(a.segments);
    const auto end = [](const RodInput& rod, const Line& line) -> Vec3 { // of its sheath
        return line.to - rod.fed.front()[1] * (line.to - line.from).normalized();
    };
    return (end(a, one) - end(b, other)).norm() <= kInputRoundOff * scale &&
           ((one.to - one.from).normalized() - (other.to - other.from).normalized()).norm() <=
               kInputRoundOff;
}

bool fits_in(const RodInput& inner, const RodInput& outer)
{
    return widest(inner.segments) < narrowest_bore(outer.segments);
}

bool instruments_are_rods(const Scene& scene)
{
    if (scene.beams.empty()) return false;
    if (!scene.rigids.empty() || !scene.rods.empty() || !scene.couplings.empty()) return true;
    const auto is_tube = [](const SolidInput& b) { return b.mesh.generate == "tube"; };
    if (!std::ranges::all_of(scene.solids, is_tube)) return true;
    const bool touching = std::ranges::any_of(scene.contact, [&](const ContactLaw& law) {
        const BeamInput* const a = body_named(scene.beams, law.between[0]);
        const BeamInput* const b = body_named(scene.beams, law.between[1]);
        return a && b && (a == b || !share_introducer(*a, *b));
    });
    return touching || has_weight(scene);
}

void check_instrument_rods(const Scene& scene, Findings& findings)
{
    const std::string why = ": instruments with weight, beside other bodies, themselves or one "
                            "another are rods fed from a sheath";
    if (scene.time.path > 0)
        findings.add({"/time/path", "/bodies"}, fmt::format("{}", scene.time.path),
                     "0" + why + ", which steps in time");
    if (scene.time.balance != "mean")
        findings.add({"/time/balance", "/bodies"}, "\"" + scene.time.balance + "\"",
                     "\"mean\"" + why + ", whose steps close their energy");
    const Scene as_rods = with_instruments_as_rods(scene);
    for (const RodInput& rod : as_rods.rods)
        if (rod.instrument) check_rod_contacts(rod, as_rods, findings);
    if (scene.haptic.given && body_named(scene.beams, scene.haptic.handle))
        findings.add({"/haptic/handle"}, "\"" + scene.haptic.handle + "\", an instrument",
                     "a rigid body or a solid, or instruments and obstacles alone" + why +
                         ", whose base no hand holds yet");
    for (const BeamInput& b : scene.beams) {
        const std::string place = "/bodies/" + b.name;
        if (b.introducer.fade > 0)
            findings.add({place + "/introducer/fade"}, fmt::format("{}", b.introducer.fade),
                         "0" + why + " with a rigid end");
        for (const BeamSegment& s : b.segments)
            if (s.EI[0] == 0) {
                findings.add({place + "/segments"}, "a cable", "EI > 0" + why);
                break;
            }
        for (std::size_t k = 0; k < b.insertion.size(); ++k)
            if (!(b.insertion[k][1] >= 0))
                findings.add({fmt::format("{}/drive/insertion/{}/1", place, k)},
                             fmt::format("{}", b.insertion[k][1]), ">= 0 [m]" + why);
    }
    for (std::size_t i = 0; i < scene.contact.size(); ++i) {
        const ContactLaw& law = scene.contact[i];
        const BeamInput* const a = body_named(scene.beams, law.between[0]);
        const BeamInput* const b = body_named(scene.beams, law.between[1]);
        if (law.foundation > 0 && (a || b))
            findings.add({fmt::format("/contact/{}/foundation", i)},
                         fmt::format("{}", law.foundation), "0" + why + ", whose walls are rigid");
        if (!a || !b || a == b) continue;
        const double apart = distance(sheath_of(*a), sheath_of(*b));
        if (!share_introducer(*a, *b) && !a->introducer.placed() && !b->introducer.placed() &&
            apart < widest(a->segments) + widest(b->segments))
            findings.add(
                {"/bodies/" + b->name + "/introducer", "/bodies/" + a->name + "/introducer"},
                fmt::format("introducers {:.3g} m apart", apart),
                fmt::format("at least {:.3g} m apart, the radii of the two, or one place: "
                            "instruments in one another come out of one",
                            widest(a->segments) + widest(b->segments)));
    }
    for (std::size_t k = 0; k < scene.beams.size(); ++k)
        for (std::size_t l = k + 1; l < scene.beams.size(); ++l)
            check_bore(scene, scene.beams[k], scene.beams[l], why, findings);
}

Vec3 introducer_normal(const IntroducerInput& introducer, const std::optional<Vec3>& plane)
{
    const Vec3 d = introducer.direction.normalized();
    Vec3 normal;
    if (introducer.normal) {
        normal = *introducer.normal;
    } else if (plane) {
        normal = plane->cross(d);
    } else {
        // Any, but always the same: the axis of space that is least along the wire.
        int axis = 0;
        d.cwiseAbs().minCoeff(&axis);
        normal = Vec3::Unit(axis);
    }
    return (normal - d * d.dot(normal)).normalized();
}

Scene with_instruments_as_rods(Scene scene)
{
    std::vector<RodInput> rods; // in the scene's order, as all its lists
    for (const std::string& name : scene.order)
        if (const BeamInput* beam = body_named(scene.beams, name))
            rods.push_back(rod_of(*beam));
        else if (const RodInput* rod = body_named(scene.rods, name))
            rods.push_back(*rod);
    scene.rods = std::move(rods);
    scene.beams.clear();
    return scene;
}

} // namespace amontons
