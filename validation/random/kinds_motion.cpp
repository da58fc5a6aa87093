// Scenes in motion.

#include "validation/random/geometry.hpp"
#include "validation/random/pieces.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace amontons::validation {
namespace {

/// One of the rules of second order, or of any.
void any_rule(Draw& draw, Json& time, bool second_order)
{
    const int rule = draw.whole(0, second_order ? 1 : 2);
    if (rule == 0) time["theta"] = 0.5;
    if (rule == 1) {
        time["rule"] = "generalised_alpha";
        time["spectral_radius"] = draw.real(0.5, 1);
    }
}

bool is_euler(const Json& time)
{
    return !time.contains("theta") && !time.contains("rule");
}

/// Potential and kinetic energy of one body by height and the reported kinetic energy, over the
/// run.
std::string energy_kept(const WrittenRun& run, const std::string& body, double mass, double share)
{
    const std::vector<double> z = run.history.values(body + "_z"),
                              kinetic = run.history.values("kinetic");
    double low = 1e300, high = -1e300, most = 0;
    for (std::size_t i = 0; i < z.size(); ++i) {
        const double e = kinetic[i] - kinetic[0] + mass * kGravity * (z[i] - z[0]);
        low = std::min(low, e);
        high = std::max(high, e);
        most = std::max(most, mass * kGravity * std::abs(z[i] - z[0]));
    }
    if (high <= share * most && low >= -share * most) return "";
    return fmt::format("the energy runs from {:.3g} to {:.3g} of the largest change of potential "
                       "energy, right is 0 within {:g}",
                       low / most, high / most, share);
}

} // namespace

RandomScene draw_pendulum(Draw& draw)
{
    const double a = draw.ratio(0.02, 1), period = 2 * 3.141592653589793 * std::sqrt(a / kGravity);
    const std::string kind = draw.one_of({"hinge", "ball"});
    Json bar = rigid_box({a, four_digits(a * draw.real(0.1, 0.4)), 0.2 * a}, {0.5 * a, 0, 0});
    bar["density"] = draw.ratio(100, 1e4);
    const double tilt = draw.real(-0.8, 1.2); // from the horizontal, about y
    bar["start"] = {{"place", list_of(0.5 * a * Vec3(std::cos(tilt), 0, -std::sin(tilt)))},
                    {"turn", list_of({0, tilt, 0})}};
    const int steps = draw.whole(100, 200);
    Json time = dynamic(four_digits(period / steps), four_digits(draw.real(0.8, 1.6) * period));
    any_rule(draw, time, true);
    RandomScene s{scene_of({{"bar", bar}}, Json::array(), time)};
    s.scene["couplings"] = Json::array(
        {{{"kind", kind}, {"between", {"bar", "world"}}, {"at", {0, 0, 0}}, {"axis", {0, 1, 0}}}});
    s.scene["gravity"] = {0, 0, -kGravity};
    s.drawn = fmt::format("on a {}, {} steps a period, {}", kind, steps,
                          time.contains("rule") ? "generalised alpha" : "midpoint");
    const double width = bar.at("shape").at("size").at(1);
    const double mass = bar.at("density").get<double>() * a * width * 0.2 * a;
    // Second order: (step / period)^2 times (2 pi)^2 over a period.
    const double share = 2 * 1.6 * 40.0 / (steps * steps) + 1e-6;
    s.right = [=](const WrittenRun& run) { return energy_kept(run, "bar", mass, share); };
    s.same = 1e-5;
    return s;
}

RandomScene draw_bowl(Draw& draw)
{
    const double r = draw.ratio(0.005, 0.2), bowl = four_digits(r * draw.real(3, 8)),
                 way = bowl - r;
    const bool trough = draw.chance(0.4);
    const double angle = draw.real(0.5, 1.5); // from the bottom
    const double period = 2 * 3.141592653589793 * std::sqrt(way / kGravity);
    const int steps = draw.whole(100, 200);
    Json surface = {{"generate", trough ? "cylinder" : "ball"}, {"radius", bowl}};
    if (trough) surface["axis"] = {0, 1, 0};
    Json ball = rigid_ball(r, {way * std::sin(angle), 0, -way * std::cos(angle)});
    ball["density"] = draw.ratio(100, 1e4);
    Json time = dynamic(four_digits(period / steps), four_digits(draw.real(0.6, 1.2) * period));
    any_rule(draw, time, true);
    RandomScene s{
        scene_of({{"bowl", {{"kind", "obstacle"}, {"side", "inside"}, {"surface", surface}}},
                  {"ball", ball}},
                 pair("ball", "bowl"), time)};
    s.scene["gravity"] = {0, 0, -kGravity};
    s.drawn =
        fmt::format("a {} of {:.2g} radii, {} steps a period, {}", trough ? "trough" : "bowl",
                    bowl / r, steps, time.contains("rule") ? "generalised alpha" : "midpoint");
    const double mass = ball.at("density").get<double>() * 4.0 / 3 * 3.141592653589793 * r * r * r;
    s.right = [=](const WrittenRun& run) { return energy_kept(run, "ball", mass, 0.01); };
    s.same = 1e-5;
    return s;
}

