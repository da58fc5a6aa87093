#include "solver/rod10/rod10_contact.hpp"

#include "mesh/base/error.hpp"
#include "mesh/surface_edges.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <string>

namespace amontons {
namespace {

constexpr int kPointsOfEdge = 4;

using Vec10 = Eigen::Matrix<double, 10, 1>;

Vec10 of_element(const std::vector<Rod10Node>& nodes, std::size_t e, const Mat3& to_rod)
{
    Vec10 v;
    for (std::size_t end = 0; end < 2; ++end) {
        const Rod10Node& n = nodes[e + end];
        v.segment<3>(5 * int(end)) = to_rod * n.along;
        v[5 * int(end) + 3] = n.turn[0];
        v[5 * int(end) + 4] = n.turn[1];
    }
    return v;
}

/// Displacement of a point beside the axis by the element's numbers, in the rod's axes: that of the
/// axis (table 1 is that of cubics), and what the section's turn does to the arm.
/// @param s    along the element, 0 to 1
/// @param arm  from the axis, across it [m]
Eigen::Matrix<double, 3, 10> displacement(double length, double s, const Vec3& arm)
{
    const double h[4] = {1 - s * s * (3 - 2 * s), length * s * (1 - s) * (1 - s),
                         s * s * (3 - 2 * s), -length * s * s * (1 - s)};
    const double slope[4] = {-6 * s * (1 - s) / length, (1 - s) * (1 - 3 * s),
                             6 * s * (1 - s) / length, s * (3 * s - 2)};
    Eigen::Matrix<double, 3, 10> N = Eigen::Matrix<double, 3, 10>::Zero();
    N(0, 0) = 1 - s;
    N(0, 5) = s;
    const int y[4] = {1, 4, 6, 9}, z[4] = {2, 3, 7, 8};
    for (int k = 0; k < 4; ++k) {
        const double sign = k % 2 == 0 ? 1 : -1; // a turn about y lowers z
        N(1, y[k]) = h[k];
        N(2, z[k]) = sign * h[k];
        // turn x arm = (turn_y arm_z - turn_z arm_y) along the rod; turn_y = -dz/dx
        N(0, y[k]) -= slope[k] * arm.y();
        N(0, z[k]) -= sign * slope[k] * arm.z();
    }
    return N;
}

} // namespace

Rod10Object::Rod10Object(const SurfaceMesh& surface)
{
    // Rounding of coordinates may make coplanar triangles rest on each other by this part.
    constexpr double kFlat = 1e-9;
    std::vector<Vec3> corners;
    for (const auto& t : surface.triangles)
        for (const std::int32_t k : t)
            corners.push_back(surface.points[std::size_t(k)]);
    const auto refuse = [](std::string place, std::string found) {
        throw InputError({{"", std::move(place), std::move(found),
                           "a closed convex surface with its normals outwards"}});
    };
    if (surface.triangles.empty()) refuse("surface", "no triangle");
    for_each_edge(sorted_half_edges(surface), [&](std::span<const HalfEdge> sides) {
        if (sides.size() != 2)
            refuse("triangle " + std::to_string(sides[0].triangle),
                   "an edge with " + std::to_string(sides.size()) + " triangles");
    });
    Vec3 low = corners.front(), high = low;
    for (const Vec3& x : corners) {
        low = low.cwiseMin(x);
        high = high.cwiseMax(x);
    }
    centre_ = (low + high) / 2;
    radius_ = (high - low).norm() / 2;
    for (std::size_t i = 0; i < surface.triangles.size(); ++i) {
        const Vec3* x = &corners[3 * i];
        const Vec3 across = (x[1] - x[0]).cross(x[2] - x[0]);
        if (!(across.norm() > 0)) refuse("triangle " + std::to_string(i), "no area");
        normals_.push_back(across.normalized());
        offsets_.push_back(normals_.back().dot(x[0]));
        for (const Vec3& other : corners)
            if (normals_.back().dot(other) - offsets_.back() > kFlat * radius_)
                refuse("triangle " + std::to_string(i), "a corner in front of it");
    }
}

std::optional<Rod10Object::Face> Rod10Object::contains(const Vec3& x) const
{
    std::size_t nearest = 0;
    double depth = 1e300;
    for (std::size_t i = 0; i < normals_.size(); ++i) {
        const double d = offsets_[i] - normals_[i].dot(x);
        if (d < 0) return std::nullopt;
        if (d < depth) depth = d, nearest = i;
    }
    return Face{normals_[nearest], depth};
}

Rod10Contact::Rod10Contact(const Rod10& rod, std::vector<Rod10Object> objects,
                           Rod10ContactOptions options, int every)
    : rod_(rod)
    , objects_(std::move(objects))
    , options_(options)
    , solver_(rod, every)
    , deflections_(std::size_t(rod.nodes))
    , loads_(std::size_t(rod.nodes))
{
    std::vector<Issue> issues;
    const auto need = [&](bool fine, const char* name, double value, const char* allowed) {
        if (!fine) issues.push_back({"", name, std::to_string(value), allowed});
    };
    need(options.stiffness > 0, "stiffness", options.stiffness, "a number > 0 [N/m]");
    need(options.attenuation >= 0, "attenuation", options.attenuation, "a number >= 0 [N s/m]");
    need(options.frame > 0, "frame", options.frame, "a number > 0 [s]");
    need(options.largest_change > 0, "largest_change", options.largest_change, "a number > 0 [N]");
    if (!issues.empty()) throw InputError(std::move(issues));
    const double r = rod.diameter / 2;
    for (const Vec3& arm : {Vec3(0, r, 0), Vec3(0, -r, 0), Vec3(0, 0, r), Vec3(0, 0, -r)})
        for (int k = 1; k <= kPointsOfEdge; ++k) {
            const double s = double(k) / kPointsOfEdge;
            place_.push_back(Vec3(s * rod.element(), 0, 0) + arm);
            shape_.push_back(displacement(rod.element(), s, arm));
        }
}

Rod10Contact::Frame Rod10Contact::frame(const Vec3& hand, const Mat3& to_rod)
{
    solver_.orient(to_rod);
    const Mat3 to_space = to_rod.transpose();
    const std::size_t points = place_.size();
    const bool first = before_.empty();
    before_.resize(std::size_t(rod_.nodes - 1) * points);
    std::fill(loads_.begin(), loads_.end(), Rod10Node{});
    Frame result;
    for (std::size_t e = 0; e + 1 < std::size_t(rod_.nodes); ++e) {
        // The deflections of the last frame follow the hand.
        const Vec10 d = of_element(deflections_, e, to_rod_);
        Vec10 load = Vec10::Zero();
        for (std::size_t p = 0; p < points; ++p) {
            const Vec3 own = Vec3(double(e) * rod_.element(), 0, 0) + place_[p] + shape_[p] * d;
            const Vec3 x = hand + to_space * own;
            const Vec3 v =
                first ? Vec3::Zero() : Vec3((x - before_[e * points + p]) / options_.frame);
            before_[e * points + p] = x;
            for (const Rod10Object& object : objects_) {
                if (!object.near(x)) continue;
                const auto face = object.contains(x);
                if (!face) continue;
                const Vec3 f = (options_.stiffness * face->depth -
                                options_.attenuation * v.dot(face->normal)) *
                               face->normal;
                load += shape_[p].transpose() * (to_rod * f);
                result.force += f;
                ++result.touching;
                result.depth = std::max(result.depth, face->depth);
            }
        }
        for (std::size_t end = 0; end < 2; ++end) {
            Rod10Node& n = loads_[e + end];
            n.along += to_space * load.segment<3>(5 * int(end));
            n.turn[0] += load[5 * int(end) + 3];
            n.turn[1] += load[5 * int(end) + 4];
        }
    }
    deflections_ = solver_.deflections(loads_);
    to_rod_ = to_rod;
    const Vec3 change = result.force - sent_;
    const double part = options_.largest_change / change.norm();
    sent_ = part < 1 ? Vec3(sent_ + part * change) : result.force;
    result.sent = sent_;
    return result;
}

} // namespace amontons
