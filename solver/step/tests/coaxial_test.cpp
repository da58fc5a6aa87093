#include "solver/step/coaxial.hpp"

#include "solver/obstacle/build.hpp"
#include "solver/scene/read.hpp"
#include "solver/scene/tests/issues_of.hpp"
#include "solver/step/tests/keep.hpp"
#include "solver/step/wire_simulation.hpp"

#include <cmath>
#include <doctest/doctest.h>
#include <fmt/format.h>
#include <map>

using namespace amontons;

namespace {

/// A catheter over a pre-curved wire in a bent tube, with friction everywhere: both in, the
/// catheter over the held wire, both turned, the wire back into the catheter.
std::string in_bend(double mirror, double mu, double step)
{
    return fmt::format(R"({{"schema": 1, "bodies": {{
        "tube": {{"kind": "obstacle", "surface": {{"generate": "tube", "radius": 0.003, "centreline":
          {{"normal": [0, {0}, 0], "pieces": [{{"length": 0.01}}, {{"radius": 0.03, "angle": 2}}]}}}}}},
        "wire": {{"kind": "beam", "introducer": {{"normal": [0, {0}, 0]}},
          "segments": [{{"length": 0.08, "radius": 4.445e-4, "EI": 5.2e-4, "element": 2.5e-3}},
                       {{"length": 0.02, "radius": 4.445e-4, "EI": 1e-4, "curvature": 40,
                         "curvature_angle": {1}, "element": 2.5e-3}}],
          "drive": {{"insertion": [[0, 0], [1, 0.05], [3, 0.05], [4, 0.02]],
                     "twist": [[2, 0], [3, {2}]]}}}},
        "catheter": {{"kind": "beam", "introducer": {{"normal": [0, {0}, 0]}},
          "segments": [{{"length": 0.1, "radius": 8.35e-4, "inner_radius": 5e-4, "EI": 1.9e-4,
                         "element": 2.5e-3}}],
          "drive": {{"insertion": [[1, 0], [2, 0.04]]}}}}}},
        "contact": [{{"between": ["wire", "tube"], "friction": {3}}},
                    {{"between": ["catheter", "tube"], "friction": {3}}},
                    {{"between": ["catheter", "wire"], "friction": {3}}}],
        "time": {{"step": {4}, "end": 4}}}})",
                       mirror, 0.5 * mirror, mirror, mu, step);
}

/// The steps of a run that is done.
std::vector<StepRecord> steps_of(const std::string& text, RunSummary* summary = nullptr,
                                 const std::vector<std::string>& overrides = {})
{
    const Scene scene = parse_scene(text, "s.json", overrides);
    WireSimulation simulation(scene, build_obstacles(scene));
    Keep keep;
    const std::atomic<bool> never{false};
    const RunSummary sum = simulation.run(keep, never);
    INFO(sum.message);
    REQUIRE(sum.status == "done");
    if (summary) *summary = sum;
    return keep.records;
}

/// The issues of a scene of wires; "" if it has none.
std::string issues_of_wires(const std::string& text, const std::vector<std::string>& overrides)
{
    try {
        const Scene scene = parse_scene(text, "s.json", overrides);
        WireSimulation simulation(scene, build_obstacles(scene));
    } catch (const InputError& error) {
        return error.what();
    }
    return "";
}

} // namespace

TEST_CASE("a wire in a catheter in a bent tube: certified and nothing passes and energy closes")
{
    RunSummary sum;
    const std::vector<StepRecord> s = steps_of(in_bend(1, 0.1, 0.02), &sum);
    CHECK(sum.uncertified_steps == 0);
    CHECK(sum.worst_penetration < 1e-9);
    CHECK(std::abs(sum.energy.error()) < 0.01 * sum.energy.work_absolute);
    std::size_t in_bore = 0;
    for (const StepRecord& r : s) {
        std::size_t here = 0;
        Vec3 on_wire = Vec3::Zero();
        for (const ContactRecord& c : r.contacts) {
            CHECK(c.gap > -1e-9);
            const double cone = c.force.dot(c.normal) * 0.1;
            CHECK((c.force - c.normal * c.force.dot(c.normal)).norm() <= cone + 1e-9);
            here += c.body_b == 2;
            if (c.body_b == 2) on_wire += c.force;
        }
        in_bore = std::max(in_bore, here);
    }
    CHECK(in_bore >= 4);
    // The wire has been pulled back into the catheter, whose tip stays out.
    CHECK(value(s.back(), "wire_depth") < value(s.back(), "catheter_depth"));
}

