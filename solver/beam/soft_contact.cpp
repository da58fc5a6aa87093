#include "solver/beam/soft_contact.hpp"

#include "mesh/base/dense.hpp"
#include "solver/beam/soft_tube.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace amontons {

// A soft wall's free space is { y + u(y) }, y in the undeformed one: the distance of x is that of
// y to first order, its gradient F^-T n with F = dx/dy.
WallSample sample_wall(const WireWall& wall, const Vec3& x, WallHint& hint, Candidate& c)
{
    if (!wall.soft) return wall.wall->sample(x, hint);
    const PulledBack back = wall.soft->pull_back(x, hint);
    WallSample sample = wall.wall->sample(back.y, hint);
    const Mat3 inverse = back.gradient.inverse();
    const Vec3 gradient = inverse.transpose() * sample.normal;
    const double size = gradient.norm();
    sample.normal = gradient / size;
    sample.slope *= size;
    const Mat3 across = Mat3::Identity() - sample.normal * sample.normal.transpose();
    sample.hessian = across * (inverse.transpose() * sample.hessian * inverse / size) * across;
    c.along = back.place.along;
    c.around = back.place.around;
    return sample;
}

namespace {

constexpr int kMostSweeps = 30;    // until forces and displacement of a soft wall agree
constexpr double kSettled = 1e-12; // of places, relative to the wall's radius; of forces
constexpr int kPatient = 6;        // sweeps that must have led somewhere
constexpr double kNowhere = 0.1;   // of what they disagree by then
constexpr double kAstray = 2;      // ... and after one: every further place costs columns
constexpr double kSlowSweep = 0.2; // of what they disagree by, left by a sweep

/// Geometry of one contact: what a wall's own motion changes in it.
struct Touch {
    Mat3 F = Mat3::Identity(), Fs = F; ///< dx/dy; the same for slip: less what moved before
    Mat3 turn = Mat3::Zero();          ///< of the normal for a motion in the undeformed wall
    Vec3 along = Vec3::Zero(), around = along; ///< gradients of the place's numbers
    Eigen::Matrix<double, 3, 6> tilt = Eigen::Matrix<double, 3, 6>::Zero(); ///< by slopes of u
};

Touch touch_of(const WireWall& wall, const Candidate& c, WallHint& hint)
{
    Touch t;
    if (!wall.soft) {
        t.turn = c.hessian;
        return t;
    }
    const PulledBack b = wall.soft->pull_back(c.x, hint);
    const WallSample s = wall.wall->sample(b.y, hint);
    const Mat3 back = b.gradient.inverse().transpose();
    const Vec3 m = back * (s.slope * s.normal);
    const Mat3 across = (Mat3::Identity() - c.n * c.n.transpose()) / m.norm() * back;
    t.F = b.gradient;
    t.along = b.along;
    t.around = b.around;
    const std::array<Vec3, 2> moved = wall.soft->since_start_slopes(b.place);
    t.Fs = t.F - moved[0] * b.along.transpose() - moved[1] * b.around.transpose();
    t.turn = across * (s.hessian - wall.soft->bend(b, m));
    t.tilt.leftCols<3>() = across * b.along * m.transpose();
    t.tilt.rightCols<3>() = across * b.around * m.transpose();
    return t;
}

Vec3 force_on_wire(const Candidate& c)
{
    return c.normal * c.n + c.tangential[0] * c.t1 + c.tangential[1] * c.t2;
}

using Matrix = Eigen::MatrixXd;

/// Y = S^-1 (X + C phi): motions in the undeformed walls by motions X of the points and changes
/// phi of the forces; normals turn by (turn + dipole) Y + tilt phi, forces with them by B.
struct Linear {
    std::vector<Touch> touch;
    Matrix C, S;
    Matrix turn;   ///< by the place: blocks of its own contact
    Matrix dipole; ///< by forces that move, through the wall's slopes
    Matrix tilt;   ///< by forces, through the wall's slopes
    Matrix B;      ///< blocks of its own contact
};

/// Rows of contacts, each multiplied by its own 3x3 block of a matrix.
Matrix blocks(const Matrix& diagonal, const Matrix& m)
{
    Matrix r(m.rows(), m.cols());
    for (Eigen::Index k = 0; k < m.rows(); k += 3)
        r.middleRows<3>(k) = diagonal.block<3, 3>(k, k) * m.middleRows<3>(k);
    return r;
}

Linear linearise(const std::vector<WireWall>& walls, const std::vector<const Candidate*>& contact,
                 std::vector<Proximity>& proximity)
{
    Linear l;
    const auto n = Eigen::Index(contact.size());
    for (const Candidate* c : contact)
        l.touch.push_back(
            touch_of(walls[std::size_t(c->wall)], *c, proximity[std::size_t(c->index)].hint));
    for (Matrix* m : {&l.C, &l.S, &l.turn, &l.dipole, &l.tilt, &l.B})
        *m = Matrix::Zero(3 * n, 3 * n);
    for (Eigen::Index k = 0; k < n; ++k) {
        const Candidate& c = *contact[std::size_t(k)];
        const Touch& t = l.touch[std::size_t(k)];
        const auto at = 3 * k;
        l.turn.block<3, 3>(at, at) = t.turn;
        l.S.block<3, 3>(at, at) = t.F;
        if (c.compliance > 0) l.C.block<3, 3>(at, at) = c.compliance * c.n * c.n.transpose();
        if (!(c.normal > 0)) continue;
        // The normal reaction turns with the normal, friction keeps in the wall.
        const Vec3 ft = c.tangential[0] * c.t1 + c.tangential[1] * c.t2;
        l.B.block<3, 3>(at, at) = c.normal * Mat3::Identity() - c.n * ft.transpose();
    }
    for (std::size_t w = 0; w < walls.size(); ++w) {
        if (!walls[w].soft) continue;
        std::vector<TubePlace> places;
        std::vector<Eigen::Index> at;
        for (Eigen::Index k = 0; k < n; ++k)
            if (const Candidate& c = *contact[std::size_t(k)]; c.wall == int(w)) {
                places.push_back(walls[w].soft->place(c.along, c.around));
                at.push_back(k);
            }
        if (at.empty()) continue;
        const Matrix all = walls[w].soft->compliance_with_slopes(places);
        for (std::size_t i = 0; i < at.size(); ++i)
            for (std::size_t j = 0; j < at.size(); ++j) {
                const auto block = all.block<9, 9>(9 * Eigen::Index(i), 9 * Eigen::Index(j));
                const auto to = 3 * at[i], from = 3 * at[j];
                const Touch &ti = l.touch[std::size_t(at[i])], &tj = l.touch[std::size_t(at[j])];
                const Candidate& c = *contact[std::size_t(at[j])];
                l.C.block<3, 3>(to, from) = block.topLeftCorner<3, 3>();
                l.tilt.block<3, 3>(to, from) = ti.tilt * block.bottomLeftCorner<6, 3>();
                if (!(c.normal > 0)) continue;
                const Vec3 f = force_on_wire(c);
                Eigen::Matrix<double, 9, 3> by = block.middleCols<3>(3) * f * tj.along.transpose();
                by += block.rightCols<3>() * f * tj.around.transpose();
                l.S.block<3, 3>(to, from) -= by.topRows<3>();
                l.dipole.block<3, 3>(to, from) = ti.tilt * by.bottomRows<6>();
            }
    }
    return l;
}

} // namespace

