#include "contact/surface/facet_outline.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>

namespace amontons {

ConvexPolygon outline(const Facet& facet, const FacetPlane& plane, bool from_back,
                      double heights[2])
{
    ConvexPolygon p;
    heights[0] = std::numeric_limits<double>::infinity();
    heights[1] = -heights[0];
    for (int i = 0; i < facet.corners; ++i) {
        const Vec3 x =
            plane(facet.corner[static_cast<std::size_t>(from_back ? facet.corners - 1 - i : i)]);
        p.add(x.head<2>());
        heights[0] = std::min(heights[0], x.z());
        heights[1] = std::max(heights[1], x.z());
    }
    return p;
}

bool cut_to(const ConvexPolygon& q, ConvexPolygon& p)
{
    ConvexPolygon rest;
    for (int k = 0; k < q.count; ++k) {
        const Vec2 &a = q[k], &b = q[k + 1 < q.count ? k + 1 : 0];
        double least = twice_area(a, b, p[0]), most = least;
        for (int i = 1; i < p.count; ++i) {
            const double side = twice_area(a, b, p[i]);
            least = std::min(least, side);
            most = std::max(most, side);
        }
        if (!(most > 0)) return false;
        if (!(least < 0)) continue;
        keep_left(p, a, b, rest);
        if (rest.count == 0) return false;
        p = rest;
    }
    return true;
}

bool is_convex_polygon(const ConvexPolygon& p)
{
    for (int i = 0; i < p.count; ++i)
        if (twice_area(p[i], p[(i + 1) % p.count], p[(i + 2) % p.count]) < 0) return false;
    return true;
}

} // namespace amontons
