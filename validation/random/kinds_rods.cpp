// Rods and instruments.

#include "validation/random/pieces.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace amontons::validation {
namespace {

constexpr double kPi = 3.141592653589793;

/// Tension of an elastic catenary between two supports of the same height [N].
/// @param weight  per length free of load [N/m]
double catenary_pull(double length, double span, double weight, double ea)
{
    // span = 2 H/w asinh(w l / 2H) + H l / EA grows with H where the rope is longer than it is far:
    // bisection.
    double low = 1e-9 * weight * length, high = 1e6 * (weight * length + ea);
    for (int i = 0; i < 300; ++i) {
        const double h = std::sqrt(low * high);
        const double reach =
            2 * h / weight * std::asinh(weight * length / (2 * h)) + h * length / ea;
        (reach < span ? low : high) = h;
    }
    return high;
}

} // namespace

RandomScene draw_rope(Draw& draw)
{
    const double length = draw.ratio(0.2, 5), radius = 0.001 * length,
                 density = draw.ratio(1000, 9000);
    const double weight = density * kPi * radius * radius * kGravity;
    // What bends it is small beside its weight; what it stretches by is drawn.
    const double ei = four_digits(weight * length * length * length * draw.ratio(1e-6, 1e-3)),
                 ea = four_digits(weight * length * draw.ratio(1e2, 1e5));
    const double span = four_digits(length * draw.one_of({0.8, 0.9, 0.98, 1.0}));
    const bool supported = draw.chance(0.3);
    const int elements = draw.whole(30, 60);
    Json segments = Json::array({{{"length", length},
                                  {"radius", radius},
                                  {"EI", ei},
                                  {"EA", ea},
                                  {"density", density},
                                  {"element", length / elements}}});
    Json rope = rod(segments, {{"start", {-0.5 * length, 0, 0}}, {"normal", {0, 0, 1}}});
    rope["plane"] = {0, 1, 0};
    const double shorter = length - span;
    rope["hold"] = Json::array({Json{{"set", "start"}, {"turns", "free"}},
                                Json{{"set", "end"},
                                     {"turns", "free"},
                                     {"x", shorter > 0 ? ramp(-shorter) : Json(0)},
                                     {"y", 0},
                                     {"z", 0}}});
    NamedBodies bodies{{"rope", rope}};
    Json contact = Json::array();
    if (supported) {
        bodies.push_back({"floor", plane({0, 0, -0.1 * length}, {0, 0, 1})});
        contact.push_back(pair("rope", "floor", draw.chance(0.5) ? 0.3 : 0));
    }
    RandomScene s{scene_of(bodies, contact, quasi_static(draw.one_of({1.0, 0.25})))};
    s.scene["gravity"] = {0, 0, -kGravity};
    s.drawn = fmt::format("span {:.3g} of its length, EI {:.2g}, EA {:.2g} of its weight{}",
                          span / length, ei / (weight * length * length * length),
                          ea / (weight * length), supported ? ", over a floor" : "");
    // The catenary, beside it what the bending stiffness changes: sqrt(EI / (H l^2)) at each end.
    const double pull = catenary_pull(length, span, weight, ea),
                 allowed = 0.02 + 4 * std::sqrt(ei / (pull * length * length));
    if (!supported && allowed < 0.3)
        s.right = [=](const WrittenRun& run) {
            return between("the pull [N]", std::abs(run.history.last("rope_end_force_x")),
                           pull * (1 - allowed), pull * (1 + allowed));
        };
    s.same = 1e-5;
    return s;
}

