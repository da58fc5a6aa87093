#pragma once

#include "haptics/loop/proxy_loop.hpp"
#include "haptics/tests/scenes.hpp"

#include <algorithm>
#include <stdexcept>

// Problems whose answers are known in closed form: for this room's tests and for `validate`.

namespace amontons::test {

/// Options of the loop for F03 and F06 of the benchmarks: solved to round-off.
template <class Real> ProxyOptions exact()
{
    ProxyOptions options;
    options.tolerance = sizeof(Real) == 8 ? 1e-13 : 1e-7;
    options.max_sweeps = 5000;
    return options;
}

/// One point held by a spring of k against planes through the origin.
template <class Real>
ReducedOperator<Real> planes(const std::vector<Vec3>& normals, double mu, double k)
{
    const auto n = static_cast<Eigen::Index>(normals.size());
    ReducedOperator<Real> op(static_cast<int>(n));
    Eigen::Matrix<double, Eigen::Dynamic, 6> J(3 * n, 6);
    for (Eigen::Index i = 0; i < n; ++i) {
        CandidateContact& c = op.contact[static_cast<std::size_t>(i)];
        c.id = i;
        c.frame = frame_of(normals[static_cast<std::size_t>(i)]);
        c.mu = mu;
        c.J = rigid_jacobian(c.frame, Vec3::Zero());
        J.middleRows<3>(3 * i) = c.J;
    }
    Eigen::MatrixXd W = Eigen::MatrixXd::Zero(3 * n, 3 * n);
    add_coupling(W, J, k, std::numeric_limits<double>::infinity());
    op.validity = 0.01;
    op.period = 0.02;
    if (!set_delassus(op, W)) throw std::logic_error("planes: no operator");
    return op;
}

inline HandPose at(const Vec3& position)
{
    return {position, Eigen::Quaterniond::Identity()};
}

/// The point of the wedge between two planes nearest to x, by trying plane, plane and edge.
inline Vec3 nearest(const Vec3& a, const Vec3& b, const Vec3& x)
{
    if (a.dot(x) >= 0 && b.dot(x) >= 0) return x;
    const Vec3 edge = a.cross(b).normalized();
    Vec3 best = edge.dot(x) * edge;
    for (const Vec3& n : {a, b}) {
        const Vec3 p = x - std::min(0.0, n.dot(x)) * n;
        const bool inside = a.dot(p) >= -1e-15 && b.dot(p) >= -1e-15;
        if (inside && (p - x).norm() < (best - x).norm()) best = p;
    }
    return best;
}

} // namespace amontons::test
