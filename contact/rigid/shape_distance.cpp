#include "contact/rigid/shape_distance.hpp"

#include "contact/rigid/pair_contacts.hpp"

#include <algorithm>
#include <cmath>

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
    constexpr double kSameNormal = 2.5e-13; // 1 - cosine of half an angle of 1.4e-6
    const Polyhedron& body = shape.polyhedron;
    const NearestTriangle found = shape.tree.nearest(x, near);
    near = found.triangle;
    const auto t = std::size_t(near);
    const auto& corners = shape.mesh.triangles[t];
    const Vec3 &p = found.at.point, &normal = body.triangle_normals[t];

    // ---- Outwards there: the mean of the triangles at that place, weighted by angles
    // Source: Baerentzen & Aanaes 2005. The point stays where x moves along the normal of a face;
    // from an edge also across it, from a corner in any way.
    Vec3 outward = normal;
    Mat3 kept = normal * normal.transpose();
    const int feature = int(found.at.feature);
    if (feature >= int(TriangleFeature::vertex0)) {
        const auto v = std::size_t(corners[std::size_t(feature - int(TriangleFeature::vertex0))]);
        outward = body.point_normals[v];
        // What is no corner is on an edge or in a face.
        if (body.corner_of[v] >= 0 || !(outward.dot(normal) > 1 - kSameNormal)) kept.setIdentity();
    } else if (feature >= int(TriangleFeature::edge0)) {
        const auto k = std::size_t(feature - int(TriangleFeature::edge0));
        if (const std::int32_t other = body.neighbours[t][k]; other >= 0)
            outward = (normal + body.triangle_normals[std::size_t(other)]).normalized();
        if (!(outward.dot(normal) > 1 - kSameNormal)) {
            const Vec3 along = (shape.mesh.points[std::size_t(corners[(k + 1) % 3])] -
                                shape.mesh.points[std::size_t(corners[k])])
                                   .normalized();
            kept = Mat3::Identity() - along * along.transpose();
        }
    }

    const Vec3 d = x - p;
    const double sign = d.dot(outward) < 0 ? -1 : 1;
    if (!(d.norm() > 1e-14 * (p.norm() + x.norm()))) return {0, outward, Mat3::Zero()};
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
