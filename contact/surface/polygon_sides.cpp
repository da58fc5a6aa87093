#include "contact/surface/polygon_sides.hpp"

#include <algorithm>
#include <utility>

namespace amontons {

PolygonSides::PolygonSides(const ConvexPolygon& q)
{
    from_x = from_y = along_x = along_y = PerSide::Zero();
    beyond = PerSide::Ones();
    for (int k = 0; k < std::min(q.count, 4); ++k) {
        const Vec2 &a = q[k], &b = q[k + 1 < q.count ? k + 1 : 0];
        from_x[k] = a.x();
        from_y[k] = a.y();
        along_x[k] = b.x() - a.x();
        along_y[k] = b.y() - a.y();
        beyond[k] = 0;
    }
}

Shared shared_with(const PolygonSides& q, const ConvexPolygon& p)
{
    if (p.count == 0) return Shared::nothing;
    PolygonSides::PerSide least = q(p[0]), most = least;
    for (int i = 1; i < p.count; ++i) {
        const PolygonSides::PerSide side = q(p[i]);
        least = least.min(side);
        most = most.max(side);
    }
    if (!(most > 0).all()) return Shared::nothing;
    return (least < 0).any() ? Shared::part : Shared::all;
}

bool cut_to(const PolygonSides& q, ConvexPolygon& p)
{
    if (p.count == 0) return false;
    // Corners with what they are beside each side; those of a cut have it from the ends of the side
    // that was cut.
    struct Corner {
        PolygonSides::PerSide side;
        Vec2 x;
    };
    Corner corners[2][ConvexPolygon::kMost];
    Corner *from = corners[0], *to = corners[1];
    PolygonSides::PerSide least = q(p[0]), most = least;
    from[0] = {least, p[0]};
    for (int i = 1; i < p.count; ++i) {
        from[i] = {q(p[i]), p[i]};
        least = least.min(from[i].side);
        most = most.max(from[i].side);
    }
    if (!(most > 0).all()) return false;
    if (!(least < 0).any()) return true;
    int count = p.count;
    for (int k = 0; k < 4; ++k) {
        if (!(least[k] < 0)) continue;
        int kept = 0;
        const Corner* last = from + count - 1;
        double side = last->side[k];
        for (int i = 0; i < count; ++i) {
            const double next = from[i].side[k];
            if (((side < 0 && next > 0) || (side > 0 && next < 0)) && kept < ConvexPolygon::kMost) {
                const double share = side / (side - next);
                to[kept].side = last->side + share * (from[i].side - last->side);
                to[kept].side[k] = 0;
                to[kept++].x = last->x + share * (from[i].x - last->x);
            }
            if (next >= 0 && kept < ConvexPolygon::kMost) to[kept++] = from[i];
            side = next;
            last = from + i;
        }
        if (kept < 3) return false;
        count = kept;
        std::swap(from, to);
    }
    p.count = count;
    for (int i = 0; i < count; ++i)
        p.corner[static_cast<std::size_t>(i)] = from[i].x;
    return true;
}

} // namespace amontons
