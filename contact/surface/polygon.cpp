#include "contact/surface/polygon.hpp"

#include <algorithm>
#include <utility>

namespace amontons {

double area(const ConvexPolygon& p)
{
    double twice = 0;
    for (int i = 1; i + 1 < p.count; ++i)
        twice += twice_area(p[0], p[i], p[i + 1]);
    return twice / 2;
}

Vec2 middle_of_outline(const ConvexPolygon& p)
{
    Vec2 sum = Vec2::Zero();
    double length = 0;
    for (int i = 0; i < p.count; ++i) {
        const Vec2 &b = p[i], &c = p[(i + 1) % p.count];
        sum += (c - b).norm() / 2 * (b + c);
        length += (c - b).norm();
    }
    return sum / length;
}

Vec2 middle(const ConvexPolygon& p)
{
    Vec2 sum = Vec2::Zero();
    for (int i = 0; i < p.count; ++i)
        sum += p[i];
    return sum / p.count;
}

void keep_left(const ConvexPolygon& p, const Vec2& a, const Vec2& b, ConvexPolygon& out)
{
    out.count = 0;
    if (p.count == 0) return;
    const auto add = [&](const Vec2& x) {
        if (out.count < ConvexPolygon::kMost) out.add(x);
    };
    int last = p.count - 1;
    double side = twice_area(a, b, p[last]);
    for (int i = 0; i < p.count; ++i) {
        const double next = twice_area(a, b, p[i]);
        if ((side < 0 && next > 0) || (side > 0 && next < 0))
            add(p[last] + side / (side - next) * (p[i] - p[last]));
        if (next >= 0) add(p[i]);
        side = next;
        last = i;
    }
    if (out.count < 3) out.count = 0;
}

namespace {

/// The least and the largest of twice_area() over the corners of p, which has one.
std::pair<double, double> sides_of(const Vec2& a, const Vec2& b, const ConvexPolygon& p)
{
    double least = twice_area(a, b, p[0]), most = least;
    for (int i = 1; i < p.count; ++i) {
        const double side = twice_area(a, b, p[i]);
        least = std::min(least, side);
        most = std::max(most, side);
    }
    return {least, most};
}

} // namespace

Shared shared_with(const ConvexPolygon& q, const ConvexPolygon& p)
{
    Shared shared = p.count == 0 ? Shared::nothing : Shared::all;
    for (int k = 0; k < q.count && shared != Shared::nothing; ++k) {
        const Vec2 &a = q[k], &b = q[k + 1 < q.count ? k + 1 : 0];
        const auto [least, most] = sides_of(a, b, p);
        if (!(most > 0))
            shared = Shared::nothing;
        else if (least < 0)
            shared = Shared::part;
    }
    return shared;
}

bool cut_to(const ConvexPolygon& q, ConvexPolygon& p)
{
    if (p.count == 0) return false;
    ConvexPolygon rest;
    for (int k = 0; k < q.count; ++k) {
        const Vec2 &a = q[k], &b = q[k + 1 < q.count ? k + 1 : 0];
        const auto [least, most] = sides_of(a, b, p);
        if (!(most > 0)) return false;
        if (!(least < 0)) continue;
        keep_left(p, a, b, rest);
        if (rest.count == 0) return false;
        p = rest;
    }
    return true;
}

void intersect(const ConvexPolygon& p, const ConvexPolygon& q, ConvexPolygon& out)
{
    out = p;
    if (!cut_to(q, out)) out.count = 0;
}

void subtract(const ConvexPolygon& p, const ConvexPolygon& q, double least,
              std::vector<ConvexPolygon>& pieces)
{
    ConvexPolygon rest = p, piece, kept;
    // Cut by the lines of a polygon that it does not touch, p would come back in pieces, and they
    // in pieces again.
    intersect(p, q, kept);
    if (!(area(kept) > least)) {
        pieces.push_back(p);
        return;
    }
    for (int i = 0; i < q.count && rest.count > 0; ++i) {
        const Vec2 &a = q[i], &b = q[i + 1 < q.count ? i + 1 : 0];
        keep_left(rest, b, a, piece);
        if (area(piece) > least) pieces.push_back(piece);
        keep_left(rest, a, b, kept);
        rest = kept;
    }
}

} // namespace amontons
