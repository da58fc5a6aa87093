#include "contact/surface/fixed_integrals.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>
#include <vector>

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
constexpr double kSmallSegment = 0.1, kSmallOfSix = 0.07;
/// Of those any triangles serve: the rule of degree 4 leaves out five powers of it.
constexpr double kAnyTriangles = 0.4;
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

PlaneTriangle triangle_in_plane(const Facet& slave, const FacetPlane& plane,
                                const FaceInPlane& face)
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
    t.stretch = std::abs(t.slope.determinant());
    if (face.nodes == 6) {
        const auto& x = face.node;
        t.place[0] = x[0];
        t.place[1] = 4 * x[3] - 3 * x[0] - x[1];
        t.place[2] = 4 * x[5] - 3 * x[0] - x[2];
        t.place[3] = 2 * x[0] + 2 * x[1] - 4 * x[3];
        t.place[4] = 2 * x[0] + 2 * x[2] - 4 * x[5];
        t.place[5] = 4 * (x[0] - x[3] + x[4] - x[5]);
    }
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

/// The points of a rule in blocks, the last one filled up with points of no weight.
struct RuleBlocks {
    struct Block {
        Many first, second, weight; ///< shares of the second and the third corner
    };
    std::vector<Block> blocks;
    int points = 0;

    explicit RuleBlocks(std::span<const QuadraturePoint> rule) : points(int(rule.size()))
    {
        for (std::size_t k = 0; k < rule.size(); ++k) {
            if (k % kPointBlock == 0)
                blocks.push_back(
                    {Many::Constant(rule[k].xi[0]), Many::Constant(rule[k].xi[1]), Many::Zero()});
            Block& block = blocks.back();
            const auto lane = Eigen::Index(k % kPointBlock);
            block.first[lane] = rule[k].xi[0];
            block.second[lane] = rule[k].xi[1];
            block.weight[lane] = rule[k].weight;
        }
    }
};

const RuleBlocks& triangle_blocks(int degree)
{
    static const RuleBlocks two(triangle_points(2)), four(triangle_points(4));
    return degree == 2 ? two : four;
}

const RuleBlocks& blocks_for_bend(double bend)
{
    constexpr int kLeastAlong = 2, kMostAlong = 12; // of points_for_bend
    static const std::map<std::size_t, RuleBlocks> by_points = [] {
        std::map<std::size_t, RuleBlocks> rules;
        for (int along = kLeastAlong; along <= kMostAlong; ++along)
            rules.emplace(triangle_points_along(along).size(),
                          RuleBlocks(triangle_points_along(along)));
        return rules;
    }();
    return by_points.at(points_for_bend(bend).size());
}

/// The slave's face in the plane of its facet: what of it its number of nodes takes.
struct SlaveInPlane {
    const PlaneQuadrilateral& quadrilateral;
    const PlaneTriangle& triangle;
};

Many four_of(const double* from)
{
    return Eigen::Map<const Many, Eigen::Aligned32>(from);
}

/// Shape functions of the slave's face and the places of four points in the plane.
/// @return  the area of the face per area of the plane
template <int kNodes>
Many shape_at(const PolygonPoints& points, int first, const SlaveInPlane& slave, Many N[kNodes],
              Many z[2])
{
    z[0] = four_of(points.z[0] + first);
    z[1] = four_of(points.z[1] + first);
    Many a, b;
    if constexpr (kNodes == 4) {
        const PlaneQuadrilateral& face = slave.quadrilateral;
        a = four_of(points.xi[0] + first);
        b = four_of(points.xi[1] + first);
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
            const Vec3* x = slave.triangle.place;
            const Many aa = a * a, bb = b * b, ab = a * b;
            Many p[3], q[3];
            for (int k = 0; k < 3; ++k) {
                p[k] = x[1][k] + 2 * x[3][k] * a + x[5][k] * b;
                q[k] = x[2][k] + 2 * x[4][k] * b + x[5][k] * a;
            }
            for (int k = 0; k < 2; ++k)
                z[k] = x[0][k] + x[1][k] * a + x[2][k] * b + x[3][k] * aa + x[4][k] * bb +
                       x[5][k] * ab;
            return slave.triangle.stretch *
                   ((p[1] * q[2] - p[2] * q[1]).square() + (p[2] * q[0] - p[0] * q[2]).square() +
                    (p[0] * q[1] - p[1] * q[0]).square())
                       .sqrt();
        }
    }
}

