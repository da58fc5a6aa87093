// Three to six bodies of random kinds, placed apart, then pressed, dropped or dragged into one
// another.

#include "validation/random/pieces.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace amontons::validation {
namespace {

/// Bodies of one place of a crowd, and what couples them.
struct Group {
    std::string words; ///< what it is
    NamedBodies bodies;
    Json couplings = Json::array();
};

/// A free body with mass (two, where they are coupled) within a ball of 0.7 `size` about a place.
Group free_group(Draw& draw, const std::string& name, const Vec3& at, double size,
                 const Vec3& velocity)
{
    const double density = draw.ratio(300, 5000);
    const int what = draw.whole(0, 5);
    Group g;
    const auto rigid = [&](Json body, const char* word, const std::string& as) {
        body["density"] = density;
        body["start"]["velocity"] = list_of(velocity);
        g.bodies.push_back({as, std::move(body)});
        g.words += (g.words.empty() ? "" : " and ") + std::string(word);
    };
    const auto thin = [&](const Vec3& from, const Vec3& to, const std::string& as) {
        const double r = four_digits(size * draw.real(0.02, 0.05)), e = draw.ratio(1e8, 1e10);
        Json body = straight_rod(from, to, r, four_digits(e * 0.7854 * std::pow(r, 4)), 6, density);
        body["velocity"] = list_of(velocity);
        g.bodies.push_back({as, std::move(body)});
        g.words += (g.words.empty() ? "" : " and ") + std::string("rod");
    };
    const double yaw = draw.real(0, 3.1);
    const Vec3 along = Vec3(std::cos(yaw), std::sin(yaw), draw.real(-0.2, 0.2));
    const Vec3 from = (at - 0.5 * size * along).unaryExpr(&four_digits),
               to = (at + 0.5 * size * along).unaryExpr(&four_digits);
    if (what == 0) {
        rigid(rigid_ball(four_digits(0.4 * size), at), "ball", name);
    } else if (what == 1) {
        Json box = rigid_box(size * Vec3(draw.real(0.5, 0.8), 0.6, 0.5), at);
        box["start"]["turn"] = list_of(draw.rotation(0.5));
        rigid(box, "box", name);
    } else if (what == 2) {
        Json cylinder = rigid_cylinder(0.3 * size, 0.6 * size, at);
        cylinder["start"]["turn"] = list_of(draw.rotation(1.5));
        rigid(cylinder, "cylinder", name);
    } else if (what == 3) {
        const char* element = any_element(draw);
        const Json mesh =
            box_mesh(size * Vec3(0.7, draw.real(0.5, 0.7), 0.5), {2, 2, 2}, element, {0, 0, 0});
        const double e = draw.ratio(3e5, 1e7), nu = draw.real(0, 0.4);
        Json solid = draw.chance(0.6) ? neo_hooke(mesh, e, nu) : elastic(mesh, e, nu);
        solid["density"] = density;
        solid["start"] = {{"place", list_of(at)},
                          {"turn", list_of(draw.rotation(0.5))},
                          {"velocity", list_of(velocity)}};
        g.bodies.push_back({name, solid});
        g.words = "solid";
    } else if (what == 4) {
        thin(from, to, name);
    } else {
        thin(from, to, name);
        rigid(rigid_ball(four_digits(0.25 * size), to), "ball", name + "_head");
        g.couplings.push_back(joint(draw.one_of({"weld", "ball"}), name, name + "_head", to));
    }
    return g;
}

void add(Group& all, Group g)
{
    for (auto& b : g.bodies)
        all.bodies.push_back(std::move(b));
    for (Json& c : g.couplings)
        all.couplings.push_back(std::move(c));
    all.words += (all.words.empty() ? "" : ", ") + g.words;
}

RandomScene scene_of_group(const Group& all, double mu, Json time)
{
    RandomScene s{scene_of(all.bodies, all_pairs(all.bodies, all.couplings, mu), std::move(time))};
    if (!all.couplings.empty()) s.scene["couplings"] = all.couplings;
    s.scene["gravity"] = {0, 0, -kGravity};
    return s;
}

} // namespace

RandomScene draw_crowd_dropped(Draw& draw)
{
    const double size = draw.ratio(0.02, 0.2), speed = std::sqrt(kGravity * size),
                 mu = draw.chance(0.7) ? draw.real(0.1, 0.6) : 0;
    const int count = draw.whole(3, 5), steps = draw.whole(40, 70);
    Group all;
    all.bodies.push_back({"floor", plane({0, 0, 0}, {0, 0, 1})});
    for (int k = 0; k < count; ++k) {
        const Vec3 shift = draw.shift(0.15 * size);
        const Vec3 at =
            (Vec3(shift.x(), shift.y(), size * (0.75 + 1.45 * k))).unaryExpr(&four_digits);
        const Vec3 velocity =
            Vec3(speed * draw.real(-0.2, 0.2), 0, -speed * (0.5 + 0.5 * k)).unaryExpr(&four_digits);
        add(all, free_group(draw, fmt::format("body{}", k), at, size, velocity));
    }
    const double step = four_digits(0.02 * size / speed);
    RandomScene s = scene_of_group(all, mu, dynamic(step, four_digits(steps * step)));
    s.drawn = fmt::format("{}, mu {:g}, {} steps", all.words, mu, steps);
    s.same = 1e-4; // blows grow what differs
    return s;
}

