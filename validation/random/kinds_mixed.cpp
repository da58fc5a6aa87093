// Solids, rigid bodies, rods and obstacles in one scene; nets of coupled rods.

#include "validation/random/pieces.hpp"

#include <cmath>
#include <fmt/format.h>

namespace amontons::validation {
namespace {

constexpr double kWholeTurn = 6.283185307179586;

Vec3 on_circle(double radius, double angle, double z)
{
    return Vec3(radius * std::cos(angle), radius * std::sin(angle), z).unaryExpr(&four_digits);
}

/// A steel-like or plastic-like section by its radius: EI of a full round one.
double round_ei(double youngs_modulus, double radius)
{
    return four_digits(youngs_modulus * 3.141592653589793 / 4 * std::pow(radius, 4));
}

/// A rule for steps in motion, first order in half of the scenes.
void draw_rule(Draw& draw, Json& time)
{
    if (draw.chance(0.25)) time["theta"] = 0.5;
}

} // namespace

RandomScene draw_net_crimped(Draw& draw)
{
    const double ring = draw.ratio(0.004, 0.05), height = four_digits(ring * draw.real(0.6, 1.2)),
                 r = four_digits(ring * draw.real(0.01, 0.03)), e = draw.ratio(1e9, 2e11);
    const int crowns = draw.whole(3, 5), steps = draw.one_of({4, 8, 16});
    const bool sides = draw.chance(0.5);
    const char* kind = draw.one_of({"weld", "hinge", "ball"});
    const double mu = draw.chance(0.6) ? draw.real(0.05, 0.4) : 0,
                 way = four_digits(draw.real(0.02, 0.25) * (sides ? ring : height));
    NamedBodies bodies;
    Json contact = Json::array(), couplings = Json::array();
    const double ei = round_ei(e, r);
    const auto bottom = [&](int k) { return on_circle(ring, kWholeTurn * k / crowns, 0); };
    for (int k = 0; k < crowns; ++k) {
        const double middle = kWholeTurn * (k + 0.5) / crowns;
        const Vec3 top = on_circle(ring, middle, height);
        const std::string up = fmt::format("up{}", k), down = fmt::format("down{}", k);
        bodies.push_back({up, straight_rod(bottom(k), top, r, ei, 6)});
        bodies.push_back({down, straight_rod(bottom(k + 1 == crowns ? 0 : k + 1), top, r, ei, 6)});
        couplings.push_back(joint(kind, up, down, top, on_circle(1, middle, 0)));
        for (const auto& [name, foot] :
             {std::pair{up, bottom(k)}, {down, bottom(k + 1 == crowns ? 0 : k + 1)}})
            couplings.push_back(joint("weld", name, "world", foot));
    }
    // Walls that are driven: a plate from above, or one from each side of the crown's tops.
    const double gap = 0.02 * ring, thick = 0.3 * ring;
    const auto wall = [&](const std::string& name, Json body) {
        bodies.push_back({name, std::move(body)});
        // One of the two struts at a crown's top: what a wall exerts on both is not determined.
        for (int k = 0; k < crowns; ++k)
            contact.push_back(pair(fmt::format("up{}", k), name, mu));
    };
    if (sides) {
        for (int k = 0; k < crowns; ++k) {
            const double angle = kWholeTurn * (k + 0.5) / crowns,
                         out = ring + r + gap + 0.5 * thick;
            Json plate = rigid_box({thick, 0.6 * ring, 0.4 * height},
                                   on_circle(out, angle, four_digits(height)));
            plate["start"]["turn"] = {0, 0, four_digits(angle)};
            const Vec3 in = on_circle(-(gap + way), angle, 0);
            plate["drive"] = {{"x", ramp(in.x())}, {"y", ramp(in.y())}, {"z", 0}};
            wall(fmt::format("wall{}", k), plate);
        }
    } else {
        Json plate = rigid_box({3 * ring, 3 * ring, thick},
                               {0.03 * ring, 0.02 * ring, height + r + gap + 0.5 * thick});
        drive_down(plate, four_digits(gap + way));
        wall("plate", plate);
    }
    RandomScene s{scene_of(bodies, contact, quasi_static(1.0 / steps))};
    s.scene["couplings"] = couplings;
    s.drawn = fmt::format("{} crowns on {}s, {} by {:.2g}, mu {:g}, {} steps", crowns, kind,
                          sides ? "pressed inwards" : "pressed down", way / (sides ? ring : height),
                          mu, steps);
    return s;
}

RandomScene draw_net_dropped(Draw& draw)
{
    const double size = draw.ratio(0.02, 0.3), r = four_digits(size * draw.real(0.01, 0.03)),
                 e = draw.ratio(1e8, 1e10), density = draw.ratio(1000, 8000);
    const std::string shape = draw.one_of({"frame", "tripod", "cross"});
    const std::string on = draw.one_of({"plane", "solid", "rigid"});
    const char* kind = draw.one_of({"weld", "hinge", "ball"});
    const double mu = draw.chance(0.7) ? draw.real(0.1, 0.5) : 0, ei = round_ei(e, r),
                 down = four_digits(std::sqrt(kGravity * size) * draw.real(0.3, 1)),
                 tilt = four_digits(draw.real(0.02, 0.2) * size);
    NamedBodies bodies;
    Json couplings = Json::array();
    const double low = r + 0.02 * size;
    const auto add = [&](const std::string& name, const Vec3& from, const Vec3& to, int elements) {
        Json strut = straight_rod(from, to, r, ei, elements, density);
        strut["velocity"] = {0, 0, -down};
        bodies.push_back({name, strut});
    };
    if (shape == "frame") {
        const double h = 0.5 * size;
        const Vec3 corner[4] = {
            {-h, -h, low}, {h, -h, low + tilt}, {h, h, low + tilt}, {-h, h, low}};
        for (int k = 0; k < 4; ++k)
            add(fmt::format("rod{}", k), corner[k], corner[(k + 1) % 4], 6);
        for (int k = 0; k < 4; ++k)
            couplings.push_back(joint(kind, fmt::format("rod{}", k),
                                      fmt::format("rod{}", (k + 1) % 4), corner[(k + 1) % 4]));
    } else if (shape == "tripod") {
        const Vec3 apex(0.02 * size, 0.01 * size, low + 0.6 * size);
        for (int k = 0; k < 3; ++k)
            add(fmt::format("rod{}", k),
                on_circle(0.5 * size, kWholeTurn * k / 3 + 0.2, k == 0 ? low + tilt : low), apex,
                6);
        for (int k = 1; k < 3; ++k)
            couplings.push_back(joint(kind, "rod0", fmt::format("rod{}", k), apex, {0, 1, 0}));
    } else {
        const double h = 0.5 * size;
        add("rod0", {-h, 0, low}, {h, 0, low + tilt}, 8);
        add("rod1", {0, -h, low + 0.5 * tilt}, {0, h, low + 0.5 * tilt}, 8);
        couplings.push_back(joint(kind, "rod0", "rod1", {0, 0, low + 0.5 * tilt}));
    }
    Json floor = plane({0, 0, 0}, {0, 0, 1});
    const Vec3 slab(1.6 * size, 1.5 * size, 0.3 * size);
    if (on == "solid") {
        const char* element = any_element(draw);
        const double stiff = draw.ratio(1e6, 1e8);
        floor =
            elastic(box_mesh(slab, {4, 4, 1}, element, {0.011 * size, 0.007 * size, -0.15 * size}),
                    stiff, draw.real(0, 0.4));
        floor["density"] = 1000;
        floor["hold"] = Json::array({held("z_min")});
    }
    if (on == "rigid") {
        floor = rigid_box(slab, {0.011 * size, 0.007 * size, -0.15 * size});
        floor["drive"] = {{"z", 0}};
    }
    bodies.push_back({"floor", floor});
    Json contact = Json::array();
    for (const auto& [name, body] : bodies)
        if (name != "floor") contact.push_back(pair(name, "floor", mu));
    const int steps = draw.whole(30, 60);
    Json time = dynamic(four_digits(0.15 * size / down / steps * 2), 0);
    time["end"] = four_digits(steps * time["step"].get<double>());
    draw_rule(draw, time);
    RandomScene s{scene_of(bodies, contact, time)};
    s.scene["couplings"] = couplings;
    s.scene["gravity"] = {0, 0, -kGravity};
    s.drawn = fmt::format("a {} on {}s on a {}, mu {:g}, {} steps{}", shape, kind, on, mu, steps,
                          time.contains("theta") ? ", midpoint" : "");
    s.same = 1e-4; // blows grow what differs
    return s;
}

RandomScene draw_layers_at_rest(Draw& draw)
{
    const Matter m = any_matter(draw);
    const double a = m.size, height = 0.3 * a, r = four_digits(a * draw.real(0.01, 0.04)),
                 mu = draw.chance(0.6) ? draw.real(0.1, 0.4) : 0,
                 depth = four_digits(a * draw.real(0.002, 0.02));
    const int n = draw.whole(4, 6), steps = draw.one_of({2, 4, 8});
    const char* element = any_element(draw);
    Json bed = elastic(box_mesh({a, a, height}, {n, n, 2}, element, {0, 0, -0.5 * height}),
                       m.youngs_modulus, m.poisson_ratio);
    bed["hold"] = Json::array({held("z_min")});
    const double ei = round_ei(m.youngs_modulus * draw.ratio(1, 100), r);
    // A rod across the bed, whose ends are led down.
    const double x = -0.2 * a;
    Json bar = straight_rod({x, -0.65 * a, r}, {x, 0.65 * a, r + 0.003 * a}, r, ei, 20);
    for (const char* end : {"start", "end"}) {
        Json hold = held(end, 0, 0, ramp(-depth));
        hold["turns"] = "free";
        if (std::string(end) == "start") hold["turns"] = "held";
        bar["hold"].push_back(hold);
    }
    // A rigid body that is driven down, onto the rod or beside it.
    const bool onto = draw.chance(0.4);
    const double tool = 0.15 * a;
    const std::string shape = draw.one_of({"box", "ball"});
    const double over = onto ? 2 * r + 0.004 * a : 0.001 * a;
    const Vec3 place(onto ? x : 0.22 * a, 0.013 * a, 0.5 * tool + over);
    Json driven =
        shape == "box" ? rigid_box(Vec3::Constant(tool), place) : rigid_ball(0.5 * tool, place);
    drive_down(driven, four_digits(depth + (onto ? 0.004 * a : 0.001 * a)));
    NamedBodies bodies{{"bed", bed}, {"bar", bar}, {"tool", driven}};
    // And one that its weight holds.
    const bool free = mu > 0 && draw.chance(0.5);
    if (free) {
        Json block = rigid_box(Vec3(0.2 * a, 0.15 * a, 0.1 * a), {0.1 * a, -0.3 * a, 0.05 * a});
        block["density"] = four_digits(1e-3 * m.youngs_modulus / (kGravity * a));
        bodies.push_back({"block", block});
    }
    bodies.push_back({"wall", plane({0.5 * a + 0.03 * a, 0, 0}, {-1, 0, 0})});
    RandomScene s{scene_of(bodies, pair("*", "*", mu), quasi_static(1.0 / steps))};
    if (free) s.scene["gravity"] = {0, 0, -kGravity};
    s.drawn = fmt::format("{}, {} cells, a {} {} the rod{}, depth {:.2g}, mu {:g}, {} steps",
                          element, n, shape, onto ? "onto" : "beside", free ? ", a free box" : "",
                          depth / a, mu, steps);
    return s;
}

RandomScene draw_coupled_at_rest(Draw& draw)
{
    const double a = draw.ratio(0.02, 0.3), e = draw.ratio(1e5, 1e8),
                 r = four_digits(a * draw.real(0.02, 0.06)), mu = draw.real(0.1, 0.5);
    const int n = draw.whole(2, 4), steps = draw.one_of({4, 8, 16}), what = draw.whole(0, 2);
    const char* element = any_element(draw);
    const double depth = four_digits(a * draw.real(0.01, 0.06));
    const double ei = round_ei(e * draw.ratio(10, 300), r);
    NamedBodies bodies;
    Json contact = Json::array(), couplings = Json::array();
    Json pad = elastic(box_mesh(Vec3::Constant(a), {n, n, n}, element, {0, 0, -0.5 * a}), e,
                       draw.real(0, 0.4));
    pad["hold"] = Json::array({held("z_min")});
    std::string words;
    if (what == 0) { // a rod that carries a rigid body down onto the pad
        const std::string shape = draw.one_of({"ball", "box"});
        const char* kind = draw.one_of({"weld", "hinge"});
        const double size = 0.4 * a, z = 0.5 * size + 0.01 * a;
        Json head = shape == "ball" ? rigid_ball(0.5 * size, {0.02 * a, 0.01 * a, z})
                                    : rigid_box(Vec3::Constant(size), {0.02 * a, 0.01 * a, z});
        Json arm =
            straight_rod({-1.5 * a, 0.01 * a, z}, {0.02 * a - 0.5 * size, 0.01 * a, z}, r, ei, 12);
        Json hold = held("start", 0, 0, ramp(-depth));
        hold["turns"] = "held";
        arm["hold"] = Json::array({hold});
        bodies = {{"pad", pad}, {"arm", arm}, {"head", head}};
        couplings.push_back(
            joint(kind, "arm", "head", {0.02 * a - 0.5 * size, 0.01 * a, z}, {0, 1, 0}));
        contact.push_back(pair("head", "pad", mu));
        contact.push_back(pair("arm", "pad", mu));
        words = fmt::format("a {} on a rod's {}", shape, kind);
    } else if (what == 1) { // a rod welded to the pad, pressed aside by a rigid body
        Json post = straight_rod({0, 0, 0}, {0, 0, 1.5 * a}, r, ei, 12);
        const double tool = 0.2 * a;
        Json driven = rigid_ball(tool, {-(r + tool + 0.01 * a), 0.02 * a, 1.2 * a});
        driven["drive"] = {{"x", ramp(four_digits(depth + 0.01 * a))}};
        bodies = {{"pad", pad}, {"post", post}, {"tool", driven}};
        Json weld = joint("weld", "post", "pad", {0, 0, 0});
        weld["set"] = "z_max";
        couplings.push_back(weld);
        contact.push_back(pair("tool", "post", mu));
        words = "a post on a pad, pressed by a ball";
    } else { // a rigid table on two rods, pressed by a solid
        const double size = a;
        Json table = rigid_box({1.4 * size, size, 0.2 * size}, {0, 0, -0.1 * size});
        bodies = {{"table", table}};
        for (const double side : {-1.0, 1.0}) {
            const Vec3 top(0.5 * side * size, 0, -0.2 * size), foot = top - Vec3(0, 0, size);
            const std::string name = side < 0 ? "left" : "right";
            Json leg = straight_rod(foot, top, r, ei, 10);
            leg["hold"] = Json::array({Json{{"set", "start"}}});
            bodies.push_back({name, leg});
            couplings.push_back(joint("weld", name, "table", top));
        }
        Json press = elastic(box_mesh(Vec3::Constant(0.6 * size), {n, n, n}, element,
                                      {0.05 * size, 0.02 * size, 0.301 * size}),
                             e, 0.3);
        press["hold"] =
            Json::array({held("z_max", Json(0), Json(0), ramp(-four_digits(0.3 * depth)))});
        bodies.push_back({"press", press});
        contact.push_back(pair("press", "table", mu));
        words = "a table on two rods, pressed by a solid";
    }
    RandomScene s{scene_of(bodies, contact, quasi_static(1.0 / steps))};
    s.scene["couplings"] = couplings;
    s.drawn = fmt::format("{}, {}, {} cells, depth {:.2g}, mu {:g}, {} steps", words, element, n,
                          depth / a, mu, steps);
    return s;
}

RandomScene draw_coupled_in_motion(Draw& draw)
{
    const double a = draw.ratio(0.02, 0.3), density = draw.ratio(500, 5000),
                 r = four_digits(a * draw.real(0.02, 0.05)), e = draw.ratio(1e7, 1e9),
                 mu = draw.chance(0.7) ? draw.real(0.1, 0.5) : 0;
    const int what = draw.whole(0, 2), steps = draw.whole(30, 60);
    const double ei = round_ei(e, r), speed = four_digits(std::sqrt(kGravity * a));
    const char* kind = draw.one_of({"weld", "ball", "hinge"});
    NamedBodies bodies;
    Json couplings = Json::array();
    std::string words;
    const auto block = [&](const Vec3& at, double size) {
        const char* element = any_element(draw);
        Json b = elastic(box_mesh(Vec3::Constant(size), {2, 2, 2}, element, Vec3::Zero()),
                         draw.ratio(1e5, 1e7), 0.3);
        b["density"] = density;
        b["start"] = {{"place", list_of(at)}};
        return b;
    };
    if (what == 0) { // a rod that is held at one end swings a rigid body against a block
        Json arm = straight_rod({0, 0, 2.2 * a}, {2 * a, 0, 2.2 * a}, r, ei, 10, density);
        arm["hold"] = Json::array({Json{{"set", "start"}, {"turns", "free"}}});
        const double size = 0.5 * a;
        Json head = rigid_box(Vec3::Constant(size), {2 * a + 0.5 * size, 0, 2.2 * a});
        head["density"] = density;
        head["start"]["velocity"] = {0, 0, -2 * speed};
        Json low = block({2 * a, 0.02 * a, 0.5 * a}, a);
        low["hold"] = Json::array({held("z_min")});
        bodies = {{"arm", arm}, {"head", head}, {"block", low}};
        couplings.push_back(joint(kind, "arm", "head", {2 * a, 0, 2.2 * a}, {0, 1, 0}));
        words = fmt::format("a box on a rod's {} swings onto a block", kind);
    } else if (what == 1) { // two rigid balls on a rod, thrown onto a floor
        Json bar = straight_rod({-a, 0, a}, {a, 0, 1.1 * a}, r, ei, 8, density);
        bar["velocity"] = {0, 0, -speed};
        bodies = {{"floor", plane({0, 0, 0}, {0, 0, 1})}, {"bar", bar}};
        for (const double side : {-1.0, 1.0}) {
            const Vec3 at(side * a, 0, side < 0 ? a : 1.1 * a);
            const std::string name = side < 0 ? "left" : "right";
            Json ball = rigid_ball(four_digits(0.3 * a), at);
            ball["density"] = density;
            ball["start"]["velocity"] = {0, 0, -speed};
            bodies.push_back({name, ball});
            couplings.push_back(joint("weld", "bar", name, at));
        }
        words = "two balls on a rod are thrown";
    } else { // a block on a rod's end falls with a ball above it
        Json pole = straight_rod({0, 0, 0.8 * a}, {0, 0, 2.2 * a}, r, ei, 8, density);
        pole["velocity"] = {0, 0, -speed};
        Json low = block({0, 0, 0.4 * a + 0.02 * a}, 0.76 * a);
        low["start"]["velocity"] = {0, 0, -speed};
        Json ball = rigid_ball(four_digits(0.3 * a), {0.02 * a, 0.01 * a, 2.2 * a + r + 0.35 * a});
        ball["density"] = density;
        ball["start"]["velocity"] = {0, 0, -2 * speed};
        bodies = {
            {"floor", plane({0, 0, 0}, {0, 0, 1})}, {"block", low}, {"pole", pole}, {"ball", ball}};
        Json weld = joint("weld", "pole", "block", {0, 0, 0.8 * a});
        weld["set"] = "z_max";
        couplings.push_back(weld);
        words = "a block with a pole falls, a ball above it";
    }
    Json time = dynamic(four_digits(0.02 * a / speed), 0);
    time["end"] = four_digits(steps * time["step"].get<double>());
    draw_rule(draw, time);
    RandomScene s{scene_of(bodies, all_pairs(bodies, couplings, mu), time)};
    s.scene["couplings"] = couplings;
    s.scene["gravity"] = {0, 0, -kGravity};
    s.drawn = fmt::format("{}, mu {:g}, {} steps{}", words, mu, steps,
                          time.contains("theta") ? ", midpoint" : "");
    s.same = 1e-4; // blows grow what differs
    return s;
}

} // namespace amontons::validation
