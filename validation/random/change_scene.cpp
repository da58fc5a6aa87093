#include "validation/random/change_scene.hpp"

#include "validation/random/geometry.hpp"
#include "validation/random/laws.hpp"
#include "validation/random/pieces.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <vector>

namespace amontons::validation {
namespace {

const char* const kAxes[] = {"x", "y", "z"};

void turn_vector(Json& object, const char* key, const Mat3& q, const Vec3& shift = Vec3::Zero())
{
    if (object.contains(key)) object[key] = list_of(q * vector_of(object[key]) + shift);
}

bool moves_axes(const Mat3& q)
{
    return ((q.array() == 0) || (q.array() == 1)).all();
}

/// Values over time along x, y and z. @param missing  a missing one is 0; else it is free and stays
/// so
void turn_curves(Json& object, const Mat3& q, bool missing_is_zero)
{
    std::array<Json, 3> old;
    bool any = false;
    for (int k = 0; k < 3; ++k)
        if (object.contains(kAxes[k])) {
            old[std::size_t(k)] = object[kAxes[k]];
            any = true;
        }
    if (!any) return;
    std::set<double> times;
    for (Json& curve : old)
        if (curve.is_array())
            for (const Json& point : curve)
                times.insert(point.at(0).get<double>());
    const bool whole = moves_axes(q);
    for (int i = 0; i < 3; ++i) {
        object.erase(kAxes[i]);
        if (whole) {
            for (int j = 0; j < 3; ++j)
                if (q(i, j) == 1 && !old[std::size_t(j)].is_null())
                    object[kAxes[i]] = old[std::size_t(j)];
            continue;
        }
        const auto sum_at = [&](double time) {
            double sum = 0;
            for (int j = 0; j < 3; ++j)
                if (!old[std::size_t(j)].is_null())
                    sum += q(i, j) * value_at(old[std::size_t(j)], time);
            return sum;
        };
        if (times.empty()) {
            object[kAxes[i]] = sum_at(0);
        } else {
            object[kAxes[i]] = Json::array();
            for (const double t : times)
                object[kAxes[i]].push_back({t, sum_at(t)});
        }
    }
    (void)missing_is_zero;
}

/// A block of hexahedra along the world's axes: its mesh along other axes has the same elements.
bool is_straight_block(const Json& body)
{
    const Json& mesh = body.at("mesh");
    const bool turned = body.contains("start") && body.at("start").contains("turn");
    return mesh.value("generate", "") == "box" && mesh.value("element", "") == "H8" && !turned &&
           !mesh.contains("grading");
}

/// The block with its axes moved on, its sets as well.
void move_block(Json& body, const Mat3& q, const Vec3& shift)
{
    Json& mesh = body["mesh"];
    turn_vector(mesh, "size", q);
    turn_vector(mesh, "centre", q);
    const Json cells = mesh.at("cells");
    for (std::size_t k = 0; k < 3; ++k)
        mesh["cells"][(k + 1) % 3] = cells.at(k);
    Json& start = body["start"];
    start["place"] = list_of(
        (start.contains("place") ? Vec3(q * vector_of(start["place"])) : Vec3(0, 0, 0)) + shift);
    turn_vector(start, "velocity", q);
    turn_vector(start, "spin", q);
    for (const char* list : {"hold", "loads"})
        if (body.contains(list))
            for (Json& entry : body[list])
                entry["set"] = moved_set(entry.at("set").get<std::string>());
}

void turn_start(Json& body, const Mat3& q, const Vec3& shift)
{
    const RigidMotion start = start_of(body);
    const Eigen::AngleAxisd turn(q * start.turn);
    Json& s = body["start"];
    s["place"] = list_of(q * start.shift + shift);
    s["turn"] = list_of(turn.angle() * turn.axis());
    turn_vector(s, "velocity", q);
    turn_vector(s, "spin", q);
}

bool turn_surface(Json& surface, const Mat3& q, const Vec3& shift)
{
    if (surface.contains("file")) return false;
    if (surface.contains("centreline")) {
        Json& line = surface["centreline"];
        if (line.contains("file")) return false;
        turn_vector(line, "start", q, shift);
        turn_vector(line, "direction", q);
        turn_vector(line, "normal", q);
        return true;
    }
    if (!surface.contains("centre")) surface["centre"] = {0, 0, 0};
    if (!surface.contains("axis") && surface.value("generate", "") != "ball")
        surface["axis"] = {0, 0, 1};
    turn_vector(surface, "centre", q, shift);
    turn_vector(surface, "axis", q);
    return true;
}

bool turn_body(Json& body, const Mat3& q, const Vec3& shift)
{
    const std::string kind = body.at("kind");
    if (kind == "obstacle") return turn_surface(body["surface"], q, shift);
    turn_vector(body, "plane", q);
    turn_vector(body, "force", q);
    turn_vector(body, "torque", q);
    turn_vector(body, "velocity", q);
    turn_vector(body, "spin", q);
    if (kind == "solid" || kind == "rigid") {
        if (kind == "solid" && moves_axes(q) && is_straight_block(body))
            move_block(body, q, shift);
        else
            turn_start(body, q, shift);
        if (body.contains("drive")) {
            Json& drive = body["drive"];
            turn_curves(drive, q, true);
            if (drive.contains("angle") && !drive.contains("axis")) drive["axis"] = {0, 0, 1};
            turn_vector(drive, "axis", q);
            turn_vector(drive, "about", q, shift);
        }
    }
    if (kind == "beam") {
        Json& introducer = body["introducer"];
        if (introducer.contains("centreline")) return false;
        turn_vector(introducer, "at", q, shift);
        turn_vector(introducer, "direction", q);
        turn_vector(introducer, "normal", q);
    }
    if (kind == "rod") {
        Json& shape = body["shape"];
        if (shape.contains("curve")) return false;
        turn_vector(shape, "start", q, shift);
        turn_vector(shape, "direction", q);
        turn_vector(shape, "normal", q);
        if (shape.contains("points"))
            for (Json& p : shape["points"])
                turn_vector(p, "at", q, shift);
        else if (!shape.contains("direction"))
            shape["direction"] = list_of(q * Vec3(1, 0, 0));
    }
    if (body.contains("hold"))
        for (Json& hold : body["hold"]) {
            turn_curves(hold, q, false);
            turn_vector(hold, "axis", q);
        }
    if (body.contains("loads"))
        for (Json& load : body["loads"]) {
            if (load.value("follows", false)) continue;
            for (const char* key : {"traction", "force", "moment", "line"})
                turn_vector(load, key, q);
        }
    return true;
}

// ---- units

/// Powers of length, force and time.
struct Dimension {
    int length = 0, force = 0, time = 0;
};

/// The unit of a field of numbers by its name, and by what it belongs to. @return false: not known
bool dimension_of(const std::string& key, const std::string& owner, Dimension& d)
{
    static const std::map<std::string, Dimension> table{
        {"size", {1, 0, 0}},       {"centre", {1, 0, 0}},       {"radius", {1, 0, 0}},
        {"end_radius", {1, 0, 0}}, {"inner_radius", {1, 0, 0}}, {"length", {1, 0, 0}},
        {"place", {1, 0, 0}},      {"start", {1, 0, 0}},        {"at", {1, 0, 0}},
        {"to", {1, 0, 0}},         {"about", {1, 0, 0}},        {"reach", {1, 0, 0}},
        {"element", {1, 0, 0}},    {"velocity", {1, 0, -1}},    {"spin", {0, 0, -1}},
        {"gravity", {1, 0, -2}},   {"curvature", {-1, 0, 0}},   {"youngs_modulus", {-2, 1, 0}},
        {"traction", {-2, 1, 0}},  {"c1", {-2, 1, 0}},          {"c2", {-2, 1, 0}},
        {"density", {-4, 1, 2}},   {"mass", {-1, 1, 2}},        {"inertia", {1, 1, 2}},
        {"force", {0, 1, 0}},      {"torque", {1, 1, 0}},       {"moment", {1, 1, 0}},
        {"line", {-1, 1, 0}},      {"EI", {2, 1, 0}},           {"GJ", {2, 1, 0}},
        {"EA", {0, 1, 0}},         {"stiffness", {-1, 1, 0}},   {"foundation", {-2, 1, 0}},
        {"step", {0, 0, 1}},       {"end", {0, 0, 1}},          {"smallest_step", {0, 0, 1}},
        {"damping", {0, 0, -1}}};
    static const std::set<std::string> none{
        "schema",      "poisson_ratio", "cells",           "around",    "along",   "friction",
        "restitution", "axis",          "normal",          "direction", "turn",    "angle",
        "plane",       "theta",         "spectral_radius", "every",     "contact", "grading"};
    if (none.count(key)) return true;
    if (key == "angle" || (key == "direction" && owner == "pieces")) return true;
    const auto at = table.find(key);
    if (at == table.end()) return false;
    d = at->second;
    return true;
}

double factor_of_powers(const Dimension& d, const OtherUnits& u)
{
    return std::pow(u.length, d.length) * std::pow(u.force, d.force) * std::pow(u.time, d.time);
}

/// Curves of numbers over time: what their values are.
bool curve_dimension(const std::string& key, Dimension& d)
{
    static const std::map<std::string, Dimension> curves{
        {"x", {1, 0, 0}},        {"y", {1, 0, 0}}, {"z", {1, 0, 0}}, {"insertion", {1, 0, 0}},
        {"fed", {1, 0, 0}},      {"twist", {}},    {"angle", {}},    {"over", {}},
        {"pressure", {-2, 1, 0}}};
    const auto at = curves.find(key);
    if (at == curves.end()) return false;
    d = at->second;
    return true;
}

void scale_numbers(Json& value, double factor)
{
    if (value.is_number())
        value = value.get<double>() * factor;
    else if (value.is_array())
        for (Json& v : value)
            scale_numbers(v, factor);
}

bool scale_fields(Json& node, const std::string& owner, const OtherUnits& units)
{
    for (auto& [key, value] : node.items()) {
        if (value.is_object()) {
            if (!scale_fields(value, key, units)) return false;
            continue;
        }
        if (value.is_string() && (key == "file" || key == "curve")) return false;
        if (value.is_array() && !value.empty() && value[0].is_object()) {
            for (Json& item : value)
                if (!scale_fields(item, key, units)) return false;
            continue;
        }
        const bool numbers =
            value.is_number() || (value.is_array() && !value.empty() && !value[0].is_string());
        if (!numbers) continue;
        Dimension d;
        const bool curve = value.is_array() && value[0].is_array();
        if (curve || key == "x" || key == "y" || key == "z" ||
            (key == "angle" && owner != "pieces")) {
            if (!curve_dimension(key, d)) return false;
            if (!curve) {
                scale_numbers(value, factor_of_powers(d, units));
                continue;
            }
            for (Json& point : value) {
                scale_numbers(point[0], units.time);
                scale_numbers(point[1], factor_of_powers(d, units));
            }
            continue;
        }
        if (!dimension_of(key, owner, d)) return false;
        if (d.length || d.force || d.time)
            scale_numbers(value, factor_of_powers(d, units)); // whole numbers stay whole
    }
    return true;
}

} // namespace

Mat3 axes_moved_on()
{
    Mat3 q;
    q << 0, 0, 1, 1, 0, 0, 0, 1, 0;
    return q;
}

bool holds_along_axes(const Json& scene)
{
    for (const auto& [name, body] : scene.at("bodies").items())
        for (const Json& hold : body.value("hold", Json::array()))
            if (hold.contains("x") || hold.contains("y") || hold.contains("z")) return true;
    return false;
}

bool meshes_move_with_axes(const Json& scene)
{
    for (const auto& [name, body] : scene.at("bodies").items())
        if (body.at("kind") == "solid" && !is_straight_block(body)) return false;
    return true;
}

std::string moved_set(const std::string& set)
{
    if (set.size() != 5 || set[1] != '_' || set[0] < 'x' || set[0] > 'z') return set;
    return "xyz"[(set[0] - 'x' + 1) % 3] + set.substr(1);
}

std::optional<Json> turned_scene(const Json& scene, const Mat3& q, const Vec3& shift)
{
    Json other = scene;
    for (auto& [name, body] : other["bodies"].items())
        if (!turn_body(body, q, shift)) return std::nullopt;
    turn_vector(other, "gravity", q);
    if (moves_axes(q) && other.contains("contact"))
        for (Json& pair : other["contact"])
            for (std::size_t k = 0; pair.contains("surfaces") && k < 2; ++k) {
                const Json& body =
                    scene.at("bodies").at(pair.at("between").at(k).get<std::string>());
                if (body.at("kind") == "solid" && is_straight_block(body))
                    pair["surfaces"][k] = moved_set(pair["surfaces"][k].get<std::string>());
            }
    if (other.contains("couplings"))
        for (Json& c : other["couplings"]) {
            if (!c.contains("at")) c["at"] = {0, 0, 0};
            if (!c.contains("axis")) c["axis"] = {0, 0, 1};
            for (const char* set : {"set", "to_set"})
                if (moves_axes(q) && c.contains(set)) {
                    const auto solid = [&](std::size_t k) {
                        const auto body =
                            scene.at("bodies").find(c.at("between").at(k).get<std::string>());
                        return body != scene.at("bodies").end() && body->at("kind") == "solid" &&
                               is_straight_block(*body);
                    };
                    if (solid(0) || solid(1)) c[set] = moved_set(c[set].get<std::string>());
                }
            turn_vector(c, "at", q, shift);
            turn_vector(c, "to", q, shift);
            turn_vector(c, "axis", q);
        }
    return other;
}

Json renamed_scene(const Json& scene, const std::map<std::string, std::string>& names)
{
    Json other = scene;
    other["bodies"] = Json::object();
    for (const auto& [name, body] : scene.at("bodies").items())
        other["bodies"][names.at(name)] = body;
    for (const char* list : {"contact", "couplings"}) {
        if (!other.contains(list)) continue;
        for (Json& entry : other[list])
            for (Json& name : entry["between"]) {
                const auto at = names.find(name.get<std::string>());
                if (at != names.end()) name = at->second; // "*" and "world" stay
            }
    }
    return other;
}

Json reordered_scene(const Json& scene)
{
    Json other = scene;
    std::vector<std::pair<std::string, Json>> bodies;
    for (const auto& [name, body] : scene.at("bodies").items())
        bodies.emplace_back(name, body);
    std::reverse(bodies.begin(), bodies.end());
    other["bodies"] = Json::object();
    for (const auto& [name, body] : bodies)
        other["bodies"][name] = body;
    Json& pairs = other["contact"];
    std::reverse(pairs.begin(), pairs.end());
    for (Json& p : pairs) {
        std::reverse(p["between"].begin(), p["between"].end());
        if (p.contains("surfaces")) std::reverse(p["surfaces"].begin(), p["surfaces"].end());
    }
    return other;
}

std::optional<Json> scene_in_units(const Json& scene, const OtherUnits& units)
{
    Json other = scene;
    if (!scale_fields(other, "", units)) return std::nullopt;
    return other;
}

double factor_of(const std::string& unit, const OtherUnits& u)
{
    static const std::map<std::string, Dimension> units{{"", {}},
                                                        {"rad", {}},
                                                        {"m", {1, 0, 0}},
                                                        {"N", {0, 1, 0}},
                                                        {"N m", {1, 1, 0}},
                                                        {"J", {1, 1, 0}},
                                                        {"Pa", {-2, 1, 0}},
                                                        {"m/s", {1, 0, -1}},
                                                        {"rad/s", {0, 0, -1}},
                                                        {"s", {0, 0, 1}},
                                                        {"kg m/s", {0, 1, 1}},
                                                        {"kg m^2/s", {1, 1, 1}},
                                                        {"1/m", {-1, 0, 0}},
                                                        {"N s", {0, 1, 1}}};
    const auto at = units.find(unit);
    return at == units.end() ? 0 : factor_of_powers(at->second, u);
}

} // namespace amontons::validation
