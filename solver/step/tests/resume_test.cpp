// A run that is ended after any step and continued with from its saved state is the run that was
// never ended, bit by bit: kinds of bodies, materials, loads, contacts, couplings and rules of
// time.

#include "solver/obstacle/build.hpp"
#include "solver/scene/read.hpp"
#include "solver/step/tests/keep.hpp"

#include <chrono>
#include <cstring>
#include <doctest/doctest.h>
#include <fmt/format.h>
#include <set>
#include <thread>

namespace amontons {
namespace {

/// Keeps what would be written after each step, and the state to continue from.
struct Written : StepObserver {
    std::vector<StepRecord> records;
    std::vector<std::vector<BodyRecord>> bodies;
    std::vector<std::vector<std::byte>> states;
    const Simulation* simulation = nullptr;
    void on_step(const StepRecord& r) override
    {
        records.push_back(r);
        bodies.push_back(simulation->body_records());
        states.push_back(simulation->save());
    }
};

/// All that a step's files hold but times in real time, and in words where it begins to differ.
class Bits {
public:
    void add(const std::string& what, const void* data, std::size_t size)
    {
        parts_.emplace_back(what, std::string(static_cast<const char*>(data), size));
    }
    void add(const std::string& what, double v) { add(what, &v, sizeof v); }
    void add(const std::string& what, const Vec3& v) { add(what, v.data(), 3 * sizeof(double)); }
    void add(const std::string& what, const std::vector<double>& v)
    {
        add(what, v.data(), v.size() * sizeof(double));
    }
    void add(const std::string& what, const std::vector<Vec3>& v)
    {
        for (const Vec3& x : v)
            add(what, x);
    }
    void add(const std::string& what, const EnergyRecord& e)
    {
        add(what + ": work", e.work);
        add(what + ": absolute work", e.work_absolute);
        add(what + ": elastic", e.elastic);
        add(what + ": kinetic", e.kinetic);
        add(what + ": friction", e.friction);
        add(what + ": released", e.released);
    }
    std::string first_difference(const Bits& other) const
    {
        if (parts_.size() != other.parts_.size()) return "another number of values";
        for (std::size_t i = 0; i < parts_.size(); ++i)
            if (parts_[i] != other.parts_[i]) return parts_[i].first;
        return "";
    }

private:
    std::vector<std::pair<std::string, std::string>> parts_;
};

Bits bits_of(const StepRecord& r, const std::vector<BodyRecord>& bodies)
{
    Bits b;
    b.add("number", r.step);
    b.add("time", r.time);
    b.add("step length", r.step_length);
    b.add("energy", r.energy);
    for (const Quantity& q : r.quantities)
        b.add(q.name, q.value);
    for (const ContactRecord& c : r.contacts) {
        b.add("contact's point", c.point);
        b.add("contact's force", c.force);
        b.add("contact's slip", c.slip);
        b.add("contact's gap", c.gap);
    }
    for (const BeamRecord& beam : r.beams) {
        b.add(beam.name, beam.points);
        for (const Field& f : beam.fields)
            b.add(beam.name + "." + f.name, f.values);
    }
    for (const BodyRecord& body : bodies) {
        b.add(body.name, body.points);
        for (const auto* fields : {&body.point_fields, &body.cell_fields})
            for (const Field& f : *fields)
                b.add(body.name + "." + f.name, f.values);
    }
    b.add("certificate", r.certificate.error);
    b.add("overlap", r.certificate.worst_overlap.depth);
    b.add("iterations", r.iterations);
    b.add("factorisations", r.factorisations);
    b.add("retries", r.retries);
    b.add("remark", r.remark.data(), r.remark.size());
    return b;
}

Bits bits_of(const RunSummary& s)
{
    Bits b;
    b.add("status", s.status.data(), s.status.size());
    b.add("message", s.message.data(), s.message.size());
    b.add("steps", s.steps);
    b.add("time", s.time);
    b.add("energy", s.energy);
    b.add("contacts", s.contacts_max);
    b.add("mean contacts", s.contacts_mean);
    b.add("worst error", s.worst_error);
    b.add("worst penetration", s.worst_penetration);
    b.add("worst overlap", s.worst_overlap.depth);
    b.add("uncertified", s.uncertified_steps);
    for (const NamedText& t : s.texts)
        b.add(t.name, t.value.data(), t.value.size());
    for (const std::string& w : s.warnings)
        b.add("warning: " + w, w.data(), w.size());
    for (const Quantity& q : s.quantities)
        b.add("summary's " + q.name, q.value);
    return b;
}

/// @param everywhere  after each of its steps; else after some
void check_resumes(const std::string& rest, bool everywhere = false)
{
    const Scene read =
        parse_scene("{\"schema\": 1, " + rest + "}", AMONTONS_SOURCE_DIR "/test.json", {});
    const auto made = [&] {
        Scene scene = read;
        place_introducers(scene);
        return make_simulation(scene, build_obstacles(scene));
    };
    const std::atomic<bool> never{false};
    const auto whole = made();
    Written all;
    all.simulation = whole.get();
    const RunSummary end = whole->run(all, never);
    INFO(end.message);
    CHECK(end.status == "done"); // one that fails resumes as well
    const std::size_t steps = all.records.size();
    REQUIRE(steps >= 3);
    std::set<std::size_t> ends{0, 1, steps / 3, steps / 2, steps - 2};
    for (std::size_t i = 0; everywhere && i + 1 < steps; ++i)
        ends.insert(i);
    for (const std::size_t at : ends) {
        CAPTURE(at);
        const auto second = made();
        second->restore(all.states[at]);
        CHECK(second->save() == all.states[at]);
        Written rest_of;
        rest_of.simulation = second.get();
        const RunSummary same = second->run(rest_of, never);
        REQUIRE(rest_of.records.size() + at + 1 == steps);
        for (std::size_t i = 0; i < rest_of.records.size(); ++i) {
            const std::size_t of_whole = at + 1 + i;
            CAPTURE(of_whole);
            const std::string off =
                bits_of(rest_of.records[i], rest_of.bodies[i])
                    .first_difference(bits_of(all.records[of_whole], all.bodies[of_whole]));
            CHECK(off == "");
            if (off != "") break;
        }
        CHECK(bits_of(same).first_difference(bits_of(end)) == "");
    }
}

constexpr const char* kPlane = R"("floor": {"kind": "obstacle", "surface": {"generate": "plane"}})";

/// A block whose foot is 1 mm above the floor, or stands on it.
std::string block(const std::string& element, const std::string& material, const std::string& more,
                  double above = 0)
{
    return fmt::format(R"("block": {{"kind": "solid", "mesh": {{"generate": "box",
        "size": [0.1, 0.06, 0.04], "cells": [4, 2, 2], "element": "{}"}}, "density": 1000, {},
        "start": {{"place": [0, 0, {}]}}, {}}})",
                       element, material, 0.02 + above, more);
}