CompliantContacts linearise_walls(const std::vector<WireWall>& walls,
                                  const std::vector<Candidate>& candidates, std::vector<int> which,
                                  std::vector<Proximity>& proximity)
{
    CompliantContacts out;
    out.which = std::move(which);
    if (out.which.empty()) return out;
    const auto n = Eigen::Index(out.which.size());
    std::vector<const Candidate*> contact;
    for (const int k : out.which)
        contact.push_back(&candidates[std::size_t(k)]);
    const Linear l = linearise(walls, contact, proximity);
    Matrix E = Matrix::Zero(3 * n, 3 * n), rows = E;
    for (Eigen::Index k = 0; k < n; ++k) {
        const Candidate& c = *contact[std::size_t(k)];
        const Touch& t = l.touch[std::size_t(k)];
        const auto at = 3 * k;
        E.block<3, 3>(at, at) << c.n, c.t1, c.t2;
        rows.block<1, 3>(at, at) = c.n.transpose() * t.F;
        rows.block<1, 3>(at + 1, at) = c.t1.transpose() * t.Fs;
        rows.block<1, 3>(at + 2, at) = c.t2.transpose() * t.Fs;
    }
    const LuFactor lu(l.S);
    const Matrix SE = lu.solve_all(E), SC = lu.solve_all(l.C);
    const Matrix turn = blocks(l.B, l.turn + l.dipole);
    const LuFactor through(Matrix::Identity(3 * n, 3 * n) - turn * SC - blocks(l.B, l.tilt));
    const Matrix follow = through.solve_all(turn * SE), share = through.solve_all(E);
    const Matrix Et = E.transpose();
    out.follow = blocks(Et, follow);
    out.share = blocks(Et, share);
    out.motion = blocks(rows, SE + SC * follow);
    out.compliance = blocks(rows, SC * share);
    out.holds = lu.determinant() > 0 && through.determinant() > 0;
    return out;
}

