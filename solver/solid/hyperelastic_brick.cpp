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
using Square = Eigen::Matrix<double, kModes, kModes>;

/// An element at places x, but for its modes.
struct Places {
    std::array<Gradient<Four>, Brick::groups> of_nodes; ///< F of the nodes alone
    Mat3 F0, Y; ///< F at the centre; F0 times the h of xi = 1
};

Places at_places(const BrickNumbers& e, const ElementPoints& x)
{
    Places p;
    for (int group = 0; group < Brick::groups; ++group)
        p.of_nodes[std::size_t(group)] = gradient(e, group, x);
    p.F0 = x * e.centre().transpose();
    p.Y = p.F0 * e.turned();
    return p;
}

/// Adds F0 M: Y = F0 `turned`.
void add_mode_gradients(const BrickNumbers& e, int group, const Mat3& F0, const Mat3& Y,
                        const Modes& a, Gradient<Four>& F)
{
    Four shift{};
    for (int k = 0; k < 3; ++k) {
        shift += a[9 + k] * e.of_group(group, Brick::c + k);
        const Four size = e.of_group(group, Brick::e + k);
        for (int J = 0; J < 3; ++J) {
            const Four v = a[3 * k + J] * size;
            for (int c = 0; c < 3; ++c)
                F[std::size_t(c + 3 * J)] += Y(c, k) * v;
        }
    }
    for (int i = 0; i < 9; ++i)
        F[std::size_t(i)] += F0.data()[i] * shift;
}

} // namespace

void add_modes(const BrickNumbers& e, int group, const Mat3& F0, const Modes& a, Gradient<Four>& F)
{
    add_mode_gradients(e, group, F0, F0 * e.turned(), a, F);
}