std::string quasi_static(double step, double end)
{
    return fmt::format(R"("time": {{"step": {}, "end": {}}})", step, end);
}

std::string dynamic(double step, double end, const std::string& rule)
{
    return fmt::format(R"("time": {{"kind": "dynamic", "step": {}, "end": {}, {}}})", step, end,
                       rule);
}

const std::string kElastic = R"("youngs_modulus": 1e5, "poisson_ratio": 0.3)";
const std::string kCorotational = kElastic + R"(, "motion": "corotational")";
const std::string kNeoHooke =
    R"("material": {"law": "neo_hooke", "youngs_modulus": 1e5, "poisson_ratio": 0.3})";
const std::string kMooney =
    R"("material": {"law": "mooney_rivlin", "c1": 1.5e4, "c2": 2e3, "poisson_ratio": 0.4})";
const std::string kKirchhoff =
    R"("material": {"law": "st_venant_kirchhoff", "youngs_modulus": 1e5, "poisson_ratio": 0.3})";
const std::string kGuccione =
    R"("material": {"law": "guccione", "c": 2000, "bf": 8, "bt": 2, "bfs": 4, "bulk_modulus": 5e4})";
const std::string kGravityDown = R"("gravity": [0, 0, -9.81])";

const std::vector<std::string> kRules{R"("rule": "theta")", R"("theta": 0.5)",
                                      R"("rule": "generalised_alpha", "spectral_radius": 0.8)"};

} // namespace

TEST_CASE(
    "solids of every law under every load continue from a saved state bit by bit, quasi-static" *
    doctest::test_suite("slow"))
{
    const std::string loads = R"("hold": [{"set": "x_min"}], "loads": [
        {"set": "z_max", "pressure": [[0, 0], [1, 800]]},
        {"set": "x_max", "traction": [300, -200, -600], "over": [[0, 0.1], [1, 1]]},
        {"set": "y_max", "force": [0.1, 0.2, -0.3]}])";
    const std::string moved = R"("hold": [{"set": "z_max", "x": [[0, 0], [1, 0.004]], "y": 0,
        "z": [[0, 0], [1, -0.004]]}])";
    const std::string driven = R"("hold": [{"set": "x_min"}], "drive": {"y": [[0, 0], [1, 0.002]],
        "angle": [[0, 0], [1, 0.05]], "axis": [0, 1, 0]})";
    for (const auto& [element, material] : {std::pair{"H8", kElastic},
                                            {"T10", kElastic},
                                            {"T4", kElastic},
                                            {"H8", kCorotational},
                                            {"T10", kCorotational},
                                            {"T4", kNeoHooke},
                                            {"H8", kNeoHooke},
                                            {"T10", kMooney},
                                            {"H8", kKirchhoff},
                                            {"H8", kGuccione}})
        for (const std::string& how : {loads, moved, driven})
            for (const std::string& contact :
                 {std::string(), std::string(R"("contact": [{"between": ["block", "floor"],
                     "friction": 0.4}], )"),
                  std::string(R"("contact": [{"between": ["block", "floor"], "friction": 0.4,
                     "sliding": "small"}], )")}) {
                if (contact.empty() && &how != &loads && how != loads) continue;
                CAPTURE(element);
                CAPTURE(material);
                CAPTURE(how);
                CAPTURE(contact);
                check_resumes(fmt::format(R"("bodies": {{{}, {}}}, {}{}, {})",
                                          block(element, material, how, 0.001), kPlane, contact,
                                          kGravityDown, quasi_static(0.2, 1)));
            }
}

