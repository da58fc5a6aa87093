// A wire fed into a ball until it fills it with its own coils: nothing passes.

#include "validation/families/rods/nest.hpp"
#include "mesh/base/curve.hpp"
#include "validation/families/rods/rods.hpp"
#include "validation/scene_run.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <fmt/format.h>
#include <stdexcept>

namespace amontons::validation {
namespace {

/// Examines every step as it comes.
struct Watch : StepObserver {
    const Scene& scene;
    std::FILE* log;
    Nest nest;
    std::vector<Vec3> before;

    Watch(const Scene& s, std::FILE* l) : scene(s), log(l) {}

    /// The part of the wire that is out of its sheath.
    std::vector<Vec3> out_of_sheath(const StepRecord& step) const
    {
        const std::vector<Vec3>& all = step.beams.at(0).points;
        const double length = scene.rods[0].segments[0].length;
        const double out = curve_value(scene.rods[0].fed, step.time) / length;
        const auto nodes = std::size_t(out * double(all.size() - 1));
        return {all.end() - std::ptrdiff_t(nodes), all.end()};
    }

    void on_step(const StepRecord& step) override
    {
        const double radius = scene.rods[0].segments[0].radius,
                     ball = scene.obstacles[0].surface.radius;
        const std::vector<Vec3>& now = step.beams.at(0).points;
        nest.least = std::min(nest.least, least_distance(refined(now), radius) / (2 * radius));
        // Two places that are a diameter apart before and after may have passed through each other
        // in between: examined on the straight ways between.
        double way = 0;
        for (std::size_t i = 0; i < before.size(); ++i)
            way = std::max(way, (now[i] - before[i]).norm());
        const int parts = int(std::ceil(4 * way / radius));
        for (int k = 1; k < parts; ++k) {
            std::vector<Vec3> between = before;
            for (std::size_t i = 0; i < between.size(); ++i)
                between[i] += double(k) / parts * (now[i] - between[i]);
            nest.least_between =
                std::min(nest.least_between, least_distance(between, radius) / (2 * radius));
        }
        before = now;
        for (const Vec3& x : refined(out_of_sheath(step)))
            nest.beyond = std::max(nest.beyond, (x.norm() + radius - ball) / (2 * radius));
        int own = 0;
        for (const ContactRecord& c : step.contacts)
            if (c.body_a == c.body_b) ++own;
        nest.contacts = std::max(nest.contacts, int(step.contacts.size()));
        nest.own = std::max(nest.own, own);
        nest.steps = step.step;
        nest.seconds += step.seconds;
        nest.error = std::max(nest.error, step.certificate.error);
        if (!step.certificate.certified) ++nest.uncertified;
        if (!log || step.step % 20 != 0) return;
        double push = 0;
        for (const Quantity& q : step.quantities)
            if (q.name == "wire_push_force") push = q.value;
        fmt::print(
            log,
            "step {:5}  t {:.4f} s  {:4} contacts ({:4} of the wire with itself)  push {:.3g} "
            "N  {:3} factors  {:.2f} s, {:.0f} s in all  least distance {:.4f}, between steps "
            "{:.4f}  beyond the ball {:.4f}  error {:.1e}\n",
            step.step, step.time, step.contacts.size(), own, push, step.factorisations,
            step.seconds, nest.seconds, nest.least, nest.least_between, nest.beyond, nest.error);
        std::fflush(log);
    }
};

} // namespace

Nest fill_nest(const Scene& scene, std::FILE* log)
{
    Watch watch(scene, log);
    const std::atomic<bool> stop{false};
    const RunSummary summary = make_simulation(scene, build_obstacles(scene))->run(watch, stop);
    if (summary.status != "done") throw std::runtime_error(summary.message);
    watch.nest.energy_error = summary.energy.error() / summary.energy.work;
    return watch.nest;
}

std::vector<Measured> rod_nest()
{
    std::vector<Measured> rows;
    for (const char* friction : {"0"}) {
        // A smaller ball, with less wire: see cases/rod-nest/README.md.
        const Nest n = fill_nest(
            scene("nest",
                  {"bodies.ball.surface.radius=0.006", "bodies.wire.segments.0.length=0.12",
                   "bodies.wire.segments.0.radius=0.001", "bodies.wire.segments.0.element=0.00125",
                   "bodies.wire.shape.points.0.at=[-0.1217,0.003,0]",
                   "bodies.wire.shape.points.1.at=[-0.0017,0.003,0]",
                   "bodies.wire.fed=[[0,0.001],[0.19,0.115]]", "time.end=0.19",
                   std::string("contact.0.friction=") + friction,
                   std::string("contact.1.friction=") + friction}));
        const std::string at = std::string(", friction ") + friction;
        // Lines touch every 1.25 radii; bent to 4 radii they are apart by h^2 / 8R less in between.
        rows.push_back(relative("least distance of middle lines over the diameter, all steps" + at,
                                1, n.least, 2.5e-2));
        rows.push_back(absolute("how much nearer than half a diameter between steps" + at, 0,
                                std::max(0.0, 0.5 - n.least_between), 0));
        rows.push_back(absolute("how far out of the ball, in diameters, all steps" + at, 0,
                                std::max(0.0, n.beyond), 2e-2));
        rows.push_back(absolute("steps without certificate" + at, 0, n.uncertified, 0));
        rows.push_back(absolute("contacts short of 80" + at, 0, std::max(0, 80 - n.contacts), 0));
        rows.push_back(absolute("energy error over the work" + at, 0, n.energy_error, 2e-2));
    }
    return rows;
}

} // namespace amontons::validation
