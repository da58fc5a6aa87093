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

PlaneQuadrilateral quadrilateral_in_plane(const FaceInPlane& face)
{
    PlaneQuadrilateral q;
    const auto& p = face.node;
    q.middle = 0.25 * (p[0] + p[1] + p[2] + p[3]);
    q.along[0] = 0.25 * (p[1] - p[0] + p[2] - p[3]);
    q.along[1] = 0.25 * (p[3] - p[0] + p[2] - p[1]);
    q.twist = 0.25 * (p[0] - p[1] + p[2] - p[3]);
    const double size = q.along[0].norm() + q.along[1].norm();
    q.warp = std::abs(q.twist.z()) > kRoundOff * size ? std::abs(q.twist.z()) : 0;
    // The area per reference area is linear: its change over the face against its middle.
    const auto cross = [](const Vec3& a, const Vec3& b) { return a.x() * b.y() - a.y() * b.x(); };
    q.bend = (std::abs(cross(q.along[0], q.twist)) + std::abs(cross(q.twist, q.along[1]))) /
             std::abs(cross(q.along[0], q.along[1]));
    if (q.bend <= kLittleBent) {
        Eigen::Matrix2d slope;
        slope << q.along[0].head<2>(), q.along[1].head<2>();
        q.near_slope = slope.inverse();
        q.near_twist = q.near_slope * q.twist.head<2>();
        q.polygon_corner = q.middle.head<2>();
        q.polygon_xi.setZero();
        q.steps = steps_from(q.bend);
    }
    return q;
}

PlaneTriangle triangle_in_plane(const Facet& slave, const FacetPlane& plane)
{
    const Vec2 a = plane(slave.corner[0]).head<2>(), b = plane(slave.corner[1]).head<2>(),
               c = plane(slave.corner[2]).head<2>();
    Eigen::Matrix2d from, to;
    from << b - a, c - a;
    to << slave.xi[1] - slave.xi[0], slave.xi[2] - slave.xi[0];
    PlaneTriangle t;
    t.slope = to * from.inverse();
    t.offset = slave.xi[0] - t.slope * a;
    t.back = from * to.inverse();
    t.origin = a - t.back * slave.xi[0];
    return t;
}