TEST_CASE("solids of every law continue from a saved state bit by bit, by every rule of motion")
{
    const std::string thrown = R"("mass_damping": 0.2)";
    const std::string held = R"("hold": [{"set": "x_min", "x": 0, "y": 0,
        "z": [[0, 0], [0.02, 0.002]]}], "mass_damping": 0.2,
        "loads": [{"set": "x_max", "traction": [0, 100, -300], "over": [[0, 0], [0.02, 1]]}])";
    for (const auto& [element, material] : {std::pair{"H8", kElastic},
                                            {"T10", kElastic},
                                            {"H8", kCorotational},
                                            {"T4", kNeoHooke},
                                            {"H8", kMooney}})
        for (const std::string& rule : kRules)
            for (const std::string& how : {thrown, held}) {
                CAPTURE(element);
                CAPTURE(material);
                CAPTURE(rule);
                CAPTURE(how);
                check_resumes(fmt::format(R"("bodies": {{{}, {}}}, {}, "contact": [
                        {{"between": ["block", "floor"], "friction": 0.4}}], {})",
                                          block(element, material, how, 1e-4), kPlane, kGravityDown,
                                          dynamic(1e-3, 0.012, rule)));
            }
}

TEST_CASE("a volume that is prescribed, springs and snaps continue from a saved state bit by bit")
{
    check_resumes(fmt::format(R"("bodies": {{{}}}, {})",
                              block("H8", kNeoHooke, R"("hold": [{"set": "z_min"}], "loads":
                  [{"set": "z_max", "volume": [[0, 0], [1, 2e-5]]}])"),
                              quasi_static(0.2, 1)));
    // A frame that snaps (Lee's): the time is the load.
    check_resumes(R"("bodies": {"frame": {"kind": "rod", "plane": [0, 0, 1], "segments":
        [{"length": 2.4, "radius": 0.0138, "EI": 1440, "EA": 4.32e7, "element": 0.24}],
        "shape": {"points": [{"at": [0, 0, 0]}, {"at": [0, 1.2, 0]}, {"at": [1.2, 1.2, 0]}]},
        "hold": [{"set": "start", "turns": "free"}, {"set": "end", "turns": "free"}],
        "loads": [{"at": 1.44, "force": [0, -1, 0], "over": [[0, 0], [30000, 30000]]}]}},
        "time": {"step": 4000, "end": 24000})");
}

TEST_CASE("nets of rods continue from a saved state bit by bit, at rest and in motion")
{
    for (const char* time : {R"("time": {"step": 0.25, "end": 1})",
                             R"("time": {"kind": "dynamic", "step": 1e-3, "end": 0.012})",
                             R"("time": {"kind": "dynamic", "step": 1e-3, "end": 0.012,
                                 "rule": "generalised_alpha"})"}) {
        CAPTURE(time);
        const std::string section = R"("segments": [{"length": 0.1, "radius": 0.001, "EI": 0.01,
            "GJ": 0.008, "EA": 1e4, "element": 0.02, "density": 8000}])";
        check_resumes(R"("bodies": {"a": {"kind": "rod", )" + section +
                      R"(, "hold": [{"set": "start"}]}, "b": {"kind": "rod", )" + section +
                      R"(, "shape": {"start": [0.1, 0, 0], "direction": [0, 1, 0]}, "loads": [
                      {"set": "end", "force": [0.05, 0, 0.1]}]}, "c": {"kind": "rod", )" +
                      section + R"(, "shape": {"start": [0.1, 0, 0], "direction": [1, -1, 1]}}},
                      "couplings": [{"kind": "weld", "between": ["a", "b"], "at": [0.1, 0, 0]},
                      {"kind": "hinge", "between": ["a", "c"], "at": [0.1, 0, 0], "axis": [0, 0, 1]},
                      {"kind": "turn_spring", "between": ["a", "c"], "at": [0.1, 0, 0],
                       "axis": [0, 0, 1], "stiffness": 0.1},
                      {"kind": "spring", "between": ["b", "world"], "at": [0.1, 0.1, 0],
                       "to": [0.1, 0.1, 0.3], "stiffness": 2}], )" +
                      time);
    }
}

