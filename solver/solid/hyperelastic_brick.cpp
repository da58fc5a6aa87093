#include "solver/solid/hyperelastic_parts.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>

// F = sum_i x_i (x) g_i at each point. H8's modes a = (v_1, v_2, v_3, s) add F0 M(a), with F0 = F
// at the centre and
//
//     M = sum_k h_k (x) v_k + (c . s) 1,     h_k and c as in element.cpp,
//
// so that F is again sum_i x_i (x) g~_i with g~_i = g_i + M^T g0_i: forces on nodes need no more
// than other gradients. M is the transpose of what acts on small strains (the same strain): so put,
// the modes do not buckle under compression. Derivation: docs/theory/hyperelasticity.md.
//
// With vec(F) by columns, P = dW/dF and A = dP/dF (9 x 9), and B_u, B_a the derivatives of vec(F):
//
//     K_uu = int B_u^T A B_u,   K_aa = int B_a^T A B_a,
//     K_ua = int B_u^T A B_a + (P as it is) dM/da^T g0      (F is bilinear in x and a).
//
// What is more than kPointwiseLambdaOfH8 shear moduli of lambda acts at the mean J of the nodes'
// volume, which the modes do not change: however large the pressure, it does not act on them, and
// summed over elements its second variation is the boundary's alone.
//
// The modes are in balance at every x (a small Newton's iteration), and K = K_uu - K_ua K_aa^-1
// K_ua^T is then the derivative of the forces on nodes.

