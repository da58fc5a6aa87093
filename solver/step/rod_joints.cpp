#include "solver/step/rod_joints.hpp"

#include "mesh/base/dense.hpp"
#include "solver/body/drive.hpp"
#include "solver/body/rod_body.hpp"
#include "solver/step/body_contacts.hpp"
#include "solver/step/couplings.hpp"

#include <algorithm>

// A row's value is v(y), y the motion of its nodes: places in space, turns in the section's axes.
// With a force r along it the tangent has -r v'', in the same coordinates in which the elements'
// own tangents are symmetric: turns by the exponential of y. With l the arm of a place, u and w
// axes of the two sections, R what turns them into space:
//
//   d . (x + R l):        v'' of the turn = (F l^T + l F^T) / 2 - (F . l) I,   F = R^T d
//   (R_a u) . (R_b w):    the same with F = R_a^T R_b w, l = u on a, and the other way round on b;
//                         [u]^T R_a^T R_b [w] between the two
//   |x_a + R_a l_a - x_b - R_b l_b|:  besides, J^T (I - d d^T) J / length.

namespace amontons {
namespace {

Mat3 bend_of_arm(const Vec3& F, const Vec3& l)
{
    return 0.5 * (F * l.transpose() + l * F.transpose()) - F.dot(l) * Mat3::Identity();
}

const RodBody* rod_of(const std::vector<BodyRef>& bodies, const CoupledPlace& c)
{
    return c.body < 0 ? nullptr : bodies[std::size_t(c.body)].rod;
}

Mat12 second_derivative(const std::vector<BodyRef>& bodies, const Coupling& c,
                        const CouplingRow& row)
{
    Mat12 k = Mat12::Zero();
    const CoupledPlace* const place[2] = {&c.a, &c.b};
    const RodBody* const rod[2] = {rod_of(bodies, c.a), rod_of(bodies, c.b)};
    if (c.square) {
        // An axis of what is no rod stands still: in space it is what the row is made of.
        Vec3 axis[2] = {c.axis, c.axis_b}, in_space[2];
        Mat3 R[2] = {Mat3::Identity(), Mat3::Identity()};
        for (int i = 0; i < 2; ++i)
            if (rod[i]) R[i] = rod[i]->node_pose(place[i]->node).turn.toRotationMatrix();
        for (int i = 0; i < 2; ++i)
            in_space[i] = R[i] * axis[i];
        if (!rod[0] ||
            !rod[1]) { // direction = arm a x b, value = arm a . b, a and b of unit length
            const int own = rod[0] ? 0 : 1;
            const Vec3 mine = in_space[own];
            const Vec3 turned = row.direction / c.arm;
            const Vec3 other =
                (own == 0 ? turned.cross(mine) : mine.cross(turned)) + row.value / c.arm * mine;
            in_space[1 - own] = other;
        }
        for (int i = 0; i < 2; ++i)
            if (rod[i])
                k.block<3, 3>(6 * i + 3, 6 * i + 3) =
                    c.arm * bend_of_arm(R[i].transpose() * in_space[1 - i], axis[i]);
        if (rod[0] && rod[1]) {
            const Mat3 mixed = c.arm * (skew_matrix(axis[0]).transpose() * R[0].transpose() * R[1] *
                                        skew_matrix(axis[1]));
            k.block<3, 3>(3, 9) = mixed;
            k.block<3, 3>(9, 3) = mixed.transpose();
        }
        return k;
    }
    if (c.turns || c.slides) return k; // Newton's method is a little slower without
    Eigen::Matrix<double, 3, 12> J = Eigen::Matrix<double, 3, 12>::Zero();
    for (int i = 0; i < 2; ++i) {
        if (!rod[i]) continue;
        const double sign = i == 0 ? 1 : -1;
        const Mat3 R = rod[i]->node_pose(place[i]->node).turn.toRotationMatrix();
        const Vec3 l = place[i]->local;
        J.block<3, 3>(0, 6 * i) = sign * Mat3::Identity();
        J.block<3, 3>(0, 6 * i + 3) = -sign * (R * skew_matrix(l));
        k.block<3, 3>(6 * i + 3, 6 * i + 3) = sign * bend_of_arm(R.transpose() * row.direction, l);
    }
    if (c.along_line && row.length > 0)
        k += J.transpose() * (Mat3::Identity() - row.direction * row.direction.transpose()) * J /
             row.length;
    return k;
}

} // namespace

std::vector<RodJoint> rod_joints(const std::vector<BodyRef>& bodies,
                                 const std::vector<Coupling>& couplings,
                                 const std::vector<CouplingRow>& rows,
                                 const std::vector<double>& force)
{
    std::vector<RodJoint> joints;
    for (std::size_t k = 0; k < couplings.size(); ++k) {
        const Coupling& c = couplings[k];
        const CouplingRow& row = rows[k];
        RodJoint j;
        j.value = row.value;
        j.force = force[k];
        j.compliance = c.softness;
        const CoupledPlace* const place[2] = {&c.a, &c.b};
        const BodyPlace at[2] = {row.place_a(c), row.place_b(c)};
        for (std::size_t i = 0; i < 2; ++i) {
            const RodBody* const rod = rod_of(bodies, *place[i]);
            if (!rod) continue;
            j.on[i] = place[i]->body;
            j.node[i] = place[i]->node;
            const Vec12 own = rod->row(at[i], row.direction);
            j.row[i] =
                (i == 0 ? 1 : -1) * (place[i]->on_rod.weight < 0.5 ? own.head<6>() : own.tail<6>());
        }
        j.bend = second_derivative(bodies, c, row);
        joints.push_back(std::move(j));
    }
    return joints;
}

FreeMotion free_motion_of_rods(const std::vector<BodyRef>& bodies,
                               const std::vector<Coupling>& couplings)
{
    constexpr double kHeld = 1e-9; // of the firmest motion, of unit length
    std::vector<int> column(bodies.size(), -1);
    std::vector<int> moving; // bodies
    for (std::size_t b = 0; b < bodies.size(); ++b)
        if (bodies[b].rod && !bodies[b].rod->has_drag()) {
            column[b] = 6 * int(moving.size());
            moving.push_back(int(b));
        }
    if (moving.empty()) return {};
    const auto n = Eigen::Index(6 * moving.size());
    std::vector<Eigen::MatrixXd> rigid(bodies.size());
    Eigen::MatrixXd seen = Eigen::MatrixXd::Zero(n, n);
    for (const int b : moving) {
        rigid[std::size_t(b)] = bodies[std::size_t(b)].rod->rigid_motions();
        const int at = column[std::size_t(b)];
        seen.block<6, 6>(at, at) = bodies[std::size_t(b)].rod->held_rigid_motions();
    }
    for (const Coupling& c : couplings) {
        const CouplingRow row = coupling_row(bodies, c);
        Eigen::VectorXd v = Eigen::VectorXd::Zero(n);
        std::vector<Eigen::Triplet<double>> entries;
        const auto add = [&](const CoupledPlace& place, const BodyPlace& at, double sign) {
            if (place.body < 0 || column[std::size_t(place.body)] < 0) return;
            entries.clear();
            bodies[std::size_t(place.body)].body->add_column(at, row.direction, sign, 0, entries);
            const Eigen::MatrixXd& R = rigid[std::size_t(place.body)];
            for (const auto& e : entries)
                v.segment<6>(column[std::size_t(place.body)]) +=
                    e.value() * R.row(e.row()).transpose();
        };
        add(c.a, row.place_a(c), 1);
        add(c.b, row.place_b(c), -1);
        if (v.norm() > 0) seen += v * v.transpose();
    }
    const SymmetricEigen eigen = symmetric_eigen(seen);
    if (eigen.values[0] > kHeld * eigen.values[n - 1]) return {};
    const Eigen::VectorXd motion = eigen.vectors.col(0);
    FreeMotion out;
    double most = -1;
    for (const int b : moving) {
        const Eigen::VectorXd own = motion.segment<6>(column[std::size_t(b)]);
        if (own.norm() <= most * (1 + 1e-9)) continue;
        most = own.norm();
        out.body = b;
        out.motion = name_of_motion(own.head<3>(), own.tail<3>());
    }
    return out;
}

} // namespace amontons
