#include "contact/curve/curve_contact.hpp"

#include "mesh/box_tree.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>

namespace amontons {
namespace {

constexpr double kAway = 3;      // radii of arc between two places of one curve that may touch
constexpr double kBulge = 1e-6;  // of the radius: what a surface does between two stations
constexpr double kSharper = 2;   // ... whose curvature is so many times the curve's
constexpr double kBeyond = 1e-9; // of a piece: a place at its end is on it
constexpr double kAcross = 0.3;  // sideways way between stations, of the radii: more is a crossing,
constexpr double kAlmost = 0.2;  // ... and less is none; between the two it is one in part
constexpr double kAlong = 0.6;   // ... and more no line
// Of the radii: straight lines of that way that touch at two stations overlap by it between these.
constexpr double kSag = kAcross * kAcross / 8;
constexpr double kOffset = 0.382; // where a number changes: not at nodes, nor half-way

// Kinds of contact within a pair.
constexpr std::int64_t kBulges = std::int64_t(1) << 60, kCrossings = std::int64_t(2) << 60,
                       kEnds = std::int64_t(3) << 60;
constexpr std::int64_t kPlaces = std::int64_t(1) << 24;

int pieces(const Curve& c)
{
    return int(c.pieces.size());
}

/// A number for the neighbourhood of a place.
std::int64_t bin(const Curve& c, const CurvePlace& p)
{
    const auto k = std::int64_t(std::floor(double(p.piece) + p.t + kOffset));
    return c.closed && k == pieces(c) ? 0 : k;
}

double arc_between(const Curve& c, double s, double t)
{
    const double d = std::abs(s - t);
    return c.closed ? std::min(d, c.start.back() - d) : d;
}

BoundingBox curve_piece_box(const CurvePiece& p, double more)
{
    BoundingBox box; // of Bézier's points
    box.add(p.x0);
    box.add(p.x1);
    box.add(p.x0 + p.d0 / 3);
    box.add(p.x1 - p.d1 / 3);
    box.low -= more;
    box.high += more;
    return box;
}

/// Places of two pieces whose distance is stationary and least nearby: downhill by Newton's method
/// from where their chords are nearest, on the pieces and a little beyond. (Undamped steps leave
/// pieces that have such places: a crossing is there in one iterate and entered the next.)
std::optional<std::array<double, 2>> feet(const CurvePiece& p, const CurvePiece& q)
{
    constexpr double kLow = -0.2, kHigh = 1.2; // how far beyond
    // From the chords.
    const Vec3 u = p.x1 - p.x0, v = q.x1 - q.x0, w = p.x0 - q.x0;
    const double a = u.dot(u), b = u.dot(v), c = v.dot(v), det = a * c - b * b;
    Eigen::Vector2d y(0.5, 0.5);
    if (det > 1e-12 * a * c) y[0] = std::clamp((b * v.dot(w) - c * u.dot(w)) / det, 0.0, 1.0);
    y[1] = std::clamp((b * y[0] + v.dot(w)) / c, 0.0, 1.0);
    y[0] = std::clamp((b * y[1] - u.dot(w)) / a, 0.0, 1.0);
    const auto apart = [&](const Eigen::Vector2d& at) {
        return (p.at(at[0]) - q.at(at[1])).squaredNorm();
    };
    for (int i = 0; i < 9; ++i) { // or from ends and middles, where those are nearer
        const Eigen::Vector2d other(0.5 * (i % 3), 0.5 * (i / 3));
        if (apart(other) < apart(y)) y = other;
    }
    for (int i = 0; i < 60; ++i) {
        const Vec3 d = p.at(y[0]) - q.at(y[1]), s = p.slope(y[0]), t = q.slope(y[1]);
        const Eigen::Vector2d g(s.dot(d), -t.dot(d));
        Eigen::Matrix2d H;
        H << s.dot(s) + p.bend(y[0]).dot(d), -s.dot(t), -s.dot(t), t.dot(t) - q.bend(y[1]).dot(d);
        if (!(H(0, 0) > 0 && H.determinant() > 1e-9 * s.dot(s) * t.dot(t))) {
            H(0, 0) = 1.001 * s.dot(s);
            H(1, 1) = 1.001 * t.dot(t);
        }
        // Motions out of the interval are set to 0.
        Eigen::Vector2d step = -H.inverse() * g;
        for (int k = 0; k < 2; ++k) {
            const bool out = (y[k] <= kLow && g[k] > 0) || (y[k] >= kHigh && g[k] < 0);
            if (!out) continue;
            const int other = 1 - k;
            step[k] = 0;
            step[other] = H(other, other) > 0 ? -g[other] / H(other, other) : 0;
            const bool too =
                (y[other] <= kLow && g[other] > 0) || (y[other] >= kHigh && g[other] < 0);
            if (too) return std::nullopt;
        }
        double most = step.cwiseAbs().maxCoeff();
        if (most > 0.5) step *= 0.5 / most;
        Eigen::Vector2d next;
        const double now = d.squaredNorm();
        for (int halved = 0;; ++halved) {
            next = (y + step).cwiseMax(kLow).cwiseMin(kHigh);
            if (most < 1e-5 || halved == 20 || apart(next) <= now) break;
            step *= 0.5;
        }
        most = (next - y).cwiseAbs().maxCoeff();
        y = next;
        if (most < 1e-13) break;
    }
    if ((y.array() < -kBeyond).any() || (y.array() > 1 + kBeyond).any()) return std::nullopt;
    return std::array<double, 2>{std::clamp(y[0], 0.0, 1.0), std::clamp(y[1], 0.0, 1.0)};
}

/// Arc length from one station to the next, on each piece [m].
std::vector<double> spacings(const Curve& c, std::span<const CurvePlace> stations)
{
    std::vector<int> count(c.pieces.size(), 0);
    for (const CurvePlace& p : stations)
        if (p.t < 1) ++count[std::size_t(p.piece)]; // its end is the next one's
    std::vector<double> out;
    for (std::size_t e = 0; e < c.pieces.size(); ++e)
        out.push_back((c.start[e + 1] - c.start[e]) / std::max(1, count[e]));
    return out;
}

/// Where a function that is below 0 at a, and not at b, passes through 0, to 1e-15: by regula
/// falsi with halved ends (Illinois); where that has not halved the interval in three values (at a
/// jump), by its middle.
template <class Function>
double root(double a, double at_a, double b, double at_b, Function&& value)
{
    if (at_b == 0) return b;
    double width = b - a; // three values ago
    for (int i = 0, side = 0; b - a > 1e-15; ++i) {
        double t = a + (b - a) * at_a / (at_a - at_b);
        if (i % 4 == 3) {
            if (b - a > 0.5 * width) t = 0.5 * (a + b);
            width = b - a;
        }
        if (!(t > a && t < b)) t = 0.5 * (a + b);
        if (!(t > a && t < b)) break; // neighbours
        const double v = value(t);
        if (v == 0) return t;
        if (v < 0) {
            a = t;
            at_a = v;
            if (side < 0) at_b *= 0.5;
            side = -1;
        } else {
            b = t;
            at_b = v;
            if (side > 0) at_a *= 0.5;
            side = 1;
        }
    }
    return 0.5 * (a + b);
}

/// Sine of the angle between two lines.
double sine(const Vec3& a, const Vec3& b)
{
    return a.cross(b).norm() / (a.norm() * b.norm());
}

struct Pair {
    const Curve& a;
    const Curve& b;
    double reach;
    std::vector<double> spacing; // of a's stations, on each piece [m]
    std::vector<CurveContact>& out;
    std::map<std::int64_t, std::size_t> made{}; // place in out by id: no two of one id
    struct Crossing {
        double arc_b, gap; // [m]
        double share;      // of a whole one
    };
    std::multimap<double, Crossing> crossed{}; // by arc length along a [m]

