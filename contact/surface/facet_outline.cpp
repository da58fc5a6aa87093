#include "contact/surface/facet_outline.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>

namespace amontons {

void outline_to(const Facet& facet, const FacetPlane& plane, bool from_back, double heights[2],
                ConvexPolygon& p)
{
    p.count = 0;
    heights[0] = std::numeric_limits<double>::infinity();
    heights[1] = -heights[0];
    for (int i = 0; i < facet.corners; ++i) {
        const Vec3 x =
            plane(facet.corner[static_cast<std::size_t>(from_back ? facet.corners - 1 - i : i)]);
        p.add(x.head<2>());
        heights[0] = std::min(heights[0], x.z());
        heights[1] = std::max(heights[1], x.z());
    }
}

ConvexPolygon outline(const Facet& facet, const FacetPlane& plane, bool from_back,
                      double heights[2])
{
    ConvexPolygon p;
    outline_to(facet, plane, from_back, heights, p);
    return p;
}

bool is_convex_polygon(const ConvexPolygon& p)
{
    for (int i = 0; i < p.count; ++i)
        if (twice_area(p[i], p[(i + 1) % p.count], p[(i + 2) % p.count]) < 0) return false;
    return true;
}

} // namespace amontons
