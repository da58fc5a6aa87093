// Forces of couplings on bodies, and what instruments are pushed and turned with.

#include "validation/random/geometry.hpp"
#include "validation/random/laws.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace amontons::validation {
namespace {

bool is_line(const Json& body)
{
    return body.at("kind") == "rod" || body.at("kind") == "beam";
}

/// Where a place of a body when the run begins is in a frame. @return false: not known here
bool moved_place(const WrittenRun& run, const std::string& name, const WrittenFrame& frame,
                 const Vec3& at, Vec3& place)
{
    if (name == "world" || run.body.at(name).at("kind") == "obstacle") {
        place = at;
        return true;
    }
    const auto part = frame.parts.find(name), first = run.frames.front().parts.find(name);
    if (part == frame.parts.end() || first == run.frames.front().parts.end()) return false;
    const WrittenArray &from = first->second.get("Points/points"),
                       &to = part->second.get("Points/points");
    if (run.body.at(name).at("kind") == "rigid") {
        double miss = 0;
        place = fit_motion(from, to, miss).apply(at);
        return true;
    }
    if (!is_line(run.body.at(name))) return false;
    const std::vector<double>&arc = first->second.get("PointData/arc_length").values,
          &now = part->second.get("PointData/arc_length").values;
    std::size_t nearest = 0;
    for (std::size_t i = 0; i < arc.size(); ++i)
        if ((from.vector(i) - at).norm() < (from.vector(nearest) - at).norm()) nearest = i;
    std::size_t there = 0;
    for (std::size_t i = 0; i < now.size(); ++i)
        if (std::abs(now[i] - arc[nearest]) < std::abs(now[there] - arc[nearest])) there = i;
    place = to.vector(there);
    return true;
}

/// The segment of an instrument that stands in its sheath's end when so much is out [m].
const Json* segment_at(const Json& body, double out)
{
    const Json& segments = body.at("segments");
    double left = out;
    for (auto s = segments.rbegin(); s != segments.rend(); ++s) {
        left -= s->at("length").get<double>();
        if (left < 0) return &*s;
    }
    return nullptr;
}

} // namespace

bool joint_loads(const WrittenRun& run, const std::string& name, const WrittenFrame& frame,
                 std::size_t row, std::vector<JointLoad>& loads)
{
    loads.clear();
    if (!run.scene().contains("couplings")) return true;
    int number = -1;
    for (const Json& c : run.scene().at("couplings")) {
        ++number;
        const std::string a = c.at("between").at(0), b = c.at("between").at(1);
        if (a != name && b != name) continue;
        const std::string stem = fmt::format("{}_on_{}_coupling_{}", a, b, number);
        if (!run.history.has_vector(stem + "_force")) return false;
        JointLoad load;
        const double sign = b == name ? 1 : -1;
        load.force = sign * run.history.vector(stem + "_force", row);
        if (run.history.has_vector(stem + "_moment"))
            load.moment = sign * run.history.vector(stem + "_moment", row);
        const std::string kind = c.value("kind", "weld");
        const Vec3 at = vector_of(c.at("at"));
        // A spring pulls at its own end; a joint's places are one.
        const bool ends = kind == "spring" || kind == "distance";
        const Vec3 to = ends && c.contains("to") ? vector_of(c.at("to")) : at;
        const auto rigid = [&](const std::string& n) {
            return n == "world" || !is_line(run.body.at(n));
        };
        load.placed = kind != "slider" && kind != "turn_spring" &&
                      (ends ? moved_place(run, name, frame, name == a ? at : to, load.at)
                            : moved_place(run, rigid(a) ? a : b, frame, at, load.at) ||
                                  moved_place(run, rigid(a) ? b : a, frame, at, load.at));
        loads.push_back(load);
    }
    return true;
}