    bool same() const { return &a == &b; }
    bool may_touch(const CurvePlace& p, const CurvePlace& q) const
    {
        if (!same()) return true;
        const double r =
            0.5 * (a.pieces[std::size_t(p.piece)].radius + b.pieces[std::size_t(q.piece)].radius);
        return arc_between(a, arc_at(a, p), arc_at(b, q)) > kAway * r;
    }
    double gap_at(const CurvePlace& p, const CurvePlace& q) const
    {
        const CurvePiece &one = a.pieces[std::size_t(p.piece)],
                         &two = b.pieces[std::size_t(q.piece)];
        return (one.at(p.t) - two.at(q.t)).norm() - one.radius - two.radius;
    }
    /// The longer way from a place of a to stations beside it.
    double spacing_at(const CurvePlace& p) const
    {
        const auto e = std::size_t(p.piece);
        const bool first = e == 0;
        if (p.t > 0 || (first && !a.closed)) return spacing[e];
        return std::max(spacing[e], spacing[first ? a.pieces.size() - 1 : e - 1]);
    }
    /// The share of a crossing that has it already, 0: none. Two whole rows at one place would
    /// share a force and exchange it as the crossing moves.
    double beside_crossing(const CurvePlace& p, const CurvePlace& q) const
    {
        if (crossed.empty()) return 0;
        const double s = arc_at(a, p), t = arc_at(b, q), near = spacing_at(p), gap = gap_at(p, q);
        double share = 0;
        const auto within = [&](double from, double to) {
            for (auto c = crossed.lower_bound(from); c != crossed.end() && c->first <= to; ++c)
                if (arc_between(b, c->second.arc_b, t) <= near && c->second.gap <= gap)
                    share = std::max(share, c->second.share);
        };
        const double all = a.start.back();
        within(s - near, s + near);
        if (a.closed) {
            within(s - near + all, all);
            within(0, s + near - all);
        }
        return share;
    }
    /// What the surfaces may overlap by at a contact that is one in part [m]: as much as it lacks.
    /// So its force sets in at zero, and the same places have the same contacts, whatever the path.
    double overlap_allowed(const CurvePlace& p, const CurvePlace& q, double share) const
    {
        return (1 - share) * kSag *
               (a.pieces[std::size_t(p.piece)].radius + b.pieces[std::size_t(q.piece)].radius);
    }
    /// @param share  of a crossing, above 0
    void cross(const CurvePlace& p, const CurvePlace& q, std::int64_t id, double share)
    {
        const double gap = gap_at(p, q);
        if (!(gap <= reach)) return;
        crossed.emplace(arc_at(a, p), Crossing{arc_at(b, q), gap, share});
        if (same()) crossed.emplace(arc_at(b, q), Crossing{arc_at(a, p), gap, share});
        add(p, q, id, true, true, overlap_allowed(p, q, share));
    }
    /// @param allowed  what may overlap [m]
    void add(const CurvePlace& p, const CurvePlace& q, std::int64_t id, bool slides_a,
             bool slides_b, double allowed = 0)
    {
        const CurvePiece &one = a.pieces[std::size_t(p.piece)],
                         &two = b.pieces[std::size_t(q.piece)];
        const Vec3 x = one.at(p.t), y = two.at(q.t), d = x - y;
        const double distance = d.norm(), gap = distance - one.radius - two.radius;
        if (!(gap <= reach) || !(distance > 0)) return;
        CurveContact c;
        c.a = p;
        c.b = q;
        c.normal = d / distance;
        c.gap = gap + allowed;
        c.point = y + (two.radius + 0.5 * gap) * c.normal;
        c.id = id;
        c.slides_a = slides_a;
        c.slides_b = slides_b;
        const auto [at, fresh] = made.emplace(id, out.size());
        if (fresh)
            out.push_back(c);
        else if (c.gap < out[at->second].gap)
            out[at->second] = c;
    }
    /// A point of `from` against the whole of `to`.
    void add_point(const CurvePlace& p, const Curve& from, const Curve& to, const BoxTree& tree,
                   bool swapped, bool all_angles, std::int64_t id)
    {
        const CurvePiece& own = from.pieces[std::size_t(p.piece)];
        const Vec3 x = own.at(p.t), slope = own.slope(p.t);
        BoundingBox box;
        box.add(x);
        tree.visit(box, [&](std::int32_t f) {
            const CurvePiece& piece = to.pieces[std::size_t(f)];
            const std::optional<double> t = foot(piece, x);
            CurvePlace q{f, 0};
            bool slides = false;
            const bool first = !to.closed && f == 0, last = !to.closed && f + 1 == pieces(to);
            if (t && *t >= -kBeyond && *t <= 1 + kBeyond) {
                q.t = std::clamp(*t, 0.0, 1.0);
                slides = true;
            } else if (first && (x - piece.x0).dot(piece.d0) < 0) { // a round end
                q.t = 0;
            } else if (last && (x - piece.x1).dot(piece.d1) > 0) {
                q.t = 1;
            } else {
                return;
            }
            const CurvePlace &pa = swapped ? q : p, &pb = swapped ? p : q;
            if (!may_touch(pa, pb)) return;
            const double crossing = all_angles ? 0 : beside_crossing(pa, pb);
            if (crossing == 1) return;
            if (same() && !all_angles && arc_at(a, pa) > arc_at(b, pb)) return; // seen from there
            if (!all_angles && spacing[std::size_t(p.piece)] * sine(slope, piece.slope(q.t)) >
                                   kAlong * (own.radius + piece.radius))
                return;
            add(pa, pb, id * kPlaces + bin(to, q) + (all_angles ? kEnds : 0), swapped && slides,
                !swapped && slides, crossing > 0 ? overlap_allowed(pa, pb, 1 - crossing) : 0);
        });
    }
};

BoxTree tree_of(const Curve& c, double more)
{
    std::vector<BoundingBox> boxes;
    for (const CurvePiece& p : c.pieces)
        boxes.push_back(curve_piece_box(p, p.radius + more));
    return BoxTree(boxes);
}

double thickest(const Curve& c)
{
    double r = 0;
    for (const CurvePiece& p : c.pieces)
        r = std::max(r, p.radius);
    return r;
}

/// Least distance of two segments [m].
double distance(const Vec3& a0, const Vec3& a1, const Vec3& b0, const Vec3& b1)
{
    const Vec3 u = a1 - a0, v = b1 - b0, w = a0 - b0;
    const double a = u.dot(u), b = u.dot(v), c = v.dot(v), d = u.dot(w), e = v.dot(w);
    const double det = a * c - b * b;
    double s = det > 1e-14 * a * c ? std::clamp((b * e - c * d) / det, 0.0, 1.0) : 0.5;
    const double t = std::clamp((b * s + e) / c, 0.0, 1.0);
    s = std::clamp((b * t - d) / a, 0.0, 1.0);
    return (w + s * u - t * v).norm();
}

} // namespace

Vec3 CurvePiece::at(double t) const
{
    const double u = t * t * (3 - 2 * t);
    return (1 - u) * x0 + u * x1 + t * (1 - t) * (1 - t) * d0 - t * t * (1 - t) * d1;
}

Vec3 CurvePiece::slope(double t) const
{
    const double u = 6 * t * (1 - t);
    return u * (x1 - x0) + (1 - t) * (1 - 3 * t) * d0 - t * (2 - 3 * t) * d1;
}

Vec3 CurvePiece::bend(double t) const
{
    return 6 * (1 - 2 * t) * (x1 - x0) + (6 * t - 4) * d0 + (6 * t - 2) * d1;
}

std::optional<double> foot(const CurvePiece& p, const Vec3& x)
{
    const Vec3 chord = p.x1 - p.x0;
    double t = std::clamp((x - p.x0).dot(chord) / chord.squaredNorm(), 0.0, 1.0);
    for (int i = 0; i < 20; ++i) {
        const Vec3 d = p.at(t) - x, s = p.slope(t);
        const double first = s.dot(d), full = s.squaredNorm() + p.bend(t).dot(d);
        const double second = full > 0.1 * s.squaredNorm() ? full : s.squaredNorm();
        const double step = std::clamp(-first / second, -0.5, 0.5);
        t += step;
        if (t < -0.2 || t > 1.2) return std::nullopt;
        if (std::abs(step) < 1e-14) break;
    }
    return t;
}

std::vector<CurvePlace> stations(const Curve& curve, double spacing)
{
    std::vector<CurvePlace> out;
    for (int e = 0; e < pieces(curve); ++e) {
        const double length = curve.start[std::size_t(e) + 1] - curve.start[std::size_t(e)];
        const int n = spacing > 0 ? std::max(1, int(std::ceil(length / spacing * (1 - 1e-9)))) : 1;
        for (int k = 0; k < n; ++k)
            out.push_back({e, double(k) / n});
    }
    if (!curve.closed) out.push_back({pieces(curve) - 1, 1});
    return out;
}

void touch_surface(const Curve& a, std::span<const CurvePlace> stations,
                   const std::function<WallSample(const Vec3&)>& surface, double reach,
                   std::span<const std::int64_t> known, std::vector<CurveContact>& out,
                   std::size_t first, std::vector<SeenDistance>* seen,
                   const std::function<double(const Vec3&)>& clearance)
{
    // ---- Distance and contact at a place
    struct Found {
        WallSample wall;
        double gap;
        Vec3 x;
        bool bound = false; // the gap is no less than this
    };
    const auto search_at = [&](const CurvePiece& piece, const Vec3& x) {
        Found f{surface(x), 0, x};
        f.gap = f.wall.distance - piece.radius;
        return f;
    };
    const auto search = [&](const CurvePlace& p) {
        const CurvePiece& piece = a.pieces[std::size_t(p.piece)];
        return search_at(piece, piece.at(p.t));
    };
    const auto add = [&](const CurvePlace& p, const Found& f, std::int64_t id, bool slides) {
        const CurvePiece& piece = a.pieces[std::size_t(p.piece)];
        CurveContact c;
        c.a = p;
        c.b.piece = -1;
        c.normal = f.wall.normal;
        c.gap = f.gap;
        c.point = piece.at(p.t) - (piece.radius + 0.5 * f.gap) * f.wall.normal;
        c.curvature = f.wall.hessian;
        c.id = id;
        c.slides_a = slides;
        out.push_back(c);
    };

    // ---- Stations
    std::vector<Found> found(stations.size() - first); // from `first` on
    const auto at = [&](std::size_t i) -> Found& { return found[i - first]; };
    if (seen) seen->resize(stations.size());
    const auto visit_place = [&](std::size_t i) {
        at(i) = search_at(a.pieces[std::size_t(stations[i].piece)], at(i).x);
        if (seen) (*seen)[i] = {at(i).x, at(i).wall.distance};
    };
    for (std::size_t i = first; i < stations.size(); ++i) {
        const CurvePiece& piece = a.pieces[std::size_t(stations[i].piece)];
        at(i).x = piece.at(stations[i].t);
        if (seen) {
            const SeenDistance& s = (*seen)[i];
            at(i).gap = s.distance - kSteepestWall * (at(i).x - s.at).norm() - piece.radius;
            at(i).bound = at(i).gap > reach;
        }
        if (!at(i).bound && clearance) {
            const double clear = clearance(at(i).x);
            at(i).gap = clear - piece.radius;
            at(i).bound = at(i).gap > reach;
            if (at(i).bound && seen) (*seen)[i] = {at(i).x, clear};
        }
        if (!at(i).bound) visit_place(i);
    }
    for (std::size_t i = first; i < stations.size(); ++i)
        if (at(i).gap <= reach) add(stations[i], at(i), std::int64_t(i), false);

    // ---- Places of least distance between stations
    // Between two stations: where the distance stops falling and begins to grow.
    const std::size_t between = a.closed ? stations.size() : stations.size() - 1; // of one: none
    for (std::size_t i = first; i < between; ++i) {
        const CurvePlace p = stations[i], next = stations[(i + 1) % stations.size()];
        const CurvePiece& piece = a.pieces[std::size_t(p.piece)];
        const double end = next.piece == p.piece && next.t > p.t ? next.t : 1;
        const Found &f0 = at(i), &f1 = at((i + 1) % stations.size());
        // The next station is at this piece's end, or elsewhere.
        const bool ends_there = next.piece == p.piece
                                    ? next.t == end
                                    : next.t == 0 && next.piece == (p.piece + 1) % pieces(a);
        const double length = ((ends_there ? f1.x : piece.at(end)) - f0.x).norm();
        const auto apart = [&] { return 0.5 * (f0.gap + f1.gap - 1.1 * length) > reach; };
        if (apart()) continue;
        if (f0.bound || f1.bound) {
            if (f0.bound) visit_place(i);
            if (f1.bound) visit_place((i + 1) % stations.size());
            if (apart()) continue;
        }
        const auto slope = [&](double t, Found& f) {
            f = search({p.piece, t});
            return f.wall.normal.dot(piece.slope(t));
        };
        constexpr int kParts = 6;
        Found f;
        double t0 = p.t, s0 = f0.wall.normal.dot(piece.slope(p.t));
        std::optional<CurvePlace> best;
        Found best_found;
        for (int k = 1; k <= kParts; ++k) {
            const double t1 = p.t + (end - p.t) * k / kParts;
            const double s1 =
                k == kParts && ends_there ? f1.wall.normal.dot(piece.slope(t1)) : slope(t1, f);
            if (s0 < 0 && s1 >= 0) {
                const double t = root(t0, s0, t1, s1, [&](double at) { return slope(at, f); });
                const Found here = search({p.piece, t});
                if (!best || here.gap < best_found.gap) {
                    best = CurvePlace{p.piece, t};
                    best_found = here;
                }
            }
            t0 = t1;
            s0 = s1;
        }
        if (!best || best_found.gap > reach) continue;
        const std::int64_t id = kBulges + std::int64_t(i);
        const bool known_before = std::binary_search(known.begin(), known.end(), id);
        // Of smooth walls the stations are enough, and their contacts do not wander.
        const Vec3 along = piece.slope(best->t);
        const double wall = along.dot(best_found.wall.hessian * along),
                     own = std::abs(best_found.wall.normal.dot(piece.bend(best->t)));
        // A contact that was found is kept if it is as closed as its neighbours, up to rounding.
        if (wall > (known_before ? 1 : kSharper) * own &&
            best_found.gap <
                std::min(f0.gap, f1.gap) + (known_before ? 1 : -1) * kBulge * piece.radius)
            add(*best, best_found, id, true);
    }
}

void touch_curve(const Curve& a, std::span<const CurvePlace> stations, const Curve& b, double reach,
                 std::vector<CurveContact>& out)
{
    const double r_a = thickest(a), r_b = thickest(b);
    Pair pair{a, b, reach, spacings(a, stations), out};
    const BoxTree tree = tree_of(b, r_a + reach);
    // Crossings.
    for (int e = 0; e < pieces(a); ++e) {
        const CurvePiece& p = a.pieces[std::size_t(e)];
        tree.visit(curve_piece_box(p, 0), [&](std::int32_t f) {
            if (pair.same() && f <= e) return;
            const CurvePiece& q = b.pieces[std::size_t(f)];
            const auto y = feet(p, q);
            if (!y) return;
            const CurvePlace one{e, (*y)[0]}, two{f, (*y)[1]};
            if (!pair.may_touch(one, two)) return;
            const std::int64_t id = kCrossings + bin(a, one) * kPlaces + bin(b, two);
            const double sideways = pair.spacing[std::size_t(e)] *
                                    sine(p.slope(one.t), q.slope(two.t)) / (p.radius + q.radius);
            const double share = std::min((sideways - kAlmost) / (kAcross - kAlmost), 1.0);
            if (share > 0) pair.cross(one, two, id, share);
        });
    }
    for (std::size_t i = 0; i < stations.size(); ++i)
        pair.add_point(stations[i], a, b, tree, false, false, std::int64_t(i));
    // Round ends against sides, at any angle.
    const auto ends = [&](const Curve& from, const Curve& to, const BoxTree& boxes, bool swapped) {
        if (from.closed) return;
        pair.add_point({0, 0}, from, to, boxes, swapped, true, swapped ? 2 : 0);
        pair.add_point({pieces(from) - 1, 1}, from, to, boxes, swapped, true, swapped ? 3 : 1);
    };
    ends(a, b, tree, false);
    if (!pair.same()) ends(b, a, tree_of(a, r_b + reach), true);
}

std::vector<std::int64_t> neighbours(std::int64_t id)
{
    std::vector<std::int64_t> ids{id - 1, id + 1}; // along b
    if (is_crossing(id))
        for (const std::int64_t a : {id - kPlaces, id + kPlaces})
            ids.insert(ids.end(), {a, a - 1, a + 1});
    return ids;
}

bool is_crossing(std::int64_t id)
{
    return id >= kCrossings && id < kEnds;
}

bool pass_through(const Curve& a_before, const Curve& a, const Curve& b_before, const Curve& b)
{
    const auto motion = [](const Curve& before, const Curve& now) {
        double most = 0;
        for (std::size_t e = 0; e < now.pieces.size(); ++e)
            most = std::max({most, (now.pieces[e].x0 - before.pieces[e].x0).norm(),
                             (now.pieces[e].x1 - before.pieces[e].x1).norm()});
        return most;
    };
    const bool same = &a == &b;
    const double way = motion(a_before, a) + motion(b_before, b);
    double least = std::numeric_limits<double>::infinity();
    for (const Curve* c : {&a, &b})
        for (const CurvePiece& p : c->pieces)
            least = std::min(least, p.radius);
    if (way <= least) return false; // surfaces that only touched still face each other
    std::vector<BoundingBox> boxes;
    for (std::size_t f = 0; f < b.pieces.size(); ++f) {
        BoundingBox box = curve_piece_box(b.pieces[f], b.pieces[f].radius);
        box.add(curve_piece_box(b_before.pieces[f], b.pieces[f].radius));
        boxes.push_back(box);
    }
    const BoxTree tree(boxes);
    bool passed = false;
    for (std::size_t e = 0; e < a.pieces.size() && !passed; ++e) {
        const CurvePiece &p0 = a_before.pieces[e], &p1 = a.pieces[e];
        BoundingBox box = curve_piece_box(p1, p1.radius);
        box.add(curve_piece_box(p0, p1.radius));
        tree.visit(box, [&](std::int32_t f) {
            if (passed || (same && f <= std::int32_t(e))) return;
            const CurvePiece &q0 = b_before.pieces[std::size_t(f)], &q1 = b.pieces[std::size_t(f)];
            const double r = p1.radius + q1.radius;
            if (same) {
                const double arcs =
                    arc_between(a, 0.5 * (a.start[e] + a.start[e + 1]),
                                0.5 * (a.start[std::size_t(f)] + a.start[std::size_t(f) + 1]));
                const double pieces_long =
                    0.5 * (a.start[e + 1] - a.start[e] + a.start[std::size_t(f) + 1] -
                           a.start[std::size_t(f)]);
                if (arcs - pieces_long <= kAway * 0.5 * r) return;
            }
            const double own = std::max((p1.x0 - p0.x0).norm(), (p1.x1 - p0.x1).norm()) +
                               std::max((q1.x0 - q0.x0).norm(), (q1.x1 - q0.x1).norm());
            const int parts = int(std::clamp(std::ceil(8 * own / r), 1.0, 1000.0));
            for (int k = 1; k < parts && !passed; ++k) {
                const double w = double(k) / parts;
                const auto between = [&](const Vec3& x, const Vec3& y) {
                    return Vec3((1 - w) * x + w * y);
                };
                passed = distance(between(p0.x0, p1.x0), between(p0.x1, p1.x1),
                                  between(q0.x0, q1.x0), between(q0.x1, q1.x1)) < 0.5 * r;
            }
        });
    }
    return passed;
}

} // namespace amontons
