#include "contact/surface/facets.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace amontons {
namespace {

const Vec2 kFacetTriangle[6] = {{0, 0}, {1, 0}, {0, 1}, {0.5, 0}, {0.5, 0.5}, {0, 0.5}};
const Vec2 kFacetSquare[4] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
constexpr int kQuarters[4][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}, {3, 4, 5}};

/// How far outside of the reference face a point may be located: where facets and the true face
/// differ.
constexpr double kMargin = 0.25;

/// On the reference face or close to it.
bool is_on(int nodes, const Vec2& xi)
{
    const double low = nodes == 4 ? -1 : 0;
    return xi.minCoeff() >= low - kMargin && xi.maxCoeff() <= 1 + kMargin &&
           (nodes == 4 || xi.sum() <= 1 + kMargin);
}

/// A T6 whose middle nodes are in the middle of straight sides is as flat as its corners' triangle.
constexpr double kStraightSide = 1e-9; // of a side

bool is_straight(std::span<const std::int32_t> nodes, std::span<const Vec3> places)
{
    for (std::size_t i = 0; i < 3; ++i) {
        const auto at = [&](std::size_t k) -> const Vec3& {
            return places[static_cast<std::size_t>(nodes[k])];
        };
        const Vec3 &a = at(i), &b = at((i + 1) % 3);
        if ((2 * at(3 + i) - a - b).squaredNorm() >
            kStraightSide * kStraightSide * (b - a).squaredNorm())
            return false;
    }
    return true;
}

/// The facets of face f, at the end of a list.
void add_facets(const ExternalSurface& surface, std::span<const Vec3> places, std::size_t f,
                std::vector<Facet>& facets)
{
    const std::span<const std::int32_t> nodes = surface.face(f);
    Facet facet;
    facet.face = static_cast<std::int32_t>(f);
    const auto set = [&](int i, int local) {
        const auto k = static_cast<std::size_t>(i);
        const auto node = static_cast<std::size_t>(nodes[static_cast<std::size_t>(local)]);
        facet.corner[k] = places[node];
        facet.xi[k] = nodes.size() == 4 ? kFacetSquare[local] : kFacetTriangle[local];
    };
    const auto add = [&] {
        const auto& c = facet.corner;
        // Of a quadrilateral: diagonals, whose cross product is its normal in the middle.
        const Vec3 a = facet.corners == 4 ? Vec3(c[2] - c[0]) : Vec3(c[1] - c[0]);
        const Vec3 b = facet.corners == 4 ? Vec3(c[3] - c[1]) : Vec3(c[2] - c[0]);
        facet.normal = a.cross(b);
        const double twice = facet.normal.norm();
        if (!(twice > 0) || !std::isfinite(twice)) return;
        facet.normal /= twice;
        facet.middle = c[0];
        for (int i = 1; i < facet.corners; ++i)
            facet.middle += c[static_cast<std::size_t>(i)];
        facet.middle /= facet.corners;
        facet.size = 0;
        for (int i = 0; i < facet.corners; ++i)
            for (int j = 0; j < i; ++j)
                facet.size = std::max(
                    facet.size,
                    (c[static_cast<std::size_t>(i)] - c[static_cast<std::size_t>(j)]).norm());
        facets.push_back(facet);
    };
    if (nodes.size() == 6 && !is_straight(nodes, places)) {
        for (const auto& quarter : kQuarters) {
            for (int i = 0; i < 3; ++i)
                set(i, quarter[i]);
            add();
        }
        return;
    }
    facet.corners = nodes.size() == 4 ? 4 : 3;
    for (int i = 0; i < facet.corners; ++i)
        set(i, i);
    add();
}

} // namespace

std::vector<Facet> facets_of(const ExternalSurface& surface, std::span<const Vec3> places)
{
    std::vector<Facet> facets;
    facets.reserve(surface.faces.size());
    for (std::size_t f = 0; f < surface.faces.size(); ++f)
        add_facets(surface, places, f, facets);
    return facets;
}

std::vector<Facet> facets_near(const ExternalSurface& surface, std::span<const Vec3> places,
                               const BoundingBox& near, double reach)
{
    std::vector<Facet> facets;
    for (std::size_t f = 0; f < surface.faces.size(); ++f) {
        BoundingBox box;
        for (const std::int32_t node : surface.face(f))
            box.add(places[static_cast<std::size_t>(node)]);
        if (reach > 0) { // no facet is larger than the box's diagonal
            const double around = reach + (box.high - box.low).matrix().norm() / 2;
            box.low -= around;
            box.high += around;
        }
        if (near.touches(box)) add_facets(surface, places, f, facets);
    }
    return facets;
}

BoundingBox box_of(const ExternalSurface& surface, std::span<const Vec3> places)
{
    BoundingBox box;
    for (const std::int32_t node : surface.used_nodes)
        box.add(places[static_cast<std::size_t>(node)]);
    return box;
}

BoundingBox box_of(const Facet& facet, const Vec3& along)
{
    BoundingBox box;
    for (int i = 0; i < facet.corners; ++i) {
        box.add(facet.corner[static_cast<std::size_t>(i)] + along);
        box.add(facet.corner[static_cast<std::size_t>(i)] - along);
    }
    return box;
}

std::vector<BoundingBox> boxes_of(std::span<const Facet> facets)
{
    std::vector<BoundingBox> boxes;
    boxes.reserve(facets.size());
    for (const Facet& f : facets)
        boxes.push_back(box_of(f));
    return boxes;
}

