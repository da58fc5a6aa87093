// Contacts at rest that are easily lost: large steps, thin bodies, coarse faces, small reaches,
// starts inside.

#include "validation/random/pieces.hpp"

#include <cmath>
#include <fmt/format.h>

namespace amontons::validation {
namespace {

constexpr double kQuarterTurn = 1.5707963267948966;
// Other numbers of steps, frictionless: a thousandth where meshes touch (their contacts appear and
// disappear), the hundredfold of the accuracy where a linear body touches an obstacle.
constexpr double kMeshSteps = 1e-3, kLinearSteps = 1e-6;

/// A number of steps from one to ten.
int any_steps(Draw& draw)
{
    return draw.one_of({1, 2, 3, 5, 10});
}

/// A block below z = 0 that is held at its bottom.
Json block_below(const Vec3& size, const std::array<int, 3>& cells, const char* element, double e,
                 double nu)
{
    Json block = elastic(box_mesh(size, cells, element, {0, 0, -0.5 * size.z()}), e, nu);
    block["hold"] = Json::array({held("z_min")});
    return block;
}

double plane_strain_modulus(const Matter& m)
{
    return m.youngs_modulus / (1 - m.poisson_ratio * m.poisson_ratio);
}

} // namespace

RandomScene draw_box_on_plane(Draw& draw)
{
    const Matter m = any_matter(draw);
    const Vec3 size = m.size * Vec3{draw.real(0.6, 1.5), draw.real(0.6, 1.5), draw.real(0.6, 1.5)};
    const double gap = draw.chance(0.5) ? 0 : four_digits(draw.real(0.01, 0.3) * size.z());
    const double depth = four_digits(draw.real(0.02, 0.3) * size.z()),
                 friction = draw.chance(0.4) ? draw.real(0.1, 0.9) : 0;
    const int steps = any_steps(draw);
    const std::array<int, 3> cells{draw.whole(2, 4), draw.whole(2, 4), draw.whole(2, 4)};
    const char* element = any_element(draw);
    Json box = elastic(box_mesh(size, cells, element, {0, 0, 0.5 * size.z() + gap}),
                       m.youngs_modulus, m.poisson_ratio);
    box["hold"] = Json::array({held("z_max", 0, 0, ramp(-(gap + depth)))});
    RandomScene s{scene_of({{"box", box}, {"plane", plane({0, 0, 0}, {0, 0, 1})}},
                           pair("box", "plane", friction), quasi_static(1.0 / steps))};
    s.drawn = fmt::format("{}, pressed by {:.2g} of its height in {} steps", element,
                          depth / size.z(), steps);
    if (friction == 0) s.steps = kLinearSteps;
    // More than under uniaxial stress, less than under uniaxial strain: that is an admissible
    // motion.
    const double low = m.youngs_modulus * size.x() * size.y() * depth / size.z();
    const double high =
        low * (1 - m.poisson_ratio) / ((1 + m.poisson_ratio) * (1 - 2 * m.poisson_ratio));
    s.right = [=](const WrittenRun& run) {
        return between("the force [N]", pair_force(run, "box", "plane", 2), low * (1 - 1e-3),
                       high * (1 + 1e-3));
    };
    return s;
}

RandomScene draw_rigid_box_in_block(Draw& draw)
{
    const Matter m = any_matter(draw);
    const int n = draw.whole(3, 6);
    const double tool = four_digits(m.size * draw.real(0.15, 0.5)), height = 0.5 * m.size;
    const double depth = four_digits(draw.real(0.01, 0.12) * m.size);
    const int steps = any_steps(draw);
    const char* element = any_element(draw);
    Json box = rigid_box(Vec3::Constant(tool), {0.013 * m.size, 0.011 * m.size, 0.5 * tool});
    drive_down(box, depth);
    RandomScene s{scene_of({{"tool", box},
                            {"block", block_below({m.size, m.size, height}, {n, n, (n + 1) / 2},
                                                  element, m.youngs_modulus, m.poisson_ratio)}},
                           pair("tool", "block"), quasi_static(1.0 / steps))};
    s.drawn = fmt::format("{}, {} cells, tool {:.2g}, depth {:.2g} of the block, {} steps", element,
                          n, tool / m.size, depth / m.size, steps);
    s.steps = kMeshSteps;
    // The softest: a punch on a half-space as wide as the tool's inscribed circle, halved for the
    // free sides.
    const double low = 0.5 * plane_strain_modulus(m) * tool * depth;
    s.right = [=](const WrittenRun& run) {
        return between("the force [N]", pair_force(run, "tool", "block", 2), low, 1e300);
    };
    return s;
}

RandomScene draw_rigid_cylinder_in_block(Draw& draw)
{
    const Matter m = any_matter(draw);
    const int n = draw.whole(4, 7);
    const double radius = four_digits(m.size * draw.real(0.08, 0.2)),
                 length = four_digits(m.size * draw.real(0.1, 0.5));
    const double depth = four_digits(draw.real(0.01, 0.06) * m.size);
    const bool lying = draw.chance(0.5);
    const int steps = any_steps(draw);
    const char* element = any_element(draw);
    Json tool = rigid_cylinder(radius, length,
                               {0.013 * m.size, 0.011 * m.size, lying ? radius : 0.5 * length});
    if (lying) tool["start"]["turn"] = {0, kQuarterTurn, 0};
    drive_down(tool, depth);
    RandomScene s{
        scene_of({{"tool", tool},
                  {"block", block_below({m.size, m.size, 0.5 * m.size}, {n, n, (n + 1) / 2},
                                        element, m.youngs_modulus, m.poisson_ratio)}},
                 pair("tool", "block"), quasi_static(1.0 / steps))};
    s.drawn = fmt::format("{}, {} cells, {}, depth {:.2g} of the block, {} steps", element, n,
                          lying ? "lying" : "upright", depth / m.size, steps);
    s.steps = kMeshSteps;
    // Upright: a flat punch on a half-space, halved for the free sides. Lying: pi/4 E* l d (Hertz,
    // line), halved twice.
    const double low = lying ? 0.2 * plane_strain_modulus(m) * std::min(length, m.size) * depth
                             : plane_strain_modulus(m) * radius * depth;
    s.right = [=](const WrittenRun& run) {
        return between("the force [N]", pair_force(run, "tool", "block", 2), low, 1e300);
    };
    return s;
}

RandomScene draw_paddle(Draw& draw)
{
    const Matter m = any_matter(draw);
    const double length = 6 * m.size,
                 angle = draw.chance(0.5) ? draw.real(2, 3) : draw.real(0.05, 0.2);
    const int steps = draw.one_of({1, 2, 4, 8});
    Json paddle = rigid_box({length, 0.5 * m.size, m.size}, {0, 0, 0});
    paddle["drive"] = {{"axis", {0, 0, 1}}, {"angle", ramp(angle)}};
    const double out = 2.2 * m.size;
    // Beside the paddle's arm, its face just clear of it; or across its way.
    const bool across = angle > 1;
    const Vec3 centre = across ? Vec3(0, out, 0) : Vec3(out, 0.8 * m.size, 0);
    Json block = elastic(box_mesh(Vec3::Constant(m.size), {3, 3, 3}, any_element(draw), centre),
                         m.youngs_modulus, m.poisson_ratio);
    block["hold"] = Json::array({held(across ? "z_min" : "y_max")});
    RandomScene s{scene_of({{"paddle", paddle}, {"block", block}}, pair("paddle", "block"),
                           quasi_static(1.0 / steps))};
    s.drawn = fmt::format("turned by {:.3g} rad in {} steps", angle, steps);
    if (across) s.answer = Answer::done_or_refused;
    const double reach = std::tan(angle) * 1.7 * m.size -
                         0.06 * m.size; // how far its face comes at the block's near end
    if (across || reach > 0)
        s.right = [](const WrittenRun& run) {
            const double force = std::hypot(pair_force(run, "paddle", "block", 0),
                                            pair_force(run, "paddle", "block", 1));
            return force > 0 ? std::string()
                             : "the paddle passed through the block or into it without a force";
        };
    return s;
}

RandomScene draw_small_reach(Draw& draw)
{
    const Matter m = any_matter(draw);
    const double a = 0.2 * m.size, reach = four_digits(m.size * draw.ratio(1e-3, 0.5)),
                 depth = four_digits(a * draw.real(0.02, 0.15));
    const bool lifted = draw.chance(0.5);
    const std::string on = draw.one_of({"block", "plane", "rigid"});
    const int n = draw.whole(2, 4);
    Json up = elastic(box_mesh(Vec3::Constant(a), {n, n, n}, any_element(draw),
                               {0.02 * m.size, 0.01 * m.size, 0.5 * a}),
                      m.youngs_modulus, m.poisson_ratio);
    Json z = ramp(-depth);
    if (lifted) z = Json::array({{0, 0}, {0.5, four_digits(0.25 * a)}, {1, -depth}});
    up["hold"] = Json::array({held("z_max", 0, 0, z)});
    Json low = plane({0, 0, 0}, {0, 0, 1});
    if (on == "block")
        low = block_below({m.size, m.size, a}, {5, 5, 2}, "H8", m.youngs_modulus, m.poisson_ratio);
    if (on == "rigid") {
        low = rigid_box({m.size, m.size, a}, {0, 0, -0.5 * a});
        low["drive"] = {{"z", 0}};
    }
    RandomScene s{scene_of({{"up", up}, {"low", low}}, pair("up", "low"),
                           quasi_static(draw.one_of({0.5, 0.25, 0.1})))};
    s.drawn = fmt::format("on a {}, reach {:.2g} of the block{}", on, reach / a,
                          lifted ? ", lifted first" : "");
    Twin twin{"without reach", s.scene, on == "block" ? kMeshSteps : kLinearSteps};
    s.scene["contact"][0]["reach"] = reach;
    s.twins.push_back(std::move(twin));
    if (on == "block") s.order = kEitherSide;
    s.steps = on == "plane" ? kLinearSteps : kMeshSteps;
    s.right = [](const WrittenRun& run) {
        return pair_force(run, "up", "low", 2) > 0 ? std::string() : "no contact force";
    };
    return s;
}

RandomScene draw_starts_inside(Draw& draw)
{
    const Matter m = any_matter(draw);
    const double a = m.size;
    const int what = draw.whole(0, 4);
    RandomScene s;
    Json tool = rigid_box({0.3 * a, 0.3 * a, 0.3 * a},
                          {0.013 * a, 0.011 * a, four_digits(a * draw.real(-0.1, 0.1))});
    tool["drive"] = {{"x", 0}, {"y", 0}, {"z", 0}};
    const Json block = block_below({a, a, 0.5 * a}, {5, 5, 3}, any_element(draw), m.youngs_modulus,
                                   m.poisson_ratio);
    if (what == 0) {
        s.scene =
            scene_of({{"tool", tool}, {"block", block}}, pair("tool", "block"), quasi_static(1));
        s.drawn = "a rigid box in a block";
    } else if (what == 1) {
        Json up = elastic(
            box_mesh(Vec3::Constant(0.3 * a), {3, 3, 3}, "H8", {0.01 * a, 0.02 * a, 0.05 * a}),
            m.youngs_modulus, m.poisson_ratio);
        up["hold"] = Json::array({held("z_max")});
        s.scene = scene_of({{"up", up}, {"block", block}}, pair("up", "block"), quasi_static(1));
        s.drawn = "a block in a block";
    } else if (what == 2 || what == 3) {
        const double r = 0.5 * a;
        Json ball = rigid_ball(r, {0, 0, r * draw.real(0.3, 0.98)});
        ball["mass"] = 1;
        const double step = draw.ratio(1e-6, 1e-3);
        s.scene = scene_of({{"ball", ball}, {"floor", plane({0, 0, 0}, {0, 0, 1})}},
                           pair("ball", "floor"), dynamic(step, 10 * step));
        s.scene["gravity"] = {0, 0, -kGravity};
        s.drawn = "a moving ball in a plane";
    } else {
        const double r = 0.02 * a;
        Json rod = {
            {"kind", "rod"},
            {"segments",
             Json::array({{{"length", a}, {"radius", r}, {"EI", 1e-4}, {"element", 0.05 * a}}})},
            {"shape",
             {{"points", Json::array({{{"at", {-1.04 * a, 0, 0}}}, {{"at", {-0.04 * a, 0, 0}}}})}}},
            {"hold", Json::array({{{"set", "start"}, {"y", 0}, {"z", 0}, {"x", ramp(0.6 * a)}}})}};
        Json ball = {{"kind", "obstacle"},
                     {"surface", {{"generate", "ball"}, {"radius", 0.3 * a}}}};
        s.scene =
            scene_of({{"rod", rod}, {"ball", ball}}, pair("rod", "ball", 0.1), quasi_static(0.1));
        s.drawn = "a rod's end in a ball";
    }
    s.answer = Answer::bad_input;
    return s;
}

RandomScene draw_ball_through_sheet(Draw& draw)
{
    const Matter m = any_matter(draw);
    const double t = four_digits(m.size * draw.real(0.03, 0.06)),
                 radius = four_digits(m.size * draw.real(0.1, 0.25));
    const double depth = four_digits(t * draw.real(0.5, 4));
    const int steps = draw.one_of({1, 2, 4, 8, 16}), n = draw.whole(5, 8);
    const char* element = draw.one_of({"T4", "H8"});
    Json sheet = elastic(box_mesh({m.size, m.size, t}, {n, n, 1}, element, {0, 0, -0.5 * t}),
                         m.youngs_modulus, m.poisson_ratio);
    sheet["motion"] = "corotational";
    sheet["hold"] = Json::array({held("x_min"), held("x_max"), held("y_min"), held("y_max")});
    Json ball = rigid_ball(radius, {0.011 * m.size, 0.007 * m.size, radius});
    drive_down(ball, depth);
    RandomScene s{scene_of({{"ball", ball}, {"sheet", sheet}}, pair("ball", "sheet"),
                           quasi_static(1.0 / steps))};
    s.drawn = fmt::format("{}, {} cells, by {:.2g} of the thickness in {} steps", element, n,
                          depth / t, steps);
    // Half of a clamped square plate under a force in its middle: F = D w / (0.0056 a^2)
    // (Timoshenko, plates).
    const double stiff =
        m.youngs_modulus * t * t * t / (12 * (1 - m.poisson_ratio * m.poisson_ratio));
    const double low = 0.5 * stiff * depth / (0.0056 * m.size * m.size);
    s.right = [=](const WrittenRun& run) {
        return between("the force [N]", pair_force(run, "ball", "sheet", 2), low, 1e300);
    };
    s.steps = kMeshSteps;
    return s;
}

namespace {

/// Two bars with ends held, crosswise, the upper driven down.
RandomScene crossing(Draw& draw, const Matter& m, int elements, double gap, double depth,
                     double step)
{
    const double t = 0.05 * m.size;
    const int other = std::max(1, elements - draw.whole(0, 2));
    Json up = elastic(box_mesh({m.size, t, t}, {elements, 1, 1}, "H8", {0, 0, 0.5 * t + gap}),
                      m.youngs_modulus, m.poisson_ratio);
    up["hold"] = Json::array(
        {held("x_min", 0, 0, ramp(-(gap + depth))), held("x_max", 0, 0, ramp(-(gap + depth)))});
    Json low = elastic(
        box_mesh({t, m.size, t}, {1, other, 1}, "H8", {0.003 * m.size, 0.002 * m.size, -0.5 * t}),
        m.youngs_modulus, m.poisson_ratio);
    low["hold"] = Json::array({held("y_min"), held("y_max")});
    return {scene_of({{"up", up}, {"low", low}}, pair("up", "low"), quasi_static(step))};
}

} // namespace

RandomScene draw_crossing_bars(Draw& draw)
{
    const Matter m = any_matter(draw);
    const double t = 0.05 * m.size, depth = four_digits(t * draw.real(0.05, 0.5));
    const int elements = draw.whole(2, 12);
    const double step = draw.one_of({1.0, 0.5, 0.25, 0.1});
    RandomScene s = crossing(draw, m, elements, four_digits(0.02 * t), depth, step);
    s.drawn = fmt::format("{} elements, depth {:.2g} of the thickness, step {:g}", elements,
                          depth / t, step);
    s.steps = kMeshSteps;
    s.order = kEitherSide;
    Twin twin{"reach of half a thickness", s.scene, 3e-2};
    twin.scene["contact"][0]["reach"] = four_digits(0.5 * t);
    s.twins.push_back(std::move(twin));
    // Clamped bars in series, each 192 EI / L^3, halved; and no energy but the work.
    const double low =
        0.25 * 192 * m.youngs_modulus * std::pow(t, 4) / 12 / std::pow(m.size, 3) * depth;
    s.right = [=](const WrittenRun& run) {
        return between("the force [N]", pair_force(run, "up", "low", 2), low, 1e300);
    };
    return s;
}

RandomScene draw_edge_through_edge(Draw& draw)
{
    const Matter m = any_matter(draw);
    const double t = 0.05 * m.size, gap = four_digits(t * draw.real(0.5, 6)),
                 depth = four_digits(t * draw.real(2, 6));
    const int elements = draw.whole(1, 2);
    const double step = draw.one_of({0.25, 0.5, 1.0});
    RandomScene s = crossing(draw, m, elements, gap, depth, step);
    s.drawn = fmt::format("gap {:.2g}, depth {:.2g} of the thickness", gap / t, depth / t);
    s.answer = Answer::done_or_refused;
    s.right = [](const WrittenRun& run) {
        return pair_force(run, "up", "low", 2) > 0 ? std::string()
                                                   : "one bar passed through the other";
    };
    s.order = kEitherSide;
    return s;
}

RandomScene draw_two_plates(Draw& draw)
{
    const Matter m = any_matter(draw);
    const double a = four_digits(m.size * draw.real(0.02, 0.1)),
                 b = four_digits(m.size * draw.real(0.02, 0.1));
    const double depth = four_digits(std::min(a, b) * draw.real(0.02, 0.2));
    const int n = draw.whole(4, 6);
    Json up = elastic(box_mesh({0.5 * m.size, 0.4 * m.size, a}, {n, n, 1}, "H8",
                               {0.03 * m.size, 0.015 * m.size, 0.5 * a + 0.0005 * m.size}),
                      m.youngs_modulus, m.poisson_ratio);
    const Json z = ramp(-four_digits(depth + 0.0005 * m.size));
    up["hold"] = Json::array({held("x_min", 0, 0, z), held("x_max", 0, 0, z)});
    Json low = elastic(box_mesh({m.size, m.size, b}, {n + 2, n + 2, 1}, "H8", {0, 0, -0.5 * b}),
                       m.youngs_modulus, m.poisson_ratio);
    low["hold"] = Json::array({held("x_min"), held("x_max"), held("y_min"), held("y_max")});
    RandomScene s{scene_of({{"up", up}, {"low", low}}, pair("up", "low"),
                           quasi_static(draw.one_of({1.0, 0.5, 0.25})))};
    s.drawn = fmt::format("thicknesses {:.2g} and {:.2g}, depth {:.2g} of the thinner", a / m.size,
                          b / m.size, depth / std::min(a, b));
    s.steps = kMeshSteps;
    s.order = kEitherSide;
    Twin twin{"reach of 0.4 of the thinner", s.scene, 3e-2};
    twin.scene["contact"][0]["reach"] = four_digits(0.4 * std::min(a, b));
    s.twins.push_back(std::move(twin));
    s.right = [](const WrittenRun& run) {
        return pair_force(run, "up", "low", 2) > 0 ? std::string() : "no contact force";
    };
    return s;
}

RandomScene draw_round_solid_on_block(Draw& draw)
{
    const Matter m = any_matter(draw);
    const bool ball = draw.chance(0.5);
    const double r = 0.2 * m.size, depth = four_digits(r * draw.real(0.02, 0.1));
    const int around = draw.whole(6, 12), n = draw.whole(3, 10);
    const char* element = ball ? draw.one_of({"T4", "T10"}) : any_element(draw);
    Json mesh = {{"generate", "ball"}, {"radius", r}, {"around", around}, {"element", element}};
    if (!ball)
        mesh = {{"generate", "cylinder"},
                {"radius", r},
                {"length", 0.6 * m.size},
                {"axis", {0, 1, 0}},
                {"centre", {0, -0.3 * m.size, 0}},
                {"around", around},
                {"along", 4},
                {"element", element}};
    Json round = elastic(mesh, m.youngs_modulus, m.poisson_ratio);
    round["start"] = {{"place", list_of({0.011 * m.size, 0.007 * m.size, r})}};
    round["hold"] = Json::array({held("all", 0, 0, ramp(-depth))});
    RandomScene s{
        scene_of({{"round", round},
                  {"block", block_below({m.size, m.size, 0.5 * m.size}, {n, n, (n + 1) / 2}, "H8",
                                        m.youngs_modulus, m.poisson_ratio)}},
                 pair("round", "block"), quasi_static(draw.one_of({1.0, 0.5, 0.2})))};
    s.drawn = fmt::format("a {} of {} on {} cells, depth {:.2g} of its radius",
                          ball ? "ball" : "roller", element, n, depth / r);
    s.order = kEitherSide;
    s.steps = kMeshSteps;
    // Hertz of a rigid ball on a half-space; of a roller pi/4 E* l d halved. 0.7: free sides,
    // facets above the ball.
    // So far the chord of a facet may stand off: of T10 each face has two.
    const double half = (std::string(element) == "T10" ? 1 : 2) * kQuarterTurn / around;
    const double way = std::max(0.0, depth - r * (1 - std::cos(half)));
    constexpr double kHeld = 0.1; // of the depth: a mesh that comes in farther
    const auto low_of = [=, stiff = plane_strain_modulus(m)](double d) {
        return ball ? 0.7 * 4 / 3 * stiff * std::sqrt(r) * std::pow(d, 1.5)
                    : 0.3 * stiff * 0.6 * m.size * d;
    };
    s.right = [=](const WrittenRun& run) {
        // What of the mesh itself comes into the block must be held.
        const std::vector<double>& points =
            run.frames.front().parts.at("round").get("Points/points").values;
        double lowest = 1e300;
        for (std::size_t k = 2; k < points.size(); k += 3)
            lowest = std::min(lowest, points[k]);
        const double least = depth - lowest > kHeld * depth ? 1e-12 * low_of(depth) : 0;
        return between("the force [N]", pair_force(run, "round", "block", 2),
                       std::max(low_of(way), least), 1e300);
    };
    return s;
}

RandomScene draw_rigid_ball_on_block(Draw& draw)
{
    Matter m = any_matter(draw);
    const bool tight = draw.chance(0.2);
    if (tight) m.poisson_ratio = draw.one_of({0.499, 0.4999});
    const double r = m.size * draw.real(0.15, 0.4), depth = four_digits(r * draw.real(0.02, 0.15));
    const int n = draw.whole(3, 7), steps = any_steps(draw);
    const char* element = any_element(draw);
    Json ball = rigid_ball(four_digits(r), {0.013 * m.size, 0.011 * m.size, r});
    drive_down(ball, depth);
    RandomScene s{
        scene_of({{"ball", ball},
                  {"block", block_below({m.size, m.size, 0.5 * m.size}, {n, n, (n + 1) / 2},
                                        element, m.youngs_modulus, m.poisson_ratio)}},
                 pair("ball", "block"), quasi_static(1.0 / steps))};
    s.drawn = fmt::format("{}, {} cells, nu {:g}, depth {:.2g} of the radius, {} steps", element, n,
                          m.poisson_ratio, depth / r, steps);
    s.steps = kMeshSteps;
    const double low = 0.7 * 4 / 3 * plane_strain_modulus(m) * std::sqrt(r) * std::pow(depth, 1.5);
    s.right = [=](const WrittenRun& run) {
        return between("the force [N]", pair_force(run, "ball", "block", 2), low, 1e300);
    };
    return s;
}

} // namespace amontons::validation
