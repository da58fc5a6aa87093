#include "solver/beam/wire_contact.hpp"

#include "solver/beam/plane_hold.hpp"
#include "solver/beam/soft_contact.hpp"
#include "solver/beam/soft_tube.hpp"
#include "solver/beam/tip_hold.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

namespace amontons {
namespace {

// Near a medial axis a sampled distance is flat: nothing touches there.
constexpr double kLeastSlope = 0.5;

void fill_rows(const Wire& wire, Candidate& c)
{
    const WireState& s = wire.state;
    const Eigen::Matrix<double, 3, 12> J = point_jacobian(wire, c.place);
    c.hn = contact_row(J.transpose() * c.n);
    // The surface point also moves with the section's spin: t.(spin x arm) = spin.(arm x t).
    const Vec3 arm = -c.radius * c.n;
    const std::size_t e = std::size_t(c.place.element);
    const Mat3 Ra = rotation_matrix(s.nodes[e].q), Rb = rotation_matrix(s.nodes[e + 1].q);
    const Vec3* t[2] = {&c.t1, &c.t2};
    for (int k = 0; k < 2; ++k) {
        Vec12 v = J.transpose() * *t[k];
        const Vec3 m = arm.cross(*t[k]);
        Vec3 ma = (1 - c.place.xi) * (Ra.transpose() * m);
        if (c.place.element == s.first) ma = wire.sheath ? Vec3(ma.x(), 0, 0) : Vec3::Zero();
        v.segment<3>(3) += ma;
        v.segment<3>(9) += c.place.xi * (Rb.transpose() * m);
        c.ht[k] = contact_row(v);
    }
}

} // namespace

std::array<ContactRow, 2> point_rows(const Wire& wire, const Candidate& c)
{
    const Eigen::Matrix<double, 3, 12> J = point_jacobian(wire, c.place);
    std::array<ContactRow, 2> rows{contact_row(J.transpose() * c.t1),
                                   contact_row(J.transpose() * c.t2)};
    if (wire.plane)
        for (ContactRow& row : rows)
            hold_in_plane(wire, c.place.element, row);
    if (wire.tip)
        for (ContactRow& row : rows)
            hold_tip(wire, c.place.element, row);
    return rows;
}

StepStart mark_step_start(const Wire& wire)
{
    StepStart start;
    start.point.reserve(wire.material.point.size());
    start.section.reserve(wire.material.point.size());
    for (const MaterialPoint& p : wire.material.point) {
        if (const auto place = place_of(wire, wire.state, p.s, p.element, p.xi)) {
            start.point.push_back(centreline_point(wire.state, *place));
            start.section.push_back(section_rotation(wire.state, *place));
        } else {
            start.point.push_back(held_point(wire, wire.state, p.s));
            start.section.push_back(held_rotation(wire, wire.state, p.s));
        }
    }
    return start;
}

namespace {

constexpr double kMovesMore = 1.5; // a wall elsewhere than where it is pressed, bound

/// Forces on the soft wall w by the reactions of a state, at the places where they were found last.
std::vector<TubeForce> forces_on(const Wire& wire, const std::vector<WireWall>& walls,
                                 std::size_t w)
{
    std::vector<TubeForce> forces;
    for (std::size_t i = w; i < wire.state.reaction.size(); i += walls.size()) {
        const Reaction& r = wire.state.reaction[i];
        if (r.normal > 0 && r.touch.known)
            forces.push_back({walls[w].soft->place(r.touch.along, r.touch.around),
                              -(r.normal * r.touch.n + r.tangential)});
    }
    return forces;
}

/// Around what the wall moves at most [m].
double reach_of(SoftTube& tube)
{
    double largest = 0;
    for (const TubeForce& f : tube.forces())
        largest = std::max(largest, tube.displacement(f.place).norm());
    return kMovesMore * largest + tube.loaded_displacement();
}

void find_candidates_once(const Wire& wire, const std::vector<WireWall>& walls,
                          const StepStart& start, double reach, std::vector<Proximity>& proximity,
                          std::vector<Candidate>& candidates, double covered)
{
    std::vector<double> moves;
    for (const WireWall& w : walls)
        moves.push_back(w.soft ? reach_of(*w.soft) : 0);
    const WireState& s = wire.state;
    const std::size_t nw = walls.size();

    // ---- Candidates of each contact point
    for (std::size_t p = 0; p < wire.material.point.size(); ++p) {
        const MaterialPoint& m = wire.material.point[p];
        const auto place = place_of(wire, s, m.s, m.element, m.xi);
        if (!place || m.s < covered) break;
        if (wire.tip && is_held(wire, place->element, place->xi)) continue;
        const Vec3 x = centreline_point(s, *place);
        for (std::size_t w = 0; w < nw; ++w) {
            const std::size_t index = p * nw + w;
            const Reaction& r = s.reaction[index];
            Proximity& near = proximity[index];
            // ---- Is it near? By the last evaluation, by a bound of the distance, by the distance
            const double need = m.radius + reach;
            if (near.distance >= 0 && r.normal == 0 &&
                near.distance - kSteepestWall * (x - near.at).norm() > need + moves[w])
                continue;
            if (!walls[w].soft && r.normal == 0) {
                const double clear = walls[w].wall->clearance(x, near.hint);
                if (clear > need) {
                    near.at = x;
                    near.distance = clear;
                    continue;
                }
            }
            if (walls[w].soft) {
                near.at = x;
                near.distance = std::max(walls[w].wall->distance(x, near.hint), 0.0);
                if (near.distance > need + moves[w] && r.normal == 0) continue;
            }
            Candidate c;
            const WallSample sample = sample_wall(walls[w], x, near.hint, c);
            if (!walls[w].soft) {
                near.at = x;
                near.distance = std::max(sample.distance, 0.0);
            }
            if (sample.distance > need && r.normal == 0) continue;

            // ---- Gap g = d(x) - r, on a foundation plus the compression of its springs
            c.point = int(p);
            c.wall = int(w);
            c.index = int(index);
            c.place = *place;
            c.x = x;
            c.n = sample.normal;
            c.hessian = sample.hessian;
            // Over the slope: it changes as the point moves along the normal, to first order.
            c.gap = (sample.distance - m.radius) / std::max(sample.slope, kLeastSlope);
            if (walls[w].foundation > 0) {
                c.compliance = 1 / (walls[w].foundation * m.spacing);
                c.gap += c.compliance * r.normal;
            }
            c.mu = walls[w].friction[p];
            c.radius = m.radius;
            c.stiffness = wire.material.stiffness[std::size_t(place->element)];
            c.normal = r.normal;
            c.sticks = r.sticks;
            // ---- Frame (n, t1 along the wire, t2) and slip u = x + a - (x0 + R0 R^T a), a = -r n
            const Quaternion section = section_rotation(s, *place);
            const Vec3 tangent = first_axis(section.q);
            Vec3 t = tangent - c.n * c.n.dot(tangent);
            if (t.norm() < 0.1) {
                const Vec3 other = rotation_matrix(section.q).col(1);
                t = other - c.n * c.n.dot(other);
            }
            c.t1 = t.normalized();
            c.t2 = c.n.cross(c.t1);
            if (c.mu > 0) {
                // Slip of the material point of the surface that is at the wall now.
                const Vec3 arm = -m.radius * c.n;
                const Vec3 before = rotation_matrix(start.section[p].q) *
                                    (rotation_matrix(section.q).transpose() * arm);
                Vec3 u = x - start.point[p] + arm - before;
                if (walls[w].soft)
                    u -= walls[w].soft->since_start(walls[w].soft->place(c.along, c.around));
                if (wire.plane) u -= *wire.plane * wire.plane->dot(u);
                c.slip[0] = u.dot(c.t1);
                c.slip[1] = u.dot(c.t2);
                c.tangential[0] = r.tangential.dot(c.t1);
                c.tangential[1] = r.tangential.dot(c.t2);
            }
            // ---- Rows, without what is held
            fill_rows(wire, c);
            if (wire.plane) hold_in_plane(wire, c);
            if (wire.tip)
                for (ContactRow* row : {&c.hn, &c.ht[0], &c.ht[1]})
                    hold_tip(wire, c.place.element, *row);
            candidates.push_back(c);
        }
    }
}

} // namespace

double find_candidates(const Wire& wire, const std::vector<WireWall>& walls, const StepStart& start,
                       double reach, std::vector<Proximity>& proximity,
                       std::vector<Candidate>& candidates, double covered)
{
    double unsettled = 0;
    for (std::size_t w = 0; w < walls.size(); ++w)
        if (walls[w].soft)
            unsettled = std::max(unsettled, settle_wall(wire, walls, w, proximity, covered));
    // Of a wall that has no shape under such forces nothing is near: every answer to where it is
    // would need columns of its compliance there.
    candidates.clear();
    if (std::isfinite(unsettled))
        find_candidates_once(wire, walls, start, reach, proximity, candidates, covered);
    return unsettled;
}

void mark_soft_walls(const Wire& wire, const std::vector<WireWall>& walls)
{
    for (std::size_t w = 0; w < walls.size(); ++w) {
        if (!walls[w].soft) continue;
        if (walls[w].soft->hyperelastic())
            walls[w].soft->set_start(*wire.state.wall[w]);
        else
            walls[w].soft->set_start(forces_on(wire, walls, w));
    }
}

bool any_soft(const std::vector<WireWall>& walls)
{
    return std::any_of(walls.begin(), walls.end(),
                       [](const WireWall& w) { return w.soft != nullptr; });
}

Vec3 pulled_back(const WireWall& wall, const Vec3& x, WallHint& hint)
{
    return wall.soft ? wall.soft->pull_back(x, hint).y : x;
}

double smallest_gap(const Wire& wire, const std::vector<WireWall>& walls,
                    std::vector<Proximity>& proximity, int* worst)
{
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t p = 0; p < wire.material.point.size(); ++p) {
        const MaterialPoint& m = wire.material.point[p];
        const auto place = place_of(wire, wire.state, m.s, m.element, m.xi);
        if (!place) break;
        const Vec3 x = centreline_point(wire.state, *place);
        for (std::size_t w = 0; w < walls.size(); ++w) {
            Proximity& near = proximity[p * walls.size() + w];
            if (near.distance - kSteepestWall * (x - near.at).norm() - m.radius > least) continue;
            const double gap = walls[w].wall->distance(x, near.hint) - m.radius;
            if (gap < least) {
                least = gap;
                if (worst) *worst = int(p * walls.size() + w);
            }
        }
    }
    return least;
}