/// Adds points to the integrals: most of what contact with triangles costs.
template <int kNodes>
void integrate_points(const PolygonPoints& points, const SlaveInPlane& slave,
                      const MasterPlane& master, DualMoments* dual, ConstantMoments& constant)
{
    for (int first = 0; first < points.count; first += kPointBlock) {
        Many N[kNodes], z[2];
        const Many area = shape_at<kNodes>(points, first, slave, N, z);
        const Many w = four_of(points.weight + first) * area;
        const Many dx = z[0] - master.corner.x(), dy = z[1] - master.corner.y();
        const Many h = master.height[0] + dx * master.height[1] + dy * master.height[2];
        Many n[3];
        for (int k = 0; k < 3; ++k)
            n[k] = master.n[0][k] + dx * master.n[1][k] + dy * master.n[2][k];
        const Many per_size = 1 / (n[0].square() + n[1].square() + n[2].square()).sqrt();
        for (Many& value : n)
            value *= per_size;
        if (dual) {
            Many* NN = dual->NN;
            for (int i = 0; i < kNodes; ++i) {
                const Many wN = w * N[i];
                for (int j = i; j < kNodes; ++j)
                    *NN++ += wN * N[j];
                for (int k = 0; k < 3; ++k)
                    dual->Nn[i][k] += wN * n[k];
                dual->Nh[i] += wN * h;
            }
            continue;
        }
        for (int i = 0; i < kNodes; ++i)
            constant.N[i] += w * N[i];
        for (int k = 0; k < 3; ++k)
            constant.n[k] += w * n[k];
        constant.h += w * h;
    }
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
        triangle_ = triangle_in_plane(slave, *plane_, face_);
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

/// Appends points whose places in the plane are known; those of no weight do no harm.
void FixedIntegrals::add_points_(const PerPoint& x, const PerPoint& y, const PerPoint& weight,
                                 int count)
{
    PolygonPoints& to = points_;
    const auto store = [&](double* at, const PerPoint& value) {
        Eigen::Map<PerPoint>(at + to.count) = value;
    };
    if (face_.nodes == 4) {
        PlaneQuadrilateral& q = quadrilateral_;
        if (q.contraction < 1) {
            const PerPoint off_x = x - q.polygon_corner.x(), off_y = y - q.polygon_corner.y();
            const PerPoint a = q.near_slope(0, 0) * off_x + q.near_slope(0, 1) * off_y,
                           b = q.near_slope(1, 0) * off_x + q.near_slope(1, 1) * off_y;
            const PerPoint ab = a * b;
            store(to.xi[0], q.polygon_xi.x() + a - q.near_twist.x() * ab);
            store(to.xi[1], q.polygon_xi.y() + b - q.near_twist.y() * ab);
            to.steps = std::max(to.steps, q.steps);
        } else {
            for (int k = 0; k < count; ++k) {
                find_on(q, {x[k], y[k]});
                if (!(q.last.cwiseAbs().maxCoeff() <= 1 + kBeyondBorder)) continue;
                to.z[0][to.count] = x[k];
                to.z[1][to.count] = y[k];
                to.xi[0][to.count] = q.last.x();
                to.xi[1][to.count] = q.last.y();
                to.weight[to.count++] = weight[k];
            }
            return;
        }
    }
    store(to.z[0], x);
    store(to.z[1], y);
    store(to.weight, weight);
    to.count += count;
}

void FixedIntegrals::flush_(int only)
{
    PolygonPoints& points = points_;
    if (points.count == 0) return;
    for (int k = points.count; k % kPointBlock != 0; ++k) { // the first once more, of no weight
        for (int i = 0; i < 2; ++i) {
            points.z[i][k] = points.z[i][0];
            points.xi[i][k] = points.xi[i][0];
        }
        points.weight[k] = 0;
    }
    const SlaveInPlane slave{quadrilateral_, triangle_};
    DualMoments* const dual = only < 0 ? &dual_ : nullptr;
    ConstantMoments& constant = only_[std::size_t(std::max(only, 0))];
    if (face_.nodes == 3)
        integrate_points<3>(points, slave, over_, dual, constant);
    else if (face_.nodes == 4)
        integrate_points<4>(points, slave, over_, dual, constant);
    else
        integrate_points<6>(points, slave, over_, dual, constant);
    points.count = points.steps = 0;
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
    const double small = face_.nodes != 6 ? kSmallSegment : only < 0 ? kSmallOfSix : kAnyTriangles;
    const bool quadratic = part < small || (face_.nodes == 3 && !(part < kAnyTriangles));
    const int degree = quadratic ? 2 : 4;
    const RuleBlocks* rule = &triangle_blocks(degree);
    if (face_.nodes == 4 && quadrilateral_.bend * part > kSmallBend)
        rule = &blocks_for_bend(quadrilateral_.bend * part);
    if (face_.nodes == 4) begin_polygon(quadrilateral_, polygon[0], part);
    const bool any_place = face_.nodes == 4 ? quadrilateral_.contraction < 1 : part < kAnyTriangles;

    const auto add_triangle = [&](const Vec2& a, const Vec2& b, const Vec2& c) {
        const double twice = share * twice_area(a, b, c);
        const Vec2 ab = b - a, ac = c - a;
        int left = rule->points;
        for (const RuleBlocks::Block& p : rule->blocks) {
            if (points_.count > PolygonPoints::kMost - kPointBlock) flush_(only);
            add_points_(a.x() + p.first * ab.x() + p.second * ac.x(),
                        a.y() + p.first * ab.y() + p.second * ac.y(), twice * p.weight,
                        std::min(left, kPointBlock));
            left -= kPointBlock;
        }
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
    flush_(only);
}

void FixedIntegrals::end_facet()
{
    Eigen::Matrix<double, 6, 2> in_plane = Eigen::Matrix<double, 6, 2>::Zero(); // of the nodes
    for (int j = 0; j < face_.nodes; ++j)
        in_plane.row(j) = face_.node[std::size_t(j)].head<2>();
    const auto add = [&](int i, double area, const Vec3& n, const Vec2& z, double height) {
        const auto k = static_cast<std::size_t>(i);
        sums_->area[k] += area;
        sums_->normal[k] += n;
        sums_->far[k] +=
            area * plane_->origin + plane_->axes.transpose() * Vec3(z.x(), z.y(), height);
    };
    const auto sum_of = [](const Many(&value)[3]) {
        return Vec3(value[0].sum(), value[1].sum(), value[2].sum());
    };
    if (has_dual_) {
        Eigen::Matrix<double, 6, 6> NN = Eigen::Matrix<double, 6, 6>::Zero();
        Eigen::Matrix<double, 6, 3> Nn = Eigen::Matrix<double, 6, 3>::Zero();
        PerNode Nh = PerNode::Zero();
        const Many* product = dual_.NN;
        for (int i = 0; i < face_.nodes; ++i) {
            for (int j = i; j < face_.nodes; ++j)
                NN(i, j) = NN(j, i) = (product++)->sum();
            Nn.row(i) = sum_of(dual_.Nn[i]);
            Nh[i] = dual_.Nh[i].sum();
        }
        const auto& F = multipliers_->functions;
        const Eigen::Matrix<double, 4, 6> slave = F * NN;
        sums_->slave += slave;
        const Eigen::Vector4d area = slave.rowwise().sum(), h = F * Nh;
        const Eigen::Matrix<double, 4, 3> n = F * Nn;
        const Eigen::Matrix<double, 4, 2> z = slave * in_plane;
        for (int i = 0; i < multipliers_->count; ++i)
            add(i, area[i], n.row(i), z.row(i), h[i]);
    }
    if (has_only_)
        for (int i = 0; i < multipliers_->count; ++i) {
            const ConstantMoments& c = only_[std::size_t(i)];
            PerNode N = PerNode::Zero();
            for (int j = 0; j < face_.nodes; ++j)
                N[j] = c.N[j].sum();
            sums_->slave.row(i) += N.transpose();
            add(i, N.sum(), sum_of(c.n), in_plane.transpose() * N, c.h.sum());
        }
}

} // namespace amontons
