#include "validation/families/wires/wires.hpp"
#include "validation/scene_run.hpp"

#include <cmath>
#include <fmt/format.h>
#include <limits>

namespace amontons::validation {
namespace {

constexpr double kDepths[] = {0.100, 0.120, 0.140, 0.180, 0.220, 0.240, 0.260, 0.300};

std::vector<Measured> against(const double (&table)[8], double most, const char* introducer)
{
    const Run r = run(scene("double-u", {std::string("bodies/wire/introducer=") + introducer}));
    std::vector<Measured> rows;
    constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
    ReferenceCurve curve{"insertion [m]", "push force [N]", {}, {}, {}};
    for (const Step& s : r.steps)
        curve.add(s.insertion, kNone, s.push);
    for (std::size_t i = 0; i < 8; ++i) {
        const double depth = kDepths[i];
        const double force = mean(r, &Step::push, depth - 0.005, depth);
        curve.add(depth - 0.0025, table[i], kNone);
        const std::string name = fmt::format("push force, 5 mm before {:.0f} mm [N]", 1e3 * depth);
        // The wire's free end decides at 180 and 300 mm, where little force is left; 260 mm lies
        // on a snap.
        if (depth == 0.180 || depth == 0.300)
            rows.push_back(absolute(name + ", absolute", table[i], force, 0.006));
        else
            rows.push_back(relative(name, table[i], force, depth == 0.260 ? 0.03 : 0.015));
    }
    rows.front().curve = std::move(curve);
    rows.push_back(relative("largest push force [N]", most, largest(r, &Step::push), 0.015));
    add_energy_and_certificates(rows, r, 1e-3);
    return rows;
}

} // namespace

std::vector<Measured> double_u()
{
    return against({0.320, 0.440, 0.381, 0.068, 0.675, 0.607, 0.364, 0.121}, 0.680,
                   "{\"fade\":0.005}");
}

std::vector<Measured> double_u_rigid_end()
{
    return against({0.329, 0.429, 0.376, 0.062, 0.673, 0.607, 0.367, 0.118}, 0.677, "{}");
}

} // namespace amontons::validation
