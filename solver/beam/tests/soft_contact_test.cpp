#include "solver/beam/soft_contact.hpp"

#include "solver/beam/clamp.hpp"
#include "solver/beam/tests/held_tube.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <doctest/doctest.h>

using namespace amontons;

namespace {

/// In two arcs of different planes.
SoftTube twice_bent_tube(double pressure)
{
    Centreline line(Vec3::Zero(), Vec3::UnitX(), Vec3::UnitY(), kTubeRadius);
    line.append_line(0.02, kTubeRadius);
    line.append_arc(0.04, 1, 0.3, kTubeRadius);
    line.append_arc(0.05, 0.6, 1.2, kTubeRadius);
    const SolidTubeOptions o{line, 0.0015, 14, 1, 20, ElementKind::H8};
    return held_tube(o, {0.4e6, 0.45, 0}, pressure);
}

/// Points that press on a soft wall, each by r along the normal and by ft in the wall; all in
/// balance with it.
struct Pressed {
    std::vector<Vec3> x, ft;
    std::vector<double> r;
};

struct Answer {
    std::vector<Candidate> contact;
    std::vector<Vec3> force, force_before,
        moved; ///< on the points; of the wall there by the forces
};

Answer settle(SoftTube& tube, const Pressed& p)
{
    Answer a;
    a.contact.resize(p.x.size());
    std::vector<TubeForce> forces;
    for (int sweep = 0; sweep < 80; ++sweep) {
        tube.set_forces(forces);
        a.force_before = a.force;
        forces.clear();
        a.force.clear();
        a.moved.clear();
        for (std::size_t k = 0; k < p.x.size(); ++k) {
            WallHint hint;
            const PulledBack b = tube.pull_back(p.x[k], hint);
            const WallSample s = tube.undeformed().sample(b.y, hint);
            const Vec3 m = b.gradient.inverse().transpose() * s.normal, n = m.normalized();
            const Vec3 f = p.r[k] * n + p.ft[k] - n * n.dot(p.ft[k]);
            forces.push_back({b.place, -f});
            a.force.push_back(f);
            a.moved.push_back(tube.since_start(b.place));
            Candidate& c = a.contact[k];
            c.index = int(k);
            c.x = p.x[k];
            c.along = b.place.along;
            c.around = b.place.around;
            c.n = n;
            const Vec3 t = p.ft[k] - n * n.dot(p.ft[k]);
            c.t1 = t.normalized();
            c.t2 = n.cross(c.t1);
            c.normal = p.r[k];
            c.tangential[0] = t.norm();
            c.gap = s.distance / m.norm();
            c.hessian = s.hessian;
        }
    }
    return a;
}

/// Three points beside one another and one elsewhere, on the displaced wall.
Pressed some_points(SoftTube& tube)
{
    const Centreline& line = tube.options().centreline;
    Pressed p;
    const double along[] = {0.030, 0.0325, 0.0345, 0.060}, around[] = {0.4, 0.45, 0.2, 2.0};
    for (int k = 0; k < 4; ++k) {
        const CurvePoint c = line.at(along[k]);
        const Vec3 u = c.tangent.unitOrthogonal();
        const Vec3 out = Eigen::AngleAxisd(around[k], c.tangent) * u;
        p.x.push_back(c.position + c.radius * out);
        p.ft.push_back(0.008 * c.tangent + 0.004 * c.tangent.cross(out));
        p.r.push_back(k == 1 ? 0.06 : 0.04);
    }
    for (int round = 0; round < 30; ++round) { // to where the wall is
        const Answer a = settle(tube, p);
        for (std::size_t k = 0; k < p.x.size(); ++k) {
            p.x[k] -= a.contact[k].gap * a.contact[k].n;
            p.ft[k] -= a.contact[k].n * a.contact[k].n.dot(p.ft[k]);
        }
    }
    return p;
}

} // namespace

