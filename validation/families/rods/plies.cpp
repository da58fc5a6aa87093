// Three plies twisted into a strand: nothing passes through anything.

#include "validation/families/rods/rods.hpp"
#include "validation/scene_run.hpp"
#include "validation/solid_run.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace amontons::validation {

namespace {

double least_ply_distance(const std::vector<Vec3>& a, const std::vector<Vec3>& b)
{
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i + 1 < a.size(); ++i)
        for (std::size_t j = 0; j + 1 < b.size(); ++j)
            if ((a[i] - b[j]).norm() < 0.006) // three diameters: not what is far
                least = std::min(least, segment_distance(a[i], a[i + 1], b[j], b[j + 1]));
    return least;
}

/// Where a ply crosses the plane x; plies run along x.
Vec3 ply_at(const std::vector<Vec3>& ply, double x)
{
    for (std::size_t i = 0; i + 1 < ply.size(); ++i)
        if (ply[i + 1].x() >= x)
            return ply[i] +
                   (x - ply[i].x()) / (ply[i + 1].x() - ply[i].x()) * (ply[i + 1] - ply[i]);
    return ply.back();
}

/// How often two plies run around each other [rad]: only passing through changes it.
double winding(const std::vector<Vec3>& a, const std::vector<Vec3>& b)
{
    const double end = std::min(a.back().x(), b.back().x());
    constexpr int kPlanes = 400;
    double sum = 0;
    Vec3 before = b.front() - a.front();
    for (int k = 1; k <= kPlanes; ++k) {
        const Vec3 now = ply_at(b, end * k / kPlanes) - ply_at(a, end * k / kPlanes);
        sum += std::atan2(before.y() * now.z() - before.z() * now.y(),
                          before.y() * now.y() + before.z() * now.z());
        before = now;
    }
    return sum;
}

} // namespace

std::vector<Measured> rod_plies()
{
    std::vector<Measured> rows;
    for (const char* friction : {"0", "0.1"}) {
        const SolidRun run =
            run_solids(scene("plies", {std::string("contact.0.friction=") + friction}));
        const double diameter = 2e-3, turns = 2;
        double nearest = std::numeric_limits<double>::infinity(), astray = 0;
        for (const StepRecord& s : run.steps) {
            for (std::size_t i = 0; i < 3; ++i) {
                const std::vector<Vec3>&a = s.beams.at(i).points,
                      &b = s.beams.at((i + 1) % 3).points;
                nearest = std::min(nearest, least_ply_distance(a, b) / diameter);
                raise_to(astray, std::abs(winding(a, b) / (2 * std::numbers::pi) - turns * s.time));
            }
        }
        const std::string at_friction = std::string(", friction ") + friction;
        rows.push_back(absolute(
            "turns of the plies round each other but for those made, worst step" + at_friction, 0,
            astray, 1e-2));
        rows.push_back(
            relative("least distance of middle lines over the diameter, all steps" + at_friction, 1,
                     nearest, 1e-2));
        add_certificates(rows, run, at_friction);
    }
    return rows;
}

} // namespace amontons::validation
