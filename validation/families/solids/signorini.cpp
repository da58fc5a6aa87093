// A09, A16: elastic blocks on a rigid plane with friction.

#include "mesh/base/limits.hpp"
#include "validation/families/solids/blocks.hpp"
#include "validation/families/solids/solids.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace amontons::validation {
namespace {

constexpr double kPoints[] = {0.0, 1.25e-3, 5e-3, 7.5e-3, 11.25e-3}; // A to E [m]

Mat3 turn_of(const RaousOptions& o)
{
    const double angle = o.turn.norm();
    return Eigen::AngleAxisd(angle, angle > 0 ? Vec3(o.turn / angle) : Vec3::UnitX())
        .toRotationMatrix();
}

} // namespace

void raous_scene(SolidScene& s, const RaousOptions& o)
{
    // x along the plane, z up, y across the slice.
    const double a = 0.04 * o.length, thick = a / o.cells;
    const double stress = o.stiffness;
    VolumeMesh mesh = lattice_mesh(
        {graded(a, o.cells, 1), graded(thick, 1, 1), graded(a, o.cells, 1)}, o.element);
    if (o.shuffle != 0) mesh = shuffled(mesh, o.shuffle);
    SolidInput& b = s.solid("block", 1.3e11 * stress, 0.2, mesh);
    b.hold = {hold("x_max", still(), {}, {}), hold("all", {}, still(), {})};
    for (HoldInput& h : b.hold)
        h.axes = "body"; // they turn with the world
    LoadInput left = traction("x_min", {o.push * stress, 0, 0});
    LoadInput top = traction("z_max", {0, 0, -5e7 * stress});
    left.over = top.over = {{0, 1e-3}, {1, 1}};
    b.loads = {left, top};
    s.scene.time.step = 1.0 / o.steps;
    const Mat3 R = turn_of(o);
    for (LoadInput& l : b.loads)
        *l.traction = R * *l.traction;
    b.start.turn = o.turn;
    b.start.place = o.place;
    s.plane("plane", o.place, R * Vec3::UnitZ());
    s.touch("block", "plane", o.mu, "z_min");
    s.scene.accuracy.contact = o.accuracy;
}

Raous raous(const RaousOptions& o)
{
    SolidScene s("block on a rigid plane");
    raous_scene(s, o);
    const SolidRun run = run_solids(s.scene, true);
    const Mat3 R = turn_of(o);
    Raous r;
    const BodyRecord& b = run.bodies.back()[0];
    const std::vector<Vec3> u = displacements(b);
    const double a = 0.04 * o.length, thick = a / o.cells;
    for (const double x : kPoints) {
        const Vec3 at(x * o.length, 0, 0);
        r.u.push_back(R.transpose() * u[nearest_node(b, o.place + R * at)] / o.length);
    }
    const std::vector<Vec3> X = first_places(b);
    for (std::size_t i = 0; i < X.size(); ++i) {
        const Vec3 at = R.transpose() * (X[i] - o.place) / o.length;
        if (std::hypot(at.y(), at.z()) > 1e-9) continue;
        r.x.push_back(at.x());
        r.u_x.push_back(Vec3(R.transpose() * u[i]).x() / o.length);
    }
    // Where u_x is held, at the last node, the drag is not determined: it is left out.
    Vec3 f = Vec3::Zero();
    for (const ContactRecord& c : run.last().contacts) {
        const Vec3 own = R.transpose() * c.force;
        const bool held = (R.transpose() * (c.point - o.place)).x() > a * (1 - 1e-3 / o.cells);
        f += held ? Vec3(0, 0, own.z()) : own;
    }
    r.normal = f.z() / (thick * o.length * o.stiffness);
    r.tangential = f.x() / (thick * o.length * o.stiffness);
    for (const ContactRecord& c : run.last().contacts) {
        const double x = (R.transpose() * (c.point - o.place)).x() / o.length;
        r.open_to = std::min(r.open_to, x);
        if (c.status == ContactStatus::slip) r.slip_to = std::max(r.slip_to, x);
    }
    r.certificates = run.summary.uncertified_steps;
    r.steps = run.summary.steps;
    r.iterations = run.last().iterations;
    return r;
}

namespace {

void add_raous(std::vector<Measured>& rows, const std::string& of, const Raous& r,
               const std::array<double, 5>& ux, double tangential)
{
    const char* points[] = {"A", "B", "C", "D", "E"};
    ReferenceCurve curve{"x along the plane [m]", "u_x [m]", {}, {}, {}};
    for (std::size_t i = 0; i < r.x.size(); ++i)
        curve.add(r.x[i], kNaN, r.u_x[i]);
    for (std::size_t i = 0; i < 5; ++i)
        if (ux[i] != 0) curve.add(kPoints[i], ux[i], kNaN);
    const std::size_t first = rows.size();
    for (std::size_t i = 0; i < 5; ++i)
        if (ux[i] != 0)
            rows.push_back(
                relative(std::string("u_x ") + points[i] + ", " + of, ux[i], r.u[i].x(), 5e-3));
    rows[first].curve = by_x(std::move(curve));
    rows.push_back(relative("drag T [N/m], " + of, tangential, r.tangential, 5e-3));
    rows.push_back(relative("normal force [N/m], " + of, 2e6, r.normal, 1e-8));
    rows.push_back(at_most("steps without certificate, " + of, r.certificates, 0));
}

} // namespace