// With f = r_n n + f_t at the point: d(r_n n) = r_n H dx; f_t turns with the normal,
// d(f_t) = -n (f_t . H dx); and the Hermite point's second derivative with the rotations.
void assemble_reactions(const Wire& wire, const std::vector<Candidate>& candidates,
                        BlockTridiagonal& K, std::vector<Node6>& g, bool follow_walls)
{
    for (const Candidate& c : candidates) {
        if (!(c.normal > 0)) continue;
        const int e = c.place.element;
        const std::size_t n = std::size_t(e);
        g[n].column -= splat6(c.normal) * c.hn.a.column +
                       splat6(c.tangential[0]) * c.ht[0].a.column +
                       splat6(c.tangential[1]) * c.ht[1].a.column;
        g[n + 1].column -= splat6(c.normal) * c.hn.b.column +
                           splat6(c.tangential[0]) * c.ht[0].b.column +
                           splat6(c.tangential[1]) * c.ht[1].b.column;

        const Vec3 ft = c.tangential[0] * c.t1 + c.tangential[1] * c.t2;
        const Vec3 f = c.normal * c.n + ft;
        const Mat3 M = c.normal * c.hessian - c.n * (ft.transpose() * c.hessian);
        const Eigen::Matrix<double, 3, 12> J = point_jacobian(wire, c.place);
        const Eigen::Matrix<double, 3, 12> MJ = M * J;
        for (int j = 0; follow_walls && j < 6; ++j) {
            const Vec3 left = MJ.col(j), right = MJ.col(j + 6);
            for (int i = 0; i < 6; ++i) {
                const Vec3 a = J.col(i), b = J.col(i + 6);
                K.diagonal(e)(i, j) -= a.dot(left);
                K.diagonal(e + 1)(i, j) -= b.dot(right);
                K.upper(e)(i, j) -= a.dot(right);
                K.lower(e)(i, j) -= b.dot(left);
            }
        }
        const Hermite h = hermite(c.place.xi, c.place.length);
        const Vec3 moment = (-c.radius * c.n).cross(ft);
        for (int side = 0; side < 2; ++side) {
            const int node = e + side;
            if (node == wire.state.first) continue;
            const Mat3 R = rotation_matrix(wire.state.nodes[std::size_t(node)].q);
            const Vec3 fb = R.transpose() * f;
            const double weight = side ? h.h3 : h.h2;
            const Vec3 mb = (side ? c.place.xi : 1 - c.place.xi) * (R.transpose() * moment);
            Mat3 k = 0.5 * skew_matrix(mb);
            k.row(0) += 0.5 * weight * fb.transpose();
            k.col(0) += 0.5 * weight * fb;
            k.diagonal().array() -= weight * fb.x();
            Block6& d = K.diagonal(node);
            for (int j = 0; j < 3; ++j)
                for (int i = 0; i < 3; ++i)
                    d(i + 3, j + 3) -= k(i, j);
        }
    }
}

} // namespace amontons
