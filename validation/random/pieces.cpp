#include "validation/random/pieces.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>

namespace amontons::validation {

Json list_of(const Vec3& v)
{
    return Json::array({v.x(), v.y(), v.z()});
}

Json ramp(double value, double end)
{
    return Json::array({Json::array({0, 0}), Json::array({end, value})});
}

Json box_mesh(const Vec3& size, const std::array<int, 3>& cells, const char* element,
              const Vec3& centre)
{
    return {{"generate", "box"},
            {"size", list_of(size)},
            {"cells", cells},
            {"element", element},
            {"centre", list_of(centre)}};
}

Json elastic(Json mesh, double youngs_modulus, double poisson_ratio)
{
    return {{"kind", "solid"},
            {"mesh", std::move(mesh)},
            {"youngs_modulus", youngs_modulus},
            {"poisson_ratio", poisson_ratio}};
}

Json neo_hooke(Json mesh, double youngs_modulus, double poisson_ratio)
{
    return {{"kind", "solid"},
            {"mesh", std::move(mesh)},
            {"material",
             {{"law", "neo_hooke"},
              {"youngs_modulus", youngs_modulus},
              {"poisson_ratio", poisson_ratio}}}};
}

Json held(const char* set)
{
    return {{"set", set}};
}

Json held(const char* set, Json x, Json y, Json z)
{
    return {{"set", set}, {"x", std::move(x)}, {"y", std::move(y)}, {"z", std::move(z)}};
}

Json rigid_box(const Vec3& size, const Vec3& place)
{
    return {{"kind", "rigid"},
            {"shape", {{"generate", "box"}, {"size", list_of(size)}}},
            {"start", {{"place", list_of(place)}}}};
}

Json rigid_ball(double radius, const Vec3& place)
{
    return {{"kind", "rigid"},
            {"shape", {{"generate", "ball"}, {"radius", radius}}},
            {"start", {{"place", list_of(place)}}}};
}

Json rigid_cylinder(double radius, double length, const Vec3& place)
{
    return {{"kind", "rigid"},
            {"shape", {{"generate", "cylinder"}, {"radius", radius}, {"length", length}}},
            {"start", {{"place", list_of(place)}}}};
}

void drive_down(Json& body, double by)
{
    body["drive"] = {{"x", 0}, {"y", 0}, {"z", ramp(-by)}};
}

Json rod(const Json& segments, const Json& shape)
{
    return {{"kind", "rod"}, {"segments", segments}, {"shape", shape}};
}

Json points(const Vec3& a, const Vec3& b)
{
    return Json::array({Json{{"at", list_of(a)}}, Json{{"at", list_of(b)}}});
}

Json bent_tube(Draw& draw, double radius, double before, double bend, double angle, double after)
{
    return {{"kind", "obstacle"},
            {"surface",
             {{"generate", "tube"},
              {"radius", radius},
              {"centreline",
               {{"start", {0, 0, 0}},
                {"direction", {1, 0, 0}},
                {"normal", {0, 1, 0}},
                {"pieces",
                 Json::array({{{"length", before}},
                              {{"radius", bend}, {"angle", angle}, {"direction", draw.real(0, 3)}},
                              {{"length", after}}})}}}}}};
}

Json instrument(double length, double radius, double ei, double element, const Vec3& at,
                const Vec3& direction, Json insertion)
{
    const Vec3 normal = direction.unitOrthogonal();
    return {
        {"kind", "beam"},
        {"segments",
         Json::array({{{"length", length}, {"radius", radius}, {"EI", ei}, {"element", element}}})},
        {"introducer",
         {{"at", list_of(at)}, {"direction", list_of(direction)}, {"normal", list_of(normal)}}},
        {"drive", {{"insertion", std::move(insertion)}}}};
}

Json straight_rod(const Vec3& from, const Vec3& to, double radius, double ei, int elements,
                  double density)
{
    const Vec3 way = to - from;
    const double length = way.norm();
    Json segment = {
        {"length", length}, {"radius", radius}, {"EI", ei}, {"element", length / elements}};
    if (density > 0) segment["density"] = density;
    return rod(Json::array({segment}), {{"start", list_of(from)},
                                        {"direction", list_of(way)},
                                        {"normal", list_of(way.unitOrthogonal())}});
}

Json joint(const char* kind, const std::string& a, const std::string& b, const Vec3& at,
           const Vec3& axis)
{
    return {{"kind", kind}, {"between", {a, b}}, {"at", list_of(at)}, {"axis", list_of(axis)}};
}

Json plane(const Vec3& at, const Vec3& normal)
{
    return {
        {"kind", "obstacle"},
        {"surface", {{"generate", "plane"}, {"centre", list_of(at)}, {"axis", list_of(normal)}}}};
}

Json pair(const std::string& a, const std::string& b, double friction)
{
    Json p = {{"between", {a, b}}};
    if (friction > 0) p["friction"] = friction;
    return p;
}

Json all_pairs(const NamedBodies& bodies, const Json& couplings, double friction)
{
    const auto joined = [&](const std::string& a, const std::string& b) {
        return std::any_of(couplings.begin(), couplings.end(), [&](const Json& c) {
            const Json& names = c.at("between");
            return (names[0] == a && names[1] == b) || (names[0] == b && names[1] == a);
        });
    };
    Json list = Json::array();
    for (std::size_t i = 0; i < bodies.size(); ++i)
        for (std::size_t j = i + 1; j < bodies.size(); ++j) {
            const auto& [a, first] = bodies[i];
            const auto& [b, second] = bodies[j];
            const bool walls = first.at("kind") == "obstacle" && second.at("kind") == "obstacle";
            if (!walls && !joined(a, b)) list.push_back(pair(a, b, friction));
        }
    return list;
}

Json quasi_static(double step, double end)
{
    return {{"kind", "quasi_static"}, {"step", step}, {"end", end}};
}

Json dynamic(double step, double end)
{
    return {{"kind", "dynamic"}, {"step", step}, {"end", end}};
}

Json scene_of(const NamedBodies& bodies, Json contact, Json time)
{
    Json scene = {{"schema", 1}, {"bodies", Json::object()}};
    for (const auto& [name, body] : bodies)
        scene["bodies"][name] = body;
    scene["contact"] = contact.is_array() ? std::move(contact) : Json::array({contact});
    scene["time"] = std::move(time);
    scene["output"] = {{"picture", false}, {"plots", false}, {"every", 1}};
    return scene;
}

const char* any_element(Draw& draw)
{
    return draw.one_of({"T4", "T10", "H8"});
}

Matter any_matter(Draw& draw)
{
    return {draw.ratio(0.02, 2), draw.ratio(1e4, 1e9), draw.real(0, 0.45)};
}

double pair_force(const WrittenRun& run, const std::string& a, const std::string& b, int axis)
{
    for (const std::string& name : {a + "_on_" + b + "_force", b + "_on_" + a + "_force"})
        if (run.history.has_vector(name))
            return std::abs(run.history.vector(name, run.history.rows.size() - 1)[axis]);
    return std::numeric_limits<double>::quiet_NaN();
}

std::string between(const std::string& what, double value, double low, double high)
{
    if (value >= low && value <= high) return "";
    return fmt::format("{} is {:.7g}, right is {:.7g} to {:.7g}", what, value, low, high);
}

} // namespace amontons::validation
