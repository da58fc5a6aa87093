#include "solver/solid/patch.hpp"

#include "mesh/closest_point.hpp"
#include "solver/solid/corotational.hpp"
#include "solver/solid/face_load.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

// Traction a + b x (X - c) on the nodes by their shape functions N_i: with the means
//   w_i = mean of N_i,   m_i = mean of N_i (X - c),   sum w_i = 1, sum m_i = 0,
// a force F and a moment M at c are the nodes' forces
//   f_i = w_i F + (K M) x m_i,   K = (tr S - S)^-1,   S = sum X_i m_i^T = mean of (X - c)(X - c)^T,
// and the motion that works with them is shift = sum w_i u_i, turn = K sum m_i x u_i. Where the
// patch has turned by R the arms R m_i take the place of m_i, and sum x_i (R m_i)^T that of S.

namespace amontons {
namespace {

using RefTriangle = std::array<Vec3, 3>; // places on a reference face

/// Integrals over parts of faces, from which a patch is made.
struct PatchSum {
    struct OfNode {
        double weight = 0;
        Vec3 arm = Vec3::Zero();
    };
    std::map<std::int32_t, OfNode> nodes;
    Vec3 origin = Vec3::Zero(); // near the patch: arms are about it until the centre is known
    Vec3 first = Vec3::Zero();
    double area = 0;

    void add(std::span<const std::int32_t> on, const FacePoint& p)
    {
        const double size = p.area.norm();
        const Vec3 arm = p.place - origin;
        area += size;
        first += size * arm;
        for (std::size_t k = 0; k < on.size(); ++k) {
            OfNode& n = nodes[on[k]];
            n.weight += size * p.values[Eigen::Index(k)];
            n.arm += size * p.values[Eigen::Index(k)] * arm;
        }
    }
};

Patch made(const PatchSum& sum)
{
    Patch patch;
    patch.area = sum.area;
    if (!(sum.area > 0)) return patch;
    const Vec3 middle = sum.first / sum.area; // from the origin
    patch.centre = sum.origin + middle;
    for (const auto& [node, n] : sum.nodes) {
        const Vec3 arm = (n.arm - n.weight * middle) / sum.area;
        patch.nodes.push_back({node, n.weight / sum.area, arm});
    }
    return patch;
}

FaceForces places_on(const VolumeMesh& mesh, const FaceNodes& face)
{
    FaceForces X(3, face.count);
    for (int k = 0; k < face.count; ++k)
        X.col(k) = mesh.nodes[std::size_t(face.node[std::size_t(k)])];
    return X;
}

void add_face(const FaceNodes& face, const FaceForces& X, PatchSum& sum)
{
    for (const QuadraturePoint& p : face.count == 4 ? square_points(3) : triangle_points(5))
        sum.add(face.nodes(), face_point(X, p));
}

void add_triangle(const FaceNodes& face, const FaceForces& X, const RefTriangle& t, PatchSum& sum)
{
    const Vec3 a = t[1] - t[0], b = t[2] - t[0];
    const double twice = std::abs(a.x() * b.y() - a.y() * b.x());
    if (!(twice > 0)) return;
    for (const QuadraturePoint& p : triangle_points(5))
        sum.add(face.nodes(),
                face_point(X, {t[0] + p.xi.x() * a + p.xi.y() * b, p.weight * twice}));
}

/// The part of a face in a ball.
class BallOnFace {
public:
    BallOnFace(const FaceNodes& face, const FaceForces& X, const Vec3& at, double radius,
               PatchSum& sum)
        : face_(face)
        , X_(X)
        , at_(at)
        , radius_(radius)
        , sum_(sum)
    {
    }
    void add(const RefTriangle& t, int depth)
    {
        constexpr int kDeepest = 14;
        constexpr double kFine = 1.0 / 24; // of the radius: chords miss 1/12 of its square there
        const std::array<Vec3, 3> x{place(t[0]), place(t[1]), place(t[2])};
        int inside = 0;
        double size = 0, nearest = std::numeric_limits<double>::infinity();
        for (std::size_t k = 0; k < 3; ++k) {
            inside += (x[k] - at_).norm() <= radius_;
            size = std::max(size, (x[k] - x[(k + 1) % 3]).norm());
        }
        nearest = (closest_on_triangle(at_, x[0], x[1], x[2]).point - at_).norm();
        const bool flat = face_.count == 3 || depth > 2;
        if (flat && nearest > radius_) return;
        if (flat && inside == 3) return add_triangle(face_, X_, t, sum_);
        if (size > kFine * radius_ && depth < kDeepest) {
            const Vec3 a = 0.5 * (t[0] + t[1]), b = 0.5 * (t[1] + t[2]), c = 0.5 * (t[2] + t[0]);
            add({t[0], a, c}, depth + 1);
            add({a, t[1], b}, depth + 1);
            add({c, b, t[2]}, depth + 1);
            add({b, c, a}, depth + 1);
            return;
        }
        cut(t, x);
    }

private:
    Vec3 place(const Vec3& xi) const { return X_ * face_shape_values(face_.count, xi); }

