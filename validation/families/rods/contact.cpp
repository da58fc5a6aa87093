// Belt friction, C11, C18: rods along curved walls.

#include "validation/families/rods/bends.hpp"
#include "validation/families/rods/rods.hpp"
#include "validation/solid_run.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <fstream>
#include <numbers>

namespace amontons::validation {
namespace {

// Bending adds forces of the order of EI / R^2, whatever the pull: it is in no slope.
constexpr double kRodEI = 1e-4, kRodBend = 0.05, kThinRod = 5e-5;

RodInput& add_rod(SolidScene& s, const std::string& name, double length, double radius, double EI,
                  double EA, double element)
{
    RodInput& rod = s.scene.rods.emplace_back();
    rod.name = name;
    s.scene.order.push_back(name);
    BeamSegment segment;
    segment.length = length;
    segment.radius = radius;
    segment.EI = {EI, EI};
    segment.GJ = {0.77 * EI, 0.77 * EI};
    segment.EA = {EA, EA};
    segment.element = element;
    rod.segments = {segment};
    return rod;
}

ObstacleInput& add_obstacle(SolidScene& s, const std::string& name, const SurfaceInput& surface,
                            const std::string& side)
{
    ObstacleInput& o = s.scene.obstacles.emplace_back();
    o.name = name;
    o.surface = surface;
    o.side = side;
    s.scene.order.push_back(name);
    return o;
}

void touch(SolidScene& s, const std::string& a, const std::string& b, double friction)
{
    ContactLaw law;
    law.between = {a, b};
    law.friction = friction;
    s.scene.contact.push_back(law);
}

/// A rod along pieces of lines and arcs, drawn at its end against a pull at its start: what the
/// end needs [N].
double drawn_rod(SolidScene& s, const std::string& wall, const std::vector<CentrelinePiece>& pieces,
                 const Vec3& start, double radius, double mu, double pull, double way,
                 double element)
{
    double length = 0;
    for (const CentrelinePiece& p : pieces)
        length += p.length + p.radius * p.angle;
    RodInput& rod = add_rod(s, "rope", length * (1 - 1e-9), radius, kRodEI, 1e4, element);
    rod.shape.curve.pieces = pieces;
    rod.shape.curve.start = start;
    rod.plane = Vec3::UnitZ();
    Vec3 tangent = Vec3::UnitX();
    double turned = 0;
    for (const CentrelinePiece& p : pieces)
        turned += (p.direction == 0 ? 1 : -1) * p.angle;
    tangent = Vec3(std::cos(turned), std::sin(turned), 0);
    RodHold hold;
    hold.set = "end";
    hold.x = {{0, 0}, {1, 0}, {2, way * tangent.x()}};
    hold.y = {{0, 0}, {1, 0}, {2, way * tangent.y()}};
    hold.z = {{0, 0}, {1, 0}, {2, 0}};
    rod.hold.push_back(hold);
    RodLoad load;
    load.set = "start";
    load.force = Vec3(-pull, 0, 0);
    load.over = {{0, 0}, {1, 1}, {2, 1}};
    rod.loads.push_back(load);
    touch(s, "rope", wall, mu);
    s.scene.time.step = 0.05;
    s.scene.time.end = 2;
    const SolidRun run = run_solids(s.scene);
    return run.vector("rope_end_force").dot(tangent);
}

/// Line load and pitch of a rod on the inside of a tube along x, from what touches between two
/// places: forces at the ends of that count by half. Zeros where it does not touch.
struct Coil {
    double load = 0, pitch = 0; // [N/m], [m]
};

Coil coil_between(const std::vector<ContactRecord>& contacts, double from, double to)
{
    std::vector<const ContactRecord*> in;
    for (const ContactRecord& c : contacts)
        if (c.normal_force > 0 && c.point.x() > from && c.point.x() < to) in.push_back(&c);
    std::sort(in.begin(), in.end(), [](const ContactRecord* a, const ContactRecord* b) {
        return a->point.x() < b->point.x();
    });
    if (in.size() < 2) return {};
    double force = 0, turned = 0;
    for (std::size_t i = 0; i < in.size(); ++i) {
        const bool end = i == 0 || i + 1 == in.size();
        force += (end ? 0.5 : 1) * in[i]->normal_force;
        if (i == 0) continue;
        const double y0 = in[i - 1]->point.y(), z0 = in[i - 1]->point.z();
        const double y1 = in[i]->point.y(), z1 = in[i]->point.z();
        turned += std::atan2(y0 * z1 - z0 * y1, y0 * y1 + z0 * z1);
    }
    const double length = in.back()->point.x() - in.front()->point.x();
    return {force / length, 2 * std::numbers::pi * length / std::abs(turned)};
}

} // namespace

std::vector<Measured> rod_capstan()
{
    const double mu = 0.1, middle = kRodBend + kThinRod;
    std::vector<Measured> rows;
    for (const int wraps : {1, 5}) {
        std::vector<CentrelinePiece> pieces{{0.02}};
        for (int i = 0; i < wraps; ++i)
            pieces.push_back({0, middle, 2 * std::numbers::pi});
        pieces.push_back({0.02});
        std::vector<double> force;
        for (const double pull : {1.0, 2.0}) {
            SolidScene s("capstan");
            SurfaceInput drum;
            drum.generate = "cylinder";
            drum.radius = kRodBend;
            add_obstacle(s, "drum", drum, "outside");
            force.push_back(drawn_rod(s, "drum", pieces, Vec3(-0.02, -middle, 0), kThinRod, mu,
                                      pull, wraps == 1 ? 0.002 : 0.01, 3e-3));
        }
        rows.push_back(relative(fmt::format("slope of the pull, {} wraps, mu {}", wraps, mu),
                                std::exp(mu * 2 * std::numbers::pi * wraps), force[1] - force[0],
                                0.01));
    }
    return rows;
}

std::vector<Measured> rod_bent_tube()
{
    const double clearance = 1e-4, straight = 0.04, between = 0.06;
    std::vector<Measured> rows;
    for (const Bends& b : bent_tubes())
        for (const double mu : {0.1, 0.2, 0.3}) {
            std::vector<CentrelinePiece> pieces{{straight}};
            for (std::size_t i = 0; i < b.angles.size(); ++i) {
                if (i > 0) pieces.push_back({between});
                pieces.push_back({0, kRodBend, b.angles[i], i % 2 == 0 ? 0 : std::numbers::pi});
            }
            std::vector<CentrelinePiece> tube = pieces;
            pieces.push_back({straight});
            tube.push_back({straight + 0.02});
            std::vector<double> force;
            for (const double pull : {3.0, 6.0}) {
                SolidScene s("bent tube");
                SurfaceInput surface;
                surface.generate = "tube";
                surface.radius = kThinRod + clearance;
                surface.centreline.pieces = tube;
                add_obstacle(s, "tube", surface, "inside");
                force.push_back(drawn_rod(s, "tube", pieces, Vec3::Zero(), kThinRod, mu, pull,
                                          0.003 * double(b.angles.size() + 1), 2.5e-3));
            }
            rows.push_back(relative(fmt::format("slope of the pull, {}, mu {}", b.name, mu),
                                    std::exp(mu * b.all()), (force[1] - force[0]) / 3, 0.02));
        }
    return rows;
}

std::vector<Measured> rod_helix()
{
    constexpr double EI = 0.15707963, clearance = 0.01, radius = 1e-3;
    constexpr double wound = 1.02; // of the pitch: how it begins
    constexpr int turns = 8, per_turn = 40;
    std::vector<Measured> rows;
    for (const double force : {20.0, 50.0}) {
        // Exactly, without torque about the tube's axis: F = 2 EI beta^2 / g^3.
        double beta = std::sqrt(force / (2 * EI)), g = 1;
        for (int i = 0; i < 50; ++i) {
            g = std::hypot(1, clearance * beta);
            beta = std::sqrt(force * g * g * g / (2 * EI));
        }
        const double pitch = 2 * std::numbers::pi / beta, slope = clearance * beta;
        SolidScene s("helix");
        SurfaceInput tube;
        tube.generate = "cylinder";
        tube.axis = Vec3::UnitX();
        tube.radius = clearance + radius;
        add_obstacle(s, "tube", tube, "inside");
        const std::string file = s.path("helix.csv");
        std::ofstream csv(file);
        csv << "x,y,z\n";
        for (int i = 0; i <= turns * per_turn; ++i) {
            const double angle = 2 * std::numbers::pi * i / per_turn;
            csv << fmt::format("{:.15g},{:.15g},{:.15g}\n", wound * angle / beta,
                               clearance * std::cos(angle), clearance * std::sin(angle));
        }
        csv.close();
        RodInput& rod = add_rod(s, "rod", turns * pitch * std::hypot(wound, slope) * (1 - 1e-4),
                                radius, EI, 1e6, pitch / per_turn);
        rod.shape.curve.file = file;
        rod.shape.curve.scale = 1;
        rod.shape.stress_free = false;
        RodHold hold;
        hold.set = "start";
        rod.hold.push_back(hold);
        // No torque about the tube, none in the rod: that is what the pitch follows from. What else
        // the end does dies out within a turn.
        RodLoad load;
        load.set = "end";
        load.force = Vec3(-force, 0, 0);
        rod.loads.push_back(load);
        touch(s, "rod", "tube", 0);
        s.scene.time.step = 1;
        s.scene.time.end = 1;
        const SolidRun run = run_solids(s.scene);
        const double length = turns * pitch;
        const Coil coil = coil_between(run.last().contacts, 0.25 * length, 0.75 * length);
        const std::string at = fmt::format(", {} N", force);
        rows.push_back(relative("pitch of the helix [m]" + at,
                                2 * std::numbers::pi * std::sqrt(2 * EI / force), coil.pitch,
                                0.03));
        rows.push_back(relative("force on the tube [N/m]" + at,
                                clearance * force * force / (4 * EI), coil.load, 0.03));
        rows.push_back(relative("exact pitch [m]" + at, pitch, coil.pitch, 1e-4));
        rows.push_back(relative("exact force on the tube [N/m]" + at,
                                clearance * beta * beta * force / 2, coil.load, 2e-4));
    }
    return rows;
}

} // namespace amontons::validation