RandomScene draw_rod_in_sheath(Draw& draw)
{
    const bool twist = draw.chance(0.4);
    RandomScene s;
    if (twist) {
        const double l = draw.ratio(0.02, 0.2), r = 0.0036 * l, ei = draw.ratio(1e-7, 1e-5),
                     angle = draw.real(0.5, 1.6);
        Json shaft = {{"length", l}, {"radius", r}, {"EI", ei}, {"element", 0.02 * l}}, tip = shaft;
        tip["length"] = 0.2 * l;
        tip["curvature"] = four_digits(draw.real(1, 5) / l);
        Json wire =
            rod(Json::array({shaft, tip}), {{"stress_free", false},
                                            {"normal", {1, 0, 0}},
                                            {"points", points({0, 0, -1.2 * l}, {0, 0, 0})}});
        wire["fed"] = Json::array({{0, 0.02 * l}, {1, 0.4 * l}});
        wire["hold"] = Json::array({Json{
            {"set", "start"}, {"turns", "held"}, {"axis", {0, 0, 1}}, {"angle", ramp(angle)}}});
        s.scene = scene_of({{"wire", wire}}, Json::array(), quasi_static(0.05));
        s.drawn = fmt::format("turned by {:.3g} rad at its start", angle);
        s.answer = Answer::done_or_bad_input; // refused until rods have a sheath that turns
        s.right = [](const WrittenRun& run) -> std::string {
            // The tip bends in a plane that the turn of the start turns: it leaves the plane it
            // would have without.
            const Vec3 tip = run.history.vector("wire_end_tangent", run.history.rows.size() - 1);
            const Vec3 first = run.history.vector("wire_end_tangent", 0);
            const double off = std::hypot(tip.x(), tip.y());
            const double turned =
                std::abs(std::atan2(tip.y(), tip.x()) - std::atan2(first.y(), first.x()));
            return off > 1e-3 && turned < 1e-3 ? "the turn at its start did not turn the tip" : "";
        };
        return s;
    }
    const double out = draw.ratio(0.1, 2), ei = draw.ratio(0.01, 10),
                 force = four_digits(ei / (out * out) * draw.real(0.1, 1));
    Json wire = rod(Json::array({{{"length", 2.5 * out},
                                  {"radius", 0.001 * out},
                                  {"EI", ei},
                                  {"EA", four_digits(1e6 * ei / (out * out))},
                                  {"element", 0.025 * out}}}),
                    {{"points", points({-1.5 * out, 0, 0}, {out, 0, 0})}});
    wire["plane"] = {0, 0, 1};
    wire["fed"] = Json::array({{0, out}, {1, out}});
    wire["loads"] =
        Json::array({Json{{"set", "end"}, {"force", {0, -force, 0}}, {"over", ramp(1)}}});
    s.scene = scene_of({{"rod", wire}}, Json::array(), quasi_static(0.1));
    s.drawn = fmt::format("a force of {:.2g} EI / l^2 across its end", force * out * out / ei);
    // The sheath is pushed back by what bends at its end: M^2 / (2 EI), M = F x of the end.
    s.right = [=](const WrittenRun& run) {
        const double x = run.history.last("rod_end_x"), push = -std::pow(force * x, 2) / (2 * ei);
        return between("the push force [N]",
                       run.history.last(run.history.column("rod_push_force") >= 0 ? "rod_push_force"
                                                                                  : "push_force"),
                       1.05 * push, 0.95 * push);
    };
    return s;
}

