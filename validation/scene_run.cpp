#include "validation/scene_run.hpp"

#include "solver/obstacle/build.hpp"
#include "solver/scene/read.hpp"
#include "validation/scene_text.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <stdexcept>

namespace amontons::validation {
namespace {

struct CollectWires : StepObserver {
    std::vector<Step>& steps;
    int& halved;
    CollectWires(std::vector<Step>& s, int& h) : steps(s), halved(h) {}
    void on_step(const StepRecord& r) override
    {
        Step s;
        s.time = r.time;
        s.energy = r.energy;
        s.contacts = int(r.contacts.size());
        s.retries = r.retries;
        halved += r.retries > 0;
        for (const Quantity& q : r.quantities) {
            if (q.name == "insertion") s.insertion = q.value;
            if (q.name == "base_twist") s.twist = q.value;
            if (q.name == "push_force") s.push = q.value;
            if (q.name == "torque") s.torque = q.value;
            if (q.name == "normal_force_sum") s.normal_sum = q.value;
            if (q.name == "tip_x") s.tip.x() = q.value;
            if (q.name == "tip_y") s.tip.y() = q.value;
            if (q.name == "tip_z") s.tip.z() = q.value;
        }
        for (const Vec3& x : r.beams.front().points)
            s.out_of_plane = std::max(s.out_of_plane, std::abs(x.z()));
        steps.push_back(s);
    }
};

} // namespace

Scene scene(std::string_view name, const std::vector<std::string>& overrides)
{
    return parse_scene(scene_text(name), std::string(name), overrides);
}

Run run(const Scene& scene)
{
    Run r;
    const std::unique_ptr<Simulation> simulation = make_simulation(scene, build_obstacles(scene));
    CollectWires collect(r.steps, r.halved);
    const std::atomic<bool> never{false};
    r.summary = simulation->run(collect, never);
    if (r.summary.status != "done") throw std::runtime_error(r.summary.message);
    return r;
}

double mean(const Run& run, double Step::*value, double from, double to)
{
    double sum = 0, length = 0;
    for (std::size_t i = 1; i < run.steps.size(); ++i) {
        const Step &a = run.steps[i - 1], &b = run.steps[i];
        const double low = std::max(from, a.insertion), high = std::min(to, b.insertion);
        if (!(high > low)) continue;
        const double slope = (b.*value - a.*value) / (b.insertion - a.insertion);
        const double middle = a.*value + slope * (0.5 * (low + high) - a.insertion);
        sum += (high - low) * middle;
        length += high - low;
    }
    if (!(length > 0.99 * (to - from))) return std::numeric_limits<double>::quiet_NaN();
    return sum / length;
}

double ripple(const Run& run, double Step::*value, double from, double to)
{
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const Step& s : run.steps) {
        if (s.insertion < from || s.insertion > to) continue;
        low = std::min(low, s.*value);
        high = std::max(high, s.*value);
    }
    return 0.5 * (high - low);
}

double largest(const Run& run, double Step::*value)
{
    double high = -std::numeric_limits<double>::infinity();
    for (const Step& s : run.steps)
        high = std::max(high, s.*value);
    return high;
}

double value_at(const Run& run, double Step::*value, double insertion, bool back)
{
    for (std::size_t i = 1; i < run.steps.size(); ++i) {
        const Step &a = run.steps[i - 1], &b = run.steps[i];
        if (back ? !(b.insertion < a.insertion && b.insertion <= insertion &&
                     insertion <= a.insertion)
                 : !(b.insertion > a.insertion && a.insertion <= insertion &&
                     insertion <= b.insertion))
            continue;
        const double t = (insertion - a.insertion) / (b.insertion - a.insertion);
        return a.*value + t * (b.*value - a.*value);
    }
    return std::numeric_limits<double>::quiet_NaN();
}

void add_energy_and_certificates(std::vector<Measured>& rows, const Run& run, double tolerance,
                                 const std::string& of)
{
    const EnergyRecord& e = run.summary.energy;
    rows.push_back(
        at_most("energy error, of the work" + of, e.error() / e.work_absolute, tolerance));
    rows.back().note =
        fmt::format("work {:.4e} J, elastic {:.4e}, friction {:.4e}, released {:.4e}", e.work,
                    e.elastic, e.friction, e.released);
    rows.push_back(at_most("steps without certificate" + of, run.summary.uncertified_steps, 0));
    rows.back().note = fmt::format("{}; worst error {:.1e}", story(run), run.summary.worst_error);
}

std::string story(const Run& run)
{
    std::string text = fmt::format("{} steps, {} halved, {} snaps", run.summary.steps, run.halved,
                                   run.summary.snaps.size());
    for (std::size_t i = 0; i < std::min<std::size_t>(run.summary.snaps.size(), 6); ++i)
        text += fmt::format("{} {:.1f} mm ({:.1e} J)", i ? "," : ":",
                            1e3 * run.summary.snaps[i].depth, run.summary.snaps[i].released);
    return text;
}

Scene scaled(Scene s, double length, double force)
{
    const auto pair = [](std::array<double, 2>& v, double by) {
        for (double& x : v)
            x *= by;
    };
    for (ObstacleInput& o : s.obstacles) {
        o.surface.radius *= length;
        o.surface.centre *= length;
        o.surface.resolution *= length;
        o.surface.centreline.start *= length;
        for (CentrelinePiece& p : o.surface.centreline.pieces) {
            p.length *= length;
            p.radius *= length;
        }
    }
    for (BeamInput& b : s.beams) {
        for (BeamSegment& g : b.segments) {
            g.length *= length;
            g.radius *= length;
            g.inner_radius *= length;
            g.element *= length;
            g.curvature /= length;
            pair(g.EI, force * length * length);
            pair(g.EI_across, force * length * length);
            pair(g.GJ, force * length * length);
            pair(g.EA, force);
            pair(g.GA, force);
        }
        b.contact_spacing *= length;
        b.introducer.at *= length;
        b.introducer.length *= length;
        b.introducer.fade *= length;
        for (auto& point : b.insertion)
            point[1] *= length;
    }
    s.output.cluster *= length;
    return s;
}

} // namespace amontons::validation
