#include "solver/scene/rod_fields.hpp"

#include "solver/scene/declare.hpp"
#include "solver/scene/segment_consistency.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace amontons {
namespace {

using namespace declare;

ObjectDeclaration declare_point()
{
    using P = RodPoint;
    return {"Point of a polyline",
            {required(field<&P::at>("at", "m", kAny, "Where."))},
            "",
            {},
            defaults_of<P>()};
}

ObjectDeclaration declare_rod_shape(const ObjectDeclaration& point,
                                    const ObjectDeclaration& centreline)
{
    using S = RodShape;
    ObjectDeclaration d{
        "Where a rod begins: along a curve, a polyline, or from a start on in its natural shape",
        {field<&S::start>("start", "m", kAny, "First cross-section, without curve and points."),
         field<&S::direction>("direction", "", direction(), "Tangent there."),
         fallback("chosen", field<&S::normal>("normal", "", direction(),
                                              "Section axis 2 at the start; curvature of angle 0 "
                                              "bends this way.")),
         no_fewer(2, list<&S::points>("points", point, "A polyline; its corners are rigid.")),
         object<&S::curve>("curve", centreline, "A smooth curve, instead of points."),
         field<&S::closed>(
             "closed", "", {},
             "The end is joined to the start; points need not come back to the first."),
         field<&S::stress_free>("stress_free", "", {},
                                "Free of stress in the shape that curve or points give; false: "
                                "bent into it from what its segments specify.")},
        "",
        {},
        defaults_of<S>()};
    d.complete = [](void* object, const std::function<bool(const char*)>&) {
        S& shape = *static_cast<S*>(object);
        if (!shape.closed || shape.points.size() < 3) return;
        double along = 0;
        for (std::size_t i = 1; i < shape.points.size(); ++i)
            along += (shape.points[i].at - shape.points[i - 1].at).norm();
        const RodPoint first = shape.points.front();
        if (!((shape.points.back().at - first.at).norm() <= 1e-6 * along))
            shape.points.push_back(first);
    };
    return d;
}

ObjectDeclaration declare_rod_hold()
{
    using H = RodHold;
    return {
        "Prescribed place and turn of a cross-section",
        {fallback("the place \"at\"", choice({"start", "end", "all"},
                                             text<&H::set>("set", "Which; \"all\": every node."))),
         fallback("none", field<&H::at>("at", "m", at_least(0), "Its arc length, without a set.")),
         choice({"held", "free"}, text<&H::places>("places", "Whether places are held at all.")),
         field<&H::x>("x", "m", kAny,
                      "Displacement over time; without x, y and z all three are held at 0, "
                      "without this one alone it is free."),
         field<&H::y>("y", "m", kAny, "As x."), field<&H::z>("z", "m", kAny, "As x."),
         choice({"held", "free", "about"},
                text<&H::turns>("turns", "\"about\": free about the axis, else held.")),
         field<&H::axis>("axis", "", direction(), "Of the turn, fixed in space."),
         field<&H::angle>("angle", "rad", kAny, "Turn about the axis over time.")},
        "",
        {},
        defaults_of<H>()};
}

ObjectDeclaration declare_rod_load()
{
    using L = RodLoad;
    return {
        "Load on a rod",
        {fallback("the place \"at\"", choice({"start", "end", "all"},
                                             text<&L::set>("set", "Where; \"all\": for `line`."))),
         fallback("none", field<&L::at>("at", "m", at_least(0), "Arc length, without a set.")),
         fallback("none", field<&L::force>("force", "N", kAny, "On the cross-section's middle.")),
         fallback("none", field<&L::moment>("moment", "N m", kAny, "On the cross-section.")),
         fallback("none", field<&L::line>("line", "N/m", kAny, "Force per length, of \"all\".")),
         field<&L::follows>("follows", "", {},
                            "Force and moment are in the section's axes (tangent first) and turn "
                            "with it; else in space."),
         fallback("1", field<&L::over>("over", "", kAny, "Factor over time."))},
        "",
        {},
        defaults_of<L>()};
}

/// Weight and loads, without what turns them down over time [N].
double load_of(const RodInput& b, const Scene& scene)
{
    constexpr double kPi = 3.14159265358979323846;
    double sum = 0, length = 0;
    for (const BeamSegment& g : b.segments) {
        sum += g.density * kPi * g.radius * g.radius * g.length * scene.gravity.norm();
        length += g.length;
    }
    for (const RodLoad& l : b.loads) {
        double factor = l.over.empty() ? 1 : 0;
        for (const auto& point : l.over)
            factor = std::max(factor, std::abs(point[1]));
        if (l.force) sum += factor * l.force->norm();
        if (l.line) sum += factor * l.line->norm() * length;
    }
    return sum;
}

void check_rod(const RodInput& b, const Scene& scene, Findings& findings)
{
    constexpr double kLengths = 1e-3;
    const std::string place = "/bodies/" + b.name, segments = place + "/segments";
    const RodShape& shape = b.shape;
    check_segments(b.segments, place, false, scene, findings, load_of(b, scene));
    for (std::size_t i = 0; i < b.segments.size() && b.elements == "corotational"; ++i)
        if (!b.segments[i].bending.empty() || !b.segments[i].stretching.empty())
            findings.add({fmt::format("{}/segments/{}", place, i), place + "/elements"}, "a table",
                         "\"exact\" elements: the others are linear");
    // Free of stress in a given shape: what the segments specify of another one would not count.
    for (std::size_t i = 0;
         i < b.segments.size() && shape.stress_free && (shape.has_curve() || !shape.points.empty());
         ++i) {
        const std::string here = fmt::format("{}/segments/{}/", place, i);
        const char* of = shape.has_curve() ? "curve" : "points";
        const auto refuse = [&](const char* field, double value) {
            if (value != 0)
                findings.add(
                    {here + field, place + "/shape/" + of},
                    fmt::format("{} beside a shape by \"{}\"", value, of),
                    "0: the rod is free of stress in that shape; or \"stress_free\": false: "
                    "it is bent into it");
        };
        refuse("curvature", b.segments[i].curvature);
        refuse("twist", b.segments[i].twist);
    }

    // ---- Shape
    if (shape.has_curve() && !shape.points.empty())
        findings.add({place + "/shape/points", place + "/shape/curve"}, "points and a curve",
                     "either \"points\" or \"curve\"");
    if (shape.closed && !shape.has_curve() && shape.points.empty())
        findings.add({place + "/shape/closed"}, "closed without a curve or points",
                     "\"curve\" or \"points\" that lead back to the start");
    double along = 0;
    for (std::size_t i = 0; i + 1 < shape.points.size(); ++i)
        along += (shape.points[i + 1].at - shape.points[i].at).norm();
    for (std::size_t i = 0; i + 1 < shape.points.size(); ++i) {
        // Nearer than round-off of the places can determine a direction, they are one.
        if (!((shape.points[i + 1].at - shape.points[i].at).norm() > 1e-9 * along))
            findings.add({fmt::format("{}/shape/points/{}", place, i + 1)},
                         "the point before it again", "another place than the point before it");
    }
    if (shape.closed && !shape.points.empty() && shape.points.size() < 4)
        findings.add({place + "/shape/points"},
                     fmt::format("{} points of a closed rod", shape.points.size() - 1),
                     "at least three");
    const double length = length_of(b.segments);
    if (!shape.points.empty() && length > 0 && std::abs(along - length) > kLengths * along)
        findings.add({segments, place + "/shape/points"}, fmt::format("{} m in all", length),
                     fmt::format("{:.9g} [m], the length of the polyline, within 0.1 %", along));
    if (shape.normal && !shape.has_curve() && shape.points.empty() &&
        !(shape.direction.normalized().cross(shape.normal->normalized()).norm() > kInputRoundOff))
        findings.add({place + "/shape/normal", place + "/shape/direction"}, "parallel to direction",
                     "another direction than the start's");
    if (!shape.curve.file.empty() && !shape.curve.pieces.empty())
        findings.add({place + "/shape/curve"}, "a file and pieces",
                     "either \"file\" or \"pieces\"");
    double begin = 0;
    for (std::size_t i = 0; i < shape.curve.pieces.size(); ++i) {
        const CentrelinePiece& p = shape.curve.pieces[i];
        const double end = begin + p.length + p.radius * p.angle;
        double thickest = 0, start = 0; // of the segments along it
        for (const BeamSegment& g : b.segments) {
            if (start < end && start + g.length > begin)
                thickest = std::max({thickest, g.radius, g.end_radius});
            start += g.length;
        }
        if (p.angle > 0 && p.radius > 0 && p.radius <= thickest)
            findings.add({fmt::format("{}/shape/curve/pieces/{}/radius", place, i), segments},
                         fmt::format("{}", p.radius),
                         fmt::format("> {} [m], the rod's own radius", thickest));
        begin = end;
    }

    // ---- Holds and loads
    const auto where = [&](const std::string& here, const std::string& set,
                           const std::optional<double>& at) {
        if (set.empty() == !at.has_value())
            findings.add({here}, at ? "a set and a place" : "neither \"set\" nor \"at\"",
                         "either \"set\" or \"at\"");
        if (at && length > 0 && *at > length * (1 + kInputRoundOff))
            findings.add({here + "/at", segments}, fmt::format("{}", *at),
                         fmt::format("<= {:.9g} [m], the rod's length", length));
    };
    for (std::size_t i = 0; i < b.hold.size(); ++i) {
        const RodHold& h = b.hold[i];
        const std::string here = fmt::format("{}/hold/{}", place, i);
        where(here, h.set, h.at);
        if (h.places == "free" && h.turns == "free")
            findings.add({here}, "a hold of nothing", "places or turns that are held");
        if (h.places == "free" && !(h.x.empty() && h.y.empty() && h.z.empty()))
            findings.add({here + "/places"}, "\"free\" with x, y or z", "\"held\"");
        if (h.turns != "held" && !h.angle.empty())
            findings.add({here + "/angle", here + "/turns"}, "an angle of turns that are not held",
                         "\"turns\": \"held\"");
    }
    check_contact_spacing(b.contact_spacing, b.segments, place, findings);
    for (std::size_t i = 0; i < b.loads.size(); ++i) {
        const RodLoad& l = b.loads[i];
        const std::string here = fmt::format("{}/loads/{}", place, i);
        where(here, l.set, l.at);
        if (!l.force && !l.moment && !l.line)
            findings.add({here}, "a load of nothing", "\"force\", \"moment\" or \"line\"");
        if (l.line && l.set != "all")
            findings.add({here + "/line"}, "a line load on a place", "\"set\": \"all\"");
        if ((l.force || l.moment) && l.set == "all")
            findings.add({here + "/set"}, "\"all\" for a force or a moment",
                         "\"start\", \"end\" or \"at\"; \"line\" for a load along the rod");
        if (l.line && l.follows)
            findings.add({here + "/follows"}, "a line load that follows", "false");
    }
}

/// A sheath, and a medium.
void check_feed(const RodInput& b, const Scene& scene, Findings& findings)
{
    const std::string place = "/bodies/" + b.name;
    const bool dynamic = scene.time.kind == "dynamic";
    if (b.drag > 0 && dynamic)
        findings.add({place + "/drag", "/time/kind"}, fmt::format("{}", b.drag),
                     "0, or \"kind\": \"quasi_static\"; \"time.damping\" of motion");
    if (b.fed.empty()) return;
    const bool natural = std::any_of(b.segments.begin(), b.segments.end(),
                                     [](const BeamSegment& s) { return s.curvature != 0; });
    const bool straight = !b.shape.closed && !b.shape.has_curve() &&
                          (b.shape.points.empty() ? !natural : b.shape.points.size() == 2);
    if (!straight)
        return findings.add({place + "/fed", place + "/shape"},
                            "a sheath around a rod that is not straight",
                            "a shape of two \"points\", or of none without curvature");
    if (scene.time.path > 0)
        findings.add({place + "/fed", "/time/path"}, "a sheath on a path of balances",
                     "\"path\": 0: steps in time");
    if (b.elements == "corotational")
        findings.add({place + "/elements", place + "/fed"}, "\"corotational\"",
                     "\"exact\": the element at a sheath's end grows");
    for (std::size_t i = 0; i < b.segments.size(); ++i)
        if (b.segments[i].twist != 0)
            findings.add({fmt::format("{}/segments/{}/twist", place, i), place + "/fed"},
                         fmt::format("{}", b.segments[i].twist),
                         "0: what is in a sheath has no twist of its own");
    constexpr double kAlong = 1e-6; // of a unit: directions that are one
    const double length = length_of(b.segments);
    double least = length; // out of the sheath
    for (const auto& point : b.fed)
        least = std::min(least, point[1]);
    for (std::size_t i = 0; i < b.hold.size(); ++i) {
        // What the sheath holds it moves along itself, and does not turn.
        const RodHold& h = b.hold[i];
        const double at = h.at ? *h.at : h.set == "end" ? length : 0;
        if (!(at < length - least)) continue;
        const auto moves = [](const CurvePoints& c) {
            return std::any_of(c.begin(), c.end(), [](const auto& p) { return p[1] != 0; });
        };
        const std::string here = fmt::format("{}/hold/{}", place, i);
        if (h.at && *h.at > 0)
            findings.add({here + "/at", place + "/fed"},
                         fmt::format("a hold at {:.4g} m, which is in the sheath when {:.4g} m are "
                                     "out of it",
                                     *h.at, least),
                         fmt::format("more than {:.4g} [m], or the \"start\": the sheath holds "
                                     "what is in it",
                                     length - least));
        const Vec3 out = !b.shape.points.empty() ? b.shape.points[1].at - b.shape.points[0].at
                                                 : b.shape.direction;
        const bool about = h.axis.cross(out).norm() <= kAlong * h.axis.norm() * out.norm();
        if (moves(h.angle) && !(h.set == "start" && about && !b.plane))
            findings.add({here + "/angle", place + "/fed"},
                         "a turn of what is in the sheath but that of its start about the sheath",
                         "a hold at the \"start\", whose \"axis\" is along the sheath, of a rod "
                         "without \"plane\"");
        const CurvePoints* const along[3] = {&h.x, &h.y, &h.z};
        for (std::size_t k = 0; k < 3; ++k)
            if (moves(*along[k]))
                findings.add({fmt::format("{}/{}", here, "xyz"[k]), place + "/fed"},
                             "a motion of a place in the sheath",
                             "none beside \"fed\", which moves it along the sheath");
    }
    for (std::size_t i = 0; i < b.fed.size(); ++i)
        if (!(b.fed[i][1] >= 0 && b.fed[i][1] <= length))
            findings.add({fmt::format("{}/fed/{}/1", place, i)}, fmt::format("{}", b.fed[i][1]),
                         fmt::format("0 to {:.9g} [m], the rod's length", length));
}

} // namespace