namespace amontons::hyperelastic_parts {
namespace {

constexpr int kMostModeSteps = 30, kMostHalvings = 12;
// Steps of Newton's after which the next, its square, is rounding: relative, and of strain.
constexpr double kModesThere = 1e-8, kModesRounding = 1e-10;

using Brick = Layout<ElementKind::H8>;
using BrickNumbers = Numbers<ElementKind::H8>;

} // namespace

Mat3 mode_gradient(const BrickNumbers& e, int q, const Modes& a)
{
    Mat3 M = e.h(q) * Eigen::Map<const Mat3>(a.data()).transpose();
    M.diagonal().array() += e.c(q).dot(a.tail<3>());
    return M;
}

namespace {

/// dvec(F)/da.
Eigen::Matrix<double, 9, kModes> mode_columns(const BrickNumbers& e, int q, const Mat3& F0)
{
    Eigen::Matrix<double, 9, kModes> B = Eigen::Matrix<double, 9, kModes>::Zero();
    for (int k = 0; k < 3; ++k) {
        const Vec3 h = F0 * e.h(q).col(k);
        for (int axis = 0; axis < 3; ++axis)
            B.block<3, 1>(3 * axis, 3 * k + axis) = h;
        B.col(9 + k) = e.c(q)[k] * Eigen::Map<const Eigen::Matrix<double, 9, 1>>(F0.data());
    }
    return B;
}

struct BrickModes {
    Modes residual;
    Eigen::Matrix<double, kModes, kModes> K;
};

bool brick_modes(const BrickNumbers& e, const ElementPoints& x, double lambda,
                 const Hyperelastic& m, const Modes& a, BrickModes& out)
{
    out.residual.setZero();
    out.K.setZero();
    const Mat3 F0 = x * e.centre().transpose();
    Point p;
    for (int q = 0; q < Brick::points; ++q) {
        const Mat3 F = x * e.gradients(q).transpose() + F0 * mode_gradient(e, q, a);
        if (!respond(m, lambda, F, p)) return false;
        const Mat3 S = full(p.r.S), P = F * S;
        const Eigen::Matrix<double, 9, kModes> B = mode_columns(e, q, F0);
        out.residual.noalias() +=
            e.volume(q) * B.transpose() * Eigen::Map<const Eigen::Matrix<double, 9, 1>>(P.data());
        const Eigen::Matrix<double, 9, kModes> AB = e.volume(q) * tangent(F, S, p.r.D) * B;
        out.K.noalias() += B.transpose() * AB;
    }
    return true;
}

/// The modes in balance at x, from those given.
ElementFault balance_modes(const BrickNumbers& e, const ElementPoints& x, double lambda,
                           const Hyperelastic& m, Modes& a)
{
    BrickModes at;
    if (!brick_modes(e, x, lambda, m, a, at)) {
        a.setZero(); // those of another place
        if (!brick_modes(e, x, lambda, m, a, at)) return ElementFault::inverted;
    }
    for (int step = 0; step < kMostModeSteps; ++step) {
        const Eigen::LLT<Eigen::Matrix<double, kModes, kModes>> factor(at.K);
        if (factor.info() != Eigen::Success) return ElementFault::unstable;
        const Modes change = -factor.solve(at.residual);
        const bool there = change.norm() <= kModesThere * a.norm() + kModesRounding;
        if (there) {
            a += change;
            return ElementFault::none;
        }
        double share = 1;
        const double before = at.residual.dot(change);
        int halvings = 0;
        for (;; share *= 0.5) {
            const Modes trial = a + share * change;
            // Not beyond where the energy along the step grows again as steeply as it fell.
            if (brick_modes(e, x, lambda, m, trial, at) &&
                at.residual.dot(change) <= -0.9 * before) {
                a = trial;
                break;
            }
            if (++halvings > kMostHalvings) return ElementFault::inverted;
        }
    }
    return ElementFault::unstable;
}

} // namespace

ElementFault brick_forces(const HyperelasticElement& element, const Hyperelastic& m,
                          const ElementPoints& x, HyperelasticState& state, ElementVector& forces)
{
    const BrickNumbers e{element.numbers.data()};
    const VolumeParts lambda = volume_parts<ElementKind::H8>(m);
    const MeanVolume mean = mean_volume<ElementKind::H8>(e, x, lambda.mean);
    const Mat3 F0 = x * e.centre().transpose();
    if (!(F0.determinant() > 0) || !(mean.J > 0)) return ElementFault::inverted;
    Modes a = state.modes.size() == kModes ? Modes(state.modes) : Modes(Modes::Zero());
    if (const ElementFault fault = balance_modes(e, x, lambda.pointwise, m, a);
        fault != ElementFault::none)
        return fault;
    Brick::Forces f = Brick::Forces::Zero();
    double energy = mean.energy, least = std::numeric_limits<double>::infinity();
    Point p;
    for (int q = 0; q < Brick::points; ++q) {
        const Mat3 M = mode_gradient(e, q, a), of_nodes = x * e.gradients(q).transpose();
        const Mat3 F = of_nodes + F0 * M;
        if (!respond(m, lambda.pointwise, F, p)) return ElementFault::inverted;
        const Brick::Gradients g = e.gradients(q) + M.transpose() * e.centre();
        f.noalias() += (e.volume(q) * F * full(p.r.S)) * g;
        if (lambda.mean > 0)
            f.noalias() += (e.volume(q) * mean.pressure * cofactor(of_nodes)) * e.gradients(q);
        energy += e.volume(q) * p.r.energy;
        least = std::min(least, p.J);
    }
    state.modes = a;
    state.energy = energy;
    state.least_volume = least;
    forces = Eigen::Map<const Eigen::VectorXd>(f.data(), f.size());
    return ElementFault::none;
}

void brick_tangent(const HyperelasticElement& element, const Hyperelastic& m,
                   const ElementPoints& x, const HyperelasticState& state, ElementMatrix& result)
{
    constexpr int n = Brick::n;
    const BrickNumbers e{element.numbers.data()};
    const VolumeParts lambda = volume_parts<ElementKind::H8>(m);
    MeanVolume mean = mean_volume<ElementKind::H8>(e, x, lambda.mean);
    if (!std::isnan(state.pressure)) mean.pressure = state.pressure;
    const Modes a = state.modes;
    const Mat3 F0 = x * e.centre().transpose();
    const Brick::Gradients g0 = e.centre();
    NodeBlocks<n> blocks;
    Brick::Forces dv = Brick::Forces::Zero(); // of the volume by the places
    Eigen::Matrix<double, 3 * n, kModes> K_ua = Eigen::Matrix<double, 3 * n, kModes>::Zero();
    Eigen::Matrix<double, kModes, kModes> K_aa = Eigen::Matrix<double, kModes, kModes>::Zero();
    Point p;
    for (int q = 0; q < Brick::points; ++q) {
        const Mat3 M = mode_gradient(e, q, a), of_nodes = x * e.gradients(q).transpose();
        const Mat3 F = of_nodes + F0 * M;
        if (!respond(m, lambda.pointwise, F, p)) return; // the state was in balance: cannot be
        if (lambda.mean > 0) {
            PointResponse of_volume;
            const double pJ = mean.pressure * of_nodes.determinant();
            add_volumetric((of_nodes.transpose() * of_nodes).inverse(), pJ, pJ, pJ, of_volume);
            blocks.add(e.gradients(q), tangent(of_nodes, full(of_volume.S), of_volume.D),
                       e.volume(q));
            dv.noalias() += (e.volume(q) * cofactor(of_nodes)) * e.gradients(q);
        }
        const Brick::Gradients g = e.gradients(q) + M.transpose() * g0;
        const Mat3 S = full(p.r.S), P = e.volume(q) * F * S;
        const Mat9 A = tangent(F, S, p.r.D);
        blocks.add(g, A, e.volume(q));
        const Eigen::Matrix<double, 9, kModes> B = mode_columns(e, q, F0), AB = e.volume(q) * A * B;
        K_aa.noalias() += B.transpose() * AB;
        Eigen::Matrix<double, 9, 3 * n> B_u = Eigen::Matrix<double, 9, 3 * n>::Zero();
        for (int node = 0; node < n; ++node)
            for (int J = 0; J < 3; ++J)
                for (int c = 0; c < 3; ++c)
                    B_u(c + 3 * J, 3 * node + c) = g(J, node);
        K_ua.noalias() += B_u.transpose() * AB;
        // Node by node: gcc 12 with AVX-512 gets one of eight columns wrong in a product of all.
        const Mat3 h = e.h(q);
        const Vec3 c = e.c(q);
        for (int node = 0; node < n; ++node) {
            const Vec3 g0_of_node = g0.col(node), P_g0 = P * g0_of_node;
            for (int k = 0; k < 3; ++k) {
                const double h_g0 = h.col(k).dot(g0_of_node);
                for (int i = 0; i < 3; ++i) {
                    for (int axis = 0; axis < 3; ++axis)
                        K_ua(3 * node + i, 3 * k + axis) += h_g0 * P(i, axis);
                    K_ua(3 * node + i, 9 + k) += c[k] * P_g0[i];
                }
            }
        }
    }
    Eigen::Matrix<double, 3 * n, 3 * n> K;
    blocks.scatter(K);
    if (lambda.mean > 0) {
        const Eigen::Map<const Eigen::Matrix<double, 3 * n, 1>> d(dv.data());
        K.noalias() += (mean.stiffness / mean.V) * d * d.transpose();
    }
    // The modes were in stable balance; on its very edge they are left as they are.
    const Eigen::LLT<Eigen::Matrix<double, kModes, kModes>> factor(K_aa);
    if (factor.info() == Eigen::Success) {
        const Eigen::Matrix<double, kModes, 3 * n> K_au = K_ua.transpose();
        const Eigen::Matrix<double, kModes, 3 * n> taken = factor.matrixL().solve(K_au);
        K.noalias() -= taken.transpose() * taken;
    }
    result = 0.5 * (K + K.transpose());
}

} // namespace amontons::hyperelastic_parts
