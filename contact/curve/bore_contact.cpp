#include "contact/curve/bore_contact.hpp"

#include <algorithm>
#include <cmath>

namespace amontons {
namespace {

constexpr double kOnPiece = 1e-9;                         // a place at the end of a piece is on it
constexpr std::int64_t kInnerEnd = std::int64_t(3) << 60; // its number: no station's

/// A contact of two places.
/// @param reach  largest gap of a contact [m]
void add_bore_contact(const BorePair& pair, const CurvePlace& a, const CurvePlace& b,
                      bool inner_slides, std::int64_t id, double reach,
                      std::vector<CurveContact>& out)
{
    const CurvePiece &outer = pair.outer.pieces[std::size_t(a.piece)],
                     &inner = pair.inner.pieces[std::size_t(b.piece)];
    const Vec3 x = outer.at(a.t), d = inner.at(b.t) - x;
    const double distance = d.norm(),
                 gap = pair.bore[std::size_t(a.piece)] - inner.radius - distance;
    if (!(gap <= reach) || !(distance > 0)) return;
    CurveContact c;
    c.a = a;
    c.b = b;
    c.normal = d / distance; // the inner curve pushes the outer one outwards
    c.gap = gap;
    c.point = inner.at(b.t) + (inner.radius + 0.5 * gap) * c.normal;
    c.id = id;
    c.slides_a = !inner_slides;
    c.slides_b = inner_slides;
    out.push_back(c);
}

} // namespace

std::optional<CurvePlace> nearest_place(const Curve& curve, const Vec3& x, int first, int& piece)
{
    const int last = int(curve.pieces.size()) - 1;
    if (first > last) return {};
    piece = std::clamp(piece, first, last);
    for (int came = 0;;) { // -1: from the piece after it; 1: from the one before
        const CurvePiece& p = curve.pieces[std::size_t(piece)];
        const std::optional<double> t = foot(p, x);
        const bool before = t ? *t < -kOnPiece : (x - p.x0).dot(p.d0) < 0,
                   after = t ? *t > 1 + kOnPiece : !before;
        if (before && came <= 0) {
            if (piece == first) return {};
            --piece;
            came = -1;
        } else if (after && came >= 0) {
            if (piece == last) return {};
            ++piece;
            came = 1;
        } else { // on it, or nearest to where it and the piece before in the search have their end
            return CurvePlace{piece, t ? std::clamp(*t, 0.0, 1.0) : came > 0 ? 0.0 : 1.0};
        }
    }
}

void touch_bore(const BorePair& pair, std::span<const CurvePlace> stations, double reach,
                std::vector<CurveContact>& out)
{
    int piece = pair.first_inner, at_tip = pair.first_outer;
    for (std::size_t i = 0; i < stations.size(); ++i) {
        const CurvePlace& a = stations[i];
        if (a.piece < pair.first_outer) continue;
        const Vec3 x = pair.outer.pieces[std::size_t(a.piece)].at(a.t);
        const std::optional<CurvePlace> b = nearest_place(pair.inner, x, pair.first_inner, piece);
        if (!b) continue; // before the place that both come out of, or beyond the inner end
        at_tip = a.piece;
        add_bore_contact(pair, a, *b, true, std::int64_t(i), reach, out);
    }
    const CurvePlace end{int(pair.inner.pieces.size()) - 1, 1};
    const Vec3 tip = pair.inner.pieces.back().at(1);
    if (const std::optional<CurvePlace> a =
            nearest_place(pair.outer, tip, pair.first_outer, at_tip))
        add_bore_contact(pair, *a, end, false, kInnerEnd, reach, out);
}

BoreOverlap bore_overlap(const BorePair& pair)
{
    BoreOverlap deepest;
    int piece = pair.first_outer;
    const CurvePiece& end = pair.outer.pieces.back();
    for (std::size_t e = std::size_t(pair.first_inner); e < pair.inner.pieces.size(); ++e) {
        const CurvePiece& p = pair.inner.pieces[e];
        const int parts =
            std::max(1, int(std::ceil(2 * (p.x1 - p.x0).norm() / std::max(p.radius, 1e-300))));
        for (int k = 0; k <= parts; ++k) {
            const Vec3 x = p.at(double(k) / parts);
            const std::optional<CurvePlace> at =
                nearest_place(pair.outer, x, pair.first_outer, piece);
            if (!at && (x - end.x1).dot(end.d1) > 0) return deepest; // it has come out there
            if (!at) continue;
            const double depth = (x - pair.outer.pieces[std::size_t(at->piece)].at(at->t)).norm() +
                                 p.radius - pair.bore[std::size_t(at->piece)];
            if (depth > deepest.depth) deepest = {depth, x};
        }
    }
    return deepest;
}

} // namespace amontons