// Plain sweeps, each with the places and normals of the one before, err less by the dents' slopes
// from one to the next. Where those are steep Newton's method takes over: forces and places change
// by phi and Y so that they agree with the moved wall,
//     Y = S^-1 (F D + C phi),      phi = df + B (turn (Y - D) + dipole Y + tilt phi),
// D and df what places and forces disagree by.
double settle_wall(const Wire& wire, const std::vector<WireWall>& walls, std::size_t w,
                   std::vector<Proximity>& proximity, double covered)
{
    SoftTube& tube = *walls[w].soft;
    const WireState& s = wire.state;
    if (tube.hyperelastic()) tube.take(s.wall[w]);
    std::vector<Candidate> carriers;
    std::vector<TubeForce> forces;

    // ---- Contact forces as they are known
    std::vector<Vec3> tangential, place; // as they are kept; in the undeformed wall
    double largest = 0;
    bool known = true;
    for (std::size_t p = 0; p < wire.material.point.size(); ++p) {
        const Reaction& r = s.reaction[p * walls.size() + w];
        if (!(r.normal > 0)) continue;
        const MaterialPoint& m = wire.material.point[p];
        const auto at = place_of(wire, s, m.s, m.element, m.xi);
        if (!at || m.s < covered) continue;
        Candidate& c = carriers.emplace_back();
        c.wall = int(w);
        c.index = int(p * walls.size() + w);
        c.x = centreline_point(s, *at);
        c.normal = r.normal;
        tangential.push_back(r.tangential);
        largest = std::max(largest, std::hypot(r.normal, r.tangential.norm()));
        known = known && r.touch.known;
        if (r.touch.known)
            forces.push_back({tube.place(r.touch.along, r.touch.around),
                              -(r.normal * r.touch.n + r.tangential)});
    }
    tube.set_forces(forces);
    if (carriers.empty()) return 0;
    const auto n = Eigen::Index(carriers.size());
    double change = 1, before = 1;

    // ---- Sweeps until places, normals and displacement agree
    for (int sweep = 0; sweep < kMostSweeps; ++sweep) {
        std::vector<TubeForce> now;
        change = known ? 0 : 1;
        Eigen::VectorXd D = Eigen::VectorXd::Zero(3 * n), df = D;
        for (std::size_t k = 0; k < carriers.size(); ++k) {
            Candidate& c = carriers[k];
            c.n = sample_wall(walls[w], c.x, proximity[std::size_t(c.index)].hint, c).normal;
            const Vec3 t = tangential[k] - c.n * c.n.dot(tangential[k]);
            const double size = t.norm();
            c.t1 = size > 0 ? Vec3(t / size) : Vec3(c.n.unitOrthogonal());
            c.t2 = c.n.cross(c.t1);
            c.tangential[0] = size;
            now.push_back({tube.place(c.along, c.around), -force_on_wire(c)});
            if (!known) continue;
            const double off[2] = {
                c.along - forces[k].place.along,
                std::remainder(c.around - forces[k].place.around, 2 * std::numbers::pi)};
            df.segment<3>(3 * Eigen::Index(k)) = forces[k].force - now[k].force;
            D.segment<3>(3 * Eigen::Index(k)) << off[0], off[1], 0;
            change = std::max({change, std::abs(off[0]) / tube.radius_scale(), std::abs(off[1]),
                               (now[k].force - forces[k].force).norm() / largest});
        }
        if (!std::isfinite(change)) return std::numeric_limits<double>::infinity();
        if ((sweep >= kPatient && change > kNowhere) || (sweep > 0 && change > kAstray))
            return std::numeric_limits<double>::infinity();
        if (known && change > kSettled && sweep > 0 && change > kSlowSweep * before) {
            std::vector<const Candidate*> contact;
            for (const Candidate& c : carriers)
                contact.push_back(&c);
            const Linear l = linearise(walls, contact, proximity);
            Eigen::VectorXd FD(3 * n);
            for (Eigen::Index k = 0; k < n; ++k) {
                // Out of the numbers of the place into space, along the wall.
                const Touch& t = l.touch[std::size_t(k)];
                Mat3 numbers;
                numbers << t.along, t.around, t.along.cross(t.around).normalized();
                const Vec3 d = solve_transposed(numbers, Vec3(D[3 * k], D[3 * k + 1], 0));
                D.segment<3>(3 * k) = d;
                FD.segment<3>(3 * k) = t.F * d;
            }
            const LuFactor lu(l.S);
            const Matrix SC = lu.solve_all(l.C), turn = blocks(l.B, l.turn + l.dipole);
            const Eigen::VectorXd Y0 = lu.solve(FD);
            const Eigen::VectorXd right = df + turn * Y0 - blocks(l.B, Matrix(l.turn)) * D;
            const Eigen::VectorXd phi =
                LuFactor(Matrix::Identity(3 * n, 3 * n) - turn * SC - blocks(l.B, l.tilt))
                    .solve(right);
            const Eigen::VectorXd Y = Y0 + SC * phi;
            for (std::size_t k = 0; k < carriers.size(); ++k) {
                const auto at = 3 * Eigen::Index(k);
                const Touch& t = l.touch[k];
                const Vec3 y = Y.segment<3>(at);
                now[k] = {tube.place(forces[k].place.along + t.along.dot(y),
                                     forces[k].place.around + t.around.dot(y)),
                          forces[k].force - phi.segment<3>(at)};
            }
        }
        before = change;
        known = true;
        forces = now;
        tube.set_forces(std::move(now));
        if (change <= kSettled) break;
    }
    return change > kSettled ? change * largest : 0;
}

