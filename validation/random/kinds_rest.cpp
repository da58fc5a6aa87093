// Solids and rigid bodies at rest: friction, weight, joints, holds, loads.

#include "validation/random/geometry.hpp"
#include "validation/random/pieces.hpp"

#include <cmath>
#include <fmt/format.h>

namespace amontons::validation {

RandomScene draw_disc_on_bed(Draw& draw)
{
    const Matter m = any_matter(draw);
    const double height = 0.4 * m.size, depth = four_digits(height * draw.real(0.01, 0.05)),
                 slide = four_digits(depth * draw.real(0, 4)),
                 friction = draw.chance(0.6) ? draw.real(0.1, 0.5) : 0;
    const bool box = draw.chance(0.4);
    const char* element = any_element(draw);
    Json bed =
        elastic(box_mesh({m.size, 0.8 * m.size, height}, {6, 5, 3}, element, {0, 0, -0.5 * height}),
                m.youngs_modulus, m.poisson_ratio);
    bed["hold"] = Json::array({held("z_min")});
    bed["motion"] = draw.one_of({"linear", "corotational"});
    const double wide = four_digits(m.size * draw.real(0.12, 0.3));
    const Vec3 place(four_digits(m.size * draw.real(-0.1, 0.1)), 0, 0.25 * m.size);
    Json tool = box ? rigid_box({2 * wide, 2 * wide, 0.5 * m.size}, place)
                    : rigid_cylinder(wide, 0.5 * m.size, place);
    tool["drive"] = {{"z", ramp(-depth, 0.5)}, {"x", Json::array({{0.5, 0}, {1, slide}})}};
    RandomScene s{scene_of({{"tool", tool}, {"bed", bed}}, pair("tool", "bed", friction),
                           quasi_static(draw.one_of({0.25, 0.125})))};
    s.drawn = fmt::format("{} on {}, mu {:g}, depth {:.2g} of the bed, slid by {:.2g} of it",
                          box ? "box" : "disc", element, friction, depth / height, slide / height);
    if (friction == 0 && slide == 0) s.steps = 1e-3;
    const double low =
        0.5 * m.youngs_modulus / (1 - m.poisson_ratio * m.poisson_ratio) * wide * depth;
    s.right = [=](const WrittenRun& run) {
        return between("the force [N]", pair_force(run, "tool", "bed", 2), low, 1e300);
    };
    return s;
}

RandomScene draw_die_slides(Draw& draw)
{
    const double unit = draw.ratio(0.05, 2), e = draw.ratio(1e3, 1e7), nu = draw.real(0.2, 0.4),
                 friction = draw.real(0.1, 0.4);
    const double thick = 0.25 * unit, depth = four_digits(unit * draw.real(0.01, 0.03)),
                 slide = four_digits(unit * draw.real(0.05, 0.2));
    const int n = draw.whole(4, 6);
    Json die = neo_hooke(box_mesh({0.5 * unit, thick, 0.4 * unit}, {n, 1, 3}, "H8",
                                  {0.45 * unit, 0.5 * thick, 0.7 * unit}),
                         3 * e, nu);
    die["hold"] = Json::array(
        {Json{{"set", "all"}, {"y", 0}}, Json{{"set", "z_max"},
                                              {"x", Json::array({{0, 0}, {1, 0}, {2, slide}})},
                                              {"z", ramp(-depth)}}});
    Json block = neo_hooke(box_mesh({1.2 * unit, thick, 0.5 * unit}, {2 * n + 1, 1, 3}, "H8",
                                    {0.6 * unit, 0.5 * thick, 0.25 * unit}),
                           e, nu);
    block["hold"] =
        Json::array({Json{{"set", "all"}, {"y", 0}}, Json{{"set", "z_min"}, {"x", 0}, {"z", 0}}});
    Json contact = pair("die", "block", friction);
    const bool named = draw.chance(0.5);
    if (named) contact["surfaces"] = {"z_min", "z_max"};
    RandomScene s{scene_of({{"die", die}, {"block", block}}, contact, quasi_static(0.1, 2))};
    s.drawn = fmt::format("mu {:g}, slid by {:.2g} of the die{}", friction, slide / unit * 2,
                          named ? ", surfaces named" : "");
    s.order = kEitherSide;
    return s;
}

RandomScene draw_free_block(Draw& draw)
{
    const Matter m = any_matter(draw);
    const double density =
        four_digits(m.youngs_modulus * draw.real(1e-4, 3e-3) / (kGravity * m.size));
    // Without friction a block on another that bends has no balance: it slides off.
    const bool two = draw.chance(0.5);
    const double friction = !two && draw.chance(0.5) ? 0 : draw.real(0.2, 0.8);
    const char* element = any_element(draw);
    const Vec3 size = m.size * Vec3{1, draw.real(0.7, 1.3), draw.real(0.5, 1)};
    const int n = draw.whole(2, 3);
    NamedBodies bodies{{"floor", plane({0, 0, 0}, {0, 0, 1})}};
    Json contact = Json::array({pair("a", "floor", friction)});
    Json a = elastic(box_mesh(size, {n, n, n}, element, {0, 0, 0.5 * size.z()}), m.youngs_modulus,
                     m.poisson_ratio);
    a["density"] = density;
    bodies.push_back({"a", a});
    if (two) {
        Json b =
            elastic(box_mesh(0.7 * size, {2, 2, 2}, element, {0.05 * m.size, 0, 1.35 * size.z()}),
                    four_digits(m.youngs_modulus * draw.ratio(0.1, 100)), m.poisson_ratio);
        b["density"] = density;
        bodies.push_back({"b", b});
        contact.push_back(pair("b", "a", friction));
    }
    RandomScene s{scene_of(bodies, contact, quasi_static(draw.one_of({1.0, 0.5})))};
    s.scene["gravity"] = {0, 0, -kGravity};
    s.drawn = fmt::format("{}, {}, mu {:g}", two ? "two blocks" : "one block", element, friction);
    if (two) s.order = kEitherSide;
    return s;
}

RandomScene draw_rigid_stack(Draw& draw)
{
    const double a = draw.ratio(0.01, 2), friction = draw.real(0.3, 0.9),
                 density = draw.ratio(100, 1e4);
    const int count = draw.whole(1, 3);
    NamedBodies bodies{{"floor", plane({0, 0, 0}, {0, 0, 1})}};
    double z = 0;
    for (int i = 0; i < count; ++i) {
        const double h = four_digits(a * draw.real(0.3, 1)),
                     aside = i ? four_digits(a * draw.real(-0.15, 0.15)) : 0;
        Json body =
            draw.chance(0.3)
                ? rigid_cylinder(four_digits(0.5 * a), h, {aside, 0, z + 0.5 * h})
                : rigid_box({a, four_digits(a * draw.real(0.8, 1.2)), h}, {aside, 0, z + 0.5 * h});
        body["density"] = density;
        if (i == count - 1 && draw.chance(0.5)) // less than what slides or tips it
            body["force"] = {four_digits(0.2 * friction * density * a * a * h * 0.6 * kGravity), 0,
                             0};
        bodies.push_back({fmt::format("body{}", i), body});
        z += h;
    }
    RandomScene s{scene_of(bodies, pair("*", "*", friction), quasi_static(1))};
    s.scene["gravity"] = {0, 0, -kGravity};
    s.drawn = fmt::format("{} bodies, mu {:g}", count, friction);
    return s;
}

RandomScene draw_weld_on_solid(Draw& draw)
{
    const Matter m = any_matter(draw);
    const int n = 2 * draw.whole(1, 2) + 1;
    const double down = four_digits(m.size * draw.real(0.005, 0.03));
    Json pad = elastic(box_mesh(Vec3::Constant(m.size), {n, n, n}, any_element(draw), {0, 0, 0}),
                       m.youngs_modulus, m.poisson_ratio);
    pad["start"] = {{"place", list_of({0, 0, 0.5 * m.size})}};
    Json arm = rigid_box({m.size, m.size, 0.3 * m.size}, {0, 0, 1.15 * m.size});
    arm["drive"] = {{"z", ramp(-down)}};
    const double friction = draw.real(0.3, 0.9);
    RandomScene s{scene_of({{"floor", plane({0, 0, 0}, {0, 0, 1})}, {"pad", pad}, {"arm", arm}},
                           pair("pad", "floor", friction), quasi_static(draw.one_of({1.0, 0.5})))};
    s.scene["couplings"] = Json::array({{{"kind", "weld"},
                                         {"between", {"pad", "arm"}},
                                         {"at", list_of({0, 0, m.size})},
                                         {"set", "z_max"}}});
    s.drawn = fmt::format("{} cells, pressed by {:.2g} of the pad", n, down / m.size);
    // A weld holds the pad's top as a punch: no less than half of uniaxial stress.
    const double low = 0.5 * m.youngs_modulus * m.size * down;
    s.right = [=](const WrittenRun& run) {
        return between("the force [N]", pair_force(run, "pad", "floor", 2), low, 1e300);
    };
    return s;
}

RandomScene draw_turned_holds(Draw& draw)
{
    const Matter m = any_matter(draw);
    const Vec3 move = draw.shift(0.05 * m.size);
    const int n = draw.whole(1, 3);
    const bool free = draw.chance(0.5);
    Json block = elastic(box_mesh(Vec3::Constant(m.size), {n, n, n}, any_element(draw), {0, 0, 0}),
                         m.youngs_modulus, m.poisson_ratio);
    block["start"] = {{"turn", list_of(draw.rotation())}, {"place", list_of(draw.shift(m.size))}};
    Json hold = held("z_max", ramp(move.x()), ramp(move.y()), ramp(move.z()));
    if (free) hold.erase("x");
    block["hold"] = Json::array({hold, held("z_min")});
    RandomScene s{
        scene_of({{"block", block}}, Json::array(), quasi_static(draw.one_of({1.0, 0.5})))};
    s.drawn = fmt::format("{} cells{}", n, free ? ", one axis free" : "");
    s.steps = 1e-6;
    s.right = [=](const WrittenRun& run) -> std::string {
        // The nodes that are highest along the block's own z moved as they were reported, along the
        // world's axes.
        const VtkText& end = run.frames.back().parts.at("block");
        const RigidMotion start = start_of(run.body.at("block"));
        for (std::size_t i = 0; i < end.points(); ++i) {
            const Vec3 moved = end.get("PointData/displacement").vector(i);
            const Vec3 own = start.back(end.get("Points/points").vector(i) - moved);
            if (own.z() < 0.5 * m.size * (1 - 1e-9)) continue;
            for (int k = free ? 1 : 0; k < 3; ++k)
                if (std::abs(moved[k] - move[k]) > 1e-9 * m.size)
                    return fmt::format(
                        "a held node moved by {:.6g} m along {}, reported are {:.6g} m", moved[k],
                        "xyz"[k], move[k]);
        }
        return "";
    };
    return s;
}

RandomScene draw_loaded_solid(Draw& draw)
{
    const Matter m = any_matter(draw);
    const Vec3 size = m.size * Vec3(1, 0.3, 0.2);
    const char* element = any_element(draw);
    const int law = draw.whole(0, 2); // linear, corotational, neo-Hookean
    const std::array<int, 3> cells{draw.whole(4, 7), 2, 2};
    Json mesh = box_mesh(size, cells, element, {0, 0, 0});
    Json beam = law == 2 ? neo_hooke(mesh, m.youngs_modulus, m.poisson_ratio)
                         : elastic(mesh, m.youngs_modulus, m.poisson_ratio);
    if (law == 1) beam["motion"] = "corotational";
    beam["hold"] = Json::array({held("x_min")});
    // A traction that bends the beam by a share of its length: w = F l^3 / (3 EI).
    const double bend = draw.ratio(0.01, draw.chance(0.35) ? 1.5 : 0.15);
    const double traction =
        four_digits(bend * m.youngs_modulus * std::pow(size.z(), 2) / (4 * m.size * m.size));
    beam["loads"] = Json::array(
        {{{"set", "x_max"},
          {"traction", list_of(traction * Vec3{draw.real(-0.5, 0.5), draw.real(-0.5, 0.5), -1})},
          {"over", ramp(1)}}});
    if (draw.chance(0.4))
        beam["loads"].push_back(
            {{"set", "z_max"}, {"pressure", ramp(four_digits(0.2 * traction))}});
    const bool weight = draw.chance(0.4), touches = draw.chance(0.6);
    if (weight) beam["density"] = four_digits(0.1 * traction / (kGravity * m.size));
    NamedBodies bodies{{"beam", beam}};
    Json contact = Json::array();
    if (touches) {
        bodies.push_back({"post", plane({0, 0, -0.5 * size.z() - 0.005 * m.size}, {0, 0, 1})});
        contact.push_back(pair("beam", "post", draw.chance(0.5) ? draw.real(0.1, 0.5) : 0));
    }
    RandomScene s{scene_of(bodies, contact, quasi_static(draw.one_of({0.25, 0.125})))};
    if (weight) s.scene["gravity"] = {0, 0, -kGravity};
    s.drawn = fmt::format("{}, {}, bent by {:.2g} of its length{}{}", element,
                          law == 2   ? "neo_hooke"
                          : law == 1 ? "corotational"
                                     : "linear",
                          bend, weight ? ", heavy" : "", touches ? ", touches" : "");
    if (law == 0 && !touches)
        s.right = [=](const WrittenRun& run) -> std::string {
            const double w = run.history.last("beam_max_displacement");
            if (w < 0.5 * m.size || run.warnings() > 0) return "";
            return fmt::format("a linear beam is bent by {:.2g} of its length without a warning",
                               w / m.size);
        };
    return s;
}

RandomScene draw_named_sets(Draw& draw)
{
    const double a = draw.ratio(0.01, 1), down = four_digits(a * draw.real(0.005, 0.05));
    const double e = draw.ratio(1e4, 1e8);
    std::string names[2];
    for (std::string& name : names)
        name = draw.one_of({"bottom, glued", "top <a> '`echo x`", "plain", "a b", "x_y,", "(1;2)",
                            "50 %", "e=mc^2 & co"});
    if (names[0] == names[1]) names[1] += " 2";
    std::string msh =
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n3\n3 1 \"volume\"\n2 6 \"" +
        names[0] + "\"\n2 7 \"" + names[1] + "\"\n$EndPhysicalNames\n$Nodes\n8\n";
    for (int i = 0; i < 8; ++i)
        msh += fmt::format("{} {} {} {}\n", i + 1, i & 1 ? a : 0, i & 2 ? a : 0, i & 4 ? a : 0);
    msh += "$EndNodes\n$Elements\n3\n1 5 2 1 1 1 2 4 3 5 6 8 7\n2 3 2 6 6 1 3 4 2\n3 3 2 7 7 5 6 8 "
           "7\n$EndElements\n";
    Json block = elastic({{"file", "sets.msh"}}, e, draw.real(0, 0.4));
    block["hold"] =
        Json::array({held(names[0].c_str()), held(names[1].c_str(), 0, 0, ramp(-down))});
    RandomScene s{
        scene_of({{"block", block}}, Json::array(), quasi_static(draw.one_of({1.0, 0.25})))};
    s.files = {{"sets.msh", msh}};
    s.drawn = fmt::format("\"{}\" and \"{}\"", names[0], names[1]);
    s.answer = Answer::done_or_bad_input;
    s.steps = 1e-6;
    return s;
}

} // namespace amontons::validation