RandomScene draw_rod_between_plates(Draw& draw)
{
    const double l = draw.ratio(0.1, 3), ei = draw.ratio(0.1, 10), r = 0.001 * l,
                 play = four_digits(l * draw.real(5e-4, 3e-3));
    const double shorter = four_digits(l * draw.ratio(5e-5, 5e-4)), y = r + play + 0.05 * l;
    Json top = rigid_box({1.2 * l, 0.1 * l, 0.1 * l}, {0.5 * l, y, 0}),
         bottom = rigid_box({1.2 * l, 0.1 * l, 0.1 * l}, {0.5 * l, -y, 0});
    top["drive"] = {{"x", 0}};
    bottom["drive"] = {{"x", 0}};
    Json wire = rod(Json::array({{{"length", l},
                                  {"radius", r},
                                  {"EI", ei},
                                  {"EA", four_digits(1e7 * ei / (l * l))},
                                  {"element", l / 50}}}),
                    {{"points", points({0, 0, 0}, {l, 0, 0})}});
    wire["plane"] = {0, 0, 1};
    wire["hold"] =
        Json::array({Json{{"set", "start"}, {"x", ramp(shorter)}, {"y", 0}}, Json{{"set", "end"}}});
    const double euler = 4 * kPi * kPi * ei / (l * l); // clamped ends
    wire["loads"] =
        Json::array({Json{{"at", 0.5 * l}, {"force", {0, four_digits(1e-3 * euler), 0}}}});
    RandomScene s{scene_of({{"top", top}, {"bottom", bottom}, {"rod", wire}},
                           Json::array({pair("rod", "top"), pair("rod", "bottom")}),
                           quasi_static(draw.one_of({0.5, 0.25, 0.1})))};
    s.drawn = fmt::format("play {:.2g}, shortened by {:.2g} of its length", play / l, shorter / l);
    s.right = [=](const WrittenRun& run) -> std::string {
        const double push = std::abs(run.history.last("rod_end_force_x")),
                     negative = run.history.last("rod_negative");
        if (negative == 0) return "";
        return fmt::format("a balance with {:g} negative modes, pushed by {:.3g} times Euler's "
                           "load, is no stable one",
                           negative, push / euler);
    };
    return s;
}

RandomScene draw_bent_rod(Draw& draw)
{
    const double l = draw.ratio(0.02, 1), ei = draw.ratio(1e-7, 1),
                 curvature = four_digits(draw.real(0.5, 3) / l);
    const bool placed = draw.chance(0.6), free = !placed || draw.chance(0.5);
    Json shape = {{"start", {0, 0, 0}}, {"direction", {0, 0, 1}}, {"normal", {1, 0, 0}}};
    if (placed) {
        shape = {{"normal", {1, 0, 0}}, {"points", points({0, 0, 0}, {0, 0, l})}};
        if (free) shape["stress_free"] = false;
    }
    Json wire = rod(Json::array({{{"length", l},
                                  {"radius", 0.004 * l},
                                  {"EI", ei},
                                  {"curvature", curvature},
                                  {"element", l / 40}}}),
                    shape);
    wire["hold"] = Json::array({Json{{"set", "start"}}});
    RandomScene s{scene_of({{"wire", wire}}, Json::array(), quasi_static(0.5))};
    s.drawn = fmt::format("curvature {:.2g} over its length, {}", curvature * l,
                          !placed ? "in its shape"
                          : free  ? "bent into a line"
                                  : "placed along a line");
    s.answer = Answer::done_or_bad_input;
    // Free of load it is an arc: its end has turned by curvature times length.
    s.right = [=](const WrittenRun& run) -> std::string {
        if (run.warnings() > 0) return "";
        const Vec3 tangent = run.history.vector("wire_end_tangent", run.history.rows.size() - 1);
        return between("the cosine of the end's turn", tangent.z(), std::cos(curvature * l) - 1e-3,
                       std::cos(curvature * l) + 1e-3);
    };
    return s;
}

