#include "haptics/link/held_rod.hpp"

#include "solver/beam/clamp.hpp"
#include "solver/beam/rod.hpp"
#include "solver/step/body_build.hpp"

#include <algorithm>
#include <fmt/format.h>

// The spring as an element: with a rest length l, short against everything else, and stiffnesses
// k l^2 for stretch and shears and k_turn l^2 for twist and curvatures, its energy is
// 1/2 k |shift|^2 + 1/2 k_turn |turn|^2, shift and turn of the rod's start from the device.

namespace amontons {
namespace {

constexpr double kSpringLength = 0.02; // of the rod's radius
constexpr double kStiffTurn = 0.2;     // of EI over that: turns held rigidly, or by more
constexpr double kSpacing = 2;         // of contact points, in radii: objects may be small

bool is_between(const ContactLaw& law, const std::string& a, const std::string& b)
{
    return (law.between[0] == a && law.between[1] == b) ||
           (law.between[0] == b && law.between[1] == a);
}

void check(const Scene& scene, const RodInput& rod, const std::vector<ContactLaw>& laws)
{
    std::vector<Issue> issues;
    const std::string here = "/bodies/" + rod.name;
    const auto add = [&](const std::string& place, const std::string& found,
                         const std::string& allowed) {
        issues.push_back({scene.file, here + place, found, allowed});
    };
    if (!rod.shape.points.empty() || rod.shape.has_curve() || rod.shape.closed)
        add("/shape", "a curve, a polyline or a closed rod",
            "\"start\" and \"direction\": a rod in the hand begins in its natural shape");
    if (!rod.loads.empty()) add("/loads", "loads", "none on a rod in the hand");
    if (rod.plane) add("/plane", "a plane", "none: the hand moves in space");
    if (rod.elements != "exact")
        add("/elements", quoted_text(rod.elements), "\"exact\" of a rod in the hand");
    if (rod.hold.size() > 1 || (rod.hold.size() == 1 && rod.hold[0].set != "start"))
        add("/hold", "a hold beside the hand's", "at most one, of \"start\": the hand's path");
    if (scene.rods.size() > 1 || !scene.solids.empty() || !scene.rigids.empty() ||
        !scene.beams.empty())
        issues.push_back({scene.file, "/bodies",
                          "other bodies that move beside " + quoted_text(rod.name),
                          "a rod in the hand and obstacles"});
    if (!scene.gravity.isZero() && std::any_of(rod.segments.begin(), rod.segments.end(),
                                               [](const BeamSegment& g) { return g.density > 0; }))
        issues.push_back({scene.file, "/gravity", "gravity on a rod with a density",
                          "none: a rod in the hand has no weight"});
    for (const ContactLaw& law : laws) {
        if (!law.surfaces[0].empty() || !law.surfaces[1].empty())
            issues.push_back({scene.file, "/contact", "\"surfaces\" of a rod in the hand",
                              "none: all of it touches"});
        if (law.sliding != "finite")
            issues.push_back({scene.file, "/contact", "\"sliding\": " + quoted_text(law.sliding),
                              "\"finite\" of a rod in the hand"});
    }
    if (!issues.empty()) throw InputError(std::move(issues));
}

/// The material with the spring before it.
WireMaterial with_spring(WireMaterial m, const HandleSpring& spring)
{
    const double length = kSpringLength * m.segments.front().radius;
    for (auto* places : {&m.node, &m.segment_start})
        for (double& s : *places)
            s += length;
    for (SectionStretch& p : m.stretch) {
        p.start += length;
        p.end += length;
    }
    for (MaterialPoint& p : m.point) {
        p.s += length;
        ++p.element;
    }
    m.length += length;
    ElementLaw law;
    law.length = length;
    const double EI = m.law.front().S[4] / m.law.front().length;
    const double turn = std::min(spring.turn_stiffness, kStiffTurn * EI / length);
    for (std::size_t i = 0; i < 6; ++i)
        law.S[i] = (i < 3 ? spring.stiffness : turn) * length * length;
    law.P[0] = law.S[0];
    law.constant = 0.5 * law.S[0];
    m.node.insert(m.node.begin(), 0);
    m.law.insert(m.law.begin(), law);
    m.stiffness.insert(m.stiffness.begin(), m.stiffness.front());
    for (auto* sums : {&m.flexibility_axial, &m.flexibility_torsion, &m.bending_energy})
        sums->insert(sums->begin(), 0);
    return m;
}

} // namespace

WireBody make_held_rod(const Scene& scene, const RodInput& rod,
                       const std::vector<Obstacle>& obstacles, const HandleSpring& spring,
                       std::vector<int>& near, std::vector<Issue>& warnings)
{
    const std::vector<ContactLaw> laws = written_out(scene);
    check(scene, rod, laws);
    for (const ContactLaw& law : laws)
        if (is_between(law, rod.name, rod.name))
            warnings.push_back({scene.file, "/contact", "contact of the rod with itself",
                                "left out: a rod in the hand touches obstacles"});
    Wire wire;
    const double spacing =
        rod.contact_spacing > 0 ? rod.contact_spacing : kSpacing * rod.segments.front().radius;
    wire.material = with_spring(make_material(rod.segments, spacing), spring);
    const Mat3 frame = first_frame(rod.shape, rod.shape.direction);
    start_clamped(wire, rod.shape.start - wire.material.law[0].length * frame.col(0), frame);

    std::vector<WireWall> walls;
    for (std::size_t o = 0; o < obstacles.size(); ++o)
        for (const ContactLaw& law : laws) {
            if (!is_between(law, rod.name, obstacles[o].name)) continue;
            WireWall& w = walls.emplace_back();
            w.wall = &obstacles[o].model.wall;
            for (const MaterialPoint& p : wire.material.point)
                w.friction.push_back(
                    rod.segments[std::size_t(p.segment)].friction.value_or(law.friction));
            near.push_back(int(o));
            break;
        }
    WireBody body = make_wire_body(std::move(wire), std::move(walls), {}, scene.accuracy.contact);
    int worst = -1;
    const double gap = smallest_gap(body.wire, body.walls, body.work->proximity, &worst);
    if (worst >= 0 && gap < 0)
        throw InputError(
            {{scene.file, "/bodies/" + rod.name + "/shape/start",
              fmt::format("a rod {:.3g} m inside {}", -gap,
                          obstacles[std::size_t(near[std::size_t(worst) % near.size()])].name),
              "a rod in the free space"}});
    return body;
}

HandPose device_of(const Wire& rod)
{
    const BeamNode& n = rod.state.nodes[0];
    return {n.position(), Eigen::Quaterniond(n.q[0], n.q[1], n.q[2], n.q[3])};
}

void place_device(Wire& rod, const HandPose& device)
{
    BeamNode& n = rod.state.nodes[0];
    const Eigen::Quaterniond& q = device.rotation;
    n = {};
    for (int k = 0; k < 3; ++k)
        n.x[k] = device.position[k];
    n.q[0] = q.w();
    n.q[1] = q.x();
    n.q[2] = q.y();
    n.q[3] = q.z();
}

} // namespace amontons