RandomScene draw_crowd_dragged(Draw& draw)
{
    const double size = draw.ratio(0.02, 0.2), speed = std::sqrt(kGravity * size),
                 mu = draw.real(0.1, 0.6);
    const int count = draw.whole(2, 4), steps = draw.whole(40, 70);
    Group all;
    all.bodies.push_back({"floor", plane({0, 0, 0}, {0, 0, 1})});
    for (int k = 0; k < count; ++k) {
        const Vec3 at(size * (1.3 + 1.45 * k), four_digits(size * draw.real(-0.1, 0.1)),
                      0.72 * size);
        add(all, free_group(draw, fmt::format("body{}", k), at, size, Vec3::Zero()));
    }
    const double step = four_digits(0.02 * size / speed), end = four_digits(steps * step);
    const bool ball = draw.chance(0.5);
    const Vec3 place(0, 0, 0.55 * size);
    Json tool = ball ? rigid_ball(0.5 * size, place) : rigid_box(Vec3::Constant(size), place);
    tool["drive"] = {{"x", ramp(four_digits(draw.real(0.5, 1.2) * speed * end), end)}};
    all.bodies.push_back({"tool", tool});
    RandomScene s = scene_of_group(all, mu, dynamic(step, end));
    s.drawn = fmt::format("a {} through {}, mu {:g}, {} steps", ball ? "ball" : "box", all.words,
                          mu, steps);
    s.same = 1e-4; // blows grow what differs
    return s;
}

RandomScene draw_crowd_pressed(Draw& draw)
{
    // At rest every body has a hold of its own, or its weight and the friction of the floor.
    const double size = draw.ratio(0.01, 0.2), e = draw.ratio(1e5, 1e8), mu = draw.real(0.2, 0.6);
    const int count = draw.whole(2, 4), steps = draw.one_of({4, 8, 16});
    NamedBodies bodies{{"floor", plane({0, 0, 0}, {0, 0, 1})}};
    std::string words;
    const double gap = 0.01 * size;
    double x = 0; // the right side of the body before
    for (int k = 0; k < count; ++k) {
        const std::string name = fmt::format("body{}", k);
        const double y = four_digits(size * draw.real(-0.03, 0.03)), wide = 0.6 * size;
        // What is compliant stands last, or before a wall.
        const std::string what = k + 1 < count ? draw.one_of({"box", "ball", "solid", "rod"})
                                               : draw.one_of({"solid", "rod"});
        Json body;
        double right = x + gap + wide;
        const Vec3 at(x + gap + 0.5 * wide, y, 0.5 * wide);
        if (what == "box" || what == "ball") {
            body = what == "box" ? rigid_box(Vec3::Constant(wide), at) : rigid_ball(0.5 * wide, at);
            body["density"] = draw.ratio(500, 5000);
        } else if (what == "solid") {
            const char* element = any_element(draw);
            body = elastic(box_mesh(Vec3::Constant(wide), {2, 2, 2}, element, at), e,
                           draw.real(0, 0.4));
            body["hold"] = Json::array({held("z_min")});
        } else {
            const double r = four_digits(size * draw.real(0.03, 0.06));
            const Vec3 foot(x + gap + r, y, -size), head = foot + Vec3(0, 0, size + 1.2 * wide);
            body = straight_rod(foot, head, r, four_digits(100 * e * 0.7854 * std::pow(r, 4)), 16);
            body["hold"] = Json::array({Json{{"set", "start"}}});
            right = x + gap + 2 * r;
        }
        words += (k ? ", " : "") + what;
        bodies.push_back({name, body});
        x = right;
    }
    const double way = four_digits(gap * (count + 1) + size * draw.real(0.005, 0.03));
    Json tool = rigid_box({0.3 * size, 1.2 * size, 0.9 * size}, {-0.15 * size, 0, 0.5 * size});
    tool["drive"] = {{"x", ramp(way)}};
    bodies.push_back({"tool", tool});
    // What is held stands in the floor: a solid by its bottom, a rod by its foot below it.
    Json contact = Json::array();
    for (Json& p : all_pairs(bodies, Json::array(), mu)) {
        const std::string b = p.at("between").at(1);
        const bool free = std::ranges::any_of(bodies, [&](const auto& named) {
            return named.first == b && named.second.contains("density");
        });
        if (p.at("between").at(0) != "floor" || free) contact.push_back(p);
    }
    RandomScene s{scene_of(bodies, contact, quasi_static(1.0 / steps))};
    s.scene["gravity"] = {0, 0, -kGravity};
    s.drawn = fmt::format("{}, mu {:g}, {} steps", words, mu, steps);
    // What friction exerts on rigid bodies before they slide is not determined, and is a part of
    // what the next step begins with.
    s.same = 1e-3;
    return s;
}

} // namespace amontons::validation