RandomScene draw_spring_mass(Draw& draw)
{
    const double mass = draw.ratio(0.01, 100), omega = draw.ratio(0.5, 50),
                 away = draw.ratio(0.01, 0.1);
    const double stiffness = mass * omega * omega, period = 2 * 3.141592653589793 / omega;
    const int steps = draw.whole(80, 200);
    Json ball = rigid_ball(0.05, {away, 0, 0});
    ball["mass"] = mass;
    Json time = dynamic(four_digits(period / steps), four_digits(draw.real(0.7, 1.6) * period));
    any_rule(draw, time, false);
    RandomScene s{scene_of({{"mass", ball}}, Json::array(), time)};
    s.scene["couplings"] = Json::array({{{"kind", "spring"},
                                         {"between", {"mass", "world"}},
                                         {"at", {away, 0, 0}},
                                         {"to", {1, 0, 0}},
                                         {"stiffness", stiffness},
                                         {"length", 1}}});
    s.drawn = fmt::format("{} steps a period, {}", steps,
                          is_euler(time)          ? "Euler"
                          : time.contains("rule") ? "generalised alpha"
                                                  : "midpoint");
    // x = a cos(w t); rules of second order shift the phase by (w step)^2 / 12 of w t at most
    // twice; Euler damps by exp(-w^2 step t / 2).
    const bool euler = is_euler(time);
    s.right = [=](const WrittenRun& run) {
        const double t = run.history.last("time"), h = omega * time.at("step").get<double>();
        const double damped = euler ? std::exp(-0.5 * h * omega * t) : 1;
        const double allowed =
            away * ((euler ? 0.5 : 0.25) * h * h * omega * t + (euler ? 0.6 * h : 0) + 1e-6);
        const double x = away * damped * std::cos(omega * t);
        return between("the place [m]", run.history.last("mass_x"), x - allowed, x + allowed);
    };
    return s;
}

RandomScene draw_struck_ball(Draw& draw)
{
    const double light = draw.ratio(0.002, 0.05), heavy = four_digits(light * draw.real(1, 5)),
                 speed = draw.ratio(0.5, 20);
    const double step = four_digits(draw.ratio(0.05, 4) * light / speed),
                 bounce = draw.chance(0.5) ? 0 : draw.real(0.1, 0.9);
    const std::string on = draw.one_of({"bar", "plane", "slab"});
    const double r = four_digits(light * draw.real(0.4, 2));
    Json a = rigid_ball(light, {0, 0, light * 1.2}),
         b = rigid_ball(heavy, {0, 0, 2.2 * light + heavy * 1.6});
    a["mass"] = draw.ratio(1e-4, 1e-1);
    b["mass"] = 1;
    b["start"]["velocity"] = {0, 0, -speed};
    Json floor = plane({0, 0, 0}, {0, 0, 1});
    if (on == "bar")
        floor = {{"kind", "obstacle"},
                 {"surface",
                  {{"generate", "cylinder"},
                   {"centre", {0, 0, -r}},
                   {"axis", {0, 1, 0}},
                   {"radius", r}}}};
    if (on == "slab") {
        floor = rigid_box({20 * heavy, 20 * heavy, 4 * r}, {0, 0, -2 * r});
        floor["drive"] = {{"z", 0}};
    }
    Json contact = pair("*", "*");
    if (bounce > 0) contact["restitution"] = bounce;
    RandomScene s{scene_of({{"light", a}, {"heavy", b}, {"floor", floor}}, contact,
                           dynamic(step, four_digits(std::max(8 * step, 4 * heavy / speed))))};
    s.drawn = fmt::format("on a {}, {:.2g} radii a step, restitution {:g}", on,
                          speed * step / light, bounce);
    s.same = 1e-5;
    s.right = [=](const WrittenRun& run) -> std::string {
        for (const auto& [name, size] :
             {std::pair<std::string, double>{"light", light}, {"heavy", heavy}})
            if (run.history.last(name + "_z") < 0.9 * size - 0.1 * r &&
                std::abs(run.history.last(name + "_x")) < r + size)
                return fmt::format("the {} ball ends at z = {:.4g} m, {:.4g} m is on the {}", name,
                                   run.history.last(name + "_z"), size, on);
        if (run.history.last("heavy_z") < run.history.last("light_z"))
            return "the balls have changed places";
        return "";
    };
    return s;
}