    /// Chords between where the edges of a small triangle leave the ball.
    void cut(const RefTriangle& t, const std::array<Vec3, 3>& x)
    {
        std::array<Vec3, 6> part; // in order around the triangle
        int count = 0;
        for (std::size_t k = 0; k < 3; ++k) {
            const std::size_t n = (k + 1) % 3;
            const bool in = (x[k] - at_).norm() <= radius_, next = (x[n] - at_).norm() <= radius_;
            if (in) part[std::size_t(count++)] = t[k];
            if (in == next) continue;
            // |x + s d - at|^2 = r^2, the root in [0, 1].
            const Vec3 d = x[n] - x[k], from = x[k] - at_;
            const double a = d.squaredNorm(), b = from.dot(d),
                         c = from.squaredNorm() - radius_ * radius_;
            const double root = std::sqrt(std::max(0.0, b * b - a * c));
            const double s = std::clamp((in ? -b + root : -b - root) / a, 0.0, 1.0);
            part[std::size_t(count++)] = t[k] + s * (t[n] - t[k]);
        }
        for (int k = 2; k < count; ++k)
            add_triangle(face_, X_, {part[0], part[std::size_t(k) - 1], part[std::size_t(k)]},
                         sum_);
    }

    const FaceNodes& face_;
    const FaceForces& X_;
    const Vec3& at_;
    double radius_;
    PatchSum& sum_;
};

/// Distance from a face, by flat triangles of its corners.
double distance_to(const FaceNodes& face, const FaceForces& X, const Vec3& at)
{
    double least = std::numeric_limits<double>::infinity();
    const auto examine = [&](const Vec3& a, const Vec3& b, const Vec3& c) {
        least = std::min(least, (closest_on_triangle(at, a, b, c).point - at).norm());
    };
    if (face.corners == 3) {
        examine(X.col(0), X.col(1), X.col(2));
        return least;
    }
    const Vec3 middle = 0.25 * (X.col(0) + X.col(1) + X.col(2) + X.col(3));
    for (int k = 0; k < 4; ++k)
        examine(middle, X.col(k), X.col((k + 1) % 4));
    return least;
}

/// The inverse of v -> sum (turn arm) x (v x x): tr V - V^T with V = sum x (turn arm)^T.
Mat3 gain_of(const Mat3& moment, const Mat3& turn)
{
    const Mat3 V = moment * turn.transpose();
    return Mat3(V.trace() * Mat3::Identity() - V.transpose()).inverse();
}

/// Mean place, and the sum of (place - centre) arm^T; the arms sum to 0.
void find_means(const Patch& patch, std::span<const Vec3> places, PatchPose& pose)
{
    pose.patch = &patch;
    pose.centre.setZero();
    for (const PatchNode& n : patch.nodes)
        pose.centre += n.weight * places[std::size_t(n.node)];
    for (const PatchNode& n : patch.nodes)
        pose.moment += (places[std::size_t(n.node)] - pose.centre) * n.arm.transpose();
}

} // namespace

Patch patch_of_faces(const VolumeMesh& mesh, std::span<const FaceRef> faces)
{
    PatchSum sum;
    for (const FaceRef& f : faces) {
        const FaceNodes face = face_nodes(mesh, f);
        const FaceForces X = places_on(mesh, face);
        if (sum.nodes.empty()) sum.origin = X.col(0);
        add_face(face, X, sum);
    }
    return made(sum);
}

Patch patch_within(const VolumeMesh& mesh, const ExternalSurface& outside, const Vec3& at,
                   double radius)
{
    constexpr double kAsNear = 1e-9; // of the radius
    std::vector<std::int32_t> candidates;
    std::vector<double> away;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < outside.faces.size(); ++i) {
        const FaceNodes face = face_nodes(mesh, outside.faces[i]);
        const FaceForces X = places_on(mesh, face);
        const double size = (X.colwise() - X.col(0)).colwise().norm().maxCoeff();
        if ((X.col(0) - at).norm() > radius + 2 * size) continue;
        candidates.push_back(std::int32_t(i));
        away.push_back(distance_to(face, X, at));
        least = std::min(least, away.back());
    }
    // Connected through edges that the ball touches, with the part that is nearest.
    std::map<std::array<std::int32_t, 2>, std::vector<std::size_t>> at_edge;
    const auto edges_of = [&](std::size_t k, auto visit) {
        const FaceNodes face = face_nodes(mesh, outside.faces[std::size_t(candidates[k])]);
        for (int e = 0; e < face.corners; ++e) {
            const std::int32_t a = face.node[std::size_t(e)],
                               b = face.node[std::size_t((e + 1) % face.corners)];
            const Vec3 &p = mesh.nodes[std::size_t(a)], &q = mesh.nodes[std::size_t(b)];
            if ((closest_on_triangle(at, p, q, q).point - at).norm() <= radius)
                visit(std::array<std::int32_t, 2>{std::min(a, b), std::max(a, b)});
        }
    };
    for (std::size_t k = 0; k < candidates.size(); ++k)
        edges_of(k, [&](const auto& edge) { at_edge[edge].push_back(k); });
    std::vector<char> chosen(candidates.size(), 0);
    std::vector<std::size_t> next;
    for (std::size_t k = 0; k < candidates.size(); ++k)
        if (away[k] <= std::min(radius, least + kAsNear * radius)) {
            chosen[k] = 1;
            next.push_back(k);
        }
    while (!next.empty()) {
        const std::size_t k = next.back();
        next.pop_back();
        edges_of(k, [&](const auto& edge) {
            for (const std::size_t other : at_edge[edge])
                if (!chosen[other]) {
                    chosen[other] = 1;
                    next.push_back(other);
                }
        });
    }
    PatchSum sum;
    sum.origin = at;
    for (std::size_t k = 0; k < candidates.size(); ++k) {
        if (!chosen[k]) continue;
        const FaceNodes face = face_nodes(mesh, outside.faces[std::size_t(candidates[k])]);
        const FaceForces X = places_on(mesh, face);
        // Quadratic faces may bulge out of the ball between their nodes.
        const bool within = (X.colwise() - at).colwise().norm().maxCoeff() <= radius;
        if (within && face.count != 6) {
            add_face(face, X, sum);
            continue;
        }
        BallOnFace part(face, X, at, radius, sum);
        if (face.corners == 3) {
            part.add({Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0)}, 0);
            continue;
        }
        const std::array<Vec3, 4> corner{Vec3(-1, -1, 0), Vec3(1, -1, 0), Vec3(1, 1, 0),
                                         Vec3(-1, 1, 0)};
        for (std::size_t c = 0; c < 4; ++c)
            part.add({Vec3::Zero(), corner[c], corner[(c + 1) % 4]}, 0);
    }
    return made(sum);
}

