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
constexpr double kSmallBend = 0.05; // beyond the rule's degree (bend / 2)^5 is left out, 1e-8
/// Segments that are smaller than this part of the slave's face take the rule of degree 2: four
/// powers of it are left out, 1e-7 of what the integrals are.
constexpr double kSmallSegment = 0.1;
constexpr int kBlock = 8; // points at once
constexpr int kNewtonSteps = 20;
constexpr double kSquared = 1e-7, kRightPlace = 1e-13, kBeyondBorder = 0.25; // as in facets.cpp

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

/// Near a place of a polygon that is small against the face the slope there serves for all of it.
void FixedIntegrals::begin_polygon_(const Vec2& z, double part)
{
    contraction_ = bend_ * part;
    if (face_.nodes != 4 || contraction_ > kSmallBend) {
        contraction_ = 1;
        return;
    }
    find_on_quadrilateral_(z);
    if (!last_.allFinite()) {
        contraction_ = 1;
        return;
    }
    Eigen::Matrix2d slope;
    slope << (along_[0] + last_.y() * twist_).head<2>(), (along_[1] + last_.x() * twist_).head<2>();
    near_slope_ = slope.inverse();
    polygon_corner_ = z;
    polygon_xi_ = last_;
    // The first guess is off by no more than the contraction, and Newton's method squares it.
    steps_ = 0;
    for (double off = contraction_; off > kRightPlace; off *= off)
        ++steps_;
}

/// @return  false where there is none on the face or close to it
bool FixedIntegrals::locate_(const Vec2& z, Point& at)
{
    if (face_.nodes == 4) {
        find_on_quadrilateral_(z);
        if (!(last_.cwiseAbs().maxCoeff() <= 1 + kBeyondBorder)) return false;
        const double x = last_.x(), y = last_.y();
        at.N << 0.25 * (1 - x) * (1 - y), 0.25 * (1 + x) * (1 - y), 0.25 * (1 + x) * (1 + y),
            0.25 * (1 - x) * (1 + y), 0, 0;
        at.z = z;
        const Vec3 normal = (along_[0] + y * twist_).cross(along_[1] + x * twist_);
        at.stretch = normal.norm() / std::abs(normal.z());
        return at.stretch > 0;
    }
    const Vec2 xi = slope_ * z + offset_;
    if (face_.nodes == 3) {
        at.N << 1 - xi.x() - xi.y(), xi.x(), xi.y(), 0, 0, 0;
        at.z = z;
        return true;
    }
    const FaceSpot s = spot(face_, xi);
    at.N = s.values;
    at.z = s.place.head<2>();
    at.stretch = s.along[0].cross(s.along[1]).norm() * std::abs(slope_.determinant());
    return at.stretch > 0;
}

/// Sums over the points of a polygon: of one function of the multipliers, or of all.
template <int kNodes> struct FixedIntegrals::Sums {
    Eigen::Matrix<double, kNodes, kNodes> NN = Eigen::Matrix<double, kNodes, kNodes>::Zero();
    Eigen::Matrix<double, kNodes, 3> Nn = Eigen::Matrix<double, kNodes, 3>::Zero(), Ny = Nn;
    Eigen::Matrix<double, kNodes, 1> N = Eigen::Matrix<double, kNodes, 1>::Zero();
    Vec3 n = Vec3::Zero(), y = Vec3::Zero();
    double area = 0;
};

