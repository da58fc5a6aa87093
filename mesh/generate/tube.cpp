#include "mesh/generate/tube.hpp"

#include "mesh/base/error.hpp"
#include "mesh/swept_tube.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace amontons {

namespace {

constexpr double kChordError = 3e-3;               // of the radius
constexpr std::int32_t kFewest = 12, kMost = 2000; // vertices around
constexpr std::size_t kMostRings = 200000;

SurfaceMesh tube_triangles(const TubeOptions& options)
{
    const Centreline& line = options.centreline;
    double widest = line.at(0.0).radius;
    for (int k = 0; k <= 200; ++k)
        widest = std::max(widest, line.at(line.length() * k / 200).radius);
    // A chord across the angle a misses the circle by r (1 - cos(a/2)).
    const double angle =
        options.resolution > 0 ? options.resolution / widest : 2 * std::acos(1 - kChordError);
    const auto around = std::clamp(
        2 * static_cast<std::int32_t>(std::ceil(std::numbers::pi / angle)), kFewest, kMost);

    // Rings: dense where the outer wall of a bend needs it, sparse where straight.
    std::vector<double> rings{0.0};
    while (rings.back() < line.length() * (1 - 1e-9) && rings.size() < kMostRings) {
        const CurvePoint p = line.at(rings.back());
        double step = options.resolution > 0 ? options.resolution : 2 * p.radius;
        if (options.resolution <= 0) {
            for (double ahead : {0.0, 0.5, 1.0}) { // a bend may begin within the step
                const CurvePoint q = line.at(rings.back() + ahead * step);
                const double k = q.curvature.norm();
                const double outer = k / (1 + k * q.radius);
                if (outer > 0) step = std::min(step, std::sqrt(8 * kChordError * q.radius / outer));
            }
        }
        const double left = line.length() - rings.back();
        rings.push_back(left < 1.5 * step ? line.length() : rings.back() + step);
    }

    SurfaceMesh mesh;
    std::vector<Vec3>& points = mesh.points;
    points.reserve(rings.size() * static_cast<std::size_t>(around));
    CurvePoint p = line.at(0.0);
    Vec3 across = p.tangent.unitOrthogonal(), tangent = p.tangent;
    for (double s : rings) { // carry the frame along without twist, ring by ring
        p = line.at(s);
        across = (across - p.tangent * p.tangent.dot(across)).normalized();
        tangent = p.tangent;
        const Vec3 third = tangent.cross(across);
        for (std::int32_t k = 0; k < around; ++k) {
            const double phi = 2 * std::numbers::pi * k / around;
            points.push_back(p.position +
                             p.radius * (std::cos(phi) * across + std::sin(phi) * third));
        }
    }
    for (std::int32_t i = 0; i + 1 < static_cast<std::int32_t>(rings.size()); ++i)
        for (std::int32_t k = 0; k < around; ++k) {
            const std::int32_t next = (k + 1) % around;
            const std::int32_t a = i * around + k, b = i * around + next, c = a + around,
                               d = b + around;
            mesh.triangles.push_back({a, c, d});
            mesh.triangles.push_back({a, d, b});
        }
    return mesh;
}

double tube_deviation(const SurfaceMesh& mesh, const SweptTube& tube)
{
    double deviation = 0;
    WallHint hint;
    for (const auto& t : mesh.triangles) {
        const Vec3 &a = mesh.points[static_cast<std::size_t>(t[0])],
                   &b = mesh.points[static_cast<std::size_t>(t[1])],
                   &c = mesh.points[static_cast<std::size_t>(t[2])];
        for (const Vec3& x : {Vec3{(a + b + c) / 3}, Vec3{(a + b) / 2}, Vec3{(b + c) / 2}})
            deviation = std::max(deviation, std::abs(tube.distance(x, hint)));
    }
    return deviation;
}

} // namespace

WallModel make_tube(const TubeOptions& options)
{
    const Centreline& line = options.centreline;
    std::vector<Issue> issues;
    if (line.piece_count() == 0)
        issues.push_back({"", "/centreline/pieces", "no pieces", "at least one"});
    if (!(options.resolution >= 0) || !std::isfinite(options.resolution))
        issues.push_back({"", "/resolution", std::to_string(options.resolution), ">= 0 [m]"});
    if (!issues.empty()) throw InputError(std::move(issues));

    const Late<SurfaceMesh> mesh{[options] { return tube_triangles(options); }};
    const Late<double> deviation{[mesh, line] { return tube_deviation(*mesh, SweptTube{line}); }};
    WallModel model{mesh, make_wall(SweptTube{line}), {}, {}, deviation};
    const CurvePoint first = line.at(0.0), last = line.at(line.length());
    model.openings = {{"inlet", first.position, -first.tangent, first.radius},
                      {"outlet", last.position, last.tangent, last.radius}};
    return model;
}

} // namespace amontons
