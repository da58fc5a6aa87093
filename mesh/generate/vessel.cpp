#include "mesh/generate/vessel.hpp"

#include "mesh/base/error.hpp"
#include "mesh/base/text.hpp"
#include "mesh/generate/trim_openings.hpp"
#include "mesh/generate/vessel_distance.hpp"
#include "mesh/layered_field.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <set>

namespace amontons {

namespace {

constexpr double kTubeExtension = 8;    // radii that a tube continues beyond its opening
constexpr double kMostTaper = 1.0 / 16; // slope that continues there; a steeper one stops
// Spacing h of the field over the smallest radius r. The wall is off by h^4 / (128 r^3), 3e-5 r, as
// long as a spline on the wall takes no samples from beyond the tube's axis: 4 h < r.
constexpr double kFieldSpacing = 0.24;
constexpr double kGridOfBlend = 0.4; // and over the blend radius
constexpr double kOwnGrid =
    0.8; // of that of the aorta: a narrower branch has a finer grid around it
constexpr double kBetweenGrids = 3;               // spacings on which the coarser becomes the finer
constexpr double kEdge = 0.3, kEdgeOfBlend = 0.6; // the same for triangles
constexpr double kSeedEdge = 0.5;       // of the points where tubes join that searches begin with
constexpr double kShallowest = 0.35;    // angle between a branch and its parent [rad]
constexpr double kSteepestTaper = 0.45; // of radius over length: nets allow for that (kMargin)

std::vector<Issue> vessel_issues(const VesselOptions& o)
{
    std::vector<Issue> issues;
    const auto positive = [&](const std::string& place, double value) {
        if (!(value > 0) || !std::isfinite(value))
            issues.push_back({"", place, std::to_string(value), "> 0 and finite [m]"});
    };
    positive("/descending_length", o.descending_length);
    positive("/descending_diameter/0", o.descending_diameter[0]);
    positive("/descending_diameter/1", o.descending_diameter[1]);
    positive("/arch_radius", o.arch_radius);
    positive("/arch_diameter/0", o.arch_diameter[0]);
    positive("/arch_diameter/1", o.arch_diameter[1]);
    positive("/ascending_length", o.ascending_length);
    positive("/ascending_diameter", o.ascending_diameter);
    positive("/blend", o.blend);
    const auto tapers = [&](const std::string& place, double from, double to, double length) {
        const double slope = std::abs(to - from) / (2 * length);
        if (length > 0 && slope > kSteepestTaper)
            issues.push_back({"", place,
                              "a radius that changes by " + number_text(slope) + " of the length",
                              "at most " + number_text(kSteepestTaper) + " of it"});
    };
    tapers("/descending_diameter", o.descending_diameter[0], o.descending_diameter[1],
           o.descending_length);
    tapers("/arch_diameter", o.descending_diameter[1], o.arch_diameter[1],
           o.arch_radius * o.arch_angle);
    tapers("/ascending_diameter", o.arch_diameter[1], o.ascending_diameter, o.ascending_length);
    if (!(o.resolution >= 0) || !std::isfinite(o.resolution))
        issues.push_back({"", "/resolution", std::to_string(o.resolution), ">= 0 [m]"});
    if (!(o.arch_angle > 0 && o.arch_angle <= 2 * std::numbers::pi))
        issues.push_back({"", "/arch_angle", std::to_string(o.arch_angle), "in (0, 2 pi] [rad]"});
    if (!(2 * o.arch_radius > std::max(o.arch_diameter[0], o.arch_diameter[1])))
        issues.push_back({"", "/arch_radius", std::to_string(o.arch_radius),
                          "more than half the arch's diameter [m]"});
    if (!o.inlet.allFinite()) issues.push_back({"", "/centre", "not finite", "finite [m]"});
    const bool directed =
        o.axis.allFinite() && o.arch_towards.allFinite() &&
        o.axis.cross(o.arch_towards).norm() > 1e-6 * o.axis.norm() * o.arch_towards.norm();
    if (!directed)
        issues.push_back({"", "/arch_towards", "parallel to the axis, or no direction",
                          "a direction across the axis"});
    std::set<std::string> names{"inlet"};
    for (std::size_t i = 0; i < o.branches.size(); ++i) {
        const VesselBranch& b = o.branches[i];
        const std::string place = "/branches/" + std::to_string(i);
        positive(place + "/length", b.length);
        positive(place + "/diameter/0", b.root_diameter);
        positive(place + "/diameter/1", b.end_diameter);
        tapers(place + "/diameter", b.root_diameter, b.end_diameter, b.length);
        if (b.name.empty() || !names.insert(b.name).second)
            issues.push_back({"", place + "/name", '"' + b.name + '"', "a name of its own"});
        if (!(b.at >= 0 && b.at <= o.arch_radius * o.arch_angle))
            issues.push_back({"", place + "/at", std::to_string(b.at),
                              "in [0, " + std::to_string(o.arch_radius * o.arch_angle) +
                                  "], the arch's length [m]"});
        if (!(b.angle >= kShallowest && b.angle <= std::numbers::pi - kShallowest))
            issues.push_back(
                {"", place + "/angle", std::to_string(b.angle), "in [0.35, pi - 0.35] [rad]"});
        if (!(b.root_diameter < std::min(o.arch_diameter[0], o.arch_diameter[1])))
            issues.push_back({"", place + "/diameter/0", std::to_string(b.root_diameter),
                              "less than the arch's diameter [m]"});
    }
    return issues;
}

// Where a branch's axis leaves the arch's centreline and its wall, and which way.
struct TakeOff {
    Vec3 start, direction;
    double hidden = 0; // length inside the arch [m]
};

double end_slope(double slope)
{
    return std::abs(slope) <= kMostTaper ? slope : 0.0;
}

Centreline aorta(const VesselOptions& o, double extension)
{
    const Vec3 axis = o.axis.normalized();
    const double r0 = o.descending_diameter[0] / 2, r1 = o.descending_diameter[1] / 2;
    const double before = r0 - end_slope((r1 - r0) / o.descending_length) * extension;
    Centreline line{o.inlet - extension * axis, axis, o.arch_towards, before};
    line.append_line(extension, r0);
    line.append_line(o.descending_length, r1);
    return line;
}

void add_arch(Centreline& line, const VesselOptions& o)
{
    line.append_arc(o.arch_radius, o.arch_angle, 0, o.arch_diameter[1] / 2);
    line.append_line(o.ascending_length, o.ascending_diameter / 2);
}

TakeOff take_off(const VesselOptions& o, const SweptTube& main, double arch_end,
                 const VesselBranch& b)
{
    const CurvePoint p = main.centreline().at(arch_end - b.at);
    const Vec3 outward = -p.curvature.normalized();
    TakeOff t;
    t.start = p.position;
    t.direction = -std::cos(b.angle) * p.tangent + std::sin(b.angle) * outward;
    double inside = 0, outside = 4 * (o.arch_diameter[0] + o.arch_diameter[1]);
    for (double s = 0; s < outside; s += p.radius / 16) { // the first way out
        WallHint hint;
        if (main.distance(t.start + s * t.direction, hint) <= 0) {
            outside = s;
            break;
        }
        inside = s;
    }
    while (outside - inside > 1e-14 * p.radius) {
        WallHint hint;
        const double middle = 0.5 * (inside + outside);
        if (middle <= inside || middle >= outside) break;
        (main.distance(t.start + middle * t.direction, hint) > 0 ? inside : outside) = middle;
    }
    t.hidden = 0.5 * (inside + outside);
    return t;
}

SweptTube branch_tube(const TakeOff& t, const VesselBranch& b, double extension)
{
    const double r0 = b.root_diameter / 2, r1 = b.end_diameter / 2;
    const double slope = (r1 - r0) / b.length;
    Centreline line{t.start, t.direction, t.direction.unitOrthogonal(), r0};
    line.append_line(t.hidden, r0);
    line.append_line(b.length, r1);
    line.append_line(extension, r1 + end_slope(slope) * extension);
    return SweptTube{std::move(line), TubeEnd::ball, TubeEnd::ball};
}

// Every tube continues by `extension` radii beyond its opening, or by a length of its own.
VesselShape vessel_shape(const VesselOptions& o, const std::vector<TakeOff>& roots,
                         const std::vector<double>& extension)
{
    Centreline line = aorta(o, extension[0]);
    add_arch(line, o);
    std::vector<SweptTube> tubes;
    tubes.emplace_back(std::move(line), TubeEnd::ball, TubeEnd::ball);
    for (std::size_t i = 0; i < roots.size(); ++i)
        tubes.push_back(branch_tube(roots[i], o.branches[i], extension[i + 1]));
    return VesselShape{std::move(tubes), o.blend};
}

// A tube that continues must not open another one's wall: how far it may extend.
void check_clear(const VesselOptions& o, const VesselShape& shape,
                 const std::vector<Opening>& openings, std::vector<double>& extension)
{
    std::vector<Issue> issues;
    for (std::size_t i = 0; i < openings.size(); ++i) {
        const Opening& opening = openings[i];
        double clear = extension[i];
        for (int k = 0; k <= 64; ++k) {
            const double s = extension[i] * k / 64;
            double deepest = -1e300;
            WallHint hint;
            for (std::size_t j = 0; j < shape.tubes().size(); ++j) {
                hint = {};
                if (j != i)
                    deepest = std::max(deepest, shape.tubes()[j].distance(
                                                    opening.centre + s * opening.outward, hint));
            }
            if (deepest > -(opening.radius + 2 * o.blend)) {
                clear = s - opening.radius; // a ball closes it
                break;
            }
        }
        if (clear < opening.radius)
            issues.push_back({"", i == 0 ? "/inlet" : "/branches/" + std::to_string(i - 1),
                              "\"" + opening.name + "\" opens into another part of the vessel",
                              "an opening clear of all others by its own radius"});
        extension[i] = clear;
    }
    if (!issues.empty()) throw InputError(std::move(issues));
}

// What the triangles are made of, of which a little beyond the openings is cut off.
struct Stubs {
    VesselShape shape;
    std::vector<Opening> openings;
    std::vector<double> reach; // of what is cut off there [m]
    Vec3 low = Vec3::Constant(1e300), high = Vec3::Constant(-1e300);

