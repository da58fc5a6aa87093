#include "contact/rigid/shape.hpp"
#include "mesh/base/error.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

namespace amontons {
namespace {

using WedgeCorner = Eigen::Vector2d;

double turning(const WedgeCorner& a, const WedgeCorner& b, const WedgeCorner& c)
{
    const WedgeCorner u = b - a, v = c - b;
    return u.x() * v.y() - u.y() * v.x();
}

/// Do the sides a b and c d have a point in common?
bool sides_cross(const WedgeCorner& a, const WedgeCorner& b, const WedgeCorner& c,
                 const WedgeCorner& d)
{
    const auto sign = [](double x) { return (x > 0) - (x < 0); };
    const auto between = [](const WedgeCorner& p, const WedgeCorner& q, const WedgeCorner& x) {
        return std::min(p.x(), q.x()) <= x.x() && x.x() <= std::max(p.x(), q.x()) &&
               std::min(p.y(), q.y()) <= x.y() && x.y() <= std::max(p.y(), q.y());
    };
    const int abc = sign(turning(a, b, c)), abd = sign(turning(a, b, d)),
              cda = sign(turning(c, d, a)), cdb = sign(turning(c, d, b));
    if (abc != abd && cda != cdb) return true;
    return (abc == 0 && between(a, b, c)) || (abd == 0 && between(a, b, d)) ||
           (cda == 0 && between(c, d, a)) || (cdb == 0 && between(c, d, b));
}

/// Triangles of a simple polygon that runs counter-clockwise, by cutting off ears.
std::vector<std::array<int, 3>> cut_ears(const std::vector<WedgeCorner>& p)
{
    std::vector<int> left(p.size());
    std::iota(left.begin(), left.end(), 0);
    std::vector<std::array<int, 3>> triangles;
    while (left.size() > 3) {
        // Of all ears the best shaped: none is thinner than it must be.
        std::size_t best = left.size();
        double best_shape = 0;
        for (std::size_t i = 0; i < left.size(); ++i) {
            const int before = left[(i + left.size() - 1) % left.size()], here = left[i],
                      after = left[(i + 1) % left.size()];
            const WedgeCorner &a = p[std::size_t(before)], &b = p[std::size_t(here)],
                              &c = p[std::size_t(after)];
            const double area = turning(a, b, c);
            if (!(area > 0)) continue;
            const bool empty = std::none_of(left.begin(), left.end(), [&](int k) {
                if (k == before || k == here || k == after) return false;
                const WedgeCorner& x = p[std::size_t(k)];
                return turning(a, b, x) >= 0 && turning(b, c, x) >= 0 && turning(c, a, x) >= 0;
            });
            const double shape =
                area / ((b - a).squaredNorm() + (c - b).squaredNorm() + (a - c).squaredNorm());
            if (empty && shape > best_shape) {
                best = i;
                best_shape = shape;
            }
        }
        if (best == left.size()) return {};
        triangles.push_back({left[(best + left.size() - 1) % left.size()], left[best],
                             left[(best + 1) % left.size()]});
        left.erase(left.begin() + std::ptrdiff_t(best));
    }
    triangles.push_back({left[0], left[1], left[2]});
    return triangles;
}

} // namespace

TriangleShape make_wedge(std::vector<std::array<double, 2>> polygon, double length)
{
    constexpr const char* kAllowed = "a polygon whose sides do not cross or touch";
    std::vector<WedgeCorner> p;
    for (const auto& [x, y] : polygon)
        p.emplace_back(x, y);
    const std::size_t n = p.size();
    if (n < 3)
        throw InputError({Issue{"", "/points", std::to_string(n) + " corners", "at least 3"}});
    double area = 0, size = 0;
    for (std::size_t i = 0; i < n; ++i) {
        const WedgeCorner u = p[i] - p[0], v = p[(i + 1) % n] - p[0];
        area += (u.x() * v.y() - u.y() * v.x()) / 2;
        size = std::max(size, u.norm());
    }
    for (std::size_t i = 0; i < n; ++i) {
        const std::size_t j = (i + 1) % n;
        if (!((p[j] - p[i]).norm() > 1e-9 * size))
            throw InputError({Issue{"", "/points/" + std::to_string(j),
                                    "a corner on the one before it", "corners apart"}});
    }
    for (std::size_t i = 0; i < n; ++i) {
        if (std::abs(turning(p[(i + n - 1) % n], p[i], p[(i + 1) % n])) <= 1e-12 * size * size &&
            (p[i] - p[(i + n - 1) % n]).dot(p[(i + 1) % n] - p[i]) < 0)
            throw InputError({Issue{"", "/points/" + std::to_string(i),
                                    "a side that runs back on the one before it", kAllowed}});
        for (std::size_t k = i + 2; k < n; ++k) {
            if (i == 0 && k == n - 1) continue; // neighbours
            if (sides_cross(p[i], p[i + 1], p[k], p[(k + 1) % n]))
                throw InputError({Issue{"", "/points",
                                        "side " + std::to_string(i) +
                                            " that crosses or touches side " + std::to_string(k),
                                        kAllowed}});
        }
    }
    if (!(std::abs(area) > 1e-9 * size * size))
        throw InputError({Issue{"", "/points", "no area", "corners that are not on one line"}});
    if (area < 0) std::reverse(p.begin(), p.end());
    const std::vector<std::array<int, 3>> face = cut_ears(p);
    if (face.empty())
        throw InputError(
            {Issue{"", "/points", "corners nearer to other sides than round-off", kAllowed}});
    SurfaceMesh mesh;
    for (const double z : {-length / 2, length / 2})
        for (const WedgeCorner& c : p)
            mesh.points.emplace_back(c.x(), c.y(), z);
    const int count = int(n);
    for (const auto& [a, b, c] : face) {
        mesh.triangles.push_back({a, c, b});
        mesh.triangles.push_back({a + count, b + count, c + count});
    }
    for (int i = 0; i < count; ++i) {
        const int j = (i + 1) % count;
        mesh.triangles.push_back({i, j, j + count});
        mesh.triangles.push_back({i, j + count, i + count});
    }
    return make_triangle_shape(std::move(mesh));
}

} // namespace amontons
