// Forces: their sums, balances and the laws of contact.

#include "validation/random/geometry.hpp"
#include "validation/random/laws.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <set>

namespace amontons::validation {
namespace {

// Forces are as exact as the requested accuracy, relative to the largest; a hundredfold is left
// to sums over many contacts and to moments. The default 1e-8 makes 1e-6.
constexpr double kSums = 100;

std::string size_text(const char* what, double value, double allowed, double time)
{
    return fmt::format("{} {:.3g}, allowed {:.3g}, at t = {:g} s", what, value, allowed, time);
}

/// What sums of forces may leave [N].
double allowed_force(const RunScale& scale)
{
    return kSums * scale.accuracy * scale.force + scale.rounding;
}

/// The worst of many, as one finding.
struct Worst {
    std::string law, text;
    double share = 1; ///< of what is allowed

    void add(double value, double allowed, const std::string& what, double time)
    {
        const double here = value / allowed;
        if (here <= share) return; // NaN continues
        share = here;
        text = what + ": " + size_text("", value, allowed, time);
    }
    void append_to(std::vector<Finding>& list) const
    {
        if (!text.empty()) list.push_back({law, text});
    }
};

Vec3 at_time(const Json& load, const char* what, double time)
{
    if (!load.contains(what)) return Vec3::Zero();
    return vector_of(load.at(what)) * (load.contains("over") ? value_at(load.at("over"), time) : 1);
}

/// What is known of the forces on a body but those of its contacts. @return false if some are not
/// known
bool known_forces(const WrittenRun& run, const std::string& name, double time, std::size_t row,
                  Vec3& sum)
{
    const Json& body = run.body.at(name);
    const Vec3 gravity = vector_of(run.scene().at("gravity"));
    const std::string kind = body.at("kind");
    if (kind == "rigid") {
        if (body.contains("drive")) return false;
        double mass = 0;
        Vec3 inertia;
        sum += at_time(body, "force", time);
        if (rigid_mass(body, mass, inertia)) sum += mass * gravity;
        return true;
    }
    if (kind != "solid" && kind != "rod") return false;
    if (body.contains("drive") || body.contains("fed")) return false;
    std::set<std::string> sets;
    for (const Json& hold : body.value("hold", Json::array())) {
        if (!hold.contains("set") || (kind == "rod" && hold.at("set") == "all")) return false;
        sets.insert(hold.at("set").get<std::string>());
    }
    // Sets that share nodes would count these twice; opposite faces share none.
    if (sets.size() > 1 && kind == "solid") {
        if (sets.size() > 2 || sets.begin()->substr(0, 1) != sets.rbegin()->substr(0, 1) ||
            sets.count("all"))
            return false;
    }
    for (const std::string& set : sets)
        sum += run.history.vector(name + "_" + set + "_force", row);
    const bool box = kind == "solid" && body.at("mesh").value("generate", "") == "box";
    for (const Json& load : body.value("loads", Json::array())) {
        if (load.contains("pressure") || load.contains("volume") || load.value("follows", false))
            return false;
        sum += at_time(load, "force", time);
        if (load.contains("traction")) {
            const std::string set = load.at("set");
            const std::size_t axis =
                set.size() == 5 && set[0] >= 'x' && set[0] <= 'z' ? std::size_t(set[0] - 'x') : 3;
            if (!box || axis > 2) return false;
            const Vec3 size = vector_of(body.at("mesh").at("size"));
            sum += at_time(load, "traction", time) * size[(int(axis) + 1) % 3] *
                   size[(int(axis) + 2) % 3];
        }
        if (load.contains("line"))
            for (const Json& s : body.at("segments"))
                sum += at_time(load, "line", time) * s.at("length").get<double>();
    }
    if (gravity.norm() == 0) return true;
    if (kind == "solid") {
        if (!body.contains("density")) return true;
        if (!box) return false; // the volume of a round mesh is not a closed form
        sum += body.at("density").get<double>() * vector_of(body.at("mesh").at("size")).prod() *
               gravity;
        return true;
    }
    for (const Json& s : body.at("segments")) {
        if (!s.contains("density")) continue;
        if (s.contains("end_radius") && s.at("end_radius") != s.at("radius")) return false;
        const double r = s.at("radius"), bore = s.value("inner_radius", 0.0);
        sum += s.at("density").get<double>() * 3.141592653589793 * (r * r - bore * bore) *
               s.at("length").get<double>() * gravity;
    }
    return true;
}

/// Moments about the origin of what acts on a rod but its contacts, from its places as they are.
/// @return false: not all is known
bool moments_on_rod(const WrittenRun& run, const std::string& name, const WrittenFrame& frame,
                    std::size_t row, Vec3& sum)
{
    const Json& body = run.body.at(name);
    if (body.at("kind") != "rod") return false;
    if (vector_of(run.scene().at("gravity")).norm() > 0) return false; // spread along a curve
    const VtkText& line = frame.parts.at(name);
    const WrittenArray& places = line.get("Points/points");
    const std::vector<double>& arc = line.get("PointData/arc_length").values;
    const auto place_of = [&](const Json& at) -> Vec3 {
        if (at.value("set", "") == "start") return places.vector(0);
        if (at.value("set", "") == "end") return places.vector(arc.size() - 1);
        std::size_t nearest = 0;
        const double s = at.value("at", 0.0);
        for (std::size_t i = 0; i < arc.size(); ++i)
            if (std::abs(arc[i] - s) < std::abs(arc[nearest] - s)) nearest = i;
        return places.vector(nearest);
    };
    for (const Json& hold : body.value("hold", Json::array())) {
        const std::string held = name + "_" + hold.at("set").get<std::string>();
        sum += place_of(hold).cross(run.history.vector(held + "_force", row));
        if (run.history.has_vector(held + "_moment"))
            sum += run.history.vector(held + "_moment", row);
    }
    for (const Json& load : body.value("loads", Json::array())) {
        if (load.contains("line")) return false;
        sum += place_of(load).cross(at_time(load, "force", frame.time)) +
               at_time(load, "moment", frame.time);
    }
    return true;
}

} // namespace

std::vector<Finding> check_sums(const WrittenRun& run)
{
    Worst worst{"sums", ""};
    const RunScale scale = scale_of(run);
    for (const WrittenFrame& frame : run.frames) {
        const int row = run.history.row_at(frame.time);
        if (row < 0)
            return {{"sums", fmt::format("no step of history.csv ends at the frame's t = {} s",
                                         frame.time)}};
        std::map<std::string, Vec3> sums;
        for (const WrittenContact& c : contacts_of(run, frame)) {
            const auto add = [&](const std::string& name, const Vec3& f) {
                sums.emplace(name, Vec3::Zero()).first->second += f;
            };
            add(c.a + "_on_" + c.b + "_force", c.force);
            if (c.a != c.b) // the pair's name has the scene's order
                add(c.b + "_on_" + c.a + "_force", c.force);
            add(c.a + "_contact_force", c.force);
            add(c.b + "_contact_force", -c.force);
        }
        for (const std::string& column : run.history.names) {
            if (column.find("_coupling_") != std::string::npos) continue; // of a joint
            const bool pair = column.find("_on_") != std::string::npos;
            const std::string tail = pair ? "_force_x" : "_contact_force_x";
            if (column.size() < tail.size() || column.substr(column.size() - tail.size()) != tail)
                continue;
            const std::string name = column.substr(0, column.size() - 2);
            const auto sum = sums.find(name);
            const Vec3 reported = run.history.vector(name, static_cast<std::size_t>(row));
            const Vec3 here = sum == sums.end() ? Vec3::Zero() : sum->second;
            const double off =
                std::min((reported - here).norm(), pair ? (reported + here).norm() : 1e300);
            worst.add(off, allowed_force(scale),
                      "contact forces of the frame and " + name + " differ by [N]", frame.time);
        }
    }
    std::vector<Finding> found;
    worst.append_to(found);
    return found;
}

std::vector<Finding> check_balance(const WrittenRun& run)
{
    Worst forces{"balance", ""}, moments{"balance", ""};
    const RunScale scale = scale_of(run);
    const Json& time_rule = run.scene().at("time");
    const bool dynamic = run.dynamic();
    for (std::size_t k = 1; k < run.frames.size(); ++k) {
        const WrittenFrame& frame = run.frames[k];
        const int found = run.history.row_at(frame.time);
        if (found < 1) continue;
        const auto row = static_cast<std::size_t>(found);
        std::map<std::string, Vec3> on;
        const std::vector<WrittenContact> contacts = contacts_of(run, frame);
        for (const WrittenContact& c : contacts) {
            on.emplace(c.a, Vec3::Zero()).first->second += c.force;
            on.emplace(c.b, Vec3::Zero()).first->second -= c.force;
        }
        for (const auto& [name, body] : run.body) {
            const std::string kind = body.at("kind");
            Vec3 sum = on.count(name) ? on[name] : Vec3::Zero();
            if (dynamic && (kind != "rigid" || time_rule.value("rule", "") != "theta")) continue;
            std::vector<JointLoad> joints;
            if (!known_forces(run, name, frame.time, row, sum) ||
                !joint_loads(run, name, frame, row, joints))
                continue;
            for (const JointLoad& j : joints)
                sum += j.force;
            const double allowed = allowed_force(scale);
            if (dynamic) {
                double mass = 0;
                Vec3 inertia;
                const double step = run.history.values("step_length")[row];
                if (body.contains("over") || !rigid_mass(body, mass, inertia) || !(step > 0))
                    continue;
                const Vec3 change = run.history.vector(name + "_velocity", row) -
                                    run.history.vector(name + "_velocity", row - 1);
                forces.add((mass * change - step * sum).norm(), allowed * step + 1e-12 * mass,
                           "momentum of " + name + " and impulses on it differ by [N s]",
                           frame.time);
                continue;
            }
            Vec3 across = Vec3::Zero(); // a plane that a rod is kept in takes any force along it
            if (body.contains("plane")) across = vector_of(body.at("plane")).normalized();
            sum -= sum.dot(across) * across;
            forces.add(sum.norm(), allowed, "forces on " + name + " leave [N]", frame.time);
            Vec3 centre = Vec3::Zero(), moment = Vec3::Zero();
            if (kind == "rigid") {
                centre = run.history.vector(name, row);
                moment = at_time(body, "torque", frame.time);
            } else if (!moments_on_rod(run, name, frame, row, moment)) {
                continue;
            }
            for (const WrittenContact& c : contacts)
                if (c.a == name || c.b == name)
                    moment += (c.a == name ? 1.0 : -1.0) * (c.at - centre).cross(c.force);
            if (!std::ranges::all_of(joints, &JointLoad::placed)) continue;
            for (const JointLoad& j : joints)
                moment += (j.at - centre).cross(j.force) + j.moment;
            if (across.norm() > 0)
                moment = moment.dot(across) * across; // and any moment but about it
            moments.add(moment.norm(), 10 * allowed * scale.length,
                        "moments on " + name + " leave [N m]", frame.time);
        }
    }
    std::vector<Finding> found;
    forces.append_to(found);
    moments.append_to(found);
    return found;
}

std::vector<Finding> check_coulomb(const WrittenRun& run)
{
    Worst normals{"Coulomb", ""}, pull{"Coulomb", ""}, cone{"Coulomb", ""}, on_cone{"Coulomb", ""},
        against{"Coulomb", ""};
    const RunScale scale = scale_of(run);
    const double allowed = allowed_force(scale);
    for (const WrittenFrame& frame : run.frames)
        for (const WrittenContact& c : contacts_of(run, frame)) {
            const Json* pair = pair_of(run, c.a, c.b);
            if (!pair) return {{"Coulomb", c.a + " and " + c.b + " touch, but stand in no pair"}};
            const std::string who = " of " + c.a + " and " + c.b;
            const double mu = pair->value("friction", 0.0), n = c.force.dot(c.normal);
            const Vec3 t = c.force - n * c.normal, slip = c.slip - c.slip.dot(c.normal) * c.normal;
            normals.add(std::abs(c.normal.norm() - 1), 1e-9,
                        "length of a normal" + who + " is off by", frame.time);
            pull.add(-n, allowed, "a contact" + who + " pulls with [N]", frame.time);
            bool own = false; // friction of a segment
            for (const std::string& name : {c.a, c.b})
                for (const Json& s : run.body.at(name).value("segments", Json::array()))
                    own = own || s.contains("friction");
            if (own) continue;
            cone.add(t.norm() - mu * std::max(n, 0.0), allowed,
                     "friction" + who + " is beyond mu n by [N]", frame.time);
            // In motion the law holds for velocities that a rule takes within the step.
            if (mu == 0 || c.status != 2 || run.dynamic()) continue;
            const double least = 1e-6 * scale.length;
            if (slip.norm() < least) continue;
            on_cone.add(mu * n - t.norm(), 1e-3 * mu * n + allowed,
                        "friction" + who + " slips within its cone by [N]", frame.time);
            against.add(t.dot(slip) / slip.norm(), allowed,
                        "friction" + who + " acts along the slip with [N]", frame.time);
        }
    std::vector<Finding> found;
    for (const Worst* w : {&normals, &pull, &cone, &on_cone, &against})
        w->append_to(found);
    return found;
}

std::vector<Finding> check_complementarity(const WrittenRun& run)
{
    Worst open{"complementarity", ""}, closed{"complementarity", ""};
    if (run.dynamic())
        return {}; // a blow's gaps are those of the step's start: check_overlap sees the end
    const RunScale scale = scale_of(run);
    std::map<std::string, double>
        room; // what rows at places of a coarse face may leave (certificate.md)
    for (const WrittenFrame& frame : run.frames)
        for (const WrittenContact& c : contacts_of(run, frame)) {
            const Json* pair = pair_of(run, c.a, c.b);
            if (pair && pair->contains("foundation")) continue;
            const std::string key = c.a + " and " + c.b;
            if (!room.count(key)) {
                double face = 0, curvature = 0, radius = 0;
                for (const std::string& name : {c.a, c.b}) {
                    const PlacedBody body = place_body(run, name, run.frames.front());
                    curvature += body.curvature;
                    for (const SurfacePlace& p : body.places)
                        face = std::max(face, p.face);
                    if (body.kind == "rod" || body.kind == "beam")
                        radius = std::max(radius, 0.5 * body.thickness);
                }
                room[key] = std::max({0.125 * face * face * curvature, 0.01 * face, 0.01 * radius,
                                      kSums * scale.accuracy * scale.length});
            }
            closed.add(-c.gap, room[key], "a gap of " + key + " is negative by [m]", frame.time);
            if (c.force.dot(c.normal) > 1e-4 * scale.force)
                open.add(c.gap, room[key], "a force over a gap of " + key + " of [m]", frame.time);
        }
    std::vector<Finding> found;
    open.append_to(found);
    closed.append_to(found);
    return found;
}

} // namespace amontons::validation