    Stubs(VesselShape joined, std::vector<Opening> ways_out, std::vector<double> cut_off)
        : shape{std::move(joined)}
        , openings{std::move(ways_out)}
        , reach{std::move(cut_off)}
    {
        for (const SweptTube& tube : shape.tubes()) {
            const Centreline& line = tube.centreline();
            for (int k = 0; k <= 128; ++k) {
                const CurvePoint p = line.at(line.length() * k / 128);
                const double r = 1.1 * p.radius + line.length() / 256;
                low = low.cwiseMin(p.position - Vec3::Constant(r));
                high = high.cwiseMax(p.position + Vec3::Constant(r));
            }
        }
    }
    ImplicitSurface surface() const
    {
        return {[this](const Vec3& x) { return shape.value(x); },
                [this](const Vec3& x) { return shape.project(x); }};
    }
};

struct VesselTriangles {
    Late<SurfaceMesh> mesh;
    Late<std::size_t> count;
};

/// What would take minutes and gigabytes is refused: mostly a length in another unit.
/// @param edge  of the smallest triangles [m]
/// @throws InputError
void refuse_many_triangles(const VesselOptions& o, double edge)
{
    constexpr double kMost = 5e6;
    double area =
        o.descending_length * std::max(o.descending_diameter[0], o.descending_diameter[1]) +
        o.arch_radius * o.arch_angle * std::max(o.arch_diameter[0], o.arch_diameter[1]) +
        o.ascending_length * o.ascending_diameter;
    for (const VesselBranch& b : o.branches)
        area += b.length * std::max(b.root_diameter, b.end_diameter);
    const double count = 2 * std::numbers::pi * area / (edge * edge);
    if (count > kMost)
        throw InputError(
            {{"", "",
              "about " + number_text(count) + " triangles with edges of " + number_text(edge) +
                  " m",
              "at most " + number_text(kMost) +
                  ": shorter parts, or a larger smallest diameter, blend or resolution"}});
}

SurfaceMesh make_triangles(const Stubs& s, double edge)
{
    const ImplicitSurface surface = s.surface();
    return trim_openings(surface_nets(surface, s.low, s.high, edge), surface, s.openings, edge,
                         s.reach);
}

// Made at first use; whether they can be made is checked at once. Joined tubes are one
// part without handles, or branches grow into one another: then the handles stay, however small
// the triangles are.
VesselTriangles triangles_of(const std::shared_ptr<const Stubs>& stubs, double edge)
{
    constexpr int kAttempts = 3;
    NetsPrediction all[kAttempts];
    double edges[kAttempts];
    const auto made = [&](int attempt) {
        return VesselTriangles{
            Late<SurfaceMesh>{[stubs, e = edges[attempt]] { return make_triangles(*stubs, e); }},
            Late<std::size_t>{[stubs, e = edges[attempt], n = all[attempt].triangles] {
                const Stubs& s = *stubs;
                return count_trimmed(n, s.surface(), s.low, s.high, s.openings, e, s.reach);
            }}};
    };
    for (int k = 0; k < kAttempts; ++k, edge *= 0.7) {
        edges[k] = edge;
        all[k] = predict_nets(stubs->surface(), stubs->low, stubs->high, edge);
        if (all[k].manifold && all[k].euler == 2) return made(k);
    }
    if (std::all_of(all, all + kAttempts,
                    [&](const NetsPrediction& p) { return p.manifold && p.euler == all[0].euler; }))
        return made(0);
    throw InputError({Issue{"", "/branches", "two walls nearer to each other than the triangles",
                            "a smaller resolution, or branches farther apart"}});
}

// The largest distance of triangles' middles from the wall; their corners are on it.
double deviation_of(const SurfaceMesh& mesh, const VesselShape& shape)
{
    double deviation = 0;
    for (const auto& t : mesh.triangles) {
        const Vec3 middle = (mesh.points[static_cast<std::size_t>(t[0])] +
                             mesh.points[static_cast<std::size_t>(t[1])] +
                             mesh.points[static_cast<std::size_t>(t[2])]) /
                            3;
        deviation = std::max(deviation, std::abs(shape.value(middle)));
    }
    return deviation;
}

double grid_for(const VesselOptions& o, double radius)
{
    return std::min(kFieldSpacing * radius, kGridOfBlend * o.blend);
}

DistanceField field_for(const VesselOptions& o, VesselShape shape, const Vec3& low, double radius)
{
    const double spacing = grid_for(o, radius),
                 seeds = std::min(kSeedEdge * radius, kEdgeOfBlend * o.blend);
    // The grid keeps off the planes and axes of symmetry, where rounding would decide.
    Mat3 axes; // those of the scene where the vessel stands upright and bends towards x
    axes.col(2) = o.axis.normalized();
    axes.col(0) = (o.arch_towards - o.arch_towards.dot(axes.col(2)) * axes.col(2)).normalized();
    axes.col(1) = axes.col(2).cross(axes.col(0));
    const Vec3 origin = o.inlet + spacing * (axes * Vec3{0.217, 0.331, 0.273});
    return {std::make_unique<VesselDistance>(std::move(shape), low, seeds), origin, spacing, axes};
}

/// All of a branch that bends more than the aorta's grid can follow, and where it joins.
/// @param main  the aorta
FieldWindow window_of(const VesselOptions& o, const VesselBranch& b, const SweptTube& main,
                      const TakeOff& root, const VesselShape& shape, double extension)
{
    const double r0 = b.root_diameter / 2, r1 = b.end_diameter / 2,
                 widest = std::max({r0, r1, r1 + end_slope((r1 - r0) / b.length) * extension}),
                 joined = widest + shape.blend_width();
    FieldWindow w{root.start, root.direction};
    // As long as the aorta's wall is farther than that, none of its edge with the branch is near.
    const double far = kSteepestWall * (joined + shape.blend_width());
    WallHint hint;
    while (w.from < root.hidden && main.distance(root.start + w.from * root.direction, hint) > far)
        w.from += r0 / 16;
    w.radius = joined;
    w.rise = w.fall = kBetweenGrids * kGridOfBlend * o.blend;
    return w;
}

/// The wall for contact. Around a branch that is narrower than the aorta the grid is finer.
/// @param low  a corner of the vessel's box [m]
Wall sampled_wall(const VesselOptions& o, const SweptTube& main, const std::vector<TakeOff>& roots,
                  const std::vector<double>& extension, const Vec3& low)
{
    double widest = o.ascending_diameter / 2; // of what the grid of all can follow
    for (double d : {o.descending_diameter[0], o.descending_diameter[1], o.arch_diameter[0],
                     o.arch_diameter[1]})
        widest = std::min(widest, d / 2);
    const double own = kOwnGrid * grid_for(o, widest);
    std::vector<std::pair<double, std::size_t>> narrow; // radius and number of branches
    for (std::size_t i = 0; i < roots.size(); ++i) {
        const double r = std::min(o.branches[i].root_diameter, o.branches[i].end_diameter) / 2;
        if (grid_for(o, r) < own)
            narrow.emplace_back(r, i);
        else
            widest = std::min(widest, r);
    }
    std::ranges::sort(narrow, std::greater{});
    const VesselShape shape = vessel_shape(o, roots, extension);
    DistanceField all = field_for(o, shape, low, widest);
    if (narrow.empty()) return make_wall(std::move(all));
    std::vector<LayeredField::Layer> finer;
    for (const auto& [r, i] : narrow)
        finer.push_back({field_for(o, shape, low, r),
                         window_of(o, o.branches[i], main, roots[i], shape, extension[i + 1])});
    return make_wall(LayeredField{std::move(all), std::move(finer)});
}

} // namespace

std::vector<VesselBranch> default_branches()
{
    constexpr double degree = std::numbers::pi / 180;
    return {{"brachiocephalic", 0.036, 0.012, 0.010, 0.045, 60 * degree},
            {"left_carotid", 0.052, 0.008, 0.008, 0.100, 80 * degree},
            {"left_subclavian", 0.068, 0.009, 0.009, 0.070, 90 * degree}};
}

WallModel make_vessel(const VesselOptions& o)
{
    if (std::vector<Issue> issues = vessel_issues(o); !issues.empty())
        throw InputError(std::move(issues));

    Centreline line = aorta(o, o.descending_diameter[0] / 2);
    const double arch_end = line.length() + o.arch_radius * o.arch_angle;
    add_arch(line, o);
    const SweptTube main{std::move(line), TubeEnd::ball, TubeEnd::ball};
    std::vector<TakeOff> roots;
    std::vector<Opening> openings{
        {"inlet", o.inlet, -o.axis.normalized(), o.descending_diameter[0] / 2}};
    double smallest = o.ascending_diameter / 2;
    for (const VesselBranch& b : o.branches) {
        const TakeOff t = take_off(o, main, arch_end, b);
        openings.push_back({b.name, t.start + (t.hidden + b.length) * t.direction, t.direction,
                            b.end_diameter / 2});
        smallest = std::min({smallest, b.root_diameter / 2, b.end_diameter / 2});
        roots.push_back(t);
    }
    for (double d : {o.descending_diameter[0], o.descending_diameter[1], o.arch_diameter[0],
                     o.arch_diameter[1]})
        smallest = std::min(smallest, d / 2);

    std::vector<double> extension;
    for (const Opening& opening : openings)
        extension.push_back(kTubeExtension * opening.radius);
    check_clear(o, vessel_shape(o, roots, extension), openings, extension);

    const double fine = std::min(kEdge * smallest, kEdgeOfBlend * o.blend);
    const double edge = o.resolution > 0 ? o.resolution : fine;
    refuse_many_triangles(o, std::min(fine, edge));

    // Triangles: only a little of what lies beyond the openings, to be cut off.
    std::vector<double> stub, reach;
    for (const Opening& opening : openings) {
        stub.push_back(3 * std::max(edge, fine));
        reach.push_back(stub.back() + 2 * opening.radius);
    }
    const auto stubs = std::make_shared<const Stubs>(vessel_shape(o, roots, stub), openings, reach);
    const auto [mesh, count] = triangles_of(stubs, edge);
    Wall wall = sampled_wall(o, main, roots, extension, stubs->low);
    WallModel model{
        mesh,
        std::move(wall),
        std::move(openings),
        {},
        Late<double>{[mesh = mesh, stubs] { return deviation_of(*mesh, stubs->shape); }},
        count};
    for (std::size_t i = 0; i < roots.size(); ++i) {
        const VesselBranch& b = o.branches[i];
        Branch branch;
        branch.name = b.name;
        const int pieces = std::max(2, static_cast<int>(std::ceil(2 * b.length / b.root_diameter)));
        for (int k = 0; k <= pieces; ++k) {
            const double t = static_cast<double>(k) / pieces;
            branch.centreline.push_back(roots[i].start +
                                        (roots[i].hidden + t * b.length) * roots[i].direction);
            branch.radius.push_back((b.root_diameter + t * (b.end_diameter - b.root_diameter)) / 2);
        }
        model.branches.push_back(std::move(branch));
    }
    return model;
}

} // namespace amontons
