#pragma once

#include "contact/solvers/solve.hpp"
#include "haptics/reduced_operator.hpp"

#include <cmath>
#include <limits>
#include <random>
#include <vector>

// Scenes in closed form, condensed by hand: for tests and benchmarks of this room.

namespace amontons::test {

constexpr double kPi = 3.14159265358979323846;

/// A frame with that normal.
inline Mat3 frame_of(const Vec3& normal)
{
    Mat3 F;
    F.col(0) = normal.normalized();
    F.col(1) = F.col(0).unitOrthogonal();
    F.col(2) = F.col(0).cross(F.col(1));
    return F;
}

/// A rigid tool, held by the device through a spring, over an elastic half-space (z < 0, or rigid).
/// Points of the tool touch the plane z = height(x, y) of its surface, taken as level at each
/// point.
struct Bed {
    std::vector<Vec3> points; ///< of the tool, in its own axes [m]
    double mu = 0.5;
    double k = 500; ///< spring between device and tool [N/m]
    double k_turn = std::numeric_limits<double>::infinity(); ///< [N m/rad]
    double shear = 0; ///< modulus of the half-space [Pa]; 0: rigid
    double poisson = 0.3;
    double patch = 1e-3;  ///< radius over which a contact presses [m]
    double period = 0.02; ///< [s]
    double margin = std::numeric_limits<double>::infinity(); ///< candidates: gap below [m]
};

/// Compliance of a half-space between two patches, (n, x, y) with n out of the body.
/// Source: Johnson, Contact Mechanics, 3.2 and 3.6 (Boussinesq, Cerruti); centre of a uniform
/// patch.
inline Mat3 half_space(const Bed& bed, double x, double y)
{
    const double nu = bed.poisson, r2 = x * x + y * y, r = std::sqrt(r2);
    Mat3 C = Mat3::Zero();
    if (bed.shear == 0) return C;
    if (r < bed.patch / 2) {
        C.diagonal() << 1 - nu, 1 - nu / 2, 1 - nu / 2;
        return C / (kPi * bed.shear * bed.patch);
    }
    const double skew = (1 - 2 * nu) / 2;
    C << 1 - nu, skew * x / r, skew * y / r,                      //
        -skew * x / r, 1 - nu + nu * x * x / r2, nu * x * y / r2, //
        -skew * y / r, nu * x * y / r2, 1 - nu + nu * y * y / r2;
    return C / (2 * kPi * bed.shear * r);
}

/// The operator of a bed at a pose. The slip of each contact is measured from here.
/// @param r  reactions by point, world axes [N], as warm start; or empty
template <class Real>
void publish(ReducedOperator<Real>& op, const Bed& bed, const HandPose& pose, double time,
             std::uint64_t sequence, const std::vector<Vec3>& r = {})
{
    const Mat3 frame = frame_of(Vec3::UnitZ());
    const Mat3 R = pose.rotation.toRotationMatrix();
    std::vector<Vec3> at;
    std::size_t n = 0;
    for (std::size_t i = 0; i < bed.points.size(); ++i) {
        const Vec3 arm = R * bed.points[i], x = pose.position + arm;
        if (x[2] > bed.margin || static_cast<int>(n) == op.capacity) continue;
        CandidateContact& c = op.contact[n++];
        c = {};
        c.id = static_cast<std::int64_t>(i);
        c.frame = frame;
        c.mu = bed.mu;
        c.q = {x[2], 0, 0};
        c.rigid = true;
        c.arm = arm;
        c.J = rigid_jacobian(frame, arm);
        if (!r.empty()) c.r = frame.transpose() * r[i];
        at.push_back(x);
    }
    const auto rows = static_cast<Eigen::Index>(3 * n);
    Eigen::MatrixXd W = Eigen::MatrixXd::Zero(rows, rows);
    Eigen::Matrix<double, Eigen::Dynamic, 6> J(rows, 6);
    Mat3 axes; // of half_space in the world
    axes << Vec3::UnitZ(), Vec3::UnitX(), Vec3::UnitY();
    for (std::size_t i = 0; i < n; ++i) {
        const auto a = static_cast<Eigen::Index>(3 * i);
        J.middleRows<3>(a) = op.contact[i].J;
        for (std::size_t j = 0; j < n; ++j) {
            const Vec3 d = at[i] - at[j];
            const Mat3 C = axes * half_space(bed, d[0], d[1]) * axes.transpose();
            W.block<3, 3>(a, static_cast<Eigen::Index>(3 * j)) = frame.transpose() * C * frame;
        }
    }
    add_coupling(W, J, bed.k, bed.k_turn);
    op.handle = pose;
    op.period = bed.period;
    op.time = time;
    op.sequence = sequence;
    op.validity = 0;
    set_delassus(op, W);
}

/// The slow simulation of a bed: it stores where each point sticks.
struct BedSimulation {
    Bed bed;
    std::vector<Vec3> anchor; ///< by point [m]
    std::vector<bool> closed;
    double solve_tolerance = 1e-10;

    explicit BedSimulation(Bed b)
        : bed(std::move(b))
        , anchor(bed.points.size(), Vec3::Zero())
        , closed(bed.points.size())
    {
    }

    /// A step to this pose, solved by `contact`; then q_t counts from where the points are now.
    template <class Real>
    void step(ReducedOperator<Real>& op, const HandPose& pose, double time, std::uint64_t sequence)
    {
        publish(op, bed, pose, time, sequence);
        ContactProblem problem = contact_problem(op);
        for (int k = 0; k < op.contacts; ++k) {
            const CandidateContact& c = op.contact[static_cast<std::size_t>(k)];
            const auto i = static_cast<std::size_t>(c.id);
            if (!closed[i]) anchor[i] = pose.position + c.arm;
            problem.q.segment<2>(3 * k + 1) =
                c.frame.rightCols<2>().transpose() * (pose.position + c.arm - anchor[i]);
        }
        SolverOptions options;
        options.tolerance = solve_tolerance;
        const ContactSolution solution = solve(problem, options);
        closed.assign(closed.size(), false);
        for (int k = 0; k < op.contacts; ++k) {
            CandidateContact& c = op.contact[static_cast<std::size_t>(k)];
            const auto i = static_cast<std::size_t>(c.id);
            c.r = solution.reaction.segment<3>(3 * k);
            if (c.r.isZero(0)) continue;
            closed[i] = true;
            c.q.tail<2>() = problem.q.segment<2>(3 * k + 1);
            if (c.r.tail<2>().norm() < (1 - 1e-6) * c.mu * c.r[0]) continue;
            const Eigen::Vector2d slip = solution.u.segment<2>(3 * k + 1);
            anchor[i] += c.frame.rightCols<2>() * slip;
            c.q.tail<2>() -= slip;
        }
    }
};

/// A flat tool with n points in a grid of that pitch.
inline std::vector<Vec3> grid(int n, double pitch)
{
    const int side = static_cast<int>(std::ceil(std::sqrt(n)));
    std::vector<Vec3> points;
    for (int i = 0; i < n; ++i)
        points.emplace_back(pitch * (i % side - (side - 1) / 2.0),
                            pitch * (i / side - (side - 1) / 2.0), 0);
    return points;
}

} // namespace amontons::test