VariantDeclaration rod_variant(const ObjectDeclaration& segment,
                               const ObjectDeclaration& centreline)
{
    using R = RodInput;
    static const ObjectDeclaration point = declare_point();
    static const ObjectDeclaration shape = declare_rod_shape(point, centreline);
    static const ObjectDeclaration hold = declare_rod_hold();
    static const ObjectDeclaration load = declare_rod_load();
    return {
        "rod",
        "A beam that no introducer feeds: held and loaded anywhere.",
        {required(list<&R::segments>("segments", segment, "From its start to its end.")),
         object<&R::shape>("shape", shape, "Where it begins."),
         choice({"exact", "corotational"},
                text<&R::elements>("elements",
                                   "\"exact\": geometrically exact; \"corotational\": linear "
                                   "in a frame that turns with each element.")),
         fallback("none", field<&R::plane>("plane", "", direction(),
                                           "Normal of a plane that the rod is kept in.")),
         list<&R::hold>("hold", hold, "Prescribed places and turns."),
         list<&R::loads>("loads", load, "Loads."),
         fallback("no sheath",
                  field<&R::fed>("fed", "m", kAny,
                                 "How far the rod's end is out of a straight sheath, over "
                                 "time: what has not come out is held and moves along it.")),
         field<&R::drag>("drag", "N s/m^2", at_least(0),
                         "Of a medium that the rod moves through, force per length and "
                         "velocity: quasi-static steps then follow snaps in time."),
         fallback("one at each node, two on elements that hang slack",
                  field<&R::contact_spacing>("contact_spacing", "m", at_least(0),
                                             "Largest distance of two contact places where a body "
                                             "runs along the rod; 0: the nodes, the middle "
                                             "of elements longer than (EI / weight)^(1/3), and "
                                             "on solids as many as there are faces. Crossings and "
                                             "edges are found wherever they are.")),
         field<&R::velocity>("velocity", "m/s", kAny, "When it begins; dynamic only."),
         field<&R::spin>("spin", "rad/s", kAny,
                         "Angular velocity about the centre of mass, when it begins; dynamic "
                         "only.")},
        &append_body<&Scene::rods>,
        &find_body<&Scene::rods>};
}

