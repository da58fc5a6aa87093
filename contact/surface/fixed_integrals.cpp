#include "contact/surface/fixed_integrals.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

// What is integrated over a segment are products of the slave's shape functions, and of these with
// the place and the normal of the master, which are linear in the plane but for the normal's
// length. The slave's functions are polynomials of the place in the plane for triangles and
// parallelograms. On other quadrilaterals they have a root, singular where the area per reference
// area vanishes: over a segment that is small against the distance to there (`bend`) they are
// nearly polynomials.

namespace amontons {
namespace {

constexpr double kRoundOff = 1e-14; // of a face's sides: it is plane
constexpr double kLittleBent = 0.2; // Newton's method finds places from the middle of the face
constexpr double kSmallBend = 0.04; // beyond the rule's degree (bend / 2)^5 is left out, 3e-9
/// Segments that are smaller than this part of the slave's face take the rule of degree 2: four
/// powers of it are left out, 1e-7 of what the integrals are.
constexpr double kSmallSegment = 0.1;
constexpr int kNewtonSteps = 20;
constexpr double kSquared = 1e-7, kBeyondBorder = 0.25; // as in facets.cpp
constexpr double kRightPlace = 1e-10;                   // on the reference face

/// Newton's steps, each of which squares the error on the reference face, from a guess that leaves
/// out the square of the bend.
int steps_from(double bend)
{
    int steps = 0;
    for (double off = 2 * bend * bend; off > kRightPlace; off *= off)
        ++steps;
    return steps;
}

} // namespace

FixedIntegrals::FixedIntegrals(const FixedShape& master, const ExternalSurface& surface,
                               std::span<const Vec3> places)
    : master_(master)
    , surface_(surface)
    , places_(places)
{
}

void FixedIntegrals::begin_face(const FaceMultipliers& multipliers, FaceSums& sums)
{
    multipliers_ = &multipliers;
    sums_ = &sums;
}

void FixedIntegrals::begin_facet(const Facet& slave)
{
    facet_ = &slave;
    plane_.emplace(slave);
    over_.facet = nullptr;
    face_ = FaceInPlane(surface_.face(std::size_t(slave.face)), places_, *plane_);
    last_.setZero();
    has_dual_ = has_only_ = false;
    if (face_.nodes == 4) {
        const auto& p = face_.node;
        middle_ = 0.25 * (p[0] + p[1] + p[2] + p[3]);
        along_[0] = 0.25 * (p[1] - p[0] + p[2] - p[3]);
        along_[1] = 0.25 * (p[3] - p[0] + p[2] - p[1]);
        twist_ = 0.25 * (p[0] - p[1] + p[2] - p[3]);
        const double size = along_[0].norm() + along_[1].norm();
        warp_ = std::abs(twist_.z()) > kRoundOff * size ? std::abs(twist_.z()) : 0;
        // The area per reference area is linear: its change over the face against its middle.
        const auto cross = [](const Vec3& a, const Vec3& b) {
            return a.x() * b.y() - a.y() * b.x();
        };
        bend_ = (std::abs(cross(along_[0], twist_)) + std::abs(cross(twist_, along_[1]))) /
                std::abs(cross(along_[0], along_[1]));
        if (bend_ <= kLittleBent) {
            Eigen::Matrix2d slope;
            slope << along_[0].head<2>(), along_[1].head<2>();
            near_slope_ = slope.inverse();
            near_twist_ = near_slope_ * twist_.head<2>();
            polygon_corner_ = middle_.head<2>();
            polygon_xi_.setZero();
            steps_ = steps_from(bend_);
        }
        return;
    }
    const Vec2 a = (*plane_)(slave.corner[0]).head<2>(), b = (*plane_)(slave.corner[1]).head<2>(),
               c = (*plane_)(slave.corner[2]).head<2>();
    Eigen::Matrix2d from, to;
    from << b - a, c - a;
    to << slave.xi[1] - slave.xi[0], slave.xi[2] - slave.xi[0];
    slope_ = to * from.inverse();
    offset_ = slave.xi[0] - slope_ * a;
    back_ = from * to.inverse();
    origin_ = a - back_ * slave.xi[0];
}

Vec2 FixedIntegrals::in_plane(const Vec2& xi) const
{
    if (face_.nodes == 4) return spot(face_, xi).place.head<2>();
    return back_ * xi + origin_;
}

/// Newton's method from the last place on.
void FixedIntegrals::find_on_quadrilateral_(const Vec2& z)
{
    Vec2& xi = last_;
    if (!xi.allFinite() || xi.cwiseAbs().maxCoeff() > 1 + kBeyondBorder) xi.setZero();
    for (int k = 0; k < kNewtonSteps; ++k) {
        const Vec2 a = (along_[0] + xi.y() * twist_).head<2>(),
                   b = (along_[1] + xi.x() * twist_).head<2>();
        const Vec2 off = z - middle_.head<2>() - xi.x() * a - xi.y() * along_[1].head<2>();
        const Vec2 step =
            Vec2{b.y() * off.x() - b.x() * off.y(), a.x() * off.y() - a.y() * off.x()} /
            (a.x() * b.y() - a.y() * b.x());
        xi += step;
        if (!(step.cwiseAbs().maxCoeff() > kSquared)) return;
    }
    xi.setConstant(std::numeric_limits<double>::infinity());
}

/// Where a quadrilateral is nearly a parallelogram the slope in its middle serves for all of it;
/// else, near a place of a polygon that is small against the face, the slope there.
void FixedIntegrals::begin_polygon_(const Vec2& z, double part)
{
    contraction_ = bend_ * part;
    if (face_.nodes != 4 || contraction_ > kSmallBend) {
        contraction_ = 1;
        return;
    }
    if (bend_ <= kLittleBent) return; // as begin_facet has it
    find_on_quadrilateral_(z);
    if (!last_.allFinite()) {
        contraction_ = 1;
        return;
    }
    Eigen::Matrix2d slope;
    slope << (along_[0] + last_.y() * twist_).head<2>(), (along_[1] + last_.x() * twist_).head<2>();
    near_slope_ = slope.inverse();
    near_twist_ = near_slope_ * twist_.head<2>();
    polygon_corner_ = z;
    polygon_xi_ = last_;
    steps_ = steps_from(contraction_);
}

void FixedIntegrals::set_master_(const Facet& master)
{
    if (over_.facet == &master) return;
    over_.facet = &master;
    std::array<Vec3, 3> corner;
    for (std::size_t k = 0; k < 3; ++k)
        corner[k] = (*plane_)(master.corner[k]);
    over_.corner = corner[0].head<2>();
    const Vec3 a = corner[1] - corner[0], b = corner[2] - corner[0];
    // Derivatives of the shares of the second and the third corner.
    const double twice = a.x() * b.y() - a.y() * b.x();
    const Vec2 u = Vec2(b.y(), -b.x()) / twice, v = Vec2(-a.y(), a.x()) / twice;
    over_.height << corner[0].z(), a.z() * u + b.z() * v;
    over_.n[0] = master.normal;
    over_.n[1] = over_.n[2] = Vec3::Zero();
    if (!master_.normals.has(master.face)) return;
    over_.n[0] = master_.normals.corner(master.face, 0);
    const Vec3 along_u = master_.normals.corner(master.face, 1) - over_.n[0],
               along_v = master_.normals.corner(master.face, 2) - over_.n[0];
    for (int k = 0; k < 2; ++k)
        over_.n[1 + k] = u[k] * along_u + v[k] * along_v;
}

void FixedIntegrals::add_point_(const Vec2& z, double weight, Waiting& to, int only)
{
    const int k = to.count;
    if (face_.nodes == 4) {
        Vec2 xi;
        if (contraction_ < 1) {
            const Vec2 off = near_slope_ * (z - polygon_corner_);
            xi = polygon_xi_ + off - off.x() * off.y() * near_twist_;
            to.steps = std::max(to.steps, steps_);
        } else {
            find_on_quadrilateral_(z);
            if (!(last_.cwiseAbs().maxCoeff() <= 1 + kBeyondBorder)) return;
            xi = last_;
        }
        to.xi[0][k] = xi.x();
        to.xi[1][k] = xi.y();
    }
    to.weight[k] = weight;
    for (int i = 0; i < 2; ++i)
        to.z[i][k] = z[i];
    if (to.masters == 0 || to.master[to.masters - 1].facet != over_.facet) {
        to.from[to.masters] = k;
        to.master[to.masters++] = over_;
    }
    if (++to.count == kBlock) flush_(only);
}

void FixedIntegrals::flush_(int only)
{
    Waiting& points = waiting_[only + 1];
    if (points.count == 0) return;
    const auto fill = [&](Many& value) { // once more, of no weight
        for (int k = points.count; k < kBlock; ++k)
            value[k] = value[0];
    };
    for (int i = 0; i < 2; ++i) {
        fill(points.z[i]);
        fill(points.xi[i]);
    }
    const auto spread = [&](auto number, Many& value) { // from each master's first point on
        value.setConstant(number(points.master[0]));
        for (int m = 1; m < points.masters; ++m)
            for (int k = points.from[m]; k < kBlock; ++k)
                value[k] = number(points.master[m]);
    };
    for (int i = 0; i < 2; ++i)
        spread([i](const MasterPlane& m) { return m.corner[i]; }, points.corner[i]);
    for (int i = 0; i < 3; ++i) {
        spread([i](const MasterPlane& m) { return m.height[i]; }, points.height[i]);
        for (int j = 0; j < 3; ++j)
            spread([i, j](const MasterPlane& m) { return m.n[i][j]; }, points.n[i][j]);
    }
    for (int k = points.count; k < kBlock; ++k)
        points.weight[k] = 0;
    if (face_.nodes == 3)
        integrate_<3>(points, only);
    else if (face_.nodes == 4)
        integrate_<4>(points, only);
    else
        integrate_<6>(points, only);
    points.count = points.steps = points.masters = 0;
}

/// Shape functions of the slave's face and the points' places in the plane.
/// @return  the area of the face per area of the plane
template <int kNodes>
FixedIntegrals::Many FixedIntegrals::shape_(const Waiting& points, Many N[kNodes], Many z[2]) const
{
    z[0] = points.z[0];
    z[1] = points.z[1];
    Many a, b;
    if constexpr (kNodes == 4) {
        a = points.xi[0];
        b = points.xi[1];
        for (int k = 0; k < points.steps; ++k) {
            const Many px = along_[0].x() + b * twist_.x(), py = along_[0].y() + b * twist_.y(),
                       qx = along_[1].x() + a * twist_.x(), qy = along_[1].y() + a * twist_.y();
            const Many off_x = z[0] - middle_.x() - a * px - b * along_[1].x(),
                       off_y = z[1] - middle_.y() - a * py - b * along_[1].y();
            const Many per_area = 1 / (px * qy - py * qx);
            a += (qy * off_x - qx * off_y) * per_area;
            b += (px * off_y - py * off_x) * per_area;
        }
        N[0] = 0.25 * (1 - a) * (1 - b);
        N[1] = 0.25 * (1 + a) * (1 - b);
        N[2] = 0.25 * (1 + a) * (1 + b);
        N[3] = 0.25 * (1 - a) * (1 + b);
        if (!(warp_ > 0)) return Many::Ones();
        Many p[3], q[3];
        for (int k = 0; k < 3; ++k) {
            p[k] = along_[0][k] + b * twist_[k];
            q[k] = along_[1][k] + a * twist_[k];
        }
        const Many up = p[0] * q[1] - p[1] * q[0];
        return (1 + ((p[1] * q[2] - p[2] * q[1]).square() + (p[2] * q[0] - p[0] * q[2]).square()) /
                        up.square())
            .sqrt();
    } else {
        a = slope_(0, 0) * z[0] + slope_(0, 1) * z[1] + offset_.x();
        b = slope_(1, 0) * z[0] + slope_(1, 1) * z[1] + offset_.y();
        const Many c = 1 - a - b;
        if constexpr (kNodes == 3) {
            N[0] = c;
            N[1] = a;
            N[2] = b;
            return Many::Ones();
        } else {
            N[0] = c * (2 * c - 1);
            N[1] = a * (2 * a - 1);
            N[2] = b * (2 * b - 1);
            N[3] = 4 * c * a;
            N[4] = 4 * a * b;
            N[5] = 4 * b * c;
            const Many at_0 = 1 - 4 * c;
            const Many by_a[6] = {at_0, 4 * a - 1, Many::Zero(), 4 * (c - a), 4 * b, -4 * b};
            const Many by_b[6] = {at_0, Many::Zero(), 4 * b - 1, -4 * a, 4 * a, 4 * (c - b)};
            Many p[3], q[3];
            for (int k = 0; k < 3; ++k) {
                p[k] = by_a[0] * face_.node[0][k];
                q[k] = by_b[0] * face_.node[0][k];
                for (std::size_t i = 1; i < 6; ++i) {
                    p[k] += by_a[i] * face_.node[i][k];
                    q[k] += by_b[i] * face_.node[i][k];
                }
            }
            for (int k = 0; k < 2; ++k) {
                z[k] = N[0] * face_.node[0][k];
                for (std::size_t i = 1; i < 6; ++i)
                    z[k] += N[i] * face_.node[i][k];
            }
            return std::abs(slope_.determinant()) *
                   ((p[1] * q[2] - p[2] * q[1]).square() + (p[2] * q[0] - p[0] * q[2]).square() +
                    (p[0] * q[1] - p[1] * q[0]).square())
                       .sqrt();
        }
    }
}

/// Adds points to the integrals: most of what contact with triangles costs.
template <int kNodes> void FixedIntegrals::integrate_(const Waiting& points, int only)
{
    Many N[kNodes], z[2];
    const Many w = points.weight * shape_<kNodes>(points, N, z);
    const Many dx = z[0] - points.corner[0], dy = z[1] - points.corner[1];
    Many n[3],
        y[3] = {z[0], z[1], points.height[0] + dx * points.height[1] + dy * points.height[2]};
    for (int k = 0; k < 3; ++k)
        n[k] = points.n[0][k] + dx * points.n[1][k] + dy * points.n[2][k];
    const Many per_size = 1 / (n[0].square() + n[1].square() + n[2].square()).sqrt();
    for (Many& value : n)
        value *= per_size;
    if (only < 0) {
        Many* NN = dual_.NN;
        for (int i = 0; i < kNodes; ++i) {
            const Many wN = w * N[i];
            for (int j = i; j < kNodes; ++j)
                *NN++ += wN * N[j];
            for (int k = 0; k < 3; ++k) {
                dual_.Nn[i][k] += wN * n[k];
                dual_.Ny[i][k] += wN * y[k];
            }
            dual_.N[i] += wN;
        }
        return;
    }
    Constant& c = only_[std::size_t(only)];
    for (int i = 0; i < kNodes; ++i)
        c.N[i] += w * N[i];
    for (int k = 0; k < 3; ++k) {
        c.n[k] += w * n[k];
        c.y[k] += w * y[k];
    }
    c.area += w;
}

void FixedIntegrals::add(const Facet& master, const ConvexPolygon& polygon, int only, double share)
{
    if (!(share > 0)) return;
    set_master_(master);
    const auto clear = [](auto& sums) {
        Many* first = reinterpret_cast<Many*>(&sums);
        std::fill(first, first + sizeof sums / sizeof(Many), Many::Zero());
    };
    if (only < 0 && !std::exchange(has_dual_, true)) clear(dual_);
    if (only >= 0 && !std::exchange(has_only_, true)) clear(only_);

    // ---- Integration rule
    const double part = std::min(master.size / facet_->size, 1.0);
    int degree = 4;
    if (face_.nodes == 3 || part < kSmallSegment) degree = 2;
    std::span<const QuadraturePoint> points = triangle_points(degree);
    if (face_.nodes == 4 && bend_ * part > kSmallBend) points = points_for_bend(bend_ * part);
    begin_polygon_(polygon[0], part);

    Waiting& to = waiting_[only + 1];
    const auto add_triangle = [&](const Vec2& a, const Vec2& b, const Vec2& c) {
        const double twice = share * twice_area(a, b, c);
        for (const QuadraturePoint& p : points)
            add_point_(a + p.xi[0] * (b - a) + p.xi[1] * (c - a), p.weight * twice, to, only);
    };
    // Where the rule is exact but for the length of the normal, and that next to, any triangles do.
    if (contraction_ < 1 || (face_.nodes == 3 && part < kSmallSegment)) {
        for (int i = 1; i + 1 < polygon.count; ++i)
            add_triangle(polygon[0], polygon[i], polygon[i + 1]);
    } else {
        // Triangles around the middle of the outline: a corner that appears or disappears, with a
        // side of no length, changes nothing at once.
        const Vec2 a = middle_of_outline(polygon);
        for (int i = 0; i < polygon.count; ++i)
            add_triangle(a, polygon[i], polygon[(i + 1) % polygon.count]);
    }
}

void FixedIntegrals::end_facet()
{
    for (int only = -1; only < 4; ++only)
        flush_(only);
    const auto add = [&](int i, double area, const Vec3& n, const Vec3& y) {
        const auto k = static_cast<std::size_t>(i);
        sums_->area[k] += area;
        sums_->normal[k] += n;
        sums_->far[k] += area * plane_->origin + plane_->axes.transpose() * y;
    };
    const auto sum_of = [](const Many(&value)[3]) {
        return Vec3(value[0].sum(), value[1].sum(), value[2].sum());
    };
    if (has_dual_) {
        Eigen::Matrix<double, 6, 6> NN = Eigen::Matrix<double, 6, 6>::Zero();
        Eigen::Matrix<double, 6, 3> Nn = Eigen::Matrix<double, 6, 3>::Zero(), Ny = Nn;
        PerNode N = PerNode::Zero();
        const Many* product = dual_.NN;
        for (int i = 0; i < face_.nodes; ++i) {
            for (int j = i; j < face_.nodes; ++j)
                NN(i, j) = NN(j, i) = (product++)->sum();
            Nn.row(i) = sum_of(dual_.Nn[i]);
            Ny.row(i) = sum_of(dual_.Ny[i]);
            N[i] = dual_.N[i].sum();
        }
        const auto& F = multipliers_->functions;
        sums_->slave += F * NN;
        const Eigen::Vector4d area = F * N;
        const Eigen::Matrix<double, 4, 3> n = F * Nn, y = F * Ny;
        for (int i = 0; i < multipliers_->count; ++i)
            add(i, area[i], n.row(i), y.row(i));
    }
    if (has_only_)
        for (int i = 0; i < multipliers_->count; ++i) {
            const Constant& c = only_[std::size_t(i)];
            for (int j = 0; j < face_.nodes; ++j)
                sums_->slave(i, j) += c.N[j].sum();
            add(i, c.area.sum(), sum_of(c.n), sum_of(c.y));
        }
}

} // namespace amontons