RandomScene draw_wire_in_tube(Draw& draw)
{
    const double tube = draw.ratio(0.002, 0.006), bend = draw.real(0.035, 0.06),
                 angle = draw.real(0.5, 1.8), before = draw.real(0.015, 0.03);
    const double r = four_digits(tube * draw.real(0.07, 0.15)), ei = draw.ratio(1e-5, 6e-4),
                 depth = draw.real(0.06, 0.11);
    const double friction = draw.chance(0.3) ? 0 : draw.real(0.1, 0.6);
    const bool foundation = draw.chance(0.3), tip = draw.chance(0.5), line = draw.chance(0.15),
               back = draw.chance(0.3);
    Json segments =
        Json::array({{{"length", depth + 0.01}, {"radius", r}, {"EI", ei}, {"element", 0.0025}}});
    if (tip) {
        segments.push_back({{"length", 0.01},
                            {"radius", r},
                            {"EI", {ei, four_digits(0.1 * ei)}},
                            {"element", 0.0025}});
        if (draw.chance(0.5)) segments[1]["curvature"] = draw.real(10, 40);
    }
    Json insertion = Json::array({{0, 0}, {7, depth}});
    if (back) insertion.push_back({9, four_digits(0.6 * depth)});
    Json wire = {
        {"kind", "beam"},
        {"segments", segments},
        {"introducer", {{"at", {0, 0, 0}}, {"direction", {1, 0, 0}}, {"normal", {0, 1, 0}}}},
        {"drive", {{"insertion", insertion}}}};
    RandomScene s;
    if (line) {
        wire["introducer"] = {{"centreline", {{"file", "line.csv"}}},
                              {"normal", draw.chance(0.5) ? Json{0, 0, 1} : Json{0, 1, 0}}};
        s.files = {{"line.csv", "x,y,z\n0,0,0\n0.005,0,0\n0.01,0,0\n"}};
        // At the line's start the wire runs along x: a normal along z or y is across it.
    }
    if (draw.chance(0.3)) wire["drive"]["twist"] = Json::array({{3, 0}, {7, draw.real(-3, 3)}});
    Json contact = pair("wire", "tube", friction);
    if (foundation) contact["foundation"] = draw.ratio(300, 1e5);
    s.scene = scene_of({{"tube", bent_tube(draw, tube, before, bend, angle, 0.15)}, {"wire", wire}},
                       contact, quasi_static(0.1, back ? 9 : 7));
    s.drawn = fmt::format("radius {:.2g} of the tube's, depth {:.3g} m, mu {:g}{}{}{}", r / tube,
                          depth, friction, foundation ? ", on a foundation" : "",
                          line ? ", from a centreline" : "", back ? ", and back" : "");
    s.same = 1e-4; // walls of tubes are sampled
    return s;
}

RandomScene draw_coaxial(Draw& draw)
{
    const double tube = draw.real(0.003, 0.005), bend = draw.real(0.04, 0.06),
                 depth = draw.real(0.06, 0.09);
    const double r = draw.real(3e-4, 4.5e-4), bore = four_digits(r * draw.real(1.15, 1.4)),
                 ei = draw.ratio(1e-5, 5e-5);
    const Json introducer = {{"at", {0, 0, 0}}, {"direction", {1, 0, 0}}, {"normal", {0, 1, 0}}};
    Json wire = {
        {"kind", "beam"},
        {"segments",
         Json::array({{{"length", depth + 0.03}, {"radius", r}, {"EI", ei}, {"element", 0.0025}}})},
        {"introducer", introducer},
        {"drive", {{"insertion", {{0, 0}, {5, depth}, {8, depth}}}}}};
    Json catheter = {{"kind", "beam"},
                     {"segments", Json::array({{{"length", depth + 0.03},
                                                {"radius", four_digits(bore + 3e-4)},
                                                {"inner_radius", bore},
                                                {"EI", four_digits(ei * draw.real(1, 5))},
                                                {"element", 0.0025}}})},
                     {"introducer", introducer},
                     {"drive", {{"insertion", {{5, 0}, {8, four_digits(0.5 * depth)}}}}}};
    const double before = draw.real(0.02, 0.03), angle = draw.real(0.8, 1.8),
                 mu = draw.real(0.1, 0.4), other = draw.real(0.1, 0.4);
    RandomScene s{scene_of({{"tube", bent_tube(draw, tube, before, bend, angle, 0.15)},
                            {"wire", wire},
                            {"catheter", catheter}},
                           Json::array({pair("wire", "tube", mu), pair("catheter", "tube", other),
                                        pair("wire", "catheter", 0.05)}),
                           quasi_static(0.1, 8))};
    s.drawn = fmt::format("bore {:.3g} of the wire's radius, depth {:.3g} m", bore / r, depth);
    s.same = 1e-4; // walls of tubes are sampled
    return s;
}

} // namespace amontons::validation