FacetPlane::FacetPlane(const Facet& facet) : origin(facet.middle)
{
    // A side in the plane: that of a warped quadrilateral is not quite.
    Vec3 side = facet.corner[1] - facet.corner[0];
    side = (side - facet.normal.dot(side) * facet.normal).normalized();
    axes.row(0) = side;
    axes.row(1) = facet.normal.cross(side);
    axes.row(2) = facet.normal;
}

AffineMap::AffineMap(const Vec2* from, const Vec2* to)
{
    Eigen::Matrix2d A, B;
    A << from[1] - from[0], from[2] - from[0];
    B << to[1] - to[0], to[2] - to[0];
    slope = B * A.inverse();
    offset = to[0] - slope * from[0];
}

FaceInPlane::FaceInPlane(std::span<const std::int32_t> face, std::span<const Vec3> places,
                         const FacetPlane& plane)
    : nodes(static_cast<int>(face.size()))
{
    for (std::size_t i = 0; i < face.size(); ++i)
        node[i] = plane(places[static_cast<std::size_t>(face[i])]);
}

FaceInPlane::FaceInPlane(std::span<const std::int32_t> face, std::span<const Vec3> places)
    : nodes(static_cast<int>(face.size()))
{
    for (std::size_t i = 0; i < face.size(); ++i)
        node[i] = places[static_cast<std::size_t>(face[i])];
}

PerNode shape_values(int nodes, const Vec2& xi)
{
    PerNode N = PerNode::Zero();
    double dx[kMostSolidFaceNodes], dy[kMostSolidFaceNodes];
    evaluate_face(nodes, xi.x(), xi.y(), N.data(), dx, dy);
    return N;
}

FaceSpot spot(const FaceInPlane& face, const Vec2& xi)
{
    FaceSpot out{PerNode::Zero(), Vec3::Zero(), {Vec3::Zero(), Vec3::Zero()}};
    double dx[kMostSolidFaceNodes], dy[kMostSolidFaceNodes];
    evaluate_face(face.nodes, xi.x(), xi.y(), out.values.data(), dx, dy);
    for (int i = 0; i < face.nodes; ++i) {
        const Vec3& x = face.node[static_cast<std::size_t>(i)];
        out.place += out.values[i] * x;
        out.along[0] += dx[i] * x;
        out.along[1] += dy[i] * x;
    }
    return out;
}

namespace {

double cross(const Vec2& a, const Vec2& b)
{
    return a.x() * b.y() - a.y() * b.x();
}

/// Newton's step to the place that is `off` away, along the tangents a and b.
Vec2 step_in_plane(const Vec2& off, const Vec2& a, const Vec2& b)
{
    return Vec2{cross(off, b), cross(a, off)} / cross(a, b);
}

/// Where a quadrilateral in a plane, middle + x a + y b + x y twist, lies at z: eliminating y
/// leaves a quadratic equation, whose discriminant is the square of the area per reference area
/// there. Of its two roots the one on whose side of the fold the middle lies, without a difference
/// of nearly equal numbers anywhere on the reference face.
/// @return  not finite if no place of that side lies at z
Vec2 bilinear_xi(const FaceInPlane& face, const Vec2& z)
{
    const Vec2 n0 = face.node[0].head<2>(), n1 = face.node[1].head<2>(),
               n2 = face.node[2].head<2>(), n3 = face.node[3].head<2>();
    const Vec2 d = z - 0.25 * (n0 + n1 + n2 + n3), a = 0.25 * (n1 - n0 + n2 - n3),
               b = 0.25 * (n3 - n0 + n2 - n1), twist = 0.25 * (n0 - n1 + n2 - n3);
    const double middle = cross(a, b), bent = cross(d, twist), left = middle - bent,
                 size = std::copysign(std::sqrt(left * left + 4 * cross(a, twist) * cross(d, b)),
                                      middle);
    return {2 * cross(d, b) / (left + size), 2 * cross(a, d) / (middle + bent + size)};
}

constexpr int kLocateSteps = 20;
constexpr double kLocated = 1e-13; // on the reference face; a step from 1e-7 leads there

} // namespace

std::optional<FaceSpot> locate(const FaceInPlane& face, const Vec2& z, const Vec2& start)
{
    if (face.nodes == 4) {
        const Vec2 xi = bilinear_xi(face, z);
        if (!xi.allFinite() || !is_on(4, xi)) return {};
        return spot(face, xi);
    }
    Vec2 xi = start;
    for (int k = 0; k < kLocateSteps; ++k) {
        const FaceSpot at = spot(face, xi);
        const Vec2 step =
            step_in_plane(z - at.place.head<2>(), at.along[0].head<2>(), at.along[1].head<2>());
        if (!step.allFinite()) return {};
        if (step.norm() > kLocated) {
            xi += step;
            continue;
        }
        if (!is_on(face.nodes, xi)) return {};
        return at;
    }
    return {};
}

Vec2 nearest_xi(const FaceInPlane& face, const Vec3& x, const Vec2& start)
{
    if (face.nodes == 3) return start; // flat, and found already
    constexpr int kSteps = 30;
    constexpr double kClose = 1e-12;
    Vec2 xi = start;
    for (int k = 0; k < kSteps; ++k) {
        const FaceSpot at = spot(face, xi);
        Eigen::Matrix<double, 3, 2> J;
        J << at.along[0], at.along[1];
        const Eigen::Matrix2d normal = J.transpose() * J;
        const Vec2 step = normal.inverse() * (J.transpose() * (x - at.place));
        if (!step.allFinite()) return start;
        xi += step;
        if (step.norm() < kClose) return is_on(face.nodes, xi) ? xi : start;
    }
    return start;
}

} // namespace amontons
