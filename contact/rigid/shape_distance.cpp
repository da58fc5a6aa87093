#include "contact/rigid/shape_distance.hpp"

#include "contact/rigid/pair_contacts.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace amontons {
namespace {

/// From a nearest point at d; the point stays where x moves in the directions of `kept`.
WallSample from_point(const Vec3& d, const Mat3& kept)
{
    WallSample s;
    s.distance = d.norm();
    s.normal = d / s.distance;
    s.hessian = (kept - s.normal * s.normal.transpose()) / s.distance;
    return s;
}

WallSample distance_to(const Ball& ball, const Vec3& x)
{
    const double r = x.norm();
    if (!(r > 0)) return {-ball.radius, Vec3::UnitZ(), Mat3::Zero()};
    WallSample s = from_point(x, Mat3::Identity());
    s.distance -= ball.radius;
    return s;
}

WallSample distance_to(const Cylinder& cylinder, const Vec3& x)
{
    const Vec3 across(x.x(), x.y(), 0);
    const double r = across.norm();
    const Vec3 out = r > 0 ? Vec3(across / r) : Vec3::UnitX();
    const Vec3 up(0, 0, x.z() < 0 ? -1 : 1);
    const double side = r - cylinder.radius, end = std::abs(x.z()) - cylinder.half_length;
    const Vec3 round = Vec3::UnitZ().cross(out);
    WallSample s;
    if (side > 0 && end > 0) { // beyond the rim
        const Vec3 d = side * out + end * up;
        s.distance = d.norm();
        s.normal = d / s.distance;
        const Vec3 tilt = s.normal.cross(round);
        s.hessian = tilt * tilt.transpose() / s.distance +
                    s.normal.dot(out) / r * round * round.transpose();
    } else {
        s.distance = std::max(side, end);
        s.normal = side > end ? out : up;
        if (side > end && r > 0) s.hessian = round * round.transpose() / r;
    }
    return s;
}

WallSample distance_to(const Ellipsoid& ellipsoid, const Vec3& x)
{
    const NearestPlace near = nearest_on(ellipsoid, x);
    WallSample s;
    s.distance = near.distance;
    s.normal = near.normal;
    // Of the parallel surface through x: with the shape operator S of the ellipsoid, (1 + d S)^-1
    // S.
    const Vec3 square = ellipsoid.radii.cwiseAbs2();
    const Mat3 flat = Mat3::Identity() - s.normal * s.normal.transpose();
    const Mat3 S =
        flat * square.cwiseInverse().asDiagonal() * flat / near.point.cwiseQuotient(square).norm();
    const Mat3 lift = Mat3::Identity() + s.distance * S;
    if (s.distance >= 0 || lift.determinant() > 1e-6) s.hessian = lift.inverse() * S;
    s.hessian = 0.5 * (s.hessian + s.hessian.transpose()).eval();
    return s;
}

WallSample distance_to(const Capsule& capsule, const Vec3& x)
{
    const double z = std::clamp(x.z(), -capsule.half_length, capsule.half_length);
    const Vec3 from{x.x(), x.y(), x.z() - z};
    Mat3 kept = Mat3::Identity();
    if (std::abs(x.z()) < capsule.half_length) kept(2, 2) = 0;
    if (!(from.norm() > 0)) return {-capsule.radius, Vec3::UnitX(), Mat3::Zero()};
    WallSample s = from_point(from, kept);
    s.distance -= capsule.radius;
    return s;
}

WallSample distance_to(const Box& box, const Vec3& x)
{
    const Vec3 beyond = x.cwiseAbs() - box.half_extents;
    Vec3 sign;
    for (int k = 0; k < 3; ++k)
        sign[k] = x[k] < 0 ? -1 : 1;
    if (beyond.maxCoeff() > 0) {
        const Vec3 out = beyond.cwiseMax(0);
        return from_point(out.cwiseProduct(sign),
                          Mat3((beyond.array() > 0).cast<double>().matrix().asDiagonal()));
    }
    WallSample s;
    Eigen::Index nearest = 0;
    s.distance = beyond.maxCoeff(&nearest);
    s.normal = sign[nearest] * Vec3::Unit(nearest);
    return s;
}

WallSample distance_to(const TriangleShape& shape, const Vec3& x, std::int32_t& near)
{
    const SurfaceMesh& mesh = shape.mesh;
    const NearestTriangle found = shape.tree.nearest(x, near);
    near = found.triangle;
    const Vec3& p = found.at.point;
    const auto corners = [&](std::int32_t t, int k) -> const Vec3& {
        return mesh.points[std::size_t(mesh.triangles[std::size_t(t)][std::size_t(k % 3)])];
    };
    const auto normal_of = [&](std::int32_t t) {
        return Vec3((corners(t, 1) - corners(t, 0)).cross(corners(t, 2) - corners(t, 0)))
            .normalized();
    };
    // Outwards where the nearest point is: the mean of the triangles there, weighted by angles.
    // Source: Baerentzen & Aanaes 2005.
    Vec3 outward = normal_of(near);
    Mat3 kept = outward * outward.transpose();
    if (found.at.feature != TriangleFeature::face) {
        const double size = (corners(near, 1) - corners(near, 0)).norm();
        std::vector<std::int32_t> around;
        shape.tree.within(p, 1e-9 * size, around);
        outward.setZero();
        std::vector<Vec3> faces;
        for (const std::int32_t t : around) {
            const TrianglePoint at =
                closest_on_triangle(p, corners(t, 0), corners(t, 1), corners(t, 2));
            if ((at.point - p).norm() > 1e-9 * size) continue;
            double angle = 3.14159265358979323846;
            const int k = int(at.feature) - int(TriangleFeature::vertex0); // its own corner there
            if (k >= 0) {
                const Vec3 a = (corners(t, k + 1) - corners(t, k)).normalized(),
                           b = (corners(t, k + 2) - corners(t, k)).normalized();
                angle = std::acos(std::clamp(a.dot(b), -1.0, 1.0));
            }
            outward += angle * normal_of(t);
            faces.push_back(normal_of(t));
        }
        // The point stays where x moves across an edge, or in any way at a corner.
        const int feature = int(found.at.feature);
        kept.setIdentity();
        if (feature < int(TriangleFeature::vertex0)) {
            const int k = feature - int(TriangleFeature::edge0);
            const Vec3 along = (corners(near, k + 1) - corners(near, k)).normalized();
            kept -= along * along.transpose();
        }
        const bool flat = std::all_of(faces.begin(), faces.end(), [&](const Vec3& n) {
            return n.dot(faces.front()) > 1 - 1e-12;
        });
        if (flat && !faces.empty()) kept = faces.front() * faces.front().transpose();
    }
    const Vec3 d = x - p;
    const double sign = d.dot(outward) < 0 ? -1 : 1;
    if (!(d.norm() > 1e-14 * (p.norm() + x.norm()))) return {0, outward.normalized(), Mat3::Zero()};
    WallSample s = from_point(d, kept);
    s.distance *= sign;
    s.normal *= sign;
    s.hessian *= sign;
    return s;
}

} // namespace

WallSample shape_distance(const RigidShape& shape, const Vec3& x, std::int32_t& near)
{
    if (const auto* ball = std::get_if<Ball>(&shape)) return distance_to(*ball, x);
    if (const auto* cylinder = std::get_if<Cylinder>(&shape)) return distance_to(*cylinder, x);
    if (const auto* box = std::get_if<Box>(&shape)) return distance_to(*box, x);
    if (const auto* ellipsoid = std::get_if<Ellipsoid>(&shape)) return distance_to(*ellipsoid, x);
    if (const auto* capsule = std::get_if<Capsule>(&shape)) return distance_to(*capsule, x);
    if (const auto* triangles = std::get_if<TriangleShape>(&shape))
        return distance_to(*triangles, x, near);
    return {x.z(), Vec3::UnitZ(), Mat3::Zero()};
}

} // namespace amontons