TEST_CASE("rods continue from a saved state bit by bit, at rest, on their path and in motion")
{
    const auto rod = [](const std::string& elements, const std::string& more) {
        return fmt::format(R"("rod": {{"kind": "rod", "elements": "{}", "segments":
            [{{"length": 0.2, "radius": 0.001, "EI": 0.002, "EA": 2000, "density": 2000,
               "element": 0.02}}], "shape": {{"start": [0, 0, 0.0015]}}, {}}})",
                           elements, more);
    };
    const std::string on_floor =
        R"("contact": [{"between": ["rod", "floor"], "friction": 0.3}], )" + kGravityDown;
    const std::string held = R"("hold": [{"set": "start"}], "loads": [{"set": "end",
        "force": [0, 0.05, 0.01], "moment": [0, 0, 0.002], "follows": true,
        "over": [[0, 0], [1, 1]]}, {"set": "all", "line": [0, 0.01, 0]}])";
    const std::string drawn = R"("hold": [{"set": "start", "x": [[0, 0], [1, 0.01]], "y": 0,
        "z": [[0, 0], [1, 0.002]]}])";
    for (const char* elements : {"exact", "corotational"})
        for (const std::string& how : {held, drawn}) {
            CAPTURE(elements);
            CAPTURE(how);
            check_resumes(fmt::format(R"("bodies": {{{}, {}}}, {}, {})", rod(elements, how), kPlane,
                                      on_floor, quasi_static(0.1, 1)));
            for (const std::string& rule : kRules)
                check_resumes(fmt::format(R"("bodies": {{{}, {}}}, {}, {})", rod(elements, how),
                                          kPlane, on_floor, dynamic(1e-3, 0.008, rule)));
        }
    // In a medium, out of a sheath, along the path under weight.
    check_resumes(fmt::format(R"("bodies": {{{}, {}}}, {}, {})",
                              rod("exact", R"("drag": 0.5, )" + held), kPlane, on_floor,
                              quasi_static(0.1, 1)));
    check_resumes(fmt::format(R"("bodies": {{{}, {}}}, {}, {})",
                              rod("exact", R"("fed": [[0, 0.05], [1, 0.15]])"), kPlane, on_floor,
                              quasi_static(0.05, 1)));
    for (const std::string& rule : kRules)
        for (const char* fed :
             {"[[0, 0.05], [0.02, 0.055], [0.05, 0.048]]", "[[0, 0.001], [0.03, 0], [0.05, 0.01]]"})
            check_resumes(fmt::format(R"("bodies": {{{}, {}}}, {}, {})",
                                      rod("exact", fmt::format(R"("fed": {})", fed)), kPlane,
                                      on_floor, dynamic(2e-3, 0.05, rule)));
    check_resumes(fmt::format(R"("bodies": {{{}}}, {}, "time": {{"step": 0.05, "end": 1,
        "path": 0.002}})",
                              rod("exact", held), kGravityDown));
    // A straight column that leaves its balance.
    check_resumes(fmt::format(R"("bodies": {{{}}}, {})",
                              rod("exact", R"("hold": [{"set": "start", "x": [[0, 0], [1, 0.002]],
                                  "y": 0}, {"set": "end"}])"),
                              quasi_static(0.25, 1)));
}

TEST_CASE(
    "instruments beside bodies, themselves and one another continue from a saved state bit by bit")
{
    const auto wire = [](const char* name, double y, const char* way) {
        return fmt::format(R"("{}": {{"kind": "beam", "segments": [{{"length": 0.1, "radius": 4e-4,
            "EI": 1e-4, "element": 2.5e-3}}], "introducer": {{"at": [0, {}, 0.001],
            "direction": [1, 0, 0]}}, "drive": {{"insertion": {}}}}})",
                           name, y, way);
    };
    check_resumes(fmt::format(R"("gravity": [0, 0, -9.81], "bodies": {{{}, {},
        "ball": {{"kind": "rigid", "shape": {{"generate": "ball", "radius": 0.001}}, "mass": 1e-4,
                  "start": {{"place": [0.02, 0.0005, 0.001]}}}},
        "floor": {{"kind": "obstacle", "surface": {{"generate": "plane"}}}},
        "side": {{"kind": "obstacle", "surface": {{"generate": "plane", "centre": [0.03, 0, 0],
                                                  "axis": [-1, 0.3, 0]}}}}}},
        "contact": [{{"between": ["ball", "floor"], "friction": 0.3}},
                    {{"between": ["ball", "side"]}}, {{"between": ["w0", "ball"], "friction": 0.1}},
                    {{"between": ["w1", "side"], "friction": 0.1}}, {{"between": ["w0", "floor"]}},
                    {{"between": ["w0", "w1"], "friction": 0.2}}], {})",
                              wire("w0", 0, "[[0, 0.01], [1, 0.022]]"),
                              wire("w1", -0.001, "[[0, 0.01], [1, 0.031]]"), quasi_static(0.1, 1)));
}

