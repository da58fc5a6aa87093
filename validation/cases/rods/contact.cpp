// Belt friction, C11, C18: rods along curved walls; see README.md.

#include "validation/cases/rods/rods.hpp"
#include "validation/solid_run.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace amontons::validation {
namespace {

constexpr double kPi = 3.14159265358979323846;
// Bending adds forces of the order of EI / R^2, whatever the pull: it is in no slope.
constexpr double kEI = 1e-4, kBend = 0.05, kThin = 5e-5;

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
double drawn(SolidScene& s, const std::string& wall, const std::vector<CentrelinePiece>& pieces,
             const Vec3& start, double radius, double mu, double pull, double way, double element)
{
    double length = 0;
    for (const CentrelinePiece& p : pieces)
        length += p.length + p.radius * p.angle;
    RodInput& rod = add_rod(s, "rope", length * (1 - 1e-9), radius, kEI, 1e4, element);
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

} // namespace

std::vector<Measured> rod_capstan()
{
    const double mu = 0.1, middle = kBend + kThin;
    std::vector<Measured> rows;
    for (const int wraps : {1, 5}) {
        std::vector<CentrelinePiece> pieces{{0.02}};
        for (int i = 0; i < wraps; ++i)
            pieces.push_back({0, middle, 2 * kPi});
        pieces.push_back({0.02});
        std::vector<double> force;
        for (const double pull : {1.0, 2.0}) {
            SolidScene s("capstan");
            SurfaceInput drum;
            drum.generate = "cylinder";
            drum.radius = kBend;
            add_obstacle(s, "drum", drum, "outside");
            force.push_back(drawn(s, "drum", pieces, Vec3(-0.02, -middle, 0), kThin, mu, pull,
                                  wraps == 1 ? 0.002 : 0.01, 3e-3));
        }
        rows.push_back(relative(fmt::format("slope of the pull, {} wraps, mu {}", wraps, mu),
                                std::exp(mu * 2 * kPi * wraps), force[1] - force[0], 0.01));
    }
    return rows;
}

std::vector<Measured> rod_bent_tube()
{
    const double clearance = 1e-4, straight = 0.04, between = 0.06;
    std::vector<Measured> rows;
    struct Bends {
        const char* name;
        std::vector<double> angles;
    };
    for (const Bends& b : {Bends{"90 degrees", {kPi / 2}}, Bends{"180 degrees", {kPi}},
                           Bends{"360 degrees", {kPi, kPi}}})
        for (const double mu : {0.1, 0.2, 0.3}) {
            std::vector<CentrelinePiece> pieces{{straight}};
            double theta = 0;
            for (std::size_t i = 0; i < b.angles.size(); ++i) {
                if (i > 0) pieces.push_back({between});
                pieces.push_back({0, kBend, b.angles[i], i % 2 == 0 ? 0 : kPi});
                theta += b.angles[i];
            }
            std::vector<CentrelinePiece> tube = pieces;
            pieces.push_back({straight});
            tube.push_back({straight + 0.02});
            std::vector<double> force;
            for (const double pull : {3.0, 6.0}) {
                SolidScene s("bent tube");
                SurfaceInput surface;
                surface.generate = "tube";
                surface.radius = kThin + clearance;
                surface.centreline.pieces = tube;
                add_obstacle(s, "tube", surface, "inside");
                force.push_back(drawn(s, "tube", pieces, Vec3::Zero(), kThin, mu, pull,
                                      0.003 * double(b.angles.size() + 1), 2.5e-3));
            }
            rows.push_back(relative(fmt::format("slope of the pull, {}, mu {}", b.name, mu),
                                    std::exp(mu * theta), (force[1] - force[0]) / 3, 0.02));
        }
    return rows;
}

} // namespace amontons::validation