/// Several points at once, on triangles and quadrilaterals: most of what contact with triangles
/// costs.
void FixedIntegrals::add_block_(const MasterPlane& master, const double* x_of, const double* y_of,
                                const double* w_of, Sums<4>& sums) const
{
    using Many = Eigen::Array<double, 1, kBlock>;
    const Many x = Eigen::Map<const Many>(x_of), y = Eigen::Map<const Many>(y_of);
    Many w = Eigen::Map<const Many>(w_of);
    Eigen::Matrix<double, 4, kBlock> N;
    if (face_.nodes == 4) {
        const Many dx = x - polygon_corner_.x(), dy = y - polygon_corner_.y();
        Many a = polygon_xi_.x() + near_slope_(0, 0) * dx + near_slope_(0, 1) * dy,
             b = polygon_xi_.y() + near_slope_(1, 0) * dx + near_slope_(1, 1) * dy;
        for (int k = 0; k < steps_; ++k) {
            const Many px = along_[0].x() + b * twist_.x(), py = along_[0].y() + b * twist_.y(),
                       qx = along_[1].x() + a * twist_.x(), qy = along_[1].y() + a * twist_.y();
            const Many off_x = x - middle_.x() - a * px - b * along_[1].x(),
                       off_y = y - middle_.y() - a * py - b * along_[1].y();
            const Many per_area = 1 / (px * qy - py * qx);
            a += (qy * off_x - qx * off_y) * per_area;
            b += (px * off_y - py * off_x) * per_area;
        }
        N.row(0) = 0.25 * (1 - a) * (1 - b);
        N.row(1) = 0.25 * (1 + a) * (1 - b);
        N.row(2) = 0.25 * (1 + a) * (1 + b);
        N.row(3) = 0.25 * (1 - a) * (1 + b);
        if (warp_ > 0) {
            Many p[3], q[3];
            for (int k = 0; k < 3; ++k) {
                p[k] = along_[0][k] + b * twist_[k];
                q[k] = along_[1][k] + a * twist_[k];
            }
            const Many up = p[0] * q[1] - p[1] * q[0];
            w *=
                (1 + ((p[1] * q[2] - p[2] * q[1]).square() + (p[2] * q[0] - p[0] * q[2]).square()) /
                         up.square())
                    .sqrt();
        }
    } else {
        const Many a = slope_(0, 0) * x + slope_(0, 1) * y + offset_.x(),
                   b = slope_(1, 0) * x + slope_(1, 1) * y + offset_.y();
        N.row(0) = 1 - a - b;
        N.row(1) = a;
        N.row(2) = b;
        N.row(3).setZero();
    }
    const Many dx = x - master.corner.x(), dy = y - master.corner.y();
    const Many u = master.inverse(0, 0) * dx + master.inverse(0, 1) * dy,
               v = master.inverse(1, 0) * dx + master.inverse(1, 1) * dy;
    Eigen::Matrix<double, 3, kBlock> n, place;
    for (int k = 0; k < 3; ++k)
        n.row(k) = master.n[0][k] + u * master.n[1][k] + v * master.n[2][k];
    if (master.smooth) {
        const Many size = n.array().square().colwise().sum().sqrt();
        for (int k = 0; k < 3; ++k)
            n.row(k).array() /= size;
    }
    place.row(0) = x;
    place.row(1) = y;
    place.row(2) = master.height + master.slope.x() * dx + master.slope.y() * dy;
    Eigen::Matrix<double, 4, kBlock> wN;
    for (int k = 0; k < 4; ++k)
        wN.row(k) = w * N.row(k).array();
    sums.NN.noalias() += wN.lazyProduct(N.transpose());
    sums.Nn.noalias() += wN.lazyProduct(n.transpose());
    sums.Ny.noalias() += wN.lazyProduct(place.transpose());
    sums.N += wN.rowwise().sum();
    sums.n.noalias() += n.lazyProduct(w.matrix().transpose());
    sums.y.noalias() += place.lazyProduct(w.matrix().transpose());
    sums.area += w.sum();
}

void FixedIntegrals::add(const Facet& master, const ConvexPolygon& polygon, int only, double share)
{
    if (!(share > 0)) return;
    if (face_.nodes == 6)
        add_points_<6>(master, polygon, only, share);
    else
        add_points_<4>(master, polygon, only, share);
}