TEST_CASE("rigid bodies, joints and springs continue from a saved state bit by bit by every rule")
{
    const std::string bodies = fmt::format(R"("bodies": {{
        "base": {{"kind": "rigid", "density": 1000, "shape": {{"generate": "box",
            "size": [0.1, 0.1, 0.04]}}, "start": {{"place": [0, 0, 0.02]}}}},
        "ball": {{"kind": "rigid", "mass": 0.2, "shape": {{"generate": "ball", "radius": 0.02}},
            "start": {{"place": [0.01, 0, 0.061], "spin": [3, 1, 2]}}, "force": [0.1, 0, 0],
            "torque": [0, 0.001, 0], "over": [[0, 0], [0.02, 1]]}},
        "arm": {{"kind": "rigid", "mass": 0.1, "shape": {{"generate": "cylinder", "radius": 0.01,
            "length": 0.06}}, "start": {{"place": [0.2, 0, 0.1], "turn": [0.3, 0, 0],
            "velocity": [0, 0.2, 0]}}}},
        "end": {{"kind": "rigid", "mass": 0.1, "shape": {{"generate": "box",
            "size": [0.02, 0.02, 0.02]}}, "start": {{"place": [0.3, 0, 0.1]}}}}, {}}},
        "contact": [{{"between": ["*", "*"], "friction": 0.4, "restitution": 0.3}}], {}, )",
                                           kPlane, kGravityDown);
    for (const char* kind : {"weld", "ball", "hinge", "slider"})
        for (const std::string& rule : kRules) {
            CAPTURE(kind);
            CAPTURE(rule);
            check_resumes(bodies +
                          fmt::format(R"("couplings": [
                {{"kind": "{}", "between": ["arm", "end"], "at": [0.25, 0, 0.1],
                  "axis": [0, 1, 0]}},
                {{"kind": "ball", "between": ["arm", "world"], "at": [0.2, 0, 0.1]}},
                {{"kind": "spring", "between": ["end", "base"], "at": [0.3, 0, 0.1],
                  "to": [0, 0, 0.04], "stiffness": 50}}], )",
                                      kind) +
                          dynamic(2e-3, 0.04, rule));
        }
    // Dragged over the floor, quasi-static; the rest finds its pairs as they touch.
    check_resumes(fmt::format(R"("bodies": {{
        "base": {{"kind": "rigid", "density": 1000, "shape": {{"generate": "box",
            "size": [0.1, 0.1, 0.04]}}, "start": {{"place": [0, 0, 0.02]}}}},
        "pusher": {{"kind": "rigid", "mass": 1, "shape": {{"generate": "ball", "radius": 0.02}},
            "start": {{"place": [-0.075, 0.01, 0.022]}}, "drive": {{"x": [[0, 0], [1, 0.02]],
            "angle": [[0, 0], [1, 0.3]]}}}}, {}}},
        "contact": [{{"between": ["*", "*"], "friction": 0.4}}], {}, {})",
                              kPlane, kGravityDown, quasi_static(0.1, 1)));
}

TEST_CASE("solids on springs, with probes, continue from a saved state bit by bit by every rule")
{
    for (const std::string& material : {kElastic, kCorotational, kNeoHooke}) {
        CAPTURE(material);
        const std::string bodies = fmt::format(R"("bodies": {{"block": {{"kind": "solid", {},
            "density": 1000, "mesh": {{"generate": "box", "size": [0.04, 0.04, 0.02],
            "cells": [2, 2, 1], "centre": [0, 0, 0.01]}}, "supports": [{{"set": "z_min",
            "normal": 1e7, "tangential": 1e6}}, {{"set": "x_min", "normal": 1e6}}],
            "probes": {{"top": {{"set": "z_max"}}, "p": {{"at": [0.001, 0.002, 0.015]}}}},
            "loads": [{{"set": "x_max", "force": [0.5, 0.1, 0], "over": [[0, 0], [1, 1]]}}]}},
            "ball": {{"kind": "rigid", "mass": 0.1, "shape": {{"generate": "ellipsoid",
            "radii": [0.01, 0.012, 0.01]}}, "start": {{"place": [0.001, 0, 0.0305]}},
            "drive": {{"z": [[0, 0], [1, -0.002]]}}}}}}, "contact": [{{"between": ["block", "ball"],
            "friction": 0.3}}], )",
                                               material);
        check_resumes(bodies + quasi_static(0.25, 1));
        for (const std::string& rule : kRules)
            check_resumes(bodies + dynamic(1e-3, 0.006, rule));
    }
}

