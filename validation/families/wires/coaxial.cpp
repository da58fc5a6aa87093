#include "validation/families/wires/wires.hpp"

#include "solver/obstacle/build.hpp"
#include "solver/scene/read.hpp"
#include "solver/step/simulation.hpp"
#include "validation/scene_run.hpp"

#include <cmath>
#include <fmt/format.h>
#include <map>
#include <stdexcept>

namespace amontons::validation {
namespace {

constexpr double kWireEI = 5.2e-4, kCatheterEI = 1.9e-4, kWireRadius = 4.445e-4;

/// Every step's quantities by name, and the last step whole.
struct History : StepObserver {
    std::vector<std::map<std::string, double>> steps;
    StepRecord last;
    RunSummary summary;
    void on_step(const StepRecord& r) override
    {
        steps.emplace_back();
        for (const Quantity& q : r.quantities)
            steps.back()[q.name] = q.value;
        last = r;
    }
    double mean(const std::string& name, const std::string& along, double from, double to) const
    {
        double sum = 0;
        int count = 0;
        for (const auto& s : steps)
            if (s.at(along) >= from && s.at(along) <= to) sum += s.at(name), ++count;
        return sum / count;
    }
};

History run_scene(Scene scene)
{
    const auto simulation = make_simulation(scene, build_obstacles(scene));
    History h;
    const std::atomic<bool> never{false};
    h.summary = simulation->run(h, never);
    if (h.summary.status != "done") throw std::runtime_error(h.summary.message);
    return h;
}

History run_text(const std::string& text)
{
    return run_scene(parse_scene(text, "coaxial"));
}

void add_balance(std::vector<Measured>& rows, const History& h, double tolerance,
                 const std::string& of)
{
    const EnergyRecord& e = h.summary.energy;
    rows.push_back(
        at_most("energy error, of the work" + of, e.error() / e.work_absolute, tolerance));
    rows.push_back(at_most("steps without certificate" + of, h.summary.uncertified_steps, 0));
}

/// Wire and catheter with natural curvatures, pushed out into free space.
std::string concentric(double wire_curvature, double catheter_curvature, double clearance)
{
    return fmt::format(
        R"({{"schema": 1, "bodies": {{
        "wire": {{"kind": "beam", "segments": [{{"length": 0.2, "radius": {0}, "EI": {1},
          "curvature": {2}, "element": 2.5e-3}}], "drive": {{"insertion": [[0, 0.03], [1, 0.1]]}}}},
        "catheter": {{"kind": "beam", "segments": [{{"length": 0.2, "radius": 8.35e-4,
          "inner_radius": {3}, "EI": {4}, "curvature": {5}, "element": 2.5e-3}}],
          "drive": {{"insertion": [[0, 0.03], [1, 0.1]]}}}}}},
        "contact": [{{"between": ["wire", "catheter"]}}],
        "time": {{"step": 0.02, "end": 1}}}})",
        kWireRadius, kWireEI, wire_curvature, kWireRadius + clearance, kCatheterEI,
        catheter_curvature);
}

} // namespace

std::vector<Measured> coaxial_concentric()
{
    std::vector<Measured> rows;
    struct Pair {
        double wire, catheter, clearance = 1e-6;
    };
    for (const Pair& k : {Pair{20, 5}, Pair{0, 15}, Pair{-5, 5}, Pair{20, 5, 0}}) {
        const History h = run_text(concentric(k.wire, k.catheter, k.clearance));
        const double both = (kWireEI * k.wire + kCatheterEI * k.catheter) / (kWireEI + kCatheterEI);
        const std::string name = fmt::format(", {} and {} 1/m{}", k.wire, k.catheter,
                                             k.clearance > 0 ? "" : ", no clearance");
        // The free ends have a layer of their own: the middle half, by the angle it turns.
        const BeamRecord& wire = h.last.beams[0];
        const Field* curvature = nullptr;
        for (const Field& f : wire.fields)
            if (f.name == "curvature") curvature = &f;
        double sum = 0;
        int count = 0;
        for (std::size_t i = wire.points.size() / 4; i < 3 * wire.points.size() / 4; ++i)
            sum += curvature->values[i], ++count;
        rows.push_back(
            relative("curvature of both [1/m]" + name, std::abs(both), sum / count, 5e-3));
        // What is pushed out runs from straight to the common curvature.
        const auto energy = [&](double EI, double own) {
            return 0.5 * EI * (std::pow(both - own, 2) - own * own);
        };
        rows.push_back(relative("push of both, 50 to 100 mm [N]" + name,
                                energy(kWireEI, k.wire) + energy(kCatheterEI, k.catheter),
                                h.mean("wire_push_force", "wire_depth", 0.05, 0.1) +
                                    h.mean("catheter_push_force", "wire_depth", 0.05, 0.1),
                                5e-3));
        add_balance(rows, h, 2e-3, name);
    }
    return rows;
}