double distance_to_faces(const VolumeMesh& mesh, std::span<const FaceRef> faces, const Vec3& at)
{
    double least = std::numeric_limits<double>::infinity();
    for (const FaceRef& f : faces) {
        const FaceNodes face = face_nodes(mesh, f);
        least = std::min(least, distance_to(face, places_on(mesh, face), at));
    }
    return least;
}

PatchPose patch_pose(const Patch& patch, std::span<const Vec3> places)
{
    PatchPose pose;
    find_means(patch, places, pose);
    pose.turn = polar_rotation(pose.moment); // R^T sum x arm^T is symmetric
    pose.gain = gain_of(pose.moment, pose.turn);
    return pose;
}

PatchPose pose_between(const PatchPose& start, const PatchPose& end)
{
    PatchPose pose = end;
    pose.centre = 0.5 * (start.centre + end.centre);
    // sum R arm x x = 0 at both ends: with R' - R = w x (R + R') / 2 their difference is
    //   sum Rm arm x (x' - x) = (tr V - V^T) w,  V = sum xm (Rm arm)^T.
    pose.turn = 0.5 * (start.turn + end.turn);
    pose.moment = 0.5 * (start.moment + end.moment);
    pose.gain = gain_of(pose.moment, pose.turn);
    return pose;
}

} // namespace amontons