TEST_CASE("bodies of different kinds together continue from a saved state bit by bit")
{
    for (const std::string& material : {kElastic, kCorotational, kNeoHooke}) {
        CAPTURE(material);
        const std::string bodies = fmt::format(R"("bodies": {{{},
            "ball": {{"kind": "rigid", "mass": 0.1, "shape": {{"generate": "ball",
                "radius": 0.02}}, "start": {{"place": [0.01, 0, 0.0605]}}}},
            "foot": {{"kind": "solid", "mesh": {{"generate": "box", "size": [0.03, 0.03, 0.02],
                "cells": [2, 2, 1], "element": "H8"}}, "density": 500, {},
                "start": {{"place": [-0.03, 0.003, 0.0502]}}}}, {}}}, "contact": [
            {{"between": ["block", "floor"], "friction": 0.4}},
            {{"between": ["foot", "block"], "friction": 0.4}},
            {{"between": ["ball", "block"], "friction": 0.3}}], {}, )",
                                               block("H8", material, R"("mass_damping": 0.1)"),
                                               material, kPlane, kGravityDown);
        for (const std::string& rule : kRules)
            check_resumes(bodies + dynamic(1e-3, 0.01, rule));
    }
    // A rod across a driven bar, a solid hung on a joint and a spring.
    check_resumes(fmt::format(R"("bodies": {{
        "rod": {{"kind": "rod", "segments": [{{"length": 0.2, "radius": 0.002, "EI": 0.01,
            "density": 2000, "element": 0.02}}], "shape": {{"start": [-0.1, 0, 0.01]}},
            "hold": [{{"set": "start"}}, {{"set": "end"}}]}},
        "bar": {{"kind": "rigid", "mass": 0.1, "shape": {{"generate": "cylinder", "radius": 0.005,
            "length": 0.1}}, "start": {{"turn": [1.5707963, 0, 0], "place": [0.01, 0, 0.018]}},
            "drive": {{"z": [[0, 0], [1, -0.006]], "x": [[0, 0], [1, 0.01]]}}}}}},
        "contact": [{{"between": ["rod", "bar"], "friction": 0.3}}], {})",
                              quasi_static(0.1, 1)));
    for (const std::string& material : {kElastic, kCorotational, kNeoHooke})
        check_resumes(fmt::format(R"("bodies": {{{},
            "arm": {{"kind": "rigid", "mass": 0.1, "shape": {{"generate": "box",
                "size": [0.04, 0.04, 0.02]}}, "start": {{"place": [0.07, 0, 0.02]}}}}}},
            "couplings": [{{"kind": "weld", "between": ["arm", "block"], "at": [0.05, 0, 0.02],
                  "radius": 0.015}},
                {{"kind": "spring", "between": ["arm", "world"], "at": [0.09, 0, 0.02],
                  "to": [0.09, 0, 0.2], "stiffness": 100}}], {}, {})",
                                  block("H8", material, R"("hold": [{"set": "x_min"}])"),
                                  kGravityDown, dynamic(1e-3, 0.01, kRules[1])));
}

TEST_CASE("holds that turn and joints on patches continue from a saved state bit by bit")
{
    for (const std::string& material : {kElastic, kCorotational, kNeoHooke}) {
        check_resumes(fmt::format(R"("bodies": {{{}}}, {})",
                                  block("H8", material, R"("hold": [{"set": "x_min"}, {"set":
            "x_max", "x": 0, "y": 0, "axis": [0, 0, 1], "about": [0.05, 0, 0], "angle":
            [[0, 0], [1, 0.2]]}])"),
                                  quasi_static(0.2, 1)));
        for (const char* rule : {R"("theta": 0.5)", R"("rule": "generalised_alpha")"})
            check_resumes(fmt::format(R"("bodies": {{{}}}, "couplings": [{{"kind": "hinge",
                "between": ["block", "world"], "at": [-0.05, 0, 0.02], "axis": [0, 1, 0],
                "set": "x_min"}}, {{"kind": "spring", "between": ["block", "world"], "at":
                [0.05, 0, 0.02], "to": [0.05, 0, 0.2], "stiffness": 10, "radius": 0.015}}], {}, {})",
                                      block("H8", material, R"("stiffness_damping": 0)"),
                                      kGravityDown, dynamic(1e-3, 0.008, rule)));
    }
}