TEST_CASE("the mirror image of a scene of instruments has the mirrored result" *
          doctest::test_suite("slow"))
{
    const std::vector<StepRecord> a = steps_of(in_bend(1, 0.1, 0.02)),
                                  b = steps_of(in_bend(-1, 0.1, 0.02));
    REQUIRE(a.size() == b.size());
    for (std::size_t i = 0; i < a.size(); i += 10) {
        CAPTURE(i);
        for (const char* name :
             {"wire_push_force", "catheter_push_force", "catheter_over_wire_normal_force_sum"})
            CHECK(value(a[i], name) == doctest::Approx(value(b[i], name)).epsilon(1e-5).scale(1));
        CHECK(std::abs(value(a[i], "wire_tip_y") + value(b[i], "wire_tip_y")) < 1e-8);
        CHECK(std::abs(value(a[i], "wire_tip_z") - value(b[i], "wire_tip_z")) < 1e-8);
    }
}

TEST_CASE("a run of instruments continues bit for bit from where it was saved" *
          doctest::test_suite("slow"))
{
    const Scene scene = parse_scene(in_bend(1, 0.1, 0.05), "s.json");
    WireSimulation whole(scene, build_obstacles(scene)), part(scene, build_obstacles(scene)),
        rest(scene, build_obstacles(scene));
    Keep all, first, second;
    std::atomic<bool> never{false};
    REQUIRE(whole.run(all, never).status == "done");
    struct Stop : StepObserver {
        Keep& keep;
        std::atomic<bool>& stop;
        Stop(Keep& k, std::atomic<bool>& b) : keep(k), stop(b) {}
        void on_step(const StepRecord& r) override
        {
            keep.on_step(r);
            if (r.time > 2.5) stop = true;
        }
    };
    std::atomic<bool> stop{false};
    Stop observer(first, stop);
    REQUIRE(part.run(observer, stop).status == "interrupted");
    rest.restore(part.save());
    REQUIRE(rest.run(second, never).status == "done");
    REQUIRE(!second.records.empty());
    REQUIRE(first.records.size() + second.records.size() == all.records.size());
    const StepRecord &a = all.records.back(), &b = second.records.back();
    REQUIRE(a.quantities.size() == b.quantities.size());
    for (std::size_t q = 0; q < a.quantities.size(); ++q)
        CHECK(a.quantities[q].value == b.quantities[q].value);
}

TEST_CASE("a wire that fills its catheter is held in the middle of the bore" *
          doctest::test_suite("slow"))
{
    RunSummary sum;
    const std::vector<StepRecord> s =
        steps_of(in_bend(1, 0.1, 0.02), &sum, {"bodies.catheter.segments.0.inner_radius=4.445e-4"});
    CHECK(sum.uncertified_steps == 0);
    CHECK(sum.worst_penetration < 1e-9); // the distance of the centrelines
    CHECK(std::abs(sum.energy.error()) < 0.01 * sum.energy.work_absolute);
    std::size_t in_bore = 0;
    for (const StepRecord& r : s)
        for (const ContactRecord& c : r.contacts) {
            in_bore += c.body_b == 2;
            const double normal = c.force.dot(c.normal);
            CHECK(normal >= 0);
            CHECK((c.force - c.normal * normal).norm() <= 0.1 * normal + 1e-9);
        }
    CHECK(in_bore > 0);
    // It lies where it would with almost no clearance.
    const std::vector<StepRecord> filled = steps_of(
        in_bend(1, 0, 0.02), nullptr, {"bodies.catheter.segments.0.inner_radius=4.445e-4"});
    const std::vector<StepRecord> narrow =
        steps_of(in_bend(1, 0, 0.02), nullptr, {"bodies.catheter.segments.0.inner_radius=4.46e-4"});
    for (const char* name : {"catheter_tip_x", "catheter_tip_y", "catheter_tip_z"})
        CHECK(std::abs(value(filled.back(), name) - value(narrow.back(), name)) <
              2e-5); // [regression] our own run
}

