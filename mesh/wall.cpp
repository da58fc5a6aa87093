#include "mesh/wall.hpp"

#include "mesh/base/error.hpp"
#include "mesh/distance_field.hpp"
#include "mesh/layered_field.hpp"
#include "mesh/swept_tube.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <variant>

namespace amontons {

namespace {

// A ball (axis zero) or an infinite cylinder; sign -1: free inside.
struct Round {
    Vec3 centre, axis;
    double radius, sign;
    bool cylinder;

    Vec3 across(const Vec3& x) const
    {
        const Vec3 e = x - centre;
        return cylinder ? Vec3{e - axis * axis.dot(e)} : e;
    }
    double distance(const Vec3& x, WallHint&) const { return sign * (across(x).norm() - radius); }
    WallSample sample(const Vec3& x, WallHint&) const
    {
        Vec3 e = across(x);
        double d = e.norm();
        WallSample out;
        out.distance = sign * (d - radius);
        const double least = 1e-9 * radius; // at the centre any direction serves
        if (d <= least) {
            d = least;
            e = d * (cylinder ? Vec3{axis.unitOrthogonal()} : Vec3{Vec3::UnitX()});
        }
        const Vec3 m = e / d;
        out.normal = sign * m;
        out.hessian = (sign / d) * (Mat3::Identity() - m * m.transpose());
        if (cylinder) out.hessian -= (sign / d) * axis * axis.transpose();
        return out;
    }
};

struct Plane {
    Vec3 point, normal;

