// A13, A17: impacts of elastic bodies.

#include "validation/families/solids/solids.hpp"
#include "validation/solid_meshes.hpp"
#include "validation/solid_run.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace amontons::validation {

std::vector<Measured> bar_impact()
{
    const double L = 10, c = 30, p_exact = 300, side = 0.05;
    std::vector<Measured> rows;
    for (const bool euler : {true, false}) {
        const int cells = 200;
        SolidScene s("an elastic bar against a wall");
        SolidInput& b =
            s.solid("bar", 900, 0,
                    lattice_mesh({graded(L, cells, 1), {0, side}, {0, side}}, ElementKind::H8));
        b.density = 1;
        b.hold = {hold("all", {}, still(), still())};
        b.start.place = {5, 0, 0};
        b.start.velocity = {-10, 0, 0};
        s.plane("wall", Vec3::Zero(), Vec3::UnitX());
        s.touch("bar", "wall", 0, "x_min").reach = 8;
        s.scene.time.kind = "dynamic";
        s.scene.time.step = L / cells / c; // a wave passes a cell in a step
        s.scene.time.end = 1.5;
        if (!euler) s.scene.time.rule = "generalised_alpha";
        const SolidRun run = run_solids(s.scene);
        double first = 0, last = 0, impulse = 0, high = 0, low = 1e300;
        double middle = 0;
        int count = 0;
        for (const StepRecord& r : run.steps) {
            double f = 0;
            for (const ContactRecord& k : r.contacts)
                f += k.normal_force;
            const double p = f / (side * side);
            if (p > 0.05 * p_exact) {
                if (first == 0) first = r.time - r.step_length;
                last = r.time;
            }
            impulse += p * r.step_length;
            // A tenth of the contact's time after its start and before its end.
            if (r.time > 0.5 + 0.0667 && r.time < 1.1667 - 0.0667) {
                raise_to(high, p);
                low = std::min(low, p);
                middle += p;
                ++count;
            }
        }
        const std::string of = euler ? ", implicit Euler" : ", generalised-alpha";
        rows.push_back(relative("mean pressure" + of, p_exact, middle / count, 1e-2));
        rows.back().note = fmt::format("from a tenth of the contact on to nine tenths; impulse "
                                       "over the exact time {:.2f}",
                                       impulse / (2.0 / 3));
        rows.push_back(at_most("oscillation of the pressure" + of,
                               std::max(high - p_exact, p_exact - low) / p_exact, 0.1));
        rows.push_back(absolute("time of impact [s]" + of, 0.5, first, 0.01));
        rows.push_back(absolute("time of contact [s]" + of, 0.666666667, last - first, 0.03));
        const double mass = L * side * side;
        const EnergyRecord& e = run.summary.energy;
        rows.push_back(
            at_most("energy error, of the start's" + of, e.error() / (0.5 * mass * 100), 1e-8));
        rows.back().note =
            fmt::format("rebound at {:.3f} m/s of 10, {:.2e} of the energy lost",
                        run.quantity("momentum_x") / mass, e.released / (0.5 * mass * 100));
        rows.push_back(at_most("steps without certificate" + of, run.summary.uncertified_steps, 0));
    }
    rows.push_back(left_out("A13: speed of the rebound, 10 m/s",
                            "waves in 200 cells lose energy by the rule, and with it speed: how "
                            "much is reported beside the energy's error"));
    rows.push_back(left_out("A13: largest shortening of the bar, 3.333 m",
                            "a third of the length: strains of 1/3 in elements of small strains "
                            "follow from the pressure and the time of contact"));
    return rows;
}

std::vector<Measured> ball_impact()
{
    // Two equal balls are one of them against the plane between, at half the speed and approach.
    const double R = 0.01, E = 7e10, nu = 0.25, v = 0.1;
    // The mass of the whole ball in its lower half: only the contact yields at this speed.
    SolidScene s("an elastic ball against a plane");
    const double a = 1.7e-4, share = 0.784; // of a half ball's volume within the mesh's rim
    SolidInput& b = s.solid("ball", E, nu, hemisphere(R, a, a / 4, false, false));
    b.density = 2700 * 2 / share;
    b.hold = {hold("x_min", still(), {}, {}), hold("y_min", {}, still(), {})};
    b.start.velocity = {0, 0, -v};
    b.start.place = {0, 0, 3e-7}; // a step before they touch
    s.plane("plane", Vec3::Zero(), Vec3::UnitZ());
    s.touch("ball", "plane", 0, "low").reach = 0.02 * R;
    s.scene.time.kind = "dynamic";
    s.scene.time.step = 1e-6;
    s.scene.time.end = 1.1e-4;
    s.scene.time.theta = 0.5;
    const SolidRun run = run_solids(s.scene);
    double force = 0, approach = 0, moved = 0, begin = -1, end = 0, speed = -v;
    const double mass = -run.quantity("momentum_z", 1) / v;
    for (const StepRecord& r : run.steps) {
        if (r.step == 0) continue;
        double f = 0;
        for (const ContactRecord& k : r.contacts)
            f += 4 * k.normal_force;
        raise_to(force, f);
        if (f > 0) {
            if (begin < 0) begin = r.time - r.step_length;
            end = r.time;
        }
        double now = speed;
        for (const Quantity& q : r.quantities)
            if (q.name == "momentum_z") now = q.value / mass;
        moved += 0.5 * r.step_length * (speed + now);
        speed = now;
        raise_to(approach, -moved - 3e-7);
    }
    std::vector<Measured> rows;
    rows.push_back(
        relative("mass of the quarter [kg]", 2700 * 3.14159265358979 / 3 * R * R * R, mass, 1e-2));
    rows.push_back(relative("largest force [N]", 48.915177, force, 2e-2));
    rows.push_back(relative("largest approach [m]", 5.780278e-6, 2 * approach, 2e-2));
    rows.push_back(relative("time of contact [s]", 8.506474e-5, end - begin, 2e-2));
    rows.push_back(relative("speed after it", v, speed, 2e-2));
    add_certificates(rows, run);
    return rows;
}

} // namespace amontons::validation