TEST_CASE("solids that contacts alone hold, or nothing, continue from a saved state bit by bit")
{
    for (const std::string& material : {kElastic, kCorotational, kNeoHooke}) {
        CAPTURE(material);
        // Pushed over the floor by a ball, under its weight.
        const std::string pushed = fmt::format(R"("bodies": {{{}, {},
            "ball": {{"kind": "rigid", "mass": 0.1, "shape": {{"generate": "ball",
                "radius": 0.015}}, "start": {{"place": [-0.0655, 0, 0.02]}},
                "drive": {{"x": [[0, 0], [1, 0.006]]}}}}}}, "contact": [
            {{"between": ["block", "floor"], "friction": 0.2}},
            {{"between": ["ball", "block"], "friction": 0.3}}], {}, {})",
                                               block("H8", material, R"("mass_damping": 0)"),
                                               kPlane, kGravityDown, quasi_static(0.2, 1));
        check_resumes(pushed);
        // Thrown with a spin, under a load that pulls.
        for (const std::string& rule : kRules)
            check_resumes(fmt::format(R"("bodies": {{{}}}, {}, {})",
                                      block("T10", material, R"("loads": [{"set": "x_max",
                                          "traction": [0, 0, 200], "over": [[0, 0], [0.01, 1]]}])",
                                            0.1),
                                      kGravityDown, dynamic(2e-3, 0.02, rule)));
    }
    const std::string spinning = R"("bodies": {"block": {"kind": "solid", "mesh": {"generate":
        "box", "size": [0.1, 0.06, 0.04], "cells": [3, 2, 2], "element": "H8"}, "density": 1000, )" +
                                 kElastic + R"(, "start": {"turn": [0.3, 0.2, 0],
        "velocity": [1, 0, 0], "spin": [20, 3, 10]}}}, )";
    for (const std::string& rule : kRules)
        check_resumes(spinning + dynamic(2e-3, 0.02, rule));
}

TEST_CASE("rods on solids, and solids solved by iterations, continue from a saved state bit by bit")
{
    const auto rod_on_block = [](const std::string& material, const std::string& more) {
        return fmt::format(R"("bodies": {{{},
            "rod": {{"kind": "rod", "segments": [{{"length": 0.2, "radius": 0.002, "EI": 0.01,
                "density": 2000, "element": 0.02}}], "shape": {{"start": [-0.1, 0, 0.0421]}},
                "hold": [{{"set": "start", "x": 0, "y": [[0, 0], [1, 0.002]],
                "z": [[0, 0], [1, -0.004]]}}, {{"set": "end"}}]}}}},
            "contact": [{{"between": ["rod", "block"], "friction": 0.3}}], {})",
                           block("H8", material, R"("hold": [{"set": "z_min"}])"), more);
    };
    for (const std::string& material : {kElastic, kNeoHooke})
        check_resumes(rod_on_block(material, quasi_static(0.2, 1)));
    check_resumes(rod_on_block(kElastic, dynamic(1e-3, 0.01, kRules[1])));
}

TEST_CASE("bodies that begin inside each other continue from a saved state bit by bit")
{
    for (const char* start : {"resolve", "close"})
        for (const std::string& time : {quasi_static(0.2, 1), dynamic(1e-3, 0.01, kRules[0]),
                                        dynamic(1e-3, 0.01, kRules[2])}) {
            CAPTURE(start);
            CAPTURE(time);
            check_resumes(fmt::format(R"("bodies": {{{}, {}}}, "contact": [
                {{"between": ["block", "floor"], "friction": 0.4, "start_overlap": "{}"}}], {}, {})",
                                      block("H8", kElastic,
                                            R"("hold": [{"set": "z_max", "x": [[0, 0], [1, 0.003]],
                                            "y": 0, "z": [[0, 0], [1, -0.001]]}])",
                                            -1e-4),
                                      kPlane, start, kGravityDown, time));
        }
}

TEST_CASE("wires, nested instruments and vessels that are compliant continue from a saved state "
          "bit by bit")
{
    const std::string tube = R"("tube": {"kind": "obstacle", "surface": {"generate": "tube",
        "radius": 0.004, "centreline": {"pieces": [{"length": 0.02},
        {"radius": 0.03, "angle": 1.57}, {"length": 0.06}]}}})";
    const auto wire = [](const char* name, double radius, const std::string& more) {
        return fmt::format(R"("{}": {{"kind": "beam", "segments": [{{"length": 0.12,
            "radius": {}, "EI": 5.2e-4, "density": 7900, "element": 2.5e-3{}}}],
            "drive": {{"insertion": [[0, 0.005], [1, 0.06]], "twist": [[0, 0], [1, 1]]}}}})",
                           name, radius, more);
    };
    const std::string contact = R"("contact": [{"between": ["wire", "tube"], "friction": 0.1}], )";
    for (const std::string& time :
         {quasi_static(0.05, 1), std::string(R"("time": {"kind": "dynamic", "step": 0.05, "end": 1,
            "damping": 20})")})
        check_resumes("\"bodies\": {" + tube + ", " + wire("wire", 4.445e-4, "") + "}, " + contact +
                      time);
    check_resumes("\"bodies\": {" + tube + ", " + wire("wire", 4.445e-4, "") + "}, " + contact +
                  R"("gravity": [0, 0, -9.81], )" + quasi_static(0.05, 1));
    for (const std::string& time :
         {quasi_static(0.05, 0.5), dynamic(0.01, 0.1, R"("damping": 20)")})
        check_resumes("\"bodies\": {" + tube + ", " + wire("wire", 3e-4, "") + ", " +
                      wire("sheath", 8e-4, R"(, "inner_radius": 4e-4)") +
                      R"(}, "contact": [{"between": ["wire", "tube"], "friction": 0.1},
                      {"between": ["sheath", "tube"], "friction": 0.1},
                      {"between": ["wire", "sheath"], "friction": 0.05}], )" +
                      time);
    check_resumes("\"bodies\": {" + tube + ", " + wire("wire", 4.445e-4, "") +
                  R"(}, "contact": [{"between": ["wire", "tube"], "friction": 0.1,
                     "foundation": 1e5}], )" +
                  quasi_static(0.05, 1));
    for (const std::string& material : {kElastic, kNeoHooke})
        check_resumes(R"("bodies": {"tube": {"kind": "solid", "mesh": {"generate": "tube",
            "centreline": {"pieces": [{"length": 0.02}, {"radius": 0.03, "angle": 1.2},
            {"length": 0.02}]}, "radius": 0.004, "thickness": 0.001, "around": 8, "along": 12,
            "through": 1, "element": "H8"}, )" +
                      material + R"(, "hold": [{"set": "start"}, {"set": "end"}],
            "loads": [{"set": "inner", "pressure": 200}]}, )" +
                      wire("wire", 4.445e-4, "") + "}, " + contact + quasi_static(0.1, 1));
}

