// An overhand knot drawn together: it stays that knot, and nothing passes.

#include "mesh/base/dense.hpp"
#include "validation/families/rods/rods.hpp"
#include "validation/solid_run.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <fstream>
#include <limits>
#include <numbers>

namespace amontons::validation {
namespace {

constexpr double kKnotRadius = 1e-3, kKnotEI = 1e-4, kElement = 2e-3, kTail = 0.08, kSize = 0.012;
constexpr double kPull = 0.08, kStep = 0.01; // of each end [m]; of the pull

/// A trefoil that is opened where it is outermost, with straight ends along its tangent there, side
/// by side: the ends run along x.
std::vector<Vec3> knotted_line()
{
    const Vec3 along = Vec3(0, 2, 1).normalized(), out = Vec3::UnitX(), up = along.cross(out);
    const auto trefoil = [](double f) {
        const double r = kSize * (2 + std::cos(3 * f));
        return Vec3(r * std::cos(2 * f), r * std::sin(2 * f), kSize * std::sin(3 * f));
    };
    const double apart = 1.5 * kKnotRadius;
    const auto fades = [&](double f) { // of an end's way aside, over the curve
        const double x = std::min(1.0, f / 1.2);
        return apart * (1 - x * x * (3 - 2 * x));
    };
    std::vector<Vec3> line;
    constexpr int kStraight = 80, kAround = 300;
    for (int i = 0; i < kStraight; ++i)
        line.push_back(trefoil(0) - kTail * (1 - double(i) / kStraight) * along + apart * up);
    for (int i = 0; i <= kAround; ++i) {
        const double f = 2 * std::numbers::pi * i / kAround;
        line.push_back(trefoil(f) + (fades(f) - fades(2 * std::numbers::pi - f)) * up);
    }
    for (int i = 1; i <= kStraight; ++i)
        line.push_back(trefoil(0) + kTail * i / kStraight * along - apart * up);
    for (Vec3& x : line)
        x = Vec3(along.dot(x), out.dot(x), up.dot(x));
    return line;
}

/// Determinant of a knot, whose open ends are taken to be joined far away: 3 of a trefoil, 1 of no
/// knot. From its crossings seen along z, by the colouring of its arcs.
int determinant(const std::vector<Vec3>& line)
{
    struct Crossing {
        double over, under; // places along the line
    };
    std::vector<Crossing> crossings;
    const std::size_t n = line.size() - 1;
    for (std::size_t i = 0; i < n; ++i)
        for (std::size_t j = i + 2; j < n; ++j) {
            const Vec3 u = line[i + 1] - line[i], v = line[j + 1] - line[j], w = line[j] - line[i];
            const double det = u.x() * v.y() - u.y() * v.x();
            if (det == 0) continue;
            const double s = (w.x() * v.y() - w.y() * v.x()) / det,
                         t = (w.x() * u.y() - w.y() * u.x()) / det;
            if (s < 0 || s >= 1 || t < 0 || t >= 1) continue;
            const double zi = line[i].z() + s * u.z(), zj = line[j].z() + t * v.z();
            const double a = double(i) + s, b = double(j) + t;
            crossings.push_back(zi > zj ? Crossing{a, b} : Crossing{b, a});
        }
    std::ranges::sort(crossings, {}, &Crossing::under);
    const auto count = Eigen::Index(crossings.size());
    if (count < 2) return 1;
    const auto arc_at = [&](double place) { // arcs run from one passage below to the next
        return Eigen::Index(std::ranges::count_if(
                   crossings, [&](const Crossing& c) { return c.under < place; })) %
               count;
    };
    Eigen::MatrixXd colours = Eigen::MatrixXd::Zero(count, count);
    for (Eigen::Index k = 0; k < count; ++k) {
        colours(k, arc_at(crossings[std::size_t(k)].over)) += 2;
        colours(k, k) -= 1;
        colours(k, (k + 1) % count) -= 1;
    }
    const LuFactor minor(colours.topLeftCorner(count - 1, count - 1));
    return int(std::lround(std::abs(minor.determinant())));
}

} // namespace

std::vector<Measured> rod_knot()
{
    std::vector<Measured> rows;
    const std::vector<Vec3> line = knotted_line();
    // A line that only rises is no knot: what the steps are judged by can determine.
    std::vector<Vec3> rising = line;
    for (std::size_t i = 0; i < rising.size(); ++i)
        rising[i].z() = kKnotRadius * double(i);
    rows.push_back(absolute("determinant of the line at the start", 3, determinant(line), 0));
    rows.push_back(
        absolute("determinant of the line with heights that rise", 1, determinant(rising), 0));
    double length = 0;
    for (std::size_t i = 1; i < line.size(); ++i)
        length += (line[i] - line[i - 1]).norm();
    for (const double friction : {0.0, 0.1}) {
        SolidScene s("knot");
        RodInput& rod = s.scene.rods.emplace_back();
        rod.name = "wire";
        s.scene.order.push_back(rod.name);
        BeamSegment segment;
        segment.length = length * (1 - 1e-4); // of chords: the curve's is longer by less
        segment.radius = kKnotRadius;
        segment.EI = {kKnotEI, kKnotEI};
        segment.GJ = {kKnotEI / 1.3, kKnotEI / 1.3};
        const double EA = 4 * kKnotEI / (kKnotRadius * kKnotRadius); // of a round section
        segment.EA = {EA, EA};
        segment.element = kElement;
        rod.segments = {segment};
        rod.shape.curve.file = s.path("knot.csv");
        rod.shape.curve.scale = 1;
        std::ofstream csv(rod.shape.curve.file);
        csv << "x,y,z\n";
        for (const Vec3& x : line)
            csv << fmt::format("{:.15g},{:.15g},{:.15g}\n", x.x(), x.y(), x.z());
        csv.close();
        for (const auto& [set, way] : {std::pair{"start", -kPull}, {"end", kPull}}) {
            RodHold hold;
            hold.set = set;
            hold.x = {{0, 0}, {1, way}};
            hold.y = hold.z = {{0, 0}, {1, 0}};
            rod.hold.push_back(hold);
        }
        ContactLaw law;
        law.between = {"wire", "wire"};
        law.friction = friction;
        s.scene.contact.push_back(law);
        s.scene.time.step = kStep;
        s.scene.time.smallest_step = kStep / 4;
        s.scene.time.end = 1;
        const SolidRun run = run_solids(s.scene);
        double nearest = std::numeric_limits<double>::infinity();
        int refused = 0, untied = 0;
        for (const StepRecord& step : run.steps) {
            if (!step.certificate.certified) ++refused;
            const std::vector<Vec3> now = refined(refined(step.beams.at(0).points));
            nearest = std::min(nearest, least_distance(now, kKnotRadius) / (2 * kKnotRadius));
            if (determinant(now) != 3) ++untied;
        }
        const std::string at = fmt::format(", friction {}", friction);
        rows.push_back(
            absolute("steps after which it is another knot, or none" + at, 0, untied, 0));
        rows.push_back(relative("least distance of middle lines over the diameter, all steps" + at,
                                1, nearest, 1e-2));
        rows.push_back(absolute("steps without certificate" + at, 0, refused, 0));
        const EnergyRecord& e = run.summary.energy;
        rows.push_back(absolute("energy error over the work" + at, 0, e.error() / e.work, 1e-3));
    }
    return rows;
}

} // namespace amontons::validation
