#include "validation/families/wires/wires.hpp"
#include "validation/scene_run.hpp"

#include <cmath>
#include <fmt/format.h>
#include <limits>

namespace amontons::validation {
namespace {

constexpr double kTorusEI = 5.2e-4, kTorusBend = 0.050, kTorusClearance = 1e-3 - 4.445e-4;
constexpr double kWindow = 0.020;

} // namespace

std::vector<Measured> torus()
{
    const Run r = run(scene("torus"));
    const double R = kTorusBend + kTorusClearance;
    const double force = kTorusEI / (2 * R * R), growth = kTorusEI / (R * R * R) * kWindow;
    std::vector<Measured> rows;
    // The steady part: from 150 mm on the tip's end of the wire has the form that it keeps.
    const double from = 0.150, to = 0.230;
    rows.push_back(relative("mean push force, 150 to 230 mm [N]", force,
                            mean(r, &Step::push, from, to), 1e-3));
    const double late = mean(r, &Step::normal_sum, to - kWindow, to);
    const double early = mean(r, &Step::normal_sum, to - 3 * kWindow, to - 2 * kWindow);
    rows.push_back(relative("growth of the wall force per 20 mm, 170 to 230 mm [N]", growth,
                            (late - early) / 2, 1e-3));
    rows.push_back(at_most("ripple of the push force, of its mean, contacts 1.25 mm apart",
                           ripple(r, &Step::push, from, to) / force, 5e-3));
    add_energy_and_certificates(rows, r, 2e-4);
    return rows;
}

std::vector<Measured> torus_friction()
{
    // As the frictionless torus, with a bend long enough for 240 mm and a sheath's end that fades.
    const Run r = run(scene(
        "torus",
        {"bodies/tube/surface/centreline/"
         "pieces=[{\"length\":0.020},{\"radius\":0.050,\"angle\":5.2}]",
         "bodies/wire/segments=[{\"length\":0.270,\"radius\":4.445e-4,\"EI\":5.2e-4,\"EA\":5000,"
         "\"element\":2.5e-3}]",
         "bodies/wire/introducer={\"fade\":0.005}",
         "bodies/wire/drive/insertion=[[0,0],[12,0.240]]",
         "contact=[{\"between\":[\"wire\",\"tube\"],\"friction\":0.1}]", "time/end=12"}));
    const double reference[] = {0.2321, 0.2448, 0.2580, 0.2715};
    std::vector<Measured> rows;
    constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
    ReferenceCurve curve{"insertion [m]", "push force [N], means over 20 mm", {}, {}, {}};
    for (const Step& s : r.steps)
        if (s.insertion > 0.12) curve.add(s.insertion, kNone, s.push);
    for (int i = 0; i < 4; ++i) {
        const double from = 0.160 + i * kWindow;
        rows.push_back(relative(fmt::format("mean push force, {:.0f} to {:.0f} mm [N]", 1e3 * from,
                                            1e3 * (from + kWindow)),
                                reference[i], mean(r, &Step::push, from, from + kWindow), 0.015));
        curve.add(from + kWindow / 2, reference[i], kNone);
    }
    rows.front().curve = std::move(curve);
    add_energy_and_certificates(rows, r, 1e-3);
    return rows;
}

} // namespace amontons::validation
