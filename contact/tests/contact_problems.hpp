#pragma once

#include "contact/problem.hpp"

#include <cmath>
#include <random>
#include <vector>

// Small problems with a known answer, for the tests of this room.

namespace amontons::test {

constexpr double kGravity = 9.81; // [m/s^2]

/// Point masses stacked on an incline: contact i is below block i. u are accelerations [m/s^2],
/// W holds inverse masses [1/kg]; free, all blocks fall alike, so only the lowest gap closes.
inline ContactProblem tower(const std::vector<double>& mass, double slope, double mu)
{
    const auto n = static_cast<Eigen::Index>(mass.size());
    ContactProblem p;
    p.W.dense().setZero(3 * n, 3 * n);
    p.q.setZero(3 * n);
    p.mu.setConstant(n, mu);
    p.level = ContactLevel::velocity;
    for (Eigen::Index i = 0; i < n; ++i)
        for (Eigen::Index k = 0; k < 3; ++k) {
            const double above = 1 / mass[static_cast<std::size_t>(i)];
            p.W.dense()(3 * i + k, 3 * i + k) += above;
            if (i + 1 == n) continue;
            p.W.dense()(3 * i + 3 + k, 3 * i + 3 + k) += above;
            p.W.dense()(3 * i + k, 3 * i + 3 + k) = p.W.dense()(3 * i + 3 + k, 3 * i + k) = -above;
        }
    p.q.head<3>() = kGravity * Vec3{-std::cos(slope), std::sin(slope), 0};
    return p;
}

/// Random W = G G^T with G 3n x dofs (singular if dofs < 3n), scaled contact by contact by
/// factors within 10^-contrast .. 1, and a q that some reaction can answer.
inline ContactProblem random_problem(std::mt19937& rng, int n, int dofs, double mu,
                                     double contrast = 0)
{
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> uniform;
    const auto gaussian = [&](Eigen::Index rows, Eigen::Index columns) {
        Eigen::MatrixXd m(rows, columns);
        for (double& x : m.reshaped())
            x = normal(rng);
        return m;
    };
    ContactProblem p;
    Eigen::MatrixXd G = gaussian(3 * n, dofs);
    for (int i = 0; i < n; ++i)
        G.middleRows<3>(3 * i) *= std::pow(10, -contrast / 2 * uniform(rng));
    p.W = Eigen::MatrixXd(G * G.transpose());
    // q in the range of W plus an opening: the motion v = -1 along every normal can be undone.
    p.q = G * gaussian(dofs, 1);
    for (int i = 0; i < n; ++i)
        p.q[3 * i] += uniform(rng) < 0.5 ? p.q.segment<3>(3 * i).norm() * uniform(rng) : 0;
    p.mu = Eigen::VectorXd::Constant(n, mu);
    return p;
}

/// The error of docs/theory/contact.md for frictional contacts, written again in long double.
inline long double reference_error(const ContactProblem& p, const Eigen::VectorXd& reaction,
                                   long double rho = 0)
{
    using Vector = Eigen::Matrix<long double, Eigen::Dynamic, 1>;
    using Matrix = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;
    const Matrix W = p.W.dense().cast<long double>();
    const Vector q = p.q.cast<long double>();
    if (rho == 0) rho = static_cast<long double>(W.rows()) / W.trace();
    const long double size = (rho * q).norm();
    const Vector r = reaction.cast<long double>() / size;
    const Vector u = rho * (W * r) + rho * q / size;
    long double sum = 0;
    for (Eigen::Index i = 0; i < p.mu.size(); ++i) {
        const long double mu = p.mu[i];
        const Eigen::Matrix<long double, 3, 1> a = r.segment<3>(3 * i), v = u.segment<3>(3 * i);
        Eigen::Matrix<long double, 3, 1> x = a - v;
        x[0] -= mu * v.tail<2>().norm();
        const long double t = x.tail<2>().norm();
        Eigen::Matrix<long double, 3, 1> projected = x;
        if (mu * t <= -x[0]) {
            projected.setZero();
        } else if (t > mu * x[0]) {
            const long double edge = (x[0] + mu * t) / (1 + mu * mu);
            projected << edge, mu * edge / t * x[1], mu * edge / t * x[2];
        }
        sum += (a - projected).squaredNorm();
    }
    return std::sqrt(sum);
}

} // namespace amontons::test
