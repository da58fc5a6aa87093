#pragma once

#include "contact/rigid/detect.hpp"
#include "contact/rigid/tests/shapes_for_tests.hpp"

#include <algorithm>
#include <cmath>
#include <doctest/doctest.h>

// What the tests of detect() share.

namespace amontons {

using Contacts = std::vector<RigidContact>;

inline Contacts contacts(const RigidShape& a, const Pose& pa, const RigidShape& b, const Pose& pb,
                         double reach)
{
    Contacts out;
    detect(a, pa, b, pb, reach, out);
    return out;
}

inline Contacts contacts(const RigidShape& a, const Vec3& place, const RigidShape& b, double reach)
{
    return contacts(a, {place, Eigen::Quaterniond::Identity()}, b, {}, reach);
}

inline double least_gap(const Contacts& all)
{
    double least = 1e300;
    for (const RigidContact& c : all)
        least = std::min(least, c.gap);
    return least;
}

// Is there a contact with this point on a and this normal?
inline bool has(const Contacts& all, const Vec3& point_a, const Vec3& normal,
                double tolerance = 1e-12)
{
    return std::any_of(all.begin(), all.end(), [&](const RigidContact& c) {
        return (c.point_a - point_a).norm() <= tolerance &&
               (c.normal - normal.normalized()).norm() <= tolerance;
    });
}

inline void check_sane(const Contacts& all, double size, double reach)
{
    for (const RigidContact& c : all) {
        CHECK(c.point_a.allFinite());
        CHECK(c.point_b.allFinite());
        CHECK(std::abs(c.normal.norm() - 1) < 1e-12);
        CHECK(std::abs((c.point_a - c.point_b).dot(c.normal) - c.gap) < 1e-11 * size);
        CHECK((c.point_a - c.point_b - c.gap * c.normal).norm() < 3e-6 * size);
        CHECK(c.gap <= reach);
    }
}

// Area of the convex hull of the contact points, seen along z.
inline double hull_area(const Contacts& all)
{
    std::vector<Eigen::Vector2d> p;
    for (const RigidContact& c : all)
        p.push_back(c.point_a.head<2>());
    std::sort(p.begin(), p.end(), [](const auto& a, const auto& b) {
        return a[0] != b[0] ? a[0] < b[0] : a[1] < b[1];
    });
    const auto cross = [](const auto& o, const auto& a, const auto& b) {
        return (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0]);
    };
    std::vector<Eigen::Vector2d> hull;
    for (int pass = 0; pass < 2; ++pass) {
        const std::size_t base = hull.size();
        for (const auto& q : p) {
            while (hull.size() >= base + 2 && cross(hull[hull.size() - 2], hull.back(), q) <= 0)
                hull.pop_back();
            hull.push_back(q);
        }
        hull.pop_back();
        std::reverse(p.begin(), p.end());
    }
    double area = 0;
    for (std::size_t i = 0; i < hull.size(); ++i) {
        const auto &a = hull[i], &b = hull[(i + 1) % hull.size()];
        area += (a[0] * b[1] - a[1] * b[0]) / 2;
    }
    return area;
}

inline bool convex(const RigidShape& shape)
{
    const auto* body = std::get_if<TriangleShape>(&shape);
    return body == nullptr || body->polyhedron.convex;
}

/// The first `kSharpShapes` have flat faces or are balls and cylinders, the others came later: what
/// is drawn for pairs of the first ones stays.
constexpr std::size_t kSharpShapes = 7;
inline std::vector<RigidShape> all_shapes()
{
    return {Box{{0.5, 0.7, 0.3}},
            Ball{0.6},
            Cylinder{0.4, 0.6},
            Plane{},
            triangle_box({0.5, 0.7, 0.3}, 2),
            triangle_l(),
            triangle_prism(0.5, 0.4, 7),
            Ellipsoid{{0.6, 0.4, 0.5}},
            Capsule{0.3, 0.4},
            make_wedge({{-0.5, -0.3}, {0.6, -0.3}, {-0.5, 0.5}}, 0.8)};
}

/// Every two of them.
inline std::vector<std::pair<RigidShape, RigidShape>> all_pairs()
{
    const auto shapes = all_shapes();
    std::vector<std::pair<RigidShape, RigidShape>> pairs;
    for (const bool first : {true, false})
        for (std::size_t i = 0; i < shapes.size(); ++i)
            for (std::size_t j = 0; j < shapes.size(); ++j)
                if (first == (i < kSharpShapes && j < kSharpShapes))
                    pairs.emplace_back(shapes[i], shapes[j]);
    return pairs;
}

} // namespace amontons