TEST_CASE("slopes of the wall: gradient and second derivative are those of what is pulled back")
{
    SoftTube tube = twice_bent_tube(2000);
    const Pressed p = some_points(tube);
    settle(tube, p);
    const Vec3 m(0.3, -0.8, 0.5);
    const double h = 1e-6;
    double largest = 0;
    for (const Vec3& x : p.x) {
        WallHint hint;
        const PulledBack at = tube.pull_back(x, hint);
        largest = std::max(largest, (at.gradient - Mat3::Identity()).norm());
        Mat3 gradient, along, around, bend;
        for (int k = 0; k < 3; ++k) {
            const PulledBack r = tube.pull_back(x + h * Vec3::Unit(k), hint),
                             l = tube.pull_back(x - h * Vec3::Unit(k), hint);
            gradient.col(k) = (r.y - l.y) / (2 * h);
            along.col(k) = (r.along - l.along) / (2 * h);
            around.col(k) = (r.around - l.around) / (2 * h);
            bend.col(k) = (r.gradient - l.gradient).transpose() * m / (2 * h);
            CHECK((r.place.along - l.place.along) / (2 * h) ==
                  doctest::Approx(at.along.dot(gradient.col(k))).epsilon(1e-6).scale(1));
            CHECK((r.place.around - l.place.around) / (2 * h) ==
                  doctest::Approx(at.around.dot(gradient.col(k))).epsilon(1e-6).scale(100));
        }
        CHECK((gradient * at.gradient - Mat3::Identity()).norm() < 1e-7);
        // Derivatives by x, those of PulledBack are by y.
        CHECK((along * at.gradient - at.along_bend).norm() < 1e-5 * at.along_bend.norm() + 1e-6);
        CHECK((around * at.gradient - at.around_bend).norm() < 1e-5 * at.around_bend.norm());
        const Mat3 expected = tube.bend(at, m);
        CHECK((bend * at.gradient - expected).norm() < 1e-5 * expected.norm());
    }
    CHECK(largest > 0.05); // slopes that matter
}

TEST_CASE("contacts with a soft wall: the whole derivative is that of wall and points in balance")
{
    SoftTube tube = twice_bent_tube(2000);
    const Pressed p = some_points(tube);
    const Answer at = settle(tube, p);
    std::vector<WireWall> walls(1);
    walls[0].wall = &tube.undeformed();
    walls[0].soft = &tube;
    std::vector<Proximity> proximity(4);
    for (std::size_t k = 0; k < 4; ++k) {
        CAPTURE(at.moved[k].norm());
        CHECK((at.force[k] - at.force_before[k]).norm() < 1e-12);
    }
    const CompliantContacts g = linearise_walls(walls, at.contact, {0, 1, 2, 3}, proximity);
    CHECK(g.holds);
    Eigen::MatrixXd E = Eigen::MatrixXd::Zero(12, 12);
    for (int k = 0; k < 4; ++k)
        E.block<3, 3>(3 * k, 3 * k) << at.contact[k].n, at.contact[k].t1, at.contact[k].t2;
    const auto changes = [&](const Pressed& right, const Pressed& left, double h,
                             Eigen::VectorXd& force, Eigen::VectorXd& motion) {
        const Answer r = settle(tube, right), l = settle(tube, left);
        force.resize(12);
        motion.resize(12);
        for (std::size_t k = 0; k < 4; ++k) {
            force.segment<3>(3 * Eigen::Index(k)) = (r.force[k] - l.force[k]) / (2 * h);
            const Vec3 slip = (right.x[k] - r.moved[k] - left.x[k] + l.moved[k]) / (2 * h);
            motion.segment<3>(3 * Eigen::Index(k))
                << (r.contact[k].gap - l.contact[k].gap) / (2 * h),
                at.contact[k].t1.dot(slip), at.contact[k].t2.dot(slip);
        }
        force = (E.transpose() * force).eval();
    };
    Eigen::VectorXd force, motion;
    Eigen::MatrixXd follow(12, 12), move(12, 12);
    for (int j = 0; j < 12; ++j) {
        Pressed right = p, left = p;
        const double h = 1e-7;
        right.x[std::size_t(j / 3)] += h * E.block<3, 1>(3 * (j / 3), j);
        left.x[std::size_t(j / 3)] -= h * E.block<3, 1>(3 * (j / 3), j);
        changes(right, left, h, force, motion);
        follow.col(j) = force;
        move.col(j) = motion;
    }
    CHECK((follow - g.follow).norm() < 1e-5 * g.follow.norm());
    CHECK((move - g.motion).norm() < 1e-5 * g.motion.norm());
    for (int j = 0; j < 12; ++j) {
        Pressed right = p, left = p;
        const double h = 1e-5;
        const auto k = std::size_t(j / 3);
        if (j % 3 == 0)
            right.r[k] += h, left.r[k] -= h;
        else
            right.ft[k] += h * E.block<3, 1>(3 * (j / 3), j),
                left.ft[k] -= h * E.block<3, 1>(3 * (j / 3), j);
        changes(right, left, h, force, motion);
        CHECK((force - g.share.col(j)).norm() < 1e-5 * g.share.col(j).norm());
        CHECK((motion - g.compliance.col(j)).norm() < 1e-5 * g.compliance.col(j).norm());
    }
}