TEST_CASE("a block that lands, slides and rocks continues bit by bit after each of its steps")
{
    check_resumes(R"("bodies": {"plane": {"kind": "obstacle", "surface": {"generate": "plane"}},
        "block": {"kind": "solid", "youngs_modulus": 1e6, "poisson_ratio": 0.3, "density": 1000,
            "mesh": {"generate": "box", "size": [0.1, 0.1, 0.1], "cells": [3, 3, 3],
                     "element": "H8"},
            "start": {"place": [0, 0, 0.055], "velocity": [0.5, 0.1, 0]}}},
        "contact": [{"between": ["block", "plane"], "friction": 0.3}],
        "gravity": [0, 0, -9.81], "time": {"kind": "dynamic", "step": 0.002, "end": 0.1})",
                  true);
}

namespace {

/// Requests an end while a step is tried, not between two: after some more reads of the flag.
struct StopWithin : StepObserver {
    std::int64_t at = 0;
    std::atomic<bool> stop{false};
    std::thread late;
    void on_step(const StepRecord& r) override
    {
        if (r.step != at) return;
        late = std::thread([this] {
            std::this_thread::sleep_for(std::chrono::microseconds(200 * (at % 7)));
            stop = true;
        });
    }
    ~StopWithin() override
    {
        if (late.joinable()) late.join();
    }
};

} // namespace

TEST_CASE("a step that is interrupted leaves no mark in what is saved and reported")
{
    // Steps of some milliseconds, which end when a run in the background does.
    const Scene read =
        parse_scene(fmt::format(R"({{"schema": 1, "bodies": {{{}, {}}}, {}, "contact": [
            {{"between": ["block", "floor"], "friction": 0.4}}], {}}})",
                                block("T10", kNeoHooke, R"("mass_damping": 0.1)", 1e-4), kPlane,
                                kGravityDown, dynamic(1e-3, 0.03, kRules[1])),
                    AMONTONS_SOURCE_DIR "/test.json", {});
    const auto made = [&] { return make_simulation(read, build_obstacles(read)); };
    const std::atomic<bool> never{false};
    const auto whole = made();
    Written all;
    all.simulation = whole.get();
    REQUIRE(whole->run(all, never).status == "done");
    int interrupted = 0;
    for (const std::int64_t at : {2, 4, 5, 8, 13, 20}) {
        CAPTURE(at);
        StopWithin part;
        part.at = at;
        const auto first = made();
        const RunSummary ended = first->run(part, part.stop);
        if (ended.status != "interrupted") continue; // a busy machine: the run was quicker
        ++interrupted;
        const auto steps = std::size_t(ended.steps);
        CHECK(bits_of(all.records[steps], first->body_records())
                  .first_difference(bits_of(all.records[steps], all.bodies[steps])) == "");
        const auto second = made();
        second->restore(first->save());
        Written rest;
        rest.simulation = second.get();
        REQUIRE(second->run(rest, never).status == "done");
        REQUIRE(rest.records.size() + steps + 1 == all.records.size());
        for (std::size_t i = 0; i < rest.records.size(); ++i)
            CHECK(bits_of(rest.records[i], rest.bodies[i])
                      .first_difference(
                          bits_of(all.records[steps + 1 + i], all.bodies[steps + 1 + i])) == "");
    }
    CHECK(interrupted > 0);
}

} // namespace amontons