template <int kNodes>
void FixedIntegrals::add_points_(const Facet& master, const ConvexPolygon& polygon, int only,
                                 double share)
{
    // ---- The master's facet over the plane z of the slave's facet: with xi the shares of its
    // corners, height = height_0 + slope . (z - corner), n = n_0 + xi_1 n_1 + xi_2 n_2 (of unit
    // length if smooth)
    MasterPlane over;
    std::array<Vec3, 3> corner;
    for (std::size_t k = 0; k < 3; ++k)
        corner[k] = (*plane_)(master.corner[k]);
    over.corner = corner[0].head<2>();
    Eigen::Matrix2d sides;
    sides << (corner[1] - corner[0]).head<2>(), (corner[2] - corner[0]).head<2>();
    over.inverse = sides.inverse();
    over.height = corner[0].z();
    over.slope = over.inverse.transpose() *
                 Vec2(corner[1].z() - corner[0].z(), corner[2].z() - corner[0].z());
    over.smooth = master_.normals.has(master.face);
    over.n[0] = over.smooth ? master_.normals.corner(master.face, 0) : master.normal;
    for (int k = 1; k < 3; ++k)
        over.n[k] = over.smooth ? Vec3(master_.normals.corner(master.face, k) - over.n[0])
                                : Vec3(Vec3::Zero());

    // ---- Integration rule
    const double part = std::min(master.size / facet_->size, 1.0);
    int degree = 4;
    if (face_.nodes == 3 || part < kSmallSegment) degree = 2;
    std::span<const QuadraturePoint> points = triangle_points(degree);
    if (face_.nodes == 4 && bend_ * part > kSmallBend) points = points_for_bend(bend_ * part);
    begin_polygon_(polygon[0], part);
    const bool in_blocks = face_.nodes == 3 || contraction_ < 1;

    // ---- Sums over the points of the polygon: int N N^T, int N n^T, int N y^T, int N, n, y, 1,
    // with y the place on the master and w = weight times the stretch of the slave's face
    Sums<kNodes> sums;
    alignas(64) double x[kBlock], y[kBlock], w[kBlock];
    int waiting = 0;
    const auto flush = [&] {
        if constexpr (kNodes == 4)
            if (waiting > 0) {
                for (int k = waiting; k < kBlock; ++k) { // once more, of no weight
                    x[k] = x[0];
                    y[k] = y[0];
                    w[k] = 0;
                }
                add_block_(over, x, y, w, sums);
            }
        waiting = 0;
    };
    Point at;
    const auto add_point = [&](const Vec2& z, double weight) {
        if (kNodes == 4 && in_blocks) {
            x[waiting] = z.x();
            y[waiting] = z.y();
            w[waiting] = weight;
            if (++waiting == kBlock) flush();
            return;
        }
        if (!locate_(z, at)) return;
        const double own = weight * at.stretch;
        const Vec2 d = at.z - over.corner, xi = over.inverse * d;
        Vec3 n = over.n[0] + xi.x() * over.n[1] + xi.y() * over.n[2];
        if (over.smooth) n /= n.norm();
        const Vec3 place{at.z.x(), at.z.y(), over.height + over.slope.dot(d)};
        const Eigen::Matrix<double, kNodes, 1> N = at.N.template head<kNodes>(), wN = own * N;
        sums.NN.noalias() += wN * N.transpose();
        sums.Nn.noalias() += wN * n.transpose();
        sums.Ny.noalias() += wN * place.transpose();
        sums.N += wN;
        sums.n += own * n;
        sums.y += own * place;
        sums.area += own;
    };
    const auto add_triangle = [&](const Vec2& a, const Vec2& b, const Vec2& c) {
        const double twice = share * twice_area(a, b, c);
        for (const QuadraturePoint& p : points)
            add_point(a + p.xi[0] * (b - a) + p.xi[1] * (c - a), p.weight * twice);
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
    flush();

    // ---- To the sums of the facet: of dual functions, or of the one that is 1 there
    if (only < 0) {
        if (!std::exchange(has_dual_, true)) {
            dual_.NN.setZero();
            dual_.Nn.setZero();
            dual_.Ny.setZero();
            dual_.N.setZero();
        }
        dual_.NN.topLeftCorner<kNodes, kNodes>() += sums.NN;
        dual_.Nn.topRows<kNodes>() += sums.Nn;
        dual_.Ny.topRows<kNodes>() += sums.Ny;
        dual_.N.head<kNodes>() += sums.N;
        return;
    }
    if (!std::exchange(has_only_, true))
        only_.fill({PerNode::Zero(), Vec3::Zero(), Vec3::Zero(), 0});
    Constant& c = only_[std::size_t(only)];
    c.N.head<kNodes>() += sums.N;
    c.n += sums.n;
    c.y += sums.y;
    c.area += sums.area;
}

void FixedIntegrals::end_facet()
{
    const auto add = [&](int i, double area, const Vec3& n, const Vec3& y) {
        const auto k = std::size_t(i);
        sums_->area[k] += area;
        sums_->normal[k] += n;
        sums_->far[k] += area * plane_->origin + plane_->axes.transpose() * y;
    };
    if (has_dual_) {
        const auto& F = multipliers_->functions;
        sums_->slave += F * dual_.NN;
        const Eigen::Vector4d area = F * dual_.N;
        const Eigen::Matrix<double, 4, 3> n = F * dual_.Nn, y = F * dual_.Ny;
        for (int i = 0; i < multipliers_->count; ++i)
            add(i, area[i], n.row(i), y.row(i));
    }
    if (has_only_)
        for (int i = 0; i < multipliers_->count; ++i) {
            const Constant& c = only_[std::size_t(i)];
            sums_->slave.row(i) += c.N.transpose();
            add(i, c.area, c.n, c.y);
        }
}

} // namespace amontons
