#include "validation/families/wires/wires.hpp"
#include "validation/scene_run.hpp"

#include "solver/beam/rotation.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>

namespace amontons::validation {
namespace {

/// Largest difference of two runs' push forces, of the largest force, over the insertions where
/// both have a step: rounding may decide whether a step is halved, and between steps there is
/// nothing to compare.
/// @param force, length  what forces and lengths of `b` are multiplied with
Measured compare(std::string name, const Run& a, const Run& b, double length, double force,
                 double tolerance)
{
    const double size = largest(a, &Step::push);
    double worst = 0, where = 0;
    std::size_t common = 0, beyond = 0, k = 0;
    for (const Step& s : a.steps) {
        const double here = s.insertion * length, near = 1e-9 * a.steps.back().insertion * length;
        while (k + 1 < b.steps.size() && b.steps[k].insertion < here - near)
            ++k;
        if (std::abs(b.steps[k].insertion - here) > near) continue;
        ++common;
        const double miss = std::abs(s.push - b.steps[k].push / force) / size;
        beyond += !(miss <= tolerance);
        if (miss > worst || std::isnan(miss)) {
            worst = miss;
            where = s.insertion;
        }
    }
    if (common < a.steps.size() * 9 / 10) worst = std::numeric_limits<double>::quiet_NaN();
    Measured m = at_most(std::move(name), worst, tolerance);
    m.note = fmt::format(
        "{} and {} steps, {} at the same place, {} beyond the tolerance; worst at {:.2f} mm",
        a.steps.size() - 1, b.steps.size() - 1, common - 1, beyond, 1e3 * where);
    return m;
}

// Means below this share of the largest force are left out of relative changes.
constexpr double kWorthIt = 0.05;

Scene turned(Scene s, const Mat3& R, const Vec3& shift)
{
    for (ObstacleInput& o : s.obstacles) {
        CentrelineInput& c = o.surface.centreline;
        c.start = R * c.start + shift;
        c.direction = R * c.direction;
        c.normal = R * c.normal;
    }
    for (BeamInput& b : s.beams) {
        IntroducerInput& in = b.introducer;
        in.at = R * in.at + shift;
        in.direction = R * in.direction;
        if (in.normal) in.normal = R * *in.normal;
        if (b.plane) b.plane = R * *b.plane;
    }
    return s;
}

} // namespace

std::vector<Measured> stiffness_doubled()
{
    std::vector<Measured> rows;
    for (const char* name : {"torus", "double-u"}) {
        const Scene s = scene(name);
        rows.push_back(compare(fmt::format("push force halved again, {}", name), run(s),
                               run(scaled(s, 1, 2)), 1, 2, 1e-6));
    }
    return rows;
}

std::vector<Measured> lengths_scaled()
{
    std::vector<Measured> rows;
    const double size = 1.7;
    for (const char* name : {"torus", "double-u"}) {
        const Scene s = scene(name);
        rows.push_back(compare(fmt::format("push force times 1.7^2, {}", name), run(s),
                               run(scaled(s, size, 1 / (size * size))), size, 1 / (size * size),
                               1e-6));
    }
    return rows;
}

std::vector<Measured> millimetres()
{
    std::vector<Measured> rows;
    for (const char* name : {"torus", "double-u"}) {
        const Scene s = scene(name);
        rows.push_back(compare(fmt::format("push force, {}", name), run(s), run(scaled(s, 1000, 1)),
                               1000, 1, 1e-8));
    }
    return rows;
}

std::vector<Measured> frame_turned()
{
    Quaternion q;
    rotate_in_body(q.q, Vec3(0.8, -0.5, 1.9));
    // The last is spatial: its natural curvature bends out of the tube's plane.
    const char* wire = "bodies/wire={\"kind\":\"beam\",\"segments\":[{\"length\":0.330,"
                       "\"radius\":4.445e-4,\"EI\":5.2e-4,\"EA\":5000,\"element\":2.5e-3,"
                       "\"curvature\":1,\"curvature_angle\":1.5707963267948966}],"
                       "\"contact_spacing\":1.25e-3,"
                       "\"introducer\":{\"fade\":0.005,\"normal\":[0,1,0]},"
                       "\"drive\":{\"insertion\":[[0,0],[15,0.300]]}}";
    const std::pair<const char*, Scene> scenes[] = {
        {"torus", scene("torus")},
        {"double-u", scene("double-u")},
        {"double-u in space", scene("double-u", {wire})}};
    std::vector<Measured> rows;
    for (const auto& [name, s] : scenes)
        rows.push_back(compare(fmt::format("push force, {}", name), run(s),
                               run(turned(s, rotation_matrix(q.q), Vec3(0.3, -0.2, 0.5))), 1, 1,
                               1e-6));
    return rows;
}

std::vector<Measured> retrace()
{
    const Run r = run(
        scene("torus", {"bodies/wire/drive/insertion=[[0,0],[11.5,0.230],[23,0]]", "time/end=23"}));
    const double size = largest(r, &Step::push);
    double worst = 0, where = 0;
    for (const Step& s : r.steps) {
        if (s.time >= 11.5 || s.insertion <= 0) continue;
        const double miss = std::abs(s.push - value_at(r, &Step::push, s.insertion, true)) / size;
        if (miss > worst || std::isnan(miss)) {
            worst = miss;
            where = s.insertion;
        }
    }
    std::vector<Measured> rows;
    rows.push_back(
        at_most("push against pull at the same depth, of the largest force", worst, 1e-6));
    rows.back().note = fmt::format("worst at {:.2f} mm; {}", 1e3 * where, story(r));
    rows.push_back(at_most("push force when all is back [N]", r.steps.back().push, 1e-6 * size));
    return rows;
}

std::vector<Measured> refinement()
{
    const Run base = run(scene("double-u"));
    struct Finer {
        const char* what;
        bool of_local; // change relative to the local mean, else to the largest force
        std::vector<std::string> overrides;
    };
    const char* half_element = "bodies/wire/segments/0/element=1.25e-3";
    const Finer finer[] = {{"elements of 1.25 mm, of the mean", true, {half_element}},
                           {"steps of 0.2 mm, of the mean", true, {"time/step=0.01"}},
                           {"elements and contacts halved, of the largest force",
                            false,
                            {half_element, "bodies/wire/contact_spacing=0.625e-3"}}};
    std::vector<Measured> rows;
    const double size = largest(base, &Step::push);
    for (const Finer& f : finer) {
        const Run r = run(scene("double-u", f.overrides));
        const auto snaps_near = [](const Run& x, double depth) {
            return std::any_of(x.summary.snaps.begin(), x.summary.snaps.end(),
                               [&](const SnapRecord& s) {
                                   return s.depth > depth - 0.010 && s.depth < depth + 0.002;
                               });
        };
        double worst = 0, where = 0;
        for (double depth = 0.030; depth < 0.3001; depth += 0.005) {
            if (snaps_near(base, depth) || snaps_near(r, depth)) continue;
            const double a = mean(base, &Step::push, depth - 0.005, depth);
            const double b = mean(r, &Step::push, depth - 0.005, depth);
            if (std::abs(a) < kWorthIt * size) continue;
            const double miss = std::abs(b - a) / (f.of_local ? std::abs(a) : size);
            if (miss > worst) {
                worst = miss;
                where = depth;
            }
        }
        rows.push_back(at_most(fmt::format("change of 5 mm means, {}", f.what), worst, 0.01));
        rows.back().note = fmt::format("worst before {:.0f} mm: {:.4f} and {:.4f} N; {}",
                                       1e3 * where, mean(base, &Step::push, where - 0.005, where),
                                       mean(r, &Step::push, where - 0.005, where), story(r));
    }
    return rows;
}

} // namespace amontons::validation