    double distance(const Vec3& x, WallHint&) const { return normal.dot(x - point); }
    WallSample sample(const Vec3& x, WallHint&) const
    {
        return {normal.dot(x - point), normal, Mat3::Zero()};
    }
};

Vec3 checked_direction(const std::string& place, const Vec3& v)
{
    if (!(v.norm() > 0) || !v.allFinite())
        throw InputError({Issue{"", place, "no direction", "a finite vector of length > 0"}});
    return v.normalized();
}

Round checked(const Round& round)
{
    std::vector<Issue> issues;
    if (!(round.radius > 0) || !std::isfinite(round.radius))
        issues.push_back({"", "/radius", std::to_string(round.radius), "> 0 and finite [m]"});
    if (!round.centre.allFinite()) issues.push_back({"", "/centre", "not finite", "finite [m]"});
    if (!issues.empty()) throw InputError(std::move(issues));
    return round;
}

} // namespace

struct Wall::Geometry {
    std::variant<SweptTube, DistanceField, LayeredField, Round, Plane> shape;
};

Wall::Wall(std::unique_ptr<Geometry> geometry) : geometry_{std::move(geometry)} {}
Wall::Wall(Wall&&) noexcept = default;
Wall& Wall::operator=(Wall&&) noexcept = default;
Wall::~Wall() = default;

Wall Wall::share() const
{
    return std::visit(
        [](const auto& shape) {
            if constexpr (requires { shape.share(); })
                return Wall{std::make_unique<Geometry>(Geometry{shape.share()})};
            else
                return Wall{std::make_unique<Geometry>(Geometry{shape})};
        },
        geometry_->shape);
}

WallSample Wall::sample(const Vec3& x, WallHint& hint) const
{
    return std::visit([&](const auto& shape) { return shape.sample(x, hint); }, geometry_->shape);
}

double Wall::distance(const Vec3& x, WallHint& hint) const
{
    return std::visit([&](const auto& shape) { return shape.distance(x, hint); }, geometry_->shape);
}

double Wall::clearance(const Vec3& x, WallHint& hint) const
{
    return std::visit(
        [&](const auto& shape) {
            if constexpr (requires { shape.clearance(x, hint); })
                return shape.clearance(x, hint);
            else
                return -std::numeric_limits<double>::infinity();
        },
        geometry_->shape);
}

void Wall::prepare(const std::string& cache, int threads)
{
    std::visit(
        [&](auto& shape) {
            if constexpr (requires { shape.prepare(cache, threads); })
                shape.prepare(cache, threads);
        },
        geometry_->shape);
}

std::vector<std::string> Wall::keep() const
{
    return std::visit(
        [&](const auto& shape) {
            if constexpr (requires { shape.keep(); })
                return shape.keep();
            else
                return std::vector<std::string>();
        },
        geometry_->shape);
}

Wall make_wall(SweptTube tube)
{
    return Wall{std::make_unique<Wall::Geometry>(Wall::Geometry{std::move(tube)})};
}

Wall make_wall(DistanceField field)
{
    return Wall{std::make_unique<Wall::Geometry>(Wall::Geometry{std::move(field)})};
}

Wall make_wall(LayeredField field)
{
    return Wall{std::make_unique<Wall::Geometry>(Wall::Geometry{std::move(field)})};
}

Wall make_ball_wall(const Vec3& centre, double radius, bool inside)
{
    const Round ball = checked({centre, Vec3::Zero(), radius, inside ? -1.0 : 1.0, false});
    return Wall{std::make_unique<Wall::Geometry>(Wall::Geometry{ball})};
}

Wall make_cylinder_wall(const Vec3& point, const Vec3& axis, double radius, bool inside)
{
    const Round cylinder =
        checked({point, checked_direction("/axis", axis), radius, inside ? -1.0 : 1.0, true});
    return Wall{std::make_unique<Wall::Geometry>(Wall::Geometry{cylinder})};
}

Wall make_plane_wall(const Vec3& point, const Vec3& normal)
{
    if (!point.allFinite()) throw InputError({Issue{"", "/centre", "not finite", "finite [m]"}});
    const Plane plane{point, checked_direction("/axis", normal)};
    return Wall{std::make_unique<Wall::Geometry>(Wall::Geometry{plane})};
}

namespace {

constexpr double kRoundLumen = 4.0 / 3; // of the radius of balls on a centreline: a round lumen
constexpr double kFlattest = 2.5;       // of it: lumens are no wider
constexpr double kWider = 1.1;          // of it: another lumen
constexpr double kAtWall = 0.02;        // of it
constexpr int kMostRayPieces = 200;

/// How deep a place is in a branch; > 0 outside [m].
struct PlaceInBranch {
    double depth = std::numeric_limits<double>::infinity();
    double radius = 0;           ///< there [m]
    Vec3 on_axis = Vec3::Zero(); ///< the nearest point of its centreline [m]
};

/// The way from a centreline across its lumen to the wall, through a place. The lumen is nowhere
/// wider on the way than around the centreline, and ends not far from there: else the way leads
/// into another one.
/// @param radius  around the centreline
/// @return  its length [m], or 0
double way_across(const Wall& wall, const Vec3& from, const Vec3& through, double radius)
{
    const Vec3 along = (through - from).normalized();
    const double to_place = (through - from).norm();
    WallHint hint;
    double way = 0;
    for (int k = 0; k < kMostRayPieces && way <= kFlattest * radius; ++k) {
        const double room = wall.distance(from + way * along, hint);
        if (!(room <= kWider * radius)) return 0;
        if (room <= kAtWall * radius) return way > to_place ? way : 0;
        way += 0.5 * room;
    }
    return 0;
}

PlaceInBranch place_in(const WallModel& model, const Branch& branch, const Vec3& x)
{
    PlaceInBranch found;
    const std::vector<Vec3>& c = branch.centreline;
    if (branch.kind == Branch::ball)
        return {(x - c[0]).norm() - branch.radius[0], branch.radius[0], c[0]};
    if (branch.kind == Branch::box) {
        const Eigen::Array3d beyond =
            (c[0].cwiseMin(c[1]) - x).cwiseMax(x - c[0].cwiseMax(c[1])).array();
        return {beyond.maxCoeff(), 0, 0.5 * (c[0] + c[1])};
    }
    const bool given = branch.kind == Branch::line;
    const std::size_t n = c.size();
    for (std::size_t i = 0; i + 1 < n; ++i) {
        const Vec3& a = c[i];
        const Vec3 along = c[i + 1] - a;
        double t = (x - a).dot(along) / along.squaredNorm();
        if (i == 0 && t < 0) continue; // still in the parent
        if (i + 2 < n) t = std::min(t, 1.0);
        t = std::max(t, 0.0);
        const double last = std::min(t, 1.0);
        const double radius = (given ? kRoundLumen : 1.0) *
                              (branch.radius[i] + last * (branch.radius[i + 1] - branch.radius[i]));
        const Vec3 on_axis = a + t * along;
        const double depth = (x - on_axis).norm() - radius;
        if (depth < found.depth) found = {depth, radius, on_axis};
    }
    if (given && found.depth >= 0 && found.radius > 0) { // the lumen may be flat
        const double way = way_across(model.wall, found.on_axis, x, found.radius / kRoundLumen);
        if (way > 0) found.depth = (x - found.on_axis).norm() - way;
    }
    return found;
}

} // namespace

int branch_number_at(const WallModel& model, const Vec3& x)
{
    int best = -1;
    PlaceInBranch deepest;
    deepest.depth = 0;
    for (std::size_t i = 0; i < model.branches.size(); ++i)
        if (const PlaceInBranch p = place_in(model, model.branches[i], x);
            p.depth < deepest.depth) {
            deepest = p;
            best = static_cast<int>(i);
        }
    if (best < 0 || model.branches[static_cast<std::size_t>(best)].kind != Branch::line)
        return best;
    // Where two centrelines run as one, the place belongs to neither.
    for (std::size_t i = 0; i < model.branches.size(); ++i) {
        if (static_cast<int>(i) == best || model.branches[i].kind != Branch::line) continue;
        const PlaceInBranch p = place_in(model, model.branches[i], x);
        if (p.depth < 0 && (p.on_axis - deepest.on_axis).norm() < 0.5 * deepest.radius) return -1;
    }
    return best;
}

std::string branch_at(const WallModel& model, const Vec3& x)
{
    const int branch = branch_number_at(model, x);
    return branch < 0 ? "" : model.branches[static_cast<std::size_t>(branch)].name;
}

const Opening* opening_passed(const WallModel& model, const Vec3& from, const Vec3& to)
{
    constexpr double kRim = 1.1; // of the radius: rims of given surfaces are not quite round
    const Opening* first = nullptr;
    double earliest = std::numeric_limits<double>::infinity();
    for (const Opening& opening : model.openings) {
        const double before = (from - opening.centre).dot(opening.outward);
        const double after = (to - opening.centre).dot(opening.outward);
        if (before > 0 || after <= 0) continue;
        const double t = before / (before - after);
        const double off = (from + t * (to - from) - opening.centre).norm();
        if (off <= kRim * opening.radius && t < earliest) {
            earliest = t;
            first = &opening;
        }
    }
    return first;
}

} // namespace amontons
