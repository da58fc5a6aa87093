#include "mesh/closest_point.hpp"

namespace amontons {

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

    const double total = va + vb + vc;
    if (!(total > 0)) return {a, Vec3::UnitX(), vertex0}; // no area and all on one spot
    const double v = vb / total, w = vc / total;
    return {a + v * ab + w * ac, {1 - v - w, v, w}, face};
}

} // namespace amontons