TEST_CASE("how many points there are in a bore does not change what friction takes" *
          doctest::test_suite("slow"))
{
    // A catheter over a straight wire that is held in a bend, then the wire back into it.
    const auto scene = [](double bore) {
        return fmt::format(R"({{"schema": 1, "bodies": {{
            "tube": {{"kind": "obstacle", "surface": {{"generate": "tube", "radius": 0.003,
              "centreline": {{"pieces": [{{"length": 0.01}}, {{"radius": 0.03, "angle": 2.2}}]}}}}}},
            "wire": {{"kind": "beam", "segments": [{{"length": 0.1, "radius": 4.445e-4,
              "EI": 5.2e-4, "element": 2.5e-3}}],
              "drive": {{"insertion": [[0, 0], [1, 0.06], [2, 0.06], [3, 0.03]]}}}},
            "catheter": {{"kind": "beam", "segments": [{{"length": 0.1, "radius": 8.35e-4,
              "inner_radius": {}, "EI": 1.9e-4, "element": 2.5e-3}}],
              "drive": {{"insertion": [[1, 0], [2, 0.045]]}}}}}},
            "contact": [{{"between": ["wire", "tube"], "friction": 0.1}},
                        {{"between": ["catheter", "tube"], "friction": 0.1}},
                        {{"between": ["catheter", "wire"], "friction": 0.1}}],
            "time": {{"step": 0.02, "end": 3}}}})",
                           bore);
    };
    for (const double bore : {5e-4, 4.445e-4}) { // with clearance and with none
        CAPTURE(bore);
        RunSummary usual;
        const std::vector<StepRecord> a = steps_of(scene(bore), &usual);
        for (const char* spacing : {"6.25e-4", "3.125e-4"}) {
            CAPTURE(spacing);
            RunSummary finer;
            const std::vector<StepRecord> b = steps_of(
                scene(bore), &finer, {std::string("bodies.catheter.contact_spacing=") + spacing});
            CHECK(finer.energy.friction == doctest::Approx(usual.energy.friction).epsilon(3e-3));
            CHECK(finer.uncertified_steps == 0);
        }
    }
}

TEST_CASE("a pigtail comes out of a sheath and back with friction of 0.4" *
          doctest::test_suite("slow"))
{
    // Newton's method loses half of its error an iteration, and steps become ever shorter, where
    // the tangent does not contain the rotation of friction's arms about the bore.
    RunSummary sum;
    const std::vector<StepRecord> s = steps_of(R"({"schema": 1, "bodies": {
        "catheter": {"kind": "beam", "instrument": "catheter-5f",
          "tip": {"shape": "pigtail", "radius": 0.006},
          "drive": {"insertion": [[0, 0], [2, 0.08], [4, 0.01]]}},
        "sheath": {"kind": "beam", "instrument": "sheath-6f", "drive": {"insertion": [[0, 0.02]]}}},
        "contact": [{"between": ["catheter", "sheath"], "friction": 0.4}],
        "time": {"step": 0.02, "end": 4}})",
                                               &sum);
    CHECK(s.size() < 350); // [regression] our own run
    CHECK(sum.uncertified_steps == 0);
    CHECK(std::abs(sum.energy.error()) < 0.01 * sum.energy.work_absolute);
}

