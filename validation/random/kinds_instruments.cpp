// Instruments (`beam`) beside bodies of every kind, at rest.

#include "validation/random/pieces.hpp"

#include <cmath>
#include <fmt/format.h>

namespace amontons::validation {
namespace {

constexpr double kWater = 1000; ///< [kg/m^3]

/// Lengths of feeding: out by `first` when the run begins, by `last` at its end.
Json fed(double first, double last)
{
    return Json::array({Json::array({0, first}), Json::array({1, last})});
}

} // namespace

RandomScene draw_wire_pushes_body(Draw& draw)
{
    const double side = draw.ratio(0.002, 0.008), r = four_digits(side * draw.real(0.03, 0.1)),
                 ei = draw.ratio(1e-5, 1e-3), density = draw.ratio(800, 4000);
    const double floor = draw.real(0.1, 0.6), tip = draw.chance(0.4) ? draw.real(0.05, 0.3) : 0;
    const double first = draw.real(0.005, 0.02), way = side * draw.real(1, 4);
    const std::string shape = draw.one_of({"box", "ball", "cylinder"});
    const double aside = shape == "ball" ? 0 : four_digits(side * draw.real(-0.2, 0.2));
    const int steps = draw.one_of({7, 10, 20, 40});
    const Vec3 place(first + r + 0.7 * side, aside, 0.5 * side);
    Json body = shape == "box"    ? rigid_box(Vec3::Constant(side), place)
                : shape == "ball" ? rigid_ball(0.5 * side, place)
                                  : rigid_cylinder(0.5 * side, side, place);
    body["density"] = density;
    Json wire = instrument(first + way + 0.02, r, ei, 0.0025, {0, 0, 0.5 * side}, {1, 0, 0},
                           fed(first, four_digits(first + way)));
    RandomScene s{scene_of({{"floor", plane({0, 0, 0}, {0, 0, 1})}, {"body", body}, {"wire", wire}},
                           Json::array({pair("body", "floor", floor), pair("wire", "body", tip)}),
                           quasi_static(1.0 / steps))};
    s.scene["gravity"] = {0, 0, -kGravity};
    s.drawn = fmt::format("a {} of {:.2g} m, {} off its middle, mu {:g} and {:g}, {} steps", shape,
                          side, aside / side, floor, tip, steps);
    const double volume = shape == "box"    ? 1
                          : shape == "ball" ? 3.141592653589793 / 6
                                            : 3.141592653589793 / 4;
    const double friction = floor * density * volume * side * side * side * kGravity;
    // A box or a cylinder that is pushed in its middle slides with mu m g; aside it turns, which
    // takes less. A ball rolls.
    const double low = shape == "ball" || aside != 0 || tip > 0 ? 0 : friction * (1 - 1e-3);
    s.right = [=](const WrittenRun& run) {
        return between("the push [N]", run.history.last("wire_push_force"), low - 1e-3 * friction,
                       friction * (1 + 1e-3 + tip * 2));
    };
    return s;
}

RandomScene draw_clot_in_tube(Draw& draw)
{
    const double tube = draw.real(0.002, 0.004), bend = draw.real(0.035, 0.06),
                 angle = draw.real(0.4, 1.4), before = draw.real(0.02, 0.03);
    const double ball = four_digits(tube * draw.real(0.6, 0.95)),
                 r = four_digits(tube * draw.real(0.08, 0.16)), ei = draw.ratio(5e-5, 5e-4);
    const double mu = draw.chance(0.7) ? draw.real(0.05, 0.4) : 0,
                 wall = draw.chance(0.5) ? draw.real(0.05, 0.3) : 0;
    const double first = 0.005, last = four_digits(before + draw.real(0.2, 0.9) * bend * angle);
    const int steps = draw.one_of({20, 40});
    Json clot = rigid_ball(ball, {first + r + 1.1 * ball, 0, -(tube - ball)});
    clot["density"] = kWater;
    Json tube_json = bent_tube(draw, tube, before, bend, angle, 0.1);
    // Level: down a slope the ball would roll on its own.
    tube_json["surface"]["centreline"]["pieces"][1]["direction"] = 0;
    Json wire = instrument(last + 0.02, r, ei, 0.0025, {0, 0, 0}, {1, 0, 0}, fed(first, last));
    RandomScene s{scene_of({{"tube", tube_json}, {"clot", clot}, {"wire", wire}},
                           Json::array({pair("clot", "tube", mu), pair("wire", "tube", wall),
                                        pair("wire", "clot", draw.chance(0.5) ? 0.2 : 0)}),
                           quasi_static(1.0 / steps))};
    s.scene["gravity"] = {0, 0, -kGravity};
    s.drawn = fmt::format("a ball of {:.2g} of the tube, wire {:.2g} of it, mu {:g}, {} steps",
                          ball / tube, r / tube, mu, steps);
    s.same = 1e-4; // walls of tubes are sampled
    // Along a level tube the ball is in balance anywhere: contact to 1e-8 of its weight places it.
    s.units = 1e-6;
    return s;
}

RandomScene draw_wire_on_solid(Draw& draw)
{
    const double a = draw.ratio(0.01, 0.03), r = four_digits(a * draw.real(0.02, 0.08)),
                 ei = draw.ratio(1e-5, 1e-3), e = draw.ratio(3e4, 1e7);
    const bool along = draw.chance(0.5);
    const double slope = along ? draw.real(0.15, 0.5) : draw.real(0.9, 1.5707); // to the face
    const double gap = 0.1 * a, out = 4 * a;
    const double more = four_digits(along ? draw.real(0.5, 1.5) * a : draw.real(0.02, 0.06) * a);
    const int n = draw.whole(2, 4), steps = draw.one_of({5, 10, 20});
    const char* element = any_element(draw);
    const double nu = draw.real(0, 0.45), mu = draw.chance(0.7) ? draw.real(0.1, 0.5) : 0;
    Json mesh = box_mesh({along ? 4 * a : 2 * a, a, a}, {along ? 2 * n : n, n, n}, element,
                         {0, 0, -0.5 * a});
    Json block = draw.chance(0.3) ? neo_hooke(mesh, e, nu) : elastic(mesh, e, nu);
    block["hold"] = Json::array({held("z_min")});
    // The tip comes to the face at its middle, or at its first quarter and then slides along.
    const Vec3 direction = Vec3(std::cos(slope), 0, -std::sin(slope)).unaryExpr(&four_digits);
    const Vec3 contact_point(along ? -a : 0, 0.03 * a, r);
    const Vec3 at = (contact_point - (out + gap) * direction.normalized()).unaryExpr(&four_digits);
    Json wire = instrument(out + 2 * a + 0.02, r, ei, out / draw.whole(12, 20), at, direction,
                           fed(out, four_digits(out + gap + more)));
    RandomScene s{scene_of({{"block", block}, {"wire", wire}}, pair("wire", "block", mu),
                           quasi_static(1.0 / steps))};
    s.drawn = fmt::format("{}, {} cells, at {:.2g} rad, {:.2g} of the block on, mu {:g}, {} steps",
                          element, n, slope, more / a, mu, steps);
    return s;
}

RandomScene draw_wire_among_rods(Draw& draw)
{
    const double r = draw.ratio(2e-4, 6e-4), ei = draw.ratio(5e-5, 1e-3),
                 spacing = draw.real(0.015, 0.025);
    const int count = draw.whole(1, 3), steps = draw.one_of({10, 20, 40});
    const double mu = draw.chance(0.7) ? draw.real(0.05, 0.4) : 0;
    NamedBodies bodies;
    Json contact = Json::array();
    double side = draw.chance(0.5) ? 1 : -1;
    for (int k = 0; k < count; ++k) {
        const double bar = four_digits(r * draw.real(1, 3)), stiff = draw.ratio(1e-3, 1e-1);
        const Vec3 at(spacing * (k + 1), 0, side * (r + bar) * draw.real(0.3, 0.8));
        Json held_rod = straight_rod(at - Vec3(0, 0.03, 0), at + Vec3(0, 0.03, 0), bar, stiff, 12);
        held_rod["hold"] = Json::array({Json{{"set", "start"}}, Json{{"set", "end"}}});
        bodies.push_back({fmt::format("bar{}", k), held_rod});
        contact.push_back(pair("wire", fmt::format("bar{}", k), mu));
        side = -side;
    }
    const double first = 0.008, last = four_digits(spacing * (count + draw.real(0.3, 0.8)));
    bodies.push_back({"wire", instrument(last + 0.02, r, ei, 0.0025, {0, 0.001, 0}, {1, 0, 0},
                                         fed(first, last))});
    RandomScene s{scene_of(bodies, contact, quasi_static(1.0 / steps))};
    s.drawn = fmt::format("{} bars, mu {:g}, {} steps", count, mu, steps);
    return s;
}

RandomScene draw_wires_side_by_side(Draw& draw)
{
    const double r = draw.ratio(2.5e-4, 5e-4), tube = four_digits(r * draw.real(4, 7)),
                 bend = draw.real(0.04, 0.08), angle = draw.real(0.5, 1.5);
    const int count = draw.whole(2, 3), steps = draw.one_of({20, 40});
    const double mu = draw.chance(0.6) ? draw.real(0.05, 0.3) : 0, before = 0.02;
    Json wall = bent_tube(draw, tube, before, bend, angle, 0.1);
    NamedBodies bodies{{"tube", wall}};
    for (int k = 0; k < count; ++k) {
        const double ei = draw.ratio(5e-5, 5e-4),
                     last = four_digits(before + draw.real(0.5, 1.2) * bend * angle),
                     begins = draw.real(0, 0.5), turn = 6.283185307179586 * k / count + 0.3;
        const Vec3 at =
            Vec3(0.001, 1.5 * r * std::cos(turn), 1.5 * r * std::sin(turn)).unaryExpr(&four_digits);
        const Json insertion = Json::array({{0, 0.005}, {begins, 0.005}, {1, last}});
        Json wire = instrument(last + 0.02, r, ei, 0.0025, at, {1, 0, 0},
                               begins > 0 ? insertion : fed(0.005, last));
        if (draw.chance(0.3)) wire["drive"]["twist"] = ramp(draw.real(-2, 2));
        bodies.push_back({fmt::format("wire{}", k), wire});
    }
    RandomScene s{
        scene_of(bodies, all_pairs(bodies, Json::array(), mu), quasi_static(1.0 / steps))};
    s.drawn = fmt::format("{} wires, tube of {:.2g} radii, mu {:g}, {} steps", count, tube / r, mu,
                          steps);
    s.same = 1e-4; // walls of tubes are sampled
    return s;
}

RandomScene draw_wire_loops(Draw& draw)
{
    const double ball = draw.real(0.006, 0.012), r = four_digits(ball * draw.real(0.03, 0.06)),
                 ei = draw.ratio(1e-5, 1e-4), mu = draw.chance(0.8) ? draw.real(0.05, 0.3) : 0;
    const double round = 6.283185307179586 * ball, last = four_digits(round * draw.real(0.6, 1.2)),
                 aside = four_digits(ball * draw.real(0.1, 0.5));
    const int steps = draw.one_of({40, 80});
    const Vec3 at(-four_digits(0.8 * ball), aside, 0);
    const Vec3 direction{1, draw.real(-0.3, 0.3), draw.real(0.05, 0.3)};
    Json wire = instrument(last + 0.01, r, ei, four_digits(ball / 8), at, direction,
                           fed(four_digits(0.3 * ball), last));
    Json wall = {{"kind", "obstacle"},
                 {"side", "inside"},
                 {"surface", {{"generate", "ball"}, {"radius", ball}}}};
    RandomScene s{scene_of({{"ball", wall}, {"wire", wire}},
                           Json::array({pair("wire", "ball", mu), pair("wire", "wire", mu)}),
                           quasi_static(1.0 / steps))};
    s.drawn = fmt::format("{:.2g} rounds of a ball of {:.2g} radii, mu {:g}, {} steps",
                          last / round, ball / r, mu, steps);
    return s;
}

RandomScene draw_body_at_tip(Draw& draw)
{
    const double r = draw.ratio(2e-4, 6e-4), ei = draw.ratio(2e-4, 2e-3),
                 size = four_digits(r * draw.real(4, 10)), density = draw.ratio(800, 3000);
    const char* kind = draw.one_of({"weld", "weld", "ball", "hinge"});
    const std::string shape = draw.one_of({"ball", "box", "cylinder"});
    const std::string under = draw.one_of({"plane", "solid", "rigid"});
    const double first = 0.01, last = draw.real(0.025, 0.045), mu = draw.real(0.05, 0.4);
    const int steps = draw.one_of({10, 20, 40});
    // It hangs from the tip, or is beyond it where the joint is a weld.
    const bool hangs = std::string(kind) != "weld";
    const Vec3 place(hangs ? first : first + 0.5 * size, 0, hangs ? -0.5 * size : 0);
    Json body = shape == "ball"  ? rigid_ball(0.5 * size, place)
                : shape == "box" ? rigid_box(Vec3::Constant(size), place)
                                 : rigid_cylinder(0.5 * size, size, place);
    body["density"] = density;
    const double below = place.z() - 0.5 * size - r; // the table is that far below it
    Json table = plane({0, 0, below}, {0, 0, 1});
    if (under == "solid") {
        const char* element = any_element(draw);
        table = elastic(box_mesh({0.06, 0.02, 0.01}, {6, 2, 2}, element, {0.045, 0, below - 0.005}),
                        draw.ratio(1e5, 1e7), 0.3);
        table["hold"] = Json::array({held("z_min")});
    }
    if (under == "rigid") {
        table = rigid_box({0.06, 0.02, 0.01}, {0.045, 0, below - 0.005});
        table["drive"] = {{"z", ramp(four_digits(draw.real(0, 3) * r))}};
    }
    Json wire =
        instrument(last + 0.02, r, ei, 0.0025, Vec3::Zero(), Vec3(1, 0, 0), fed(first, last));
    if (draw.chance(0.5)) { // a softer tip
        Json tip = wire["segments"][0];
        tip["length"] = first;
        tip["EI"] = four_digits(0.3 * ei);
        wire["segments"].push_back(tip);
    }
    RandomScene s{scene_of({{"table", table}, {"wire", wire}, {"body", body}},
                           Json::array({pair("body", "table", mu), pair("wire", "table", mu)}),
                           quasi_static(1.0 / steps))};
    s.scene["couplings"] = Json::array({joint(kind, "wire", "body", {first, 0, 0}, {0, 1, 0})});
    s.scene["gravity"] = {0, 0, -kGravity};
    s.drawn = fmt::format("a {} of {:.2g} radii on a {} over a {}, mu {:g}, {} steps", shape,
                          0.5 * size / r, kind, under, mu, steps);
    return s;
}

RandomScene draw_wire_in_crowd(Draw& draw)
{
    const double r = draw.ratio(2.5e-4, 6e-4), ei = draw.ratio(1e-4, 1e-3), side = 0.006;
    const int count = draw.whole(2, 4), steps = draw.one_of({10, 20, 40});
    const double mu = draw.chance(0.8) ? draw.real(0.1, 0.4) : 0, height = 0.5 * side;
    NamedBodies bodies{{"floor", plane({0, 0, 0}, {0, 0, 1})}};
    std::string words;
    double x = 0.014;
    // One behind the other along the way; the last may be a wall of its own.
    for (int k = 0; k < count; ++k) {
        const std::string what =
            k + 1 < count ? draw.one_of({"bar", "bar", "solid aside", "free box", "free ball"})
                          : draw.one_of({"solid", "free box", "free ball", "bar"});
        const std::string name = fmt::format("body{}", k);
        const double off = draw.real(0.3, 0.8), hand = draw.chance(0.5) ? 1 : -1;
        Json body;
        if (what == "bar") { // upright, beside the way
            const double bar = four_digits(r * draw.real(1, 3));
            const Vec3 at(x, hand * off * (r + bar), 2 * bar);
            body = straight_rod(at, at + Vec3(0, 0, 4 * side), bar, draw.ratio(1e-3, 1e-1), 12);
            body["hold"] = Json::array({Json{{"set", "start"}}, Json{{"set", "end"}}});
        } else if (what == "solid aside" || what == "solid") {
            const double y = what == "solid" ? 0.1 * side : hand * (0.5 * side + off * r);
            const char* element = any_element(draw);
            const double e = draw.ratio(1e5, 1e7);
            body = elastic(
                box_mesh(Vec3::Constant(side), {2, 2, 2}, element, {x + 0.5 * side, y, 0.5 * side}),
                e, draw.real(0, 0.4));
            body["hold"] = Json::array({held("z_min")});
            x += side;
        } else {
            const Vec3 at(x + 0.5 * side, 0, height);
            body = what == "free box" ? rigid_box(Vec3::Constant(side), at)
                                      : rigid_ball(0.5 * side, at);
            body["density"] = draw.ratio(800, 3000);
            x += side;
        }
        x += draw.real(0.004, 0.012);
        words += (k ? ", " : "") + what;
        bodies.push_back({name, body});
    }
    const bool second = draw.chance(0.3);
    const double last = four_digits(std::min(x, 0.01 + draw.real(0.5, 0.9) * x));
    bodies.push_back({"wire", instrument(last + 0.02, r, ei, 0.0025, {0, 0, height}, {1, 0, 0},
                                         fed(0.008, last))});
    if (second) { // from the side, above
        const Vec3 at(0.012, -0.03, height + 2.5 * r);
        bodies.push_back({"other", instrument(0.08, r, draw.ratio(1e-4, 1e-3), 0.0025, at,
                                              {0, 1, 0}, fed(0.005, 0.034))});
    }
    RandomScene s{scene_of(bodies, pair("*", "*", mu), quasi_static(1.0 / steps))};
    s.scene["gravity"] = {0, 0, -kGravity};
    s.drawn =
        fmt::format("{}{}, mu {:g}, {} steps", words, second ? ", a second wire" : "", mu, steps);
    return s;
}

} // namespace amontons::validation