void check_rod_contacts(const RodInput& b, const Scene& scene, Findings& findings)
{
    for (std::size_t i = 0; i < scene.contact.size(); ++i) {
        const ContactLaw& law = scene.contact[i];
        for (std::size_t k = 0; k < 2; ++k) {
            if (law.between[k] != b.name) continue;
            const std::string& other = law.between[1 - k];
            const std::string& end = law.surfaces[k];
            const bool rods = std::any_of(scene.rods.begin(), scene.rods.end(),
                                          [&](const RodInput& r) { return r.name == other; });
            if (!end.empty() && ((end != "start" && end != "end") || rods || b.shape.closed))
                findings.add({fmt::format("/contact/{}/surfaces/{}", i, k)}, quoted_text(end),
                             rods || b.shape.closed
                                 ? "\"\": all of the rod"
                                 : "\"\" (all of the rod), \"start\" or \"end\"");
        }
    }
    for (std::size_t i = 0; i < b.segments.size() && !b.instrument; ++i)
        if (b.segments[i].friction)
            findings.add({fmt::format("/bodies/{}/segments/{}/friction", b.name, i)},
                         fmt::format("{}", *b.segments[i].friction),
                         "nothing: a rod's friction is that of the pair in \"contact\"");
}

void check_rods(const Scene& scene, Findings& findings)
{
    for (const RodInput& b : scene.rods) {
        check_rod(b, scene, findings);
        check_feed(b, scene, findings);
        check_rod_contacts(b, scene, findings);
    }
    if (scene.time.path > 0 && scene.time.kind == "dynamic")
        findings.add({"/time/path", "/time/kind"}, fmt::format("{}", scene.time.path),
                     "0, or \"kind\": \"quasi_static\"");
    const bool alone = scene.rods.size() == 1 && scene.solids.empty() && scene.rigids.empty() &&
                       scene.contact.empty() && scene.couplings.empty();
    if (scene.time.path > 0 && !alone)
        findings.add({"/time/path"},
                     "a path of a scene that is not one rod alone, without contact and couplings",
                     "0: steps in time");
}

} // namespace amontons