TEST_CASE("a jump that draws a wire into its sheath by more than an element" *
          doctest::test_suite("slow"))
{
    // The first element came to 10 um: its stiffness by differences was off, and the jump crept.
    RunSummary sum;
    steps_of(R"({"schema": 1, "bodies": {
        "catheter": {"kind": "beam", "instrument": "catheter-5f",
          "tip": {"shape": "pigtail", "radius": 0.006},
          "drive": {"insertion": [[0, 0], [2.5, 0.11], [5, 0.01]]}},
        "sheath": {"kind": "beam", "instrument": "sheath-6f", "drive": {"insertion": [[0, 0.05]]}}},
        "contact": [{"between": ["catheter", "sheath"], "friction": 0.4}],
        "time": {"step": 0.02, "end": 5}})",
             &sum);
    CHECK(sum.status == "done");
    CHECK(sum.uncertified_steps == 0);
    CHECK(std::abs(sum.energy.error()) < 0.02 * sum.energy.work_absolute);
}

TEST_CASE("instruments in one another do not depend on the unit of length" *
          doctest::test_suite("slow"))
{
    // A catheter over a wire in a bend, out of balances that end: pushed off along their weakest
    // mode, whose turns had another weight beside places in another unit. By a power of two every
    // number is the same but for its exponent.
    const auto pushes = [](double unit) {
        const double stiff = unit * unit; // forces stay
        const auto steps = steps_of(fmt::format(
            R"({{"schema": 1, "bodies": {{
            "tube": {{"kind": "obstacle", "surface": {{"generate": "tube", "radius": {},
              "centreline": {{"pieces": [{{"length": {}}}, {{"radius": {}, "angle": 1.941,
                                           "direction": 0.3701}}, {{"length": {}}}]}}}}}},
            "wire": {{"kind": "beam", "drive": {{"insertion": [[0, 0], [5, {}], [12, {}]]}},
              "segments": [{{"length": {}, "radius": {}, "EI": {}, "element": {}}},
                {{"length": {}, "radius": {}, "end_radius": {}, "EI": [{}, {}], "element": {}}}]}},
            "catheter": {{"kind": "beam", "drive": {{"insertion": [[5, 0], [9, {}]]}},
              "segments": [{{"length": {}, "radius": {}, "inner_radius": {}, "EI": {},
                            "element": {}}}]}}}},
            "contact": [{{"between": ["wire", "tube"], "friction": 0.25}},
                        {{"between": ["catheter", "tube"], "friction": 0.25}},
                        {{"between": ["wire", "catheter"], "friction": 0.05}}],
            "time": {{"step": 0.06, "end": 12}}}})",
            0.004 * unit, 0.02932 * unit, 0.04944 * unit, 0.18427 * unit, 0.12 * unit, 0.12 * unit,
            0.152 * unit, 0.0004358 * unit, 1.804e-05 * stiff, 0.0025 * unit, 0.02 * unit,
            0.0004358 * unit, 0.0002615 * unit, 1.804e-05 * stiff, 2.345e-06 * stiff, 0.0025 * unit,
            0.05575 * unit, 0.152 * unit, 0.0008287 * unit, 0.0005287 * unit, 6.779e-05 * stiff,
            0.0025 * unit));
        std::vector<double> all;
        for (const StepRecord& s : steps) {
            all.push_back(value(s, "wire_push_force"));
            all.push_back(value(s, "catheter_push_force"));
        }
        return all;
    };
    const std::vector<double> one = pushes(1), other = pushes(1024);
    REQUIRE(one.size() == other.size());
    double most = 0, off = 0;
    for (std::size_t i = 0; i < one.size(); ++i) {
        most = std::max(most, std::abs(one[i]));
        off = std::max(off, std::abs(one[i] - other[i]));
    }
    CHECK(off <= 1e-8 * most);
}