RandomScene draw_bed_in_motion(Draw& draw)
{
    const double unit = draw.ratio(0.05, 0.5), e = draw.ratio(1e5, 1e7),
                 density = draw.ratio(500, 3000);
    const bool falls = draw.chance(0.5);
    const char* element = any_element(draw);
    Json bed = neo_hooke(box_mesh({unit, 0.8 * unit, 0.4 * unit}, {3, 2, 2}, element, {0, 0, 0}), e,
                         draw.real(0.2, 0.4));
    bed["density"] = density;
    bed["hold"] = Json::array({held("z_min")});
    const int steps = draw.whole(10, 25);
    const double speed = std::sqrt(e / density), step = four_digits(0.2 * unit / speed);
    Json time = dynamic(step, four_digits(steps * step));
    any_rule(draw, time, false);
    NamedBodies bodies{{"bed", bed}};
    Json contact = Json::array();
    if (falls) {
        const double r = 0.15 * unit, down = four_digits(0.02 * speed);
        Json ball = rigid_ball(r, {0.03 * unit, 0.02 * unit, 0.2 * unit + r + 5 * step * down});
        ball["density"] = four_digits(3 * density);
        ball["start"]["velocity"] = {four_digits(0.2 * down), 0, -down};
        bodies.push_back({"ball", ball});
        contact.push_back(pair("ball", "bed", draw.chance(0.5) ? 0.3 : 0));
    }
    RandomScene s{scene_of(bodies, contact, time)};
    s.scene["gravity"] = {0, 0, -kGravity};
    s.drawn = fmt::format("{}{}, {}", element, falls ? ", a ball falls" : "",
                          is_euler(time)          ? "Euler"
                          : time.contains("rule") ? "generalised alpha"
                                                  : "midpoint");
    s.same = 1e-5;
    s.right = [=](const WrittenRun& run) -> std::string {
        const std::size_t made = run.history.rows.size() - 1;
        if (made <= static_cast<std::size_t>(4 * (steps + 1))) return "";
        return fmt::format("{} steps where {} are requested", made, steps);
    };
    return s;
}

RandomScene draw_solid_drop(Draw& draw)
{
    const double unit = draw.ratio(0.05, 0.5), e = draw.ratio(3e5, 1e7),
                 density = draw.ratio(500, 3000), down = draw.real(0.5, 2);
    const char* element = any_element(draw);
    Json mesh = box_mesh(unit * Vec3{1, draw.real(0.7, 1.2), draw.real(0.7, 1.2)}, {2, 2, 2},
                         element, {0, 0, 0});
    Json solid = draw.chance(0.6) ? neo_hooke(mesh, e, draw.real(0, 0.4))
                                  : elastic(mesh, e, draw.real(0, 0.4));
    solid["density"] = density;
    solid["start"] = {{"place", list_of({0, 0, unit})},
                      {"turn", list_of(draw.rotation(1.5))},
                      {"velocity", list_of({draw.real(-0.5, 0.5), 0, -down})}};
    Json time = dynamic(four_digits(unit / down / 50), four_digits(0.9 * unit / down));
    any_rule(draw, time, false);
    RandomScene s{scene_of({{"floor", plane({0, 0, 0}, {0, 0, 1})}, {"solid", solid}},
                           pair("solid", "floor", draw.chance(0.5) ? 0.3 : 0), time)};
    s.scene["gravity"] = {0, 0, -kGravity};
    s.drawn =
        fmt::format("{}, {}, {}", element, solid.contains("material") ? "neo_hooke" : "linear",
                    is_euler(time)          ? "Euler"
                    : time.contains("rule") ? "generalised alpha"
                                            : "midpoint");
    s.same = 1e-4; // what turns and bounces grows what differs
    return s;
}

RandomScene draw_thrown_bodies(Draw& draw)
{
    const double r = draw.ratio(0.01, 0.3), friction = draw.chance(0.5) ? draw.real(0.1, 0.6) : 0,
                 bounce = draw.chance(0.5) ? draw.real(0.2, 1) : 0;
    const bool space = draw.chance(0.4); // nothing but the bodies themselves
    const int count = draw.whole(2, 4);
    NamedBodies bodies;
    if (!space) bodies.push_back({"floor", plane({0, 0, 0}, {0, 0, 1})});
    const double speed = std::sqrt(kGravity * r);
    for (int i = 0; i < count; ++i) {
        const Vec3 at(0.2 * r * i, four_digits(r * draw.real(-0.3, 0.3)), 1.2 * r + 2.6 * r * i);
        Json body = draw.chance(0.6) ? rigid_ball(r, at)
                                     : rigid_box(r * Vec3(1.2, 1.2, draw.real(0.8, 1.2)), at);
        body["density"] = draw.ratio(300, 3000);
        body["start"]["velocity"] = list_of(
            speed * Vec3{draw.real(-0.3, 0.3), draw.real(-0.3, 0.3), space ? (i ? -i : 2) : 0});
        body["start"]["spin"] = list_of(draw.shift(speed / r));
        bodies.push_back({fmt::format("body{}", i), body});
    }
    const double step = four_digits(0.02 * r / speed);
    Json contact = pair("*", "*", friction);
    if (bounce > 0) contact["restitution"] = bounce;
    RandomScene s{scene_of(bodies, contact, dynamic(step, four_digits(60 * step)))};
    if (!space) s.scene["gravity"] = {0, 0, -kGravity};
    s.drawn = fmt::format("{} bodies{}, mu {:g}, restitution {:g}", count, space ? " in space" : "",
                          friction, bounce);
    s.same = 1e-4; // blows grow what differs
    return s;
}

} // namespace amontons::validation