/// Newton's method from the last place on.
void find_on(PlaneQuadrilateral& q, const Vec2& z)
{
    Vec2& xi = q.last;
    if (!xi.allFinite() || xi.cwiseAbs().maxCoeff() > 1 + kBeyondBorder) xi.setZero();
    for (int k = 0; k < kNewtonSteps; ++k) {
        const Vec2 a = (q.along[0] + xi.y() * q.twist).head<2>(),
                   b = (q.along[1] + xi.x() * q.twist).head<2>();
        const Vec2 off = z - q.middle.head<2>() - xi.x() * a - xi.y() * q.along[1].head<2>();
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
/// @param part  of the polygon's size in the face's
void begin_polygon(PlaneQuadrilateral& q, const Vec2& z, double part)
{
    q.contraction = q.bend * part;
    if (q.contraction > kSmallBend) {
        q.contraction = 1;
        return;
    }
    if (q.bend <= kLittleBent) return; // as quadrilateral_in_plane has it
    find_on(q, z);
    if (!q.last.allFinite()) {
        q.contraction = 1;
        return;
    }
    Eigen::Matrix2d slope;
    slope << (q.along[0] + q.last.y() * q.twist).head<2>(),
        (q.along[1] + q.last.x() * q.twist).head<2>();
    q.near_slope = slope.inverse();
    q.near_twist = q.near_slope * q.twist.head<2>();
    q.polygon_corner = z;
    q.polygon_xi = q.last;
    q.steps = steps_from(q.contraction);
}

using Many = PerPoint;

/// The slave's face in the plane of its facet: what of it its number of nodes takes.
struct SlaveInPlane {
    const FaceInPlane& face;
    const PlaneQuadrilateral& quadrilateral;
    const PlaneTriangle& triangle;
};

/// Shape functions of the slave's face and the points' places in the plane.
/// @return  the area of the face per area of the plane
template <int kNodes>
Many shape_at(const WaitingPoints& points, const SlaveInPlane& slave, Many N[kNodes], Many z[2])
{
    z[0] = points.z[0];
    z[1] = points.z[1];
    Many a, b;
    if constexpr (kNodes == 4) {
        const PlaneQuadrilateral& face = slave.quadrilateral;
        a = points.xi[0];
        b = points.xi[1];
        for (int k = 0; k < points.steps; ++k) {
            const Many px = face.along[0].x() + b * face.twist.x(),
                       py = face.along[0].y() + b * face.twist.y(),
                       qx = face.along[1].x() + a * face.twist.x(),
                       qy = face.along[1].y() + a * face.twist.y();
            const Many off_x = z[0] - face.middle.x() - a * px - b * face.along[1].x(),
                       off_y = z[1] - face.middle.y() - a * py - b * face.along[1].y();
            const Many per_area = 1 / (px * qy - py * qx);
            a += (qy * off_x - qx * off_y) * per_area;
            b += (px * off_y - py * off_x) * per_area;
        }
        N[0] = 0.25 * (1 - a) * (1 - b);
        N[1] = 0.25 * (1 + a) * (1 - b);
        N[2] = 0.25 * (1 + a) * (1 + b);
        N[3] = 0.25 * (1 - a) * (1 + b);
        if (!(face.warp > 0)) return Many::Ones();
        Many p[3], q[3];
        for (int k = 0; k < 3; ++k) {
            p[k] = face.along[0][k] + b * face.twist[k];
            q[k] = face.along[1][k] + a * face.twist[k];
        }
        const Many up = p[0] * q[1] - p[1] * q[0];
        return (1 + ((p[1] * q[2] - p[2] * q[1]).square() + (p[2] * q[0] - p[0] * q[2]).square()) /
                        up.square())
            .sqrt();
    } else {
        a = slave.triangle.slope(0, 0) * z[0] + slave.triangle.slope(0, 1) * z[1] +
            slave.triangle.offset.x();
        b = slave.triangle.slope(1, 0) * z[0] + slave.triangle.slope(1, 1) * z[1] +
            slave.triangle.offset.y();
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
                p[k] = by_a[0] * slave.face.node[0][k];
                q[k] = by_b[0] * slave.face.node[0][k];
                for (std::size_t i = 1; i < 6; ++i) {
                    p[k] += by_a[i] * slave.face.node[i][k];
                    q[k] += by_b[i] * slave.face.node[i][k];
                }
            }
            for (int k = 0; k < 2; ++k) {
                z[k] = N[0] * slave.face.node[0][k];
                for (std::size_t i = 1; i < 6; ++i)
                    z[k] += N[i] * slave.face.node[i][k];
            }
            return std::abs(slave.triangle.slope.determinant()) *
                   ((p[1] * q[2] - p[2] * q[1]).square() + (p[2] * q[0] - p[0] * q[2]).square() +
                    (p[0] * q[1] - p[1] * q[0]).square())
                       .sqrt();
        }
    }
}

/// Adds points to the integrals: most of what contact with triangles costs.
template <int kNodes>
void integrate_points(const WaitingPoints& points, const SlaveInPlane& slave, DualMoments* dual,
                      ConstantMoments& constant)
{
    Many N[kNodes], z[2];
    const Many w = points.weight * shape_at<kNodes>(points, slave, N, z);
    const Many dx = z[0] - points.corner[0], dy = z[1] - points.corner[1];
    Many n[3],
        y[3] = {z[0], z[1], points.height[0] + dx * points.height[1] + dy * points.height[2]};
    for (int k = 0; k < 3; ++k)
        n[k] = points.n[0][k] + dx * points.n[1][k] + dy * points.n[2][k];
    const Many per_size = 1 / (n[0].square() + n[1].square() + n[2].square()).sqrt();
    for (Many& value : n)
        value *= per_size;
    if (dual) {
        Many* NN = dual->NN;
        for (int i = 0; i < kNodes; ++i) {
            const Many wN = w * N[i];
            for (int j = i; j < kNodes; ++j)
                *NN++ += wN * N[j];
            for (int k = 0; k < 3; ++k) {
                dual->Nn[i][k] += wN * n[k];
                dual->Ny[i][k] += wN * y[k];
            }
            dual->N[i] += wN;
        }
        return;
    }
    ConstantMoments& c = constant;
    for (int i = 0; i < kNodes; ++i)
        c.N[i] += w * N[i];
    for (int k = 0; k < 3; ++k) {
        c.n[k] += w * n[k];
        c.y[k] += w * y[k];
    }
    c.area += w;
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
    has_dual_ = has_only_ = false;
    quadrilateral_.last.setZero();
    if (face_.nodes == 4)
        quadrilateral_ = quadrilateral_in_plane(face_);
    else
        triangle_ = triangle_in_plane(slave, *plane_);
}

