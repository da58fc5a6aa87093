#include "mesh/smooth_surface.hpp"

#include "mesh/base/index.hpp"
#include "mesh/closest_point.hpp"
#include "mesh/surface_edges.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>

namespace amontons {

namespace {

constexpr int kMostNewton = 10;
// Of a patch's parameters, before the last step, which squares it where it is Newton's.
constexpr double kPatchConverged = 3e-4, kDescended = 1e-7;
constexpr double kLongest = 0.5; // of a step, in them

SmoothSurface::Wide wide(const Vec3& x)
{
    return {x[0], x[1], x[2], 0};
}

double inner_product(const SmoothSurface::Wide& a, const SmoothSurface::Wide& b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// Weights of a point of edge k, at t from vertex k to vertex k + 1.
Vec3 on_edge(int k, double t)
{
    Vec3 w = Vec3::Zero();
    w[k] = 1 - t;
    w[(k + 1) % 3] = t;
    return w;
}

} // namespace

SmoothSurface::SmoothSurface(SurfaceMesh coarse, double crease)
    : coarse_{std::move(coarse)}
    , crease_{crease}
{
    auto& triangles = coarse_.triangles;
    const auto& points = coarse_.points;
    std::erase_if(triangles, [&](const auto& t) {
        return (points[at(t[1])] - points[at(t[0])])
                   .cross(points[at(t[2])] - points[at(t[0])])
                   .squaredNorm() == 0;
    });
    const std::size_t n = triangles.size();
    std::vector<Vec3> face(n);
    normals_.resize(n);
    neighbours_.assign(n, {-1, -1, -1});
    sharp_.assign(n, {0, 0, 0});
    for (std::size_t i = 0; i < n; ++i) {
        const auto& [a, b, c] = triangles[i];
        face[i] = (points[at(b)] - points[at(a)]).cross(points[at(c)] - points[at(a)]).normalized();
    }
    const auto edge_of = [&](const HalfEdge& h) {
        const auto& t = triangles[at(h.triangle)];
        return static_cast<std::size_t>(std::find(t.begin(), t.end(), h.begin) - t.begin());
    };
    const std::vector<HalfEdge> halves = sorted_half_edges(coarse_);
    for_each_edge(halves, [&](std::span<const HalfEdge> sides) {
        if (sides.size() != 2 || sides[0].begin == sides[1].begin) { // rim, or not a surface
            if (sides.size() > 2)
                for (const HalfEdge& h : sides)
                    sharp_[at(h.triangle)][edge_of(h)] = 1;
            return;
        }
        const std::int32_t i = sides[0].triangle, j = sides[1].triangle;
        neighbours_[at(i)][edge_of(sides[0])] = j;
        neighbours_[at(j)][edge_of(sides[1])] = i;
        if (face[at(i)].dot(face[at(j)]) < std::cos(crease))
            sharp_[at(i)][edge_of(sides[0])] = sharp_[at(j)][edge_of(sides[1])] = 1;
    });
    // The normal of a corner: faces around the vertex that are reached without crossing a
    // sharp edge, weighted by their angle there.
    const auto angle = [&](std::size_t i, std::size_t k) {
        const Vec3 &p = points[at(triangles[i][k])], &q = points[at(triangles[i][(k + 1) % 3])],
                   &r = points[at(triangles[i][(k + 2) % 3])];
        return std::atan2((q - p).cross(r - p).norm(), (q - p).dot(r - p));
    };
    for (std::size_t i = 0; i < n; ++i)
        for (std::size_t k = 0; k < 3; ++k) {
            const std::int32_t vertex = triangles[i][k];
            Vec3 sum = angle(i, k) * face[i];
            for (int way = 0; way < 2; ++way) {
                std::size_t t = i, corner = k;
                for (int guard = 0; guard < 1000; ++guard) {
                    const std::size_t edge = way == 0 ? corner : (corner + 2) % 3;
                    const std::int32_t next = neighbours_[t][edge];
                    if (next < 0 || sharp_[t][edge] || at(next) == i) break;
                    t = at(next);
                    corner = static_cast<std::size_t>(
                        std::find(triangles[t].begin(), triangles[t].end(), vertex) -
                        triangles[t].begin());
                    sum += angle(t, corner) * face[t];
                }
                // A closed fan was walked whole by the first way.
                if (way == 0 && neighbours_[t][corner] >= 0 && at(neighbours_[t][corner]) == i &&
                    !sharp_[t][corner])
                    break;
            }
            normals_[i][k] = sum.norm() > 0 ? sum.normalized() : face[i];
        }
}

SmoothSurface::Patch SmoothSurface::patch_(std::int32_t i) const
{
    const auto& t = coarse_.triangles[at(i)];
    const auto& n = normals_[at(i)];
    const auto& sharp = sharp_[at(i)];
    const Vec3 &a = coarse_.points[at(t[0])], &b = coarse_.points[at(t[1])],
               &c = coarse_.points[at(t[2])];
    // A third of the way along an edge, pulled into the tangent plane of its start.
    const auto third = [](const Vec3& p, const Vec3& q, const Vec3& normal, bool straight) {
        Vec3 x = (2 * p + q) / 3;
        if (!straight) x -= (q - p).dot(normal) / 3 * normal;
        return x;
    };
    const Vec3 b210 = third(a, b, n[0], sharp[0]), b120 = third(b, a, n[1], sharp[0]),
               b021 = third(b, c, n[1], sharp[1]), b012 = third(c, b, n[2], sharp[1]),
               b102 = third(c, a, n[2], sharp[2]), b201 = third(a, c, n[0], sharp[2]);
    const Vec3 mean = (b210 + b120 + b021 + b012 + b102 + b201) / 6,
               b111 = mean + (mean - (a + b + c) / 3) / 2;
    return {i,          wide(a),    wide(b),    wide(c),    wide(b210), wide(b120),
            wide(b021), wide(b012), wide(b102), wide(b201), wide(b111)};
}

SmoothSurface::Local SmoothSurface::local_(const Patch& p, double u, double v)
{
    // Weights (w, u, v) of the corners; de Casteljau once gives a quadratic's six points.
    const double w = 1 - u - v;
    const Wide q200 = w * p.b300 + u * p.b210 + v * p.b201,
               q020 = w * p.b120 + u * p.b030 + v * p.b021,
               q002 = w * p.b102 + u * p.b012 + v * p.b003,
               q110 = w * p.b210 + u * p.b120 + v * p.b111,
               q011 = w * p.b111 + u * p.b021 + v * p.b012,
               q101 = w * p.b201 + u * p.b111 + v * p.b102;
    const Wide r100 = w * q200 + u * q110 + v * q101, r010 = w * q110 + u * q020 + v * q011,
               r001 = w * q101 + u * q011 + v * q002;
    return {w * r100 + u * r010 + v * r001,
            3 * (r010 - r100),
            3 * (r001 - r100),
            6 * (q200 - 2 * q110 + q020),
            6 * (q200 - q110 - q101 + q011),
            6 * (q200 - 2 * q101 + q002)};
}

Vec3 SmoothSurface::point(std::int32_t patch, const Vec3& weights) const
{
    return local_(patch_(patch), weights[1], weights[2]).position();
}

// Newton inside a patch; false when it leaves it, with u, v then clamped to its border.
bool SmoothSurface::inside_(const Patch& p, const Vec3& x, double& u, double& v, Local& at) const
{
    const Wide to = wide(x);
    int outside = 0;
    for (int k = 0; k < kMostNewton; ++k) {
        at = local_(p, u, v);
        const Wide e = to - at.s;
        const double gu = inner_product(e, at.su), gv = inner_product(e, at.sv);
        const double guu = inner_product(at.su, at.su), gvv = inner_product(at.sv, at.sv),
                     guv = inner_product(at.su, at.sv);
        double huu = guu - inner_product(e, at.suu), hvv = gvv - inner_product(e, at.svv),
               huv = guv - inner_product(e, at.suv);
        double enough = kPatchConverged;
        if (!(huu > 0 && huu * hvv - huv * huv > 1e-3 * guu * gvv)) // not a minimum's: descend
            huu = guu, hvv = gvv, huv = guv, enough = kDescended;
        const double determinant = huu * hvv - huv * huv;
        if (!(determinant > 0)) return false;
        double du = (hvv * gu - huv * gv) / determinant, dv = (huu * gv - huv * gu) / determinant;
        const double size = std::max(std::abs(du), std::abs(dv));
        if (size > kLongest) {
            du *= kLongest / size;
            dv *= kLongest / size;
        }
        u += du;
        v += dv;
        if (u < 0 || v < 0 || u + v > 1) {
            u = std::clamp(u, 0.0, 1.0);
            v = std::clamp(v, 0.0, 1.0);
            if (u + v > 1) {
                const double over = u + v;
                u /= over;
                v /= over;
            }
            if (++outside > 2) return false;
        } else if (size <= enough) {
            at = local_(p, u, v);
            return true;
        }
    }
    return false;
}

// Newton along edge k of a patch from t in [0, 1]; returns the t of the nearest point.
double SmoothSurface::along_edge_(const Patch& p, const Vec3& x, int edge, double t, Local& at)
{
    const Vec3 turn = on_edge(edge, 1) - on_edge(edge, 0);
    for (int k = 0; k < kMostNewton; ++k) {
        const Vec3 w = on_edge(edge, t);
        at = local_(p, w[1], w[2]);
        const Wide e = wide(x) - at.s, d1 = turn[1] * at.su + turn[2] * at.sv;
        const Wide d2 = turn[1] * turn[1] * at.suu + 2 * turn[1] * turn[2] * at.suv +
                        turn[2] * turn[2] * at.svv;
        const double size2 = inner_product(d1, d1), h = size2 - inner_product(e, d2);
        const double step = inner_product(e, d1) / (h > 0.1 * size2 ? h : size2);
        const double next = std::clamp(t + std::clamp(step, -kLongest, kLongest), 0.0, 1.0);
        const double moved = std::abs(next - t);
        t = next;
        if (moved <= kDescended) break;
    }
    const Vec3 w = on_edge(edge, t);
    at = local_(p, w[1], w[2]);
    return t;
}

PatchPoint SmoothSurface::nearest(const Vec3& x, std::int32_t patch, const Vec3& weights,
                                  Patch& last) const
{
    if (last.number != patch) last = patch_(patch);
    const Patch& p = last;
    double u = weights[1], v = weights[2];
    Local at_point;
    PatchPoint found;
    if (inside_(p, x, u, v, at_point)) {
        found = {patch, {1 - u - v, u, v}, at_point.position(), at_point.across().normalized()};
        return found;
    }
    // It left over the edge whose opposite corner has the least weight.
    const Vec3 w{1 - u - v, u, v};
    Eigen::Index corner = 0;
    w.minCoeff(&corner);
    const int edge = static_cast<int>((corner + 1) % 3);
    const double t = along_edge_(p, x, edge, std::clamp(w[(edge + 1) % 3], 0.0, 1.0), at_point);
    Vec3 normal = at_point.across().normalized();
    found = {patch, on_edge(edge, t), at_point.position(), normal};
    const std::int32_t beside = neighbours_[at(patch)][static_cast<std::size_t>(edge)];
    if (beside >= 0) {
        const auto& other = coarse_.triangles[at(beside)];
        const std::int32_t end =
            coarse_.triangles[at(patch)][static_cast<std::size_t>((edge + 1) % 3)];
        const int mirrored =
            static_cast<int>(std::find(other.begin(), other.end(), end) - other.begin());
        const Vec3 start = on_edge(mirrored, 1 - t);
        const Patch q = patch_(beside);
        u = start[1];
        v = start[2];
        const Local border = local_(q, u, v);
        normal += border.across().normalized();
        found.normal = normal.normalized();
        if (inside_(q, x, u, v, at_point) &&
            (x - at_point.position()).squaredNorm() < (x - found.position).squaredNorm())
            found = {
                beside, {1 - u - v, u, v}, at_point.position(), at_point.across().normalized()};
    }
    return found;
}

// Triangles of a patch cut n times, row by row from corner 0: weights (n - r, r - c, c) / n.
SurfaceMesh SmoothSurface::refined(int n) const
{
    SurfaceMesh mesh;
    mesh.points = coarse_.points;
    std::map<std::pair<std::int32_t, std::int32_t>, std::int32_t> edges; // first of n - 1 points
    std::vector<std::int32_t> index(static_cast<std::size_t>((n + 1) * (n + 2) / 2));
    for (std::size_t i = 0; i < coarse_.triangles.size(); ++i) {
        const auto& t = coarse_.triangles[i];
        const Patch p = patch_(static_cast<std::int32_t>(i));
        const auto on_shared_edge = [&](std::size_t from, std::size_t to, int step, const Vec3& x) {
            const auto [a, b] = std::minmax(t[from], t[to]);
            const auto [slot, fresh] =
                edges.try_emplace({a, b}, static_cast<std::int32_t>(mesh.points.size()));
            if (fresh) mesh.points.resize(mesh.points.size() + at(n - 1));
            const std::int32_t id = slot->second + (t[from] == a ? step : n - step) - 1;
            mesh.points[at(id)] = x; // both patches give the same curve
            return id;
        };
        std::size_t next = 0;
        for (int r = 0; r <= n; ++r)
            for (int c = 0; c <= r; ++c) {
                const Vec3 x = local_(p, 1.0 * (r - c) / n, 1.0 * c / n).position();
                std::int32_t& id = index[next++];
                if (r == 0)
                    id = t[0];
                else if (r == n && c == 0)
                    id = t[1];
                else if (r == n && c == n)
                    id = t[2];
                else if (c == 0)
                    id = on_shared_edge(0, 1, r, x);
                else if (c == r)
                    id = on_shared_edge(0, 2, r, x);
                else if (r == n)
                    id = on_shared_edge(1, 2, c, x);
                else {
                    id = static_cast<std::int32_t>(mesh.points.size());
                    mesh.points.push_back(x);
                }
            }
        const auto node = [&](int r, int c) {
            return index[static_cast<std::size_t>(r * (r + 1) / 2 + c)];
        };
        for (int r = 0; r < n; ++r)
            for (int c = 0; c <= r; ++c) {
                mesh.triangles.push_back({node(r, c), node(r + 1, c), node(r + 1, c + 1)});
                if (c < r)
                    mesh.triangles.push_back({node(r, c), node(r + 1, c + 1), node(r, c + 1)});
            }
    }
    return mesh;
}

Vec3 SmoothSurface::weights_in_patch(std::int32_t k, int n, const Vec3& weights) const
{
    const int local = static_cast<int>(k % (n * n));
    const int r = static_cast<int>(std::sqrt(static_cast<double>(local))); // row r begins at r^2
    const int place = local - r * r, c = place / 2;
    const auto node = [&](int row, int column) -> Vec3 {
        return Vec3{1.0 * (n - row), 1.0 * (row - column), 1.0 * column} / n;
    };
    if (place % 2 == 0)
        return weights[0] * node(r, c) + weights[1] * node(r + 1, c) +
               weights[2] * node(r + 1, c + 1);
    return weights[0] * node(r, c) + weights[1] * node(r + 1, c + 1) + weights[2] * node(r, c + 1);
}

double SmoothSurface::deviation() const
{
    double worst = 0;
    for (std::size_t i = 0; i < coarse_.triangles.size(); ++i) {
        const auto& [a, b, c] = coarse_.triangles[i];
        const Patch p = patch_(static_cast<std::int32_t>(i));
        for (const auto& [u, v] :
             {std::pair{1.0 / 3, 1.0 / 3}, {0.5, 0.0}, {0.0, 0.5}, {0.5, 0.5}}) {
            const Vec3 x = local_(p, u, v).position();
            const TrianglePoint flat = closest_on_triangle(
                x, coarse_.points[at(a)], coarse_.points[at(b)], coarse_.points[at(c)]);
            worst = std::max(worst, (x - flat.point).norm());
        }
    }
    return worst;
}

} // namespace amontons