namespace {

/// M at point q.
Mat3 mode_gradient(const BrickNumbers& e, int q, const Modes& a)
{
    Mat3 M = e.h(q) * Eigen::Map<const Mat3>(a.data()).transpose();
    M.diagonal().array() += e.c(q).dot(a.tail<3>());
    return M;
}

/// dvec(F)/da.
Eigen::Matrix<double, 9, kModes> mode_columns(const BrickNumbers& e, int q, const Mat3& F0)
{
    Eigen::Matrix<double, 9, kModes> B = Eigen::Matrix<double, 9, kModes>::Zero();
    const Mat3 h = F0 * e.h(q);
    for (int k = 0; k < 3; ++k) {
        for (int axis = 0; axis < 3; ++axis)
            B.block<3, 1>(3 * axis, 3 * k + axis) = h.col(k);
        B.col(9 + k) = e.c(q)[k] * Eigen::Map<const Eigen::Matrix<double, 9, 1>>(F0.data());
    }
    return B;
}

struct BrickModes {
    Modes residual = Modes::Zero();
    Square K = Square::Zero(); ///< lower triangle
};

/// The modes' equations. With y_k = F0 t_k, t_k the h of xi_k = 1, a mode (k, J) changes F by xi_k
/// y_k (x) e_J, hence strains by xi_k times the symmetric part of p_k (x) e_J, p_k = F^T y_k: three
/// of its six numbers are not 0. The modes of volume change F by c_k F0.
bool brick_modes(const BrickNumbers& e, const Places& at, double lambda, const Hyperelastic& m,
                 const Modes& a, BrickModes& out)
{
    std::array<Four, kModes> residual{};
    std::array<Four, kModes*(kModes + 1) / 2> K{};
    const Mat3 YY = at.Y.transpose() * at.Y, YF0 = at.Y.transpose() * at.F0,
               F0F0 = at.F0.transpose() * at.F0;
    Answer<Four> answer;
    for (int group = 0; group < Brick::groups; ++group) {
        Gradient<Four> F = at.of_nodes[std::size_t(group)];
        add_mode_gradients(e, group, at.F0, at.Y, a, F);
        if (!respond(m, lambda, 0, F, true, answer)) return false;
        const Response<Four>& r = answer.r;
        const auto D = [&](std::size_t i, std::size_t j) { return r.D[of_triangle(i, j)]; };
        const Four volume = e.volumes(group);
        Four size[3], shift[3], p[3][3];
        for (std::size_t k = 0; k < 3; ++k) {
            size[k] = e.of_group(group, Brick::e + int(k));
            shift[k] = e.of_group(group, Brick::c + int(k));
            const auto y = at.Y.col(Eigen::Index(k));
            for (std::size_t M = 0; M < 3; ++M)
                p[k][M] = y[0] * F[3 * M] + y[1] * F[3 * M + 1] + y[2] * F[3 * M + 2];
        }
        // Of F0: strain, D times it, and with the stress.
        Four strain[6], De[6], work{}, stiff{};
        for (std::size_t i = 0; i < 3; ++i)
            for (std::size_t j = 0; j <= i; ++j) {
                const auto dot = [&](std::size_t k, std::size_t l) {
                    const auto f0 = at.F0.col(Eigen::Index(k));
                    return f0[0] * F[3 * l] + f0[1] * F[3 * l + 1] + f0[2] * F[3 * l + 2];
                };
                strain[kSix[i][j]] = i == j ? dot(i, i) : dot(i, j) + dot(j, i);
                stiff +=
                    (i == j ? 1 : 2) * F0F0(Eigen::Index(i), Eigen::Index(j)) * r.S[kSix[i][j]];
            }
        for (std::size_t i = 0; i < 6; ++i) {
            De[i] = Four{};
            for (std::size_t j = 0; j < 6; ++j)
                De[i] += D(i, j) * strain[j];
            work += strain[i] * r.S[i];
            stiff += strain[i] * De[i];
        }
        for (std::size_t k = 0; k < 3; ++k) {
            residual[9 + k] += volume * shift[k] * work;
            for (std::size_t l = 0; l <= k; ++l)
                K[of_triangle(9 + k, 9 + l)] += volume * shift[k] * shift[l] * stiff;
        }
        for (std::size_t k = 0; k < 3; ++k) {
            const Four weight = volume * size[k];
            for (std::size_t J = 0; J < 3; ++J) {
                Four force{}, with_volume{}, Dp[6];
                for (std::size_t M = 0; M < 3; ++M) {
                    const std::size_t six = kSix[J][M];
                    force += p[k][M] * r.S[six];
                    with_volume +=
                        p[k][M] * De[six] + YF0(Eigen::Index(k), Eigen::Index(M)) * r.S[six];
                }
                residual[3 * k + J] += weight * force;
                for (std::size_t l = 0; l < 3; ++l)
                    K[of_triangle(9 + l, 3 * k + J)] += weight * shift[l] * with_volume;
                for (std::size_t i = 0; i < 6; ++i)
                    Dp[i] = D(i, kSix[J][0]) * p[k][0] + D(i, kSix[J][1]) * p[k][1] +
                            D(i, kSix[J][2]) * p[k][2];
                for (std::size_t l = 0; l <= k; ++l)
                    for (std::size_t L = 0; L < (l < k ? 3 : J + 1); ++L)
                        K[of_triangle(3 * k + J, 3 * l + L)] +=
                            weight * size[l] *
                            (p[l][0] * Dp[kSix[L][0]] + p[l][1] * Dp[kSix[L][1]] +
                             p[l][2] * Dp[kSix[L][2]] +
                             YY(Eigen::Index(k), Eigen::Index(l)) * r.S[kSix[J][L]]);
            }
        }
    }
    for (std::size_t i = 0; i < kModes; ++i) {
        out.residual[Eigen::Index(i)] = sum(residual[i]);
        for (std::size_t j = 0; j <= i; ++j)
            out.K(Eigen::Index(i), Eigen::Index(j)) = sum(K[of_triangle(i, j)]);
    }
    return true;
}

/// y = K^-1 y by elimination, whole columns at a time: what it does above the diagonal is of no
/// use.
/// @param K  lower triangle; lost
/// @return  false: not positive definite
bool solve_positive(Square& K, Modes& y)
{
    Modes left = y, inverse;
    for (int j = 0; j < kModes; ++j) {
        if (!(K(j, j) > 0)) return false;
        inverse[j] = 1 / K(j, j);
        y[j] = left[j];
        left -= (left[j] * inverse[j]) * K.col(j);
        for (int k = j + 1; k < kModes; ++k)
            K.col(k) -= (K(k, j) * inverse[j]) * K.col(j);
    }
    Modes x = Modes::Zero();
    for (int j = kModes - 1; j >= 0; --j)
        x[j] = (y[j] - K.col(j).dot(x)) * inverse[j];
    y = x;
    return true;
}

/// The modes in balance at x, from those given.
ElementFault balance_modes(const BrickNumbers& e, const Places& places, double lambda,
                           const Hyperelastic& m, Modes& a)
{
    BrickModes at;
    if (!brick_modes(e, places, lambda, m, a, at)) {
        a.setZero(); // those of another place
        if (!brick_modes(e, places, lambda, m, a, at)) return ElementFault::inverted;
    }
    for (int step = 0; step < kMostModeSteps; ++step) {
        Modes change = -at.residual;
        if (!solve_positive(at.K, change)) return ElementFault::unstable;
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
            if (brick_modes(e, places, lambda, m, trial, at) &&
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
    const Places at = at_places(e, x);
    if (!(at.F0.determinant() > 0) || !(mean.J > 0)) return ElementFault::inverted;
    Modes a = state.modes.size() == kModes ? Modes(state.modes) : Modes(Modes::Zero());
    if (const ElementFault fault = balance_modes(e, at, lambda.pointwise, m, a);
        fault != ElementFault::none)
        return fault;
    // g~ = g + M^T g0: what acts on g, and what of all points acts on g0.
    std::array<Four, 3 * Brick::n> f{};
    std::array<Four, 9> of_volume{}; // c P
    std::array<Four, 27> of_mode{};  // e_k P
    Four energy{}, smallest = Four{} + std::numeric_limits<double>::infinity();
    Answer<Four> answer;
    for (int group = 0; group < Brick::groups; ++group) {
        const Gradient<Four>& of_nodes = at.of_nodes[std::size_t(group)];
        Gradient<Four> F = of_nodes;
        add_mode_gradients(e, group, at.F0, at.Y, a, F);
        if (!respond(m, lambda.pointwise, 0, F, false, answer)) return ElementFault::inverted;
        const Four volume = e.volumes(group);
        Gradient<Four> P = stress(F, answer.r, volume);
        Four shift{};
        for (int k = 0; k < 3; ++k)
            shift += a[9 + k] * e.of_group(group, Brick::c + k);
        for (std::size_t i = 0; i < 9; ++i) {
            of_volume[i] += shift * P[i];
            for (std::size_t k = 0; k < 3; ++k)
                of_mode[9 * k + i] += e.of_group(group, Brick::e + int(k)) * P[i];
        }
        if (lambda.mean > 0) {
            const Gradient<Four> c = cofactor(of_nodes);
            for (std::size_t i = 0; i < 9; ++i)
                P[i] += mean.pressure * volume * c[i];
        }
        add_forces(e, group, P, f);
        energy += volume * answer.r.energy;
        smallest = smallest < answer.at.J ? smallest : answer.at.J;
    }
    // sum P M^T = sum over k of (sum e_k P) v_k (x) t_k, and the c's share.
    Mat3 on_centre;
    for (std::size_t i = 0; i < 9; ++i)
        on_centre.data()[i] = sum(of_volume[i]);
    for (int k = 0; k < 3; ++k) {
        Mat3 P;
        for (std::size_t i = 0; i < 9; ++i)
            P.data()[i] = sum(of_mode[9 * std::size_t(k) + i]);
        on_centre += P * a.segment<3>(3 * k) * e.turned().col(k).transpose();
    }
    const Brick::Forces by_centre = on_centre * e.centre();
    for (std::size_t k = 0; k < f.size(); ++k)
        forces[Eigen::Index(k)] = sum(f[k]) + by_centre.data()[k];
    state.modes = a;
    state.energy = mean.energy + sum(energy);
    state.least_volume = least(smallest);
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
    std::array<Four, 3 * n> dv{}; // of the volume by the places

    // ---- Tangent of the points, with the modes
    Eigen::Matrix<double, 3 * n, kModes> K_ua = Eigen::Matrix<double, 3 * n, kModes>::Zero();
    Square K_aa = Square::Zero();
    Answer<Four> answer;
    Gradient<Four> F;
    Tangent<Four> A_of_group;
    for (int q = 0; q < Brick::points; ++q) {
        if (q % Brick::width == 0) {
            const int group = q / Brick::width;
            const Four volume = e.volumes(group);
            F = gradient(e, group, x);
            if (lambda.mean > 0) {
                Answer<Four> of_volume;
                of_volume.at = strain_of(F);
                of_volume.r.a = of_volume.r.b = of_volume.r.c = mean.pressure * of_volume.at.J;
                of_volume.r.add_volume(of_volume.at, true);
                tangent(F, of_volume.r, volume, A_of_group);
                blocks.add(e, group, A_of_group);
                Gradient<Four> c = cofactor(F);
                for (Four& entry : c)
                    entry *= volume;
                add_forces(e, group, c, dv);
            }
            add_modes(e, group, F0, a, F);
            // The state was in balance: cannot be.
            if (!respond(m, lambda.pointwise, 0, F, true, answer)) return;
            tangent(F, answer.r, volume, A_of_group);
        }
        const Point p = point_of(F, answer, q % Brick::width);
        const Brick::Gradients g = e.gradients(q) + mode_gradient(e, q, a).transpose() * g0;
        const Mat3 P = e.volume(q) * p.F * p.S;
        const Mat9 A = tangent_of(A_of_group, q % Brick::width);
        blocks.add(g, A);
        const Eigen::Matrix<double, 9, kModes> B = mode_columns(e, q, F0), AB = A * B;
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

    // ---- Mean volume, condensation of the modes
    Eigen::Matrix<double, 3 * n, 3 * n> K;
    blocks.scatter(K);
    if (lambda.mean > 0) {
        Eigen::Matrix<double, 3 * n, 1> d;
        for (std::size_t k = 0; k < dv.size(); ++k)
            d[Eigen::Index(k)] = sum(dv[k]);
        K.noalias() += (mean.stiffness / mean.V) * d * d.transpose();
    }
    // The modes were in stable balance; on its very edge they are left as they are.
    const Eigen::LLT<Square> factor(K_aa);
    if (factor.info() == Eigen::Success) {
        const Eigen::Matrix<double, kModes, 3 * n> K_au = K_ua.transpose();
        const Eigen::Matrix<double, kModes, 3 * n> taken = factor.matrixL().solve(K_au);
        K.noalias() -= taken.transpose() * taken;
    }
    result = 0.5 * (K + K.transpose());
}

} // namespace amontons::hyperelastic_parts
