#include "mesh/closest_point.hpp"

#include <algorithm>
#include <limits>

namespace amontons {

namespace {

constexpr double kNoArea = 1e-12; // squared sine of a corner

// The nearest point of the triangle's border.
TrianglePoint on_edges(const Vec3& x, const Vec3& a, const Vec3& b, const Vec3& c)
{
    using enum TriangleFeature;
    constexpr TriangleFeature edges[3] = {edge0, edge1, edge2};
    constexpr TriangleFeature vertices[3] = {vertex0, vertex1, vertex2};
    const Vec3* corner[3] = {&a, &b, &c};
    TrianglePoint best;
    double least = std::numeric_limits<double>::infinity();
    for (int k = 0; k < 3; ++k) {
        const int next = (k + 1) % 3;
        const Vec3 along = *corner[next] - *corner[k];
        const double length2 = along.squaredNorm();
        const double t =
            length2 > 0 ? std::clamp((x - *corner[k]).dot(along) / length2, 0.0, 1.0) : 0.0;
        const Vec3 p = *corner[k] + t * along;
        const double squared = (x - p).squaredNorm();
        if (squared >= least) continue;
        least = squared;
        best.point = p;
        best.weights = (1 - t) * Vec3::Unit(k) + t * Vec3::Unit(next);
        best.feature = t <= 0 ? vertices[k] : t >= 1 ? vertices[next] : edges[k];
    }
    return best;
}

} // namespace

TrianglePoint closest_on_triangle(const Vec3& x, const Vec3& a, const Vec3& b, const Vec3& c)
{
    using enum TriangleFeature;
    const Vec3 ab = b - a, ac = c - a, ax = x - a;
    const double d1 = ab.dot(ax), d2 = ac.dot(ax);
    if (d1 <= 0 && d2 <= 0) return {a, Vec3::UnitX(), vertex0};

    const Vec3 bx = x - b;
    const double d3 = ab.dot(bx), d4 = ac.dot(bx);
    if (d3 >= 0 && d4 <= d3) return {b, Vec3::UnitY(), vertex1};

    const double vc = d1 * d4 - d3 * d2;
    if (vc <= 0 && d1 >= 0 && d3 <= 0 && d1 - d3 > 0) {
        const double v = d1 / (d1 - d3);
        return {a + v * ab, {1 - v, v, 0}, edge0};
    }

    const Vec3 cx = x - c;
    const double d5 = ab.dot(cx), d6 = ac.dot(cx);
    if (d6 >= 0 && d5 <= d6) return {c, Vec3::UnitZ(), vertex2};

    const double vb = d5 * d2 - d1 * d6;
    if (vb <= 0 && d2 >= 0 && d6 <= 0 && d2 - d6 > 0) {
        const double w = d2 / (d2 - d6);
        return {a + w * ac, {1 - w, 0, w}, edge2};
    }

    const double va = d3 * d6 - d5 * d4;
    const double e1 = d4 - d3, e2 = d5 - d6;
    if (va <= 0 && e1 >= 0 && e2 >= 0 && e1 + e2 > 0) {
        const double w = e1 / (e1 + e2);
        return {b + w * (c - b), {0, 1 - w, w}, edge1};
    }

    // The squared double area. Without area the regions above overlap: the nearest of three
    // segments decides.
    const double total = va + vb + vc;
    if (!(total > kNoArea * ab.squaredNorm() * ac.squaredNorm())) return on_edges(x, a, b, c);
    const double v = vb / total, w = vc / total;
    return {a + v * ab + w * ac, {1 - v - w, v, w}, face};
}

} // namespace amontons