TEST_CASE(
    "without friction there is a potential: points held on a soft wall are on symmetric springs")
{
    SoftTube tube = twice_bent_tube(0);
    Pressed p = some_points(tube);
    for (Vec3& t : p.ft)
        t *= 1e-14; // for its direction
    for (int round = 0; round < 30; ++round) {
        const Answer a = settle(tube, p);
        for (std::size_t k = 0; k < p.x.size(); ++k)
            p.x[k] -= a.contact[k].gap * a.contact[k].n;
    }
    const Answer at = settle(tube, p);
    std::vector<WireWall> walls(1);
    walls[0].wall = &tube.undeformed();
    walls[0].soft = &tube;
    std::vector<Proximity> proximity(4);
    const CompliantContacts g = linearise_walls(walls, at.contact, {0, 1, 2, 3}, proximity);
    Eigen::MatrixXd share(12, 4), motion(4, 12), compliance(4, 4);
    for (int k = 0; k < 4; ++k) {
        share.col(k) = g.share.col(3 * k);
        motion.row(k) = g.motion.row(3 * k);
        for (int j = 0; j < 4; ++j)
            compliance(k, j) = g.compliance(3 * k, 3 * j);
    }
    const Eigen::MatrixXd springs = share * compliance.partialPivLu().solve(motion) - g.follow;
    CHECK((springs - springs.transpose()).norm() < 1e-9 * springs.norm());
}

TEST_CASE(
    "forces under which a soft wall has no equilibrium are reported without evaluations around it")
{
    SoftTube tube = twice_bent_tube(0);
    BeamSegment g;
    g.length = 0.02;
    g.radius = 4e-4;
    g.EI = {5.2e-4, 5.2e-4};
    g.GJ = {4e-4, 4e-4};
    g.EA = {5000, 5000};
    g.element = 2.5e-3;
    Wire wire;
    wire.material = make_material({g}, g.element);
    wire.state.reaction.assign(wire.material.point.size(), {});
    start_clamped(wire, Vec3(0, 0.006, 0), Mat3::Identity());
    std::vector<WireWall> walls(1);
    walls[0].wall = &tube.undeformed();
    walls[0].soft = &tube;
    walls[0].friction.assign(wire.material.point.size(), 0);
    std::vector<Proximity> near(wire.material.point.size());
    std::vector<Candidate> candidates;
    const StepStart start = mark_step_start(wire);
    for (std::size_t p = 4; p < wire.material.point.size(); p += 3)
        wire.state.reaction[p].normal = 1e3; // N, on a wall of 0.4 MPa
    CHECK(std::isinf(find_candidates(wire, walls, start, kTubeRadius, near, candidates)));
    CHECK(candidates.empty());
    CHECK(tube.columns_solved() < int(tube.inner_nodes().size()) / 3); // [regression] our own run

    for (Reaction& r : wire.state.reaction) // forces that it bears
        r.normal *= 1e-9;
    CHECK(find_candidates(wire, walls, start, kTubeRadius, near, candidates) < 1e-12);
    CHECK(candidates.size() == wire.material.point.size());
}