TEST_CASE("an angled tip that leaves its introducer loses what it releases and no more" *
          doctest::test_suite("slow"))
{
    // It jumps by millimetres: the mesh at the introducer's end changes within the jump, and two
    // curvatures that one element had are apart again. What is bent by more than a radian in two
    // millimetres comes out of the introducer while the tip is pressed against the tube: the
    // element there is divided, and nothing must move or be lost by that.
    struct Tip {
        double length, curvature, end, EI, tube, friction, depth;
    };
    for (const Tip& tip : {Tip{0.003, 300, 0.01, 5e-4, 0.01, 0.1, 0.016},
                           Tip{0.002, 500, 0.01, 5e-4, 0.01, 0.1, 0.016},
                           Tip{0.0021, 666, 0.0148, 3.4e-4, 0.0049, 0.1, 0.0262},
                           Tip{0.0025, 604, 0.0051, 6.4e-4, 0.0042, 0, 0.0279}}) {
        CAPTURE(tip.curvature);
        RunSummary sum;
        const std::vector<StepRecord> steps =
            steps_of(fmt::format(R"({{"schema": 1, "bodies": {{
            "tube": {{"kind": "obstacle", "surface": {{"generate": "tube", "radius": {},
              "centreline": {{"pieces": [{{"length": 0.1}}]}}}}}},
            "wire": {{"kind": "beam", "drive": {{"insertion": [[0, 0], [1, {}]]}}, "segments": [
              {{"length": 1, "radius": 4.445e-4, "EI": {}, "element": 2.5e-3}},
              {{"length": {}, "radius": 4.445e-4, "EI": {}, "element": 1e-3, "curvature": {}}},
              {{"length": {}, "radius": 4.445e-4, "EI": {}, "element": 1e-3}}]}}}},
            "contact": [{{"between": ["wire", "tube"], "friction": {}}}],
            "time": {{"step": 0.02, "end": 1}}}})",
                                 tip.tube, tip.depth, tip.EI, tip.length, tip.EI, tip.curvature,
                                 tip.end, tip.EI, tip.friction),
                     &sum);
        double worst = 0, before = 0; // of every step, those between the snaps as well
        for (const StepRecord& s : steps) {
            worst = std::max(worst, std::abs(s.energy.error() - before));
            before = s.energy.error();
        }
        REQUIRE(sum.snaps.size() > 0);
        CHECK(sum.energy.released > 0.1 * sum.energy.elastic_start);
        CHECK(std::abs(sum.energy.error()) < 0.01 * sum.energy.released);
        CHECK(worst < 0.01 * sum.energy.released);
    }
}

TEST_CASE("a wire that fills a curved catheter: the curvature of both")
{
    // Pushed out together into free space.
    const double k1 = 20, k2 = 5, EI1 = 5.2e-4, EI2 = 1.9e-4;
    const std::vector<StepRecord> s = steps_of(fmt::format(R"({{"schema": 1, "bodies": {{
        "wire": {{"kind": "beam", "segments": [{{"length": 0.2, "radius": 4e-4, "EI": {0},
          "curvature": {2}, "element": 2.5e-3}}], "drive": {{"insertion": [[0, 0.03], [1, 0.1]]}}}},
        "catheter": {{"kind": "beam", "segments": [{{"length": 0.2, "radius": 8e-4,
          "inner_radius": 4e-4, "EI": {1}, "curvature": {3}, "element": 2.5e-3}}],
          "drive": {{"insertion": [[0, 0.03], [1, 0.1]]}}}}}},
        "contact": [{{"between": ["wire", "catheter"]}}],
        "time": {{"step": 0.05, "end": 1}}}})",
                                                           EI1, EI2, k1, k2));
    const double k = (EI1 * k1 + EI2 * k2) / (EI1 + EI2);
    const Field* curvature = nullptr;
    const BeamRecord& wire = s.back().beams[0];
    for (const Field& f : wire.fields)
        if (f.name == "curvature") curvature = &f;
    REQUIRE(curvature);
    double sum = 0;
    int count = 0;
    for (std::size_t i = wire.points.size() / 4; i < 3 * wire.points.size() / 4; ++i)
        sum += curvature->values[i], ++count;
    CHECK(std::abs(sum / count / k - 1) < 1e-3);
    const auto energy = [&](double EI, double own) {
        return 0.5 * EI * (std::pow(k - own, 2) - own * own);
    };
    const std::size_t last = s.size() - 1;
    CHECK(std::abs((value(s[last], "wire_push_force") + value(s[last], "catheter_push_force")) /
                       (energy(EI1, k1) + energy(EI2, k2)) -
                   1) < 5e-3);
}