std::vector<Measured> coaxial_torus()
{
    const double bend = 0.05, tube = 2e-3, outer = 8.35e-4, bore = 5e-4;
    const History h = run_text(fmt::format(
        R"({{"schema": 1, "bodies": {{
        "tube": {{"kind": "obstacle", "surface": {{"generate": "tube", "radius": {0},
          "centreline": {{"pieces": [{{"length": 0.02}}, {{"radius": {1}, "angle": 4.4}}]}}}}}},
        "wire": {{"kind": "beam", "segments": [{{"length": 0.27, "radius": {2}, "EI": {3},
          "EA": 5000, "element": 2.5e-3}}], "drive": {{"insertion": [[0, 0], [12, 0.23]]}}}},
        "catheter": {{"kind": "beam", "segments": [{{"length": 0.27, "radius": {4},
          "inner_radius": {5}, "EI": {6}, "EA": 5000, "element": 2.5e-3}}],
          "drive": {{"insertion": [[0, 0], [12, 0.23]]}}}}}},
        "contact": [{{"between": ["wire", "catheter"]}}, {{"between": ["wire", "tube"]}},
                    {{"between": ["catheter", "tube"]}}],
        "time": {{"step": 0.02, "end": 12}}}})",
        tube, bend, kWireRadius, kWireEI, outer, bore, kCatheterEI));
    // The catheter lies on the outside of the tube, the wire on the outside of its bore.
    const double catheter = bend + tube - outer, wire = catheter + bore - kWireRadius;
    const double push = kCatheterEI / (2 * catheter * catheter) + kWireEI / (2 * wire * wire);
    std::vector<Measured> rows;
    rows.push_back(relative("push of both, 190 to 230 mm [N]", push,
                            h.mean("wire_push_force", "wire_depth", 0.19, 0.23) +
                                h.mean("catheter_push_force", "wire_depth", 0.19, 0.23),
                            5e-3));
    add_balance(rows, h, 1e-3, "");
    return rows;
}

std::vector<Measured> coaxial_units()
{
    // A bend with friction everywhere: wire in, catheter over it, wire turned and pulled back.
    const Scene metres = parse_scene(fmt::format(R"({{"schema": 1, "bodies": {{
        "tube": {{"kind": "obstacle", "surface": {{"generate": "tube", "radius": 0.003,
          "centreline": {{"pieces": [{{"length": 0.01}}, {{"radius": 0.03, "angle": 2}}]}}}}}},
        "wire": {{"kind": "beam", "segments": [
            {{"length": 0.08, "radius": {0}, "EI": {1}, "element": 2.5e-3}},
            {{"length": 0.02, "radius": {0}, "EI": 1e-4, "curvature": 40, "element": 2.5e-3}}],
          "drive": {{"insertion": [[0, 0], [1, 0.05], [3, 0.05], [4, 0.02]],
                     "twist": [[2, 0], [3, 1]]}}}},
        "catheter": {{"kind": "beam", "segments": [{{"length": 0.1, "radius": 8.35e-4,
          "inner_radius": 5e-4, "EI": {2}, "element": 2.5e-3}}],
          "drive": {{"insertion": [[1, 0], [2, 0.04]]}}}}}},
        "contact": [{{"between": ["wire", "tube"], "friction": 0.1}},
                    {{"between": ["catheter", "tube"], "friction": 0.1}},
                    {{"between": ["catheter", "wire"], "friction": 0.1}}],
        "time": {{"step": 0.02, "end": 4}}}})",
                                                 kWireRadius, kWireEI, kCatheterEI),
                                     "units");
    const History m = run_scene(metres), mm = run_scene(scaled(metres, 1e3, 1));
    double push = 0, tip = 0, largest = 0;
    for (std::size_t i = 0; i < std::min(m.steps.size(), mm.steps.size()); ++i) {
        const auto &a = m.steps[i], &b = mm.steps[i];
        for (const char* name : {"wire_push_force", "catheter_push_force"}) {
            raise_to(push, std::abs(a.at(name) - b.at(name)));
            raise_to(largest, std::abs(a.at(name)));
        }
        for (const char* name : {"wire_tip_x", "wire_tip_y", "wire_tip_z"})
            raise_to(tip, std::abs(a.at(name) - 1e-3 * b.at(name)));
    }
    std::vector<Measured> rows;
    rows.push_back(
        absolute("steps in millimetres", double(m.steps.size()), double(mm.steps.size()), 0));
    rows.push_back(at_most("push forces differ, of the largest", push / largest, 1e-5));
    rows.push_back(at_most("tips differ [m]", tip, 1e-9));
    add_balance(rows, m, 1e-2, "");
    return rows;
}

} // namespace amontons::validation