std::vector<Finding> check_sheaths(const WrittenRun& run)
{
    if (run.dynamic()) return {};
    const RunScale scale = scale_of(run);
    std::vector<Finding> found;
    int instruments = 0;
    for (const auto& [name, body] : run.body)
        instruments += body.at("kind") == "beam";
    for (const auto& [name, body] : run.body) {
        if (body.at("kind") != "beam" || body.contains("hold")) continue;
        const Json& in = body.at("introducer");
        if (!in.contains("at") || in.contains("centreline") || in.value("fade", 0.0) > 0) continue;
        const std::string own = run.history.column(name + "_push_force") >= 0 ? name + "_" : "";
        if (own.empty() && (instruments > 1 || run.history.column("push_force") < 0)) continue;
        bool heavy = vector_of(run.scene().at("gravity")).norm() > 0, weighs = false;
        for (const Json& s : body.at("segments"))
            weighs = weighs || s.value("density", 0.0) > 0;
        if (heavy && weighs) continue; // spread along a curve
        // ---- Balance at the sheath's end, frame by frame
        const Vec3 end = vector_of(in.at("at")), d = vector_of(in.at("direction")).normalized();
        double share = 1;
        std::string text;
        for (const WrittenFrame& frame : run.frames) {
            const int row = run.history.row_at(frame.time);
            if (row < 0) continue;
            const auto r = static_cast<std::size_t>(row);
            Vec3 force = Vec3::Zero(), moment = Vec3::Zero();
            double size = 0, turning = 0;
            const auto add = [&](const Vec3& at, const Vec3& f) {
                force += f;
                moment += (at - end).cross(f);
                size += f.norm();
                turning += (at - end).norm() * f.norm();
            };
            bool known = true, nested = false;
            Vec3 bending_alone = Vec3::Zero(); // of contacts with what is in the sheath
            double inside = 0;                 // ... along it, on that
            for (const WrittenContact& c : contacts_of(run, frame)) {
                if (c.a != name && c.b != name) continue;
                if (c.a ==
                    c.b) { // with itself: nothing in all, but what is in the sheath bends none
                    const Vec3 aside = c.at - end - (c.at - end).dot(d) * d;
                    const double radius = body.at("segments").at(0).at("radius");
                    if ((c.at - end).dot(d) < 0 && aside.norm() < 1.5 * radius) {
                        const double sign = c.normal.dot(aside) > 0 ? 1 : -1; // which is outside
                        bending_alone += sign * (c.at - end).cross(c.force);
                        inside -= sign * c.force.dot(d);
                    }
                    continue;
                }
                const Json& other = run.body.at(c.a == name ? c.b : c.a);
                nested = nested || (other.at("kind") == "beam" &&
                                    other.at("introducer").value("at", Json()) == in.at("at"));
                add(c.at, c.a == name ? c.force : Vec3(-c.force));
            }
            // ---- Loads of joints
            std::vector<JointLoad> loads;
            known = joint_loads(run, name, frame, r, loads) && !nested;
            for (const JointLoad& l : loads) {
                known = known && l.placed;
                add(l.at, l.force);
                moment += l.moment;
                turning += l.moment.norm();
            }
            // ---- The energy that leaves with the material, and what the section carries
            // The element at the sheath's end has what its material has on the mean: of one
            // segment.
            const double out = value_at(body.at("drive").at("insertion"), frame.time);
            const Json* const segment = segment_at(body, out);
            if (!known || !segment || segment->value("curvature", 0.0) != 0) continue;
            const double element = segment->value("element", segment->at("length").get<double>());
            if (segment_at(body, out - element) != segment ||
                segment_at(body, out + element) != segment)
                continue;
            const Json& ei = segment->at("EI");
            const double stiff = ei.is_array() ? ei.at(0).get<double>() : ei.get<double>();
            if (ei.is_array() && ei.at(1).get<double>() != stiff) continue;
            const double push = run.history.values(own + "push_force")[r],
                         torque = run.history.values(own + "torque")[r];
            // The energy of what comes out changes with bending, and with the stretch: by what the
            // section at the end carries instead of the push.
            const Vec3 bends = moment + bending_alone;
            const double bending = (bends - bends.dot(d) * d).norm(), axial = force.dot(d) - inside,
                         eshelby = bending * bending / (2 * stiff),
                         stretch = (axial * axial - push * push) /
                                   (2 * segment->at("EA").at(0).get<double>());
            // Sections are linear but for terms of third order in the strain. A contact's place is
            // known to what the arm of its force may be off by.
            // The element at the sheath's end, up to half as long again as a whole one, is a cubic:
            // a thrust bends it by more, of the square of thrust over stiffness.
            const double first = 1.5 * element,
                         thrust = std::max(std::abs(axial), std::abs(push)) * first * first / stiff;
            // ---- Comparison
            const double allowed = 100 * scale.accuracy * (scale.force + size) + scale.rounding +
                                   (1e-4 + 0.01 * thrust * thrust) * eshelby;
            const double off = std::abs(push + force.dot(d) + eshelby + stretch),
                         twisted = std::abs(torque + moment.dot(d)),
                         allowed_twist = 1e-6 * turning + allowed * scale.length;
            for (const auto& [what, value, most] : {std::tuple{"the push on", off, allowed},
                                                    {"the torque on", twisted, allowed_twist}})
                if (value / most > share) {
                    share = value / most;
                    text = fmt::format("t = {:g} s: {} {} and what acts on it out of its sheath "
                                       "leave {:.3g}, allowed {:.3g}",
                                       frame.time, what, name, value, most);
                }
        }
        if (!text.empty()) found.push_back({"balance", text});
    }
    return found;
}

} // namespace amontons::validation