TEST_CASE("instruments that cannot be in one another")
{
    const std::string good = in_bend(1, 0.1, 0.02);
    CHECK(issues_of_wires(good, {}).empty());
    CHECK(has(issues_of_wires(good, {"bodies.catheter.segments.0.inner_radius=4.4e-4"}),
              "an instrument that fits in the other"));
    // too thick by less than six digits show
    CHECK(has(issues_of_wires(good, {"bodies.wire.segments.0.radius=4.45e-4",
                                     "bodies.catheter.segments.0.inner_radius=4.4499999e-4"}),
              "of radius 0.000445 in the bore of \"catheter\", radius 0.00044499999"));
    CHECK(has(issues_of_wires(good, {"bodies.catheter.segments.0.inner_radius=9e-4"}),
              "/bodies/catheter/segments/0/inner_radius (--set): found 0.0009"));
    CHECK(has(issues_of_wires(good, {"bodies.catheter.introducer.at=[0,0,0.001]"}),
              "come out of one"));
    CHECK(has(issues_of_wires(good, {"bodies.wire.plane=[0,0,1]", "bodies.catheter.plane=[0,0,1]"}),
              "move in space"));
    // Beside itself a wire is a rod, which needs clearance.
    CHECK(has(issues_of_wires(good, {"contact.0.between=[\"wire\",\"wire\"]",
                                     "bodies.catheter.segments.0.inner_radius=4.445e-4"}),
              "an instrument with clearance in the other"));
    CHECK(has(issues_of_wires(good, {"bodies.wire.drive.insertion=[[0,0],[1,0.05],[1,0.06]]"}),
              "> 1 [s]"));
}

TEST_CASE("a wire pressed against a wall is compressed as a bar also by more than an element")
{
    // 4 mm of 100 mm; elements of 1 mm, and 80 mm of the wire in the sheath.
    const std::vector<StepRecord> s = steps_of(R"({"schema": 1, "bodies": {
        "wall": {"kind": "obstacle", "surface": {"generate": "plane",
          "centre": [0.0205, 0, 0], "axis": [-1, 0, 0]}},
        "wire": {"kind": "beam", "segments": [{"length": 0.1, "radius": 5e-4, "EI": 1e-3, "EA": 100,
          "element": 1e-3}], "drive": {"insertion": [[0, 0.02], [1, 0.024]]}}},
        "contact": [{"between": ["wire", "wall"], "friction": 1}],
        "time": {"step": 0.05, "end": 1}})");
    CHECK(value(s.back(), "push_force") == doctest::Approx(100 * 0.04).epsilon(1e-6));
}

TEST_CASE(
    "elements of a fiftieth of the radius: round-off is in the certificate and not in the push" *
    doctest::test_suite("slow"))
{
    std::vector<double> push;
    for (const double element : {1e-3, 1e-5}) {
        RunSummary sum;
        const std::vector<StepRecord> s = steps_of(fmt::format(R"({{"schema": 1, "bodies": {{
            "tube": {{"kind": "obstacle", "surface": {{"generate": "tube", "radius": 0.002,
              "centreline": {{"pieces": [{{"length": 0.01}}, {{"radius": 0.02, "angle": 1.5}}]}}}}}},
            "wire": {{"kind": "beam", "segments": [{{"length": 0.04, "radius": 4.445e-4,
              "EI": 5.2e-4, "element": {}}}], "contact_spacing": 1e-3,
              "drive": {{"insertion": [[0, 0.008], [1, 0.02]]}}}}}},
            "contact": [{{"between": ["wire", "tube"], "friction": 0.1}}],
            "time": {{"step": 0.1, "end": 1}}}})",
                                                               element),
                                                   &sum);
        CHECK(sum.uncertified_steps == 0);
        push.push_back(value(s.back(), "push_force"));
    }
    CHECK(std::abs(push[1] / push[0] - 1) < 1e-5);
}