Eigen::MatrixXd compliance_of_walls(const std::vector<WireWall>& walls,
                                    const std::vector<Candidate>& candidates)
{
    const auto n = Eigen::Index(candidates.size());
    Eigen::MatrixXd C = Eigen::MatrixXd::Zero(3 * n, 3 * n);
    for (std::size_t w = 0; w < walls.size(); ++w) {
        std::vector<TubePlace> places;
        std::vector<Eigen::Index> at;
        for (Eigen::Index k = 0; k < n; ++k) {
            const Candidate& c = candidates[std::size_t(k)];
            if (c.wall != int(w)) continue;
            C.block<3, 3>(3 * k, 3 * k) = c.compliance * c.n * c.n.transpose();
            if (!walls[w].soft) continue;
            places.push_back(walls[w].soft->place(c.along, c.around));
            at.push_back(k);
        }
        if (places.empty()) continue;
        const Eigen::MatrixXd part = walls[w].soft->compliance(places);
        for (std::size_t i = 0; i < at.size(); ++i)
            for (std::size_t j = 0; j < at.size(); ++j)
                C.block<3, 3>(3 * at[i], 3 * at[j]) =
                    part.block<3, 3>(3 * Eigen::Index(i), 3 * Eigen::Index(j));
    }
    return C;
}

} // namespace amontons