Vec2 FixedIntegrals::in_plane(const Vec2& xi) const
{
    if (face_.nodes == 4) return spot(face_, xi).place.head<2>();
    return triangle_.back * xi + triangle_.origin;
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

void FixedIntegrals::add_point_(const Vec2& z, double weight, WaitingPoints& to, int only)
{
    const int k = to.count;
    if (face_.nodes == 4) {
        PlaneQuadrilateral& q = quadrilateral_;
        Vec2 xi;
        if (q.contraction < 1) {
            const Vec2 off = q.near_slope * (z - q.polygon_corner);
            xi = q.polygon_xi + off - off.x() * off.y() * q.near_twist;
            to.steps = std::max(to.steps, q.steps);
        } else {
            find_on(q, z);
            if (!(q.last.cwiseAbs().maxCoeff() <= 1 + kBeyondBorder)) return;
            xi = q.last;
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
    if (++to.count == kPointBlock) flush_(only);
}

void FixedIntegrals::flush_(int only)
{
    WaitingPoints& points = waiting_[only + 1];
    if (points.count == 0) return;
    const auto fill = [&](Many& value) { // once more, of no weight
        for (int k = points.count; k < kPointBlock; ++k)
            value[k] = value[0];
    };
    for (int i = 0; i < 2; ++i) {
        fill(points.z[i]);
        fill(points.xi[i]);
    }
    const auto spread = [&](auto number, Many& value) { // from each master's first point on
        value.setConstant(number(points.master[0]));
        for (int m = 1; m < points.masters; ++m)
            for (int k = points.from[m]; k < kPointBlock; ++k)
                value[k] = number(points.master[m]);
    };
    for (int i = 0; i < 2; ++i)
        spread([i](const MasterPlane& m) { return m.corner[i]; }, points.corner[i]);
    for (int i = 0; i < 3; ++i) {
        spread([i](const MasterPlane& m) { return m.height[i]; }, points.height[i]);
        for (int j = 0; j < 3; ++j)
            spread([i, j](const MasterPlane& m) { return m.n[i][j]; }, points.n[i][j]);
    }
    for (int k = points.count; k < kPointBlock; ++k)
        points.weight[k] = 0;
    const SlaveInPlane slave{face_, quadrilateral_, triangle_};
    DualMoments* const dual = only < 0 ? &dual_ : nullptr;
    ConstantMoments& constant = only_[std::size_t(std::max(only, 0))];
    if (face_.nodes == 3)
        integrate_points<3>(points, slave, dual, constant);
    else if (face_.nodes == 4)
        integrate_points<4>(points, slave, dual, constant);
    else
        integrate_points<6>(points, slave, dual, constant);
    points.count = points.steps = points.masters = 0;
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
    if (face_.nodes == 4 && quadrilateral_.bend * part > kSmallBend)
        points = points_for_bend(quadrilateral_.bend * part);
    if (face_.nodes == 4) begin_polygon(quadrilateral_, polygon[0], part);
    const bool any_place = face_.nodes == 4 ? quadrilateral_.contraction < 1
                                            : face_.nodes == 3 && part < kSmallSegment;

    WaitingPoints& to = waiting_[only + 1];
    const auto add_triangle = [&](const Vec2& a, const Vec2& b, const Vec2& c) {
        const double twice = share * twice_area(a, b, c);
        for (const QuadraturePoint& p : points)
            add_point_(a + p.xi[0] * (b - a) + p.xi[1] * (c - a), p.weight * twice, to, only);
    };
    // Where the rule is exact but for the length of the normal, and that next to, any triangles do.
    if (any_place) {
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
            const ConstantMoments& c = only_[std::size_t(i)];
            for (int j = 0; j < face_.nodes; ++j)
                sums_->slave(i, j) += c.N[j].sum();
            add(i, c.area.sum(), sum_of(c.n), sum_of(c.y));
        }
}

} // namespace amontons