std::vector<Measured> raous_block()
{
    std::vector<Measured> rows;
    const std::array<double, 5> hard{2.8602e-05, 2.7225e-05, 2.2867e-05, 1.9807e-05, 1.5413e-05};
    const std::array<double, 5> soft{1.4649e-05, 1.3734e-05, 1.0711e-05, 8.6135e-06, 5.719e-06};
    for (const ElementKind kind : {ElementKind::H8, ElementKind::T10}) {
        const std::string name = kind == ElementKind::H8 ? "H8" : "T10";
        RaousOptions o;
        o.element = kind;
        Raous r = raous(o);
        add_raous(rows, "F 15e7, " + name, r, hard, -1405360);
        rows.push_back(relative("u_z A, F 15e7, " + name, 5.91e-7, r.u[0].z(), 2e-2));
        rows.back().note = "its reference has three digits";
        // Zones are read where the multipliers are: within a cell.
        rows.push_back(absolute("open up to [mm], " + name, 3.25, 1e3 * r.open_to, 1.25));
        rows.push_back(absolute("slips up to [mm], " + name, 29.7, 1e3 * r.slip_to, 1.25));
        o.push = 10e7;
        r = raous(o);
        add_raous(rows, "F 10e7, " + name, r, soft, -1078740);
        rows.push_back(absolute("u_z A, F 10e7, " + name, 5e-7, r.u[0].z(), 0.5e-7));
        rows.back().note = "its reference has one digit";
        rows.push_back(absolute("open up to [mm], F 10e7, " + name, 2.95, 1e3 * r.open_to, 1.25));
        rows.push_back(absolute("slips up to [mm], F 10e7, " + name, 22.35, 1e3 * r.slip_to, 1.25));
    }
    RaousOptions o;
    o.cells = 64; // as the reference
    o.mu = 0;
    add_raous(rows, "mu 0, H8", raous(o), {4.0615385e-05, 0, 0, 0, 0}, 1);
    rows.erase(rows.end() - 3);             // no drag
    rows[rows.size() - 3].tolerance = 1e-8; // a uniform state: exact
    o.mu = 0.2;
    add_raous(rows, "mu 0.2, H8", raous(o), {3.67548e-05, 0, 0, 0, 2.53381e-05}, -395891.2);
    o.mu = 0.5;
    add_raous(rows, "mu 0.5, H8", raous(o), {3.27004e-05, 0, 0, 0, 2.0594e-05}, -946203.3);
    o.mu = 1;
    o.cells = 32;
    const Raous one = raous(o);
    o.steps = 10;
    const Raous ten = raous(o);
    rows.push_back(relative("u_x A in 10 steps against 1", one.u[0].x(), ten.u[0].x(), 2e-3));
    rows.back().note = "monotone proportional load";
    return rows;
}

std::vector<Measured> dragged_block()
{
    // N and T after each of four steps; the state after the first one slips radially.
    const std::array<double, 4> N{10643.1, 10641.5, 10638.7, 10477.4};
    const std::array<double, 4> T{0, 516.956, 1033.19, 3137.04};
    std::vector<Measured> rows;
    for (const char* element : {"T10", "H8"}) {
        SolidScene s("bonded block, pressed and dragged");
        const double n = element[0] == 'T' ? 9 : 16;
        SolidInput& b = s.block("block", 1e6, 0.3, {0, 0, 0}, {1, 1, 1}, {n, n, n}, element);
        b.hold = {hold("z_max", {{0, 0}, {1, 0}, {2, 0.002}, {3, 0.004}, {4, 0.03}}, still(),
                       {{0, 0}, {1, -0.01}})};
        s.plane("plane", Vec3::Zero(), Vec3::UnitZ());
        s.touch("block", "plane", 0.3, "z_min");
        s.scene.time.end = 4;
        const SolidRun run = run_solids(s.scene);
        const std::string of = std::string(", ") + element;
        for (int k = 0; k < 4; ++k) {
            const Vec3 f = run.vector("plane_on_block_force", k + 1);
            rows.push_back(relative(fmt::format("normal force N, step {}{}", k + 1, of),
                                    N[std::size_t(k)], f.z(), 2e-3));
            if (k > 0)
                rows.push_back(relative(fmt::format("drag T, step {}{}", k + 1, of),
                                        T[std::size_t(k)], -f.x(), 5e-3));
            else
                rows.push_back(
                    at_most("drag of the first step over N" + of, std::abs(f.x()) / f.z(), 1e-3));
        }
        add_certificates(rows, run, of);
    }
    return rows;
}

} // namespace amontons::validation
