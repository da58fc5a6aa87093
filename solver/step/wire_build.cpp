#include "solver/step/wire_build.hpp"

#include "mesh/base/curve.hpp"
#include "solver/obstacle/build.hpp"
#include "solver/scene/consistency.hpp"
#include "solver/scene/instrument_rods.hpp"
#include "solver/step/wire_overlap.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>

namespace amontons {
namespace {

// Where a fading grip begins it holds the wire this much stiffer than the wire holds itself
// over the fade's length: EI / fade^4 is the wire's own lateral stiffness per length there.
constexpr double kGripOverBending = 190;

std::string number(double v)
{
    char text[32];
    std::snprintf(text, sizeof text, "%.6g", v);
    return text;
}

Mat3 sheath_frame(const IntroducerInput& in, const std::optional<Vec3>& plane)
{
    const Vec3 d = in.direction.normalized(), second = introducer_normal(in, plane);
    Mat3 frame;
    frame << d, second, d.cross(second);
    return frame;
}

/// Every list of a wire's dynamics, in the order of the checkpoint.
template <class Dynamics> auto lists_of(Dynamics& d)
{
    return std::array{&d.velocity,       &d.spin,          &d.inertia_force,
                      &d.inertia_moment, &d.contact_force, &d.contact_arm};
}

/// Of contact points in a bore [m]: the outer instrument's own. Where the inner one fills the bore,
/// no finer than the instrument is thick and the elements are long, whatever the scene specifies:
/// there a couple is two forces that grow as their arm falls, and a beam resolves no arm shorter
/// than that.
double bore_spacing(const Wire& inner, const Wire& outer)
{
    const double own = outer.material.point.front().spacing;
    double widest = 0, bore = std::numeric_limits<double>::infinity(), thick = 0, element = 0;
    for (const BeamSegment& s : inner.material.segments)
        widest = std::max(widest, s.radius);
    for (const BeamSegment& s : outer.material.segments) {
        bore = std::min(bore, s.inner_radius);
        thick = std::max(thick, 2 * s.radius);
    }
    for (const Wire* w : {&inner, &outer})
        for (const ElementLaw& law : w->material.law)
            element = std::max(element, law.length);
    return fills_bore(widest, bore) ? std::max(thick, element) : own;
}

/// A wire can be held in a plane only if nothing takes it out.
void check_plane(const Scene& scene, const BeamInput& beam, std::vector<Issue>& issues)
{
    const std::string place = "/bodies/" + beam.name;
    const Vec3 n = beam.plane->normalized();
    const auto in_plane = [&](const Vec3& v) { return std::abs(n.dot(v)) <= 1e-9 * v.norm(); };
    if (beam.introducer.normal && !in_plane(*beam.introducer.normal))
        issues.push_back({scene.file, place + "/introducer/normal", "a direction out of `plane`",
                          "one in the plane that the wire is held in"});
    for (const auto& t : beam.twist)
        if (t[1] != 0) {
            issues.push_back({scene.file, place + "/drive/twist", "a twist of " + number(t[1]),
                              "0: a wire held in a plane cannot turn"});
            break;
        }
    for (std::size_t k = 0; k < beam.segments.size(); ++k)
        if (beam.segments[k].curvature != 0 &&
            std::abs(std::sin(beam.segments[k].curvature_angle)) > 1e-9)
            issues.push_back({scene.file,
                              place + "/segments/" + std::to_string(k) + "/curvature_angle",
                              number(beam.segments[k].curvature_angle),
                              "0 or pi: a wire held in a plane bends in it"});
}

} // namespace

WireBody build_wire(const Scene& scene, const BeamInput& beam,
                    const std::vector<Obstacle>& obstacles, const std::vector<SoftVessel>& vessels,
                    std::vector<int>& near)
{
    Wire wire;
    wire.material = make_material(beam.segments, beam.contact_spacing);
    Sheath sheath;
    sheath.frame = sheath_frame(beam.introducer, beam.plane);
    sheath.fade = beam.introducer.fade;
    sheath.end = beam.introducer.at - sheath.fade * sheath.frame.col(0);
    if (sheath.fade > 0) {
        double EI = 0;
        for (const BeamSegment& g : beam.segments)
            EI = std::max({EI, g.EI[0], g.EI[1], g.EI_across[0], g.EI_across[1]});
        sheath.grip = kGripOverBending * EI / std::pow(sheath.fade, 4);
    }
    wire.sheath = sheath;
    if (beam.plane) wire.plane = beam.plane->normalized();

    std::vector<WireWall> walls;
    const auto add_wall = [&](const std::string& name, WireWall w, std::size_t body) {
        for (const ContactLaw& law : scene.contact) {
            const bool one = law.between[0] == beam.name && law.between[1] == name;
            const bool other = law.between[1] == beam.name && law.between[0] == name;
            if (!one && !other) continue;
            for (const BeamSegment& g : beam.segments)
                w.friction_of_segment.push_back(g.friction.value_or(law.friction));
            for (const MaterialPoint& p : wire.material.point)
                w.friction.push_back(w.friction_of_segment[std::size_t(p.segment)]);
            w.foundation = law.foundation;
            walls.push_back(std::move(w));
            near.push_back(int(body));
            break;
        }
    };
    for (std::size_t o = 0; o < obstacles.size(); ++o) {
        WireWall w;
        w.wall = &obstacles[o].model.wall;
        add_wall(obstacles[o].name, std::move(w), o);
    }
    for (std::size_t v = 0; v < vessels.size(); ++v) {
        WireWall w;
        w.wall = &vessels[v].tube->undeformed();
        w.soft = vessels[v].tube.get();
        add_wall(vessels[v].name, std::move(w), obstacles.size() + scene.beams.size() + v);
    }
    WireMotion motion;
    if (scene.time.kind == "dynamic") motion = make_motion(wire.material, scene.time.damping);
    WireBody body = make_wire_body(std::move(wire), std::move(walls), std::move(motion),
                                   scene.accuracy.contact);
    body.course = scene.time.balance == "course";
    const double t0 = beam.twist.empty() ? 0 : curve_value(beam.twist, 0);
    start_in_sheath(body.wire, curve_value(beam.insertion, 0) + beam.introducer.fade, t0);
    if (beam.hold.given && body.wire.outside()) hold_tip_here(body.wire, beam.hold.turns == "held");
    return body;
}

void check_start(const Scene& scene, const BeamInput& beam, const WireBody& body,
                 const std::vector<std::string>& walls, const std::vector<Obstacle>& obstacles,
                 std::vector<Issue>& issues)
{
    if (beam.plane) check_plane(scene, beam, issues);
    const std::string place = "/bodies/" + beam.name + "/introducer/at";
    const auto hint_of = [&](const std::string& name) {
        for (const Obstacle& o : obstacles)
            if (o.name == name) return side_hint(scene, o);
        return std::string();
    };
    std::string by_branch;
    if (const IntroducerInput& i = beam.introducer; !i.branch.empty()) {
        const bool start = i.end == "start";
        by_branch = std::string("; this is the ") + (start ? "start" : "end") +
                    " of the centreline of " + i.branch + ", \"end\": \"" +
                    (start ? "end" : "start") + "\" the other one";
    }
    for (std::size_t k = 0; k < walls.size(); ++k) {
        const Wall& wall = *body.walls[k].wall;
        const double radius = beam.segments.back().radius;
        WallHint hint;
        const Vec3 x = beam.introducer.at;
        const double gap = wall.distance(x, hint) - radius;
        if (!(gap >= -1e-6 * radius)) {
            issues.push_back({scene.file, place,
                              "an end with the wire's surface " + number(-gap) +
                                  " m inside the wall of " + walls[k],
                              "a point of the free space, the wire's radius off every wall" +
                                  by_branch + hint_of(walls[k])});
            continue;
        }
        double most = 0;
        for (const auto& c : beam.insertion)
            most = std::max(most, c[1]);
        if (most <= 0) continue;
        // The space ahead of the sheath must be free, or the wire starts against a wall.
        const double step = std::min(radius, most);
        if (wall.distance(x + step * body.wire.sheath->frame.col(0), hint) < 0.25 * radius)
            issues.push_back({scene.file, "/bodies/" + beam.name + "/introducer/direction",
                              "a direction straight into the wall of " + walls[k],
                              "a direction into the free space"});
    }
}

std::vector<WireGroup> make_groups(const Scene& scene, std::vector<WireBody>& wires,
                                   std::vector<std::unique_ptr<Coaxial>>& coaxial)
{
    const auto index_of = [&](const std::string& name) {
        for (std::size_t w = 0; w < scene.beams.size(); ++w)
            if (scene.beams[w].name == name) return int(w);
        return -1;
    };
    struct Pair {
        std::size_t inner, outer;
        double friction;
    };
    std::vector<Pair> pairs;
    std::vector<std::size_t> together(wires.size()); // the first wire of each one's group
    for (std::size_t w = 0; w < wires.size(); ++w)
        together[w] = w;
    for (const ContactLaw& law : scene.contact) {
        const int a = index_of(law.between[0]), b = index_of(law.between[1]);
        if (a < 0 || b < 0) continue;
        const bool a_inside = fits_in(scene.beams[std::size_t(a)], scene.beams[std::size_t(b)]);
        pairs.push_back(
            {std::size_t(a_inside ? a : b), std::size_t(a_inside ? b : a), law.friction});
        const std::size_t from = std::max(together[std::size_t(a)], together[std::size_t(b)]),
                          to = std::min(together[std::size_t(a)], together[std::size_t(b)]);
        std::replace(together.begin(), together.end(), from, to);
    }
    std::vector<WireGroup> groups;
    for (std::size_t first = 0; first < wires.size(); ++first) {
        if (together[first] != first) continue;
        WireGroup& g = groups.emplace_back();
        std::vector<int> place(wires.size(), -1);
        for (std::size_t w = first; w < wires.size(); ++w)
            if (together[w] == first) {
                place[w] = int(g.wires.size());
                g.wires.push_back(&wires[w]);
            }
        if (g.wires.size() == 1) continue;
        auto c = std::make_unique<Coaxial>();
        c->wires = g.wires;
        for (const Pair& p : pairs) {
            if (place[p.inner] < 0) continue;
            const Wire& bore = wires[p.outer].wire;
            const Wire& within = wires[p.inner].wire;
            c->nestings.push_back(
                make_nesting(within, bore, p.friction, bore_spacing(within, bore)));
            c->pairs.push_back({place[p.inner], place[p.outer]});
        }
        c->contacts.resize(c->nestings.size());
        g.coaxial = c.get();
        coaxial.push_back(std::move(c));
    }
    return groups;
}

void save_reactions(const std::vector<Reaction>& reactions, ByteWriter& out)
{
    out.value(std::uint64_t(reactions.size()));
    for (const Reaction& r : reactions) {
        out.value(r.normal);
        for (int k = 0; k < 3; ++k)
            out.value(r.tangential[k]);
        out.value(r.sticks);
        out.value(r.touch.known);
        out.value(r.touch.along);
        out.value(r.touch.around);
        for (int k = 0; k < 3; ++k)
            out.value(r.touch.n[k]);
    }
}

std::vector<Reaction> read_reactions(std::size_t size, ByteReader& in)
{
    if (in.value<std::uint64_t>() != size) ByteReader::refuse("another number of contact points");
    std::vector<Reaction> reactions(size);
    for (Reaction& r : reactions) {
        r.normal = in.value<double>();
        for (int k = 0; k < 3; ++k)
            r.tangential[k] = in.value<double>();
        r.sticks = in.value<bool>();
        r.touch.known = in.value<bool>();
        r.touch.along = in.value<double>();
        r.touch.around = in.value<double>();
        for (int k = 0; k < 3; ++k)
            r.touch.n[k] = in.value<double>();
    }
    return reactions;
}

void save_wire(const WireBody& b, ByteWriter& out)
{
    const WireState& s = b.wire.state;
    out.value(b.halvings);
    out.value(s.first);
    out.value(s.inserted);
    out.value(s.inserted_rest);
    out.value(s.rotation);
    out.value(s.base_insertion);
    out.value(s.base_twist);
    out.vector(s.nodes);
    save_reactions(s.reaction, out);
    out.value(s.wall_energy);
    save_walls(s, b.walls, out);
    const auto vec = [&](const Vec3& v) {
        for (int k = 0; k < 3; ++k)
            out.value(v[k]);
    };
    if (b.wire.tip)
        for (const Vec3* v : {&s.tip_moved, &s.tip_force, &s.tip_moment})
            vec(*v);
    for (const auto* list : lists_of(b.dynamics))
        for (const Vec3& v : *list)
            vec(v);
    for (const Proximity& p : b.work->proximity) {
        out.value(p.hint.piece);
        vec(p.at);
        out.value(p.distance);
    }
}

SavedWire read_wire(const WireBody& b, ByteReader& in)
{
    SavedWire w;
    WireState& s = w.state;
    w.halvings = in.value<int>();
    if (w.halvings < 0 || w.halvings > kMostSpacingHalvings)
        ByteReader::refuse("contact points at an impossible distance");
    const std::size_t reactions =
        b.walls.size() * contact_point_count(b.wire.material.length,
                                             std::ldexp(b.wire.material.point.front().spacing,
                                                        b.halvings - w.halvings));
    s.first = in.value<int>();
    s.inserted = in.value<double>();
    s.inserted_rest = in.value<double>();
    s.rotation = in.value<double>();
    s.base_insertion = in.value<double>();
    s.base_twist = in.value<double>();
    if (s.first < 0 || s.first > b.wire.last() || !(s.inserted >= 0) ||
        !(s.inserted < b.wire.material.length))
        ByteReader::refuse("a wire held at an impossible place");
    s.nodes = in.exactly<BeamNode>(b.wire.material.node.size());
    s.reaction = read_reactions(reactions, in);
    s.wall_energy = in.value<double>();
    w.walls = read_walls(b.walls, in);
    const auto vec = [&] {
        Vec3 v;
        for (int k = 0; k < 3; ++k)
            v[k] = in.value<double>();
        return v;
    };
    if (b.wire.tip)
        for (Vec3* v : {&s.tip_moved, &s.tip_force, &s.tip_moment})
            *v = vec();
    w.dynamics = b.dynamics;
    w.dynamics.contact_force.resize(reactions);
    w.dynamics.contact_arm.resize(reactions);
    for (std::vector<Vec3>* list : lists_of(w.dynamics))
        for (Vec3& v : *list)
            v = vec();
    w.proximity.resize(reactions);
    for (Proximity& p : w.proximity) {
        p.hint.piece = in.value<std::int32_t>();
        p.at = vec();
        p.distance = in.value<double>();
    }
    return w;
}

void restore_wire(WireBody& b, const SavedWire& w)
{
    const bool any = !b.wire.state.wall.empty();
    set_halvings(b, w.halvings);
    b.wire.state = w.state;
    for (std::size_t k = 0; any && k < b.walls.size(); ++k) {
        const std::shared_ptr<WallState>& wall = w.walls[k];
        if (wall && !wall->tangent_at) wall->tangent_at = b.walls[k].soft->tangent_at();
        b.wire.state.wall.push_back(wall);
    }
    b.dynamics = w.dynamics;
    b.work->proximity = w.proximity;
}

} // namespace amontons
