#include "solver/solid/hyperelastic.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>

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

namespace amontons {
namespace {

using Mat9 = Eigen::Matrix<double, 9, 9>;
constexpr int kModes = kMostInternalModes;
constexpr int kMostModeSteps = 30, kMostHalvings = 12;
// Steps of Newton's after which the next, its square, is rounding: relative, and of strain.
constexpr double kModesThere = 1e-8, kModesRounding = 1e-10;

template <ElementKind kind> struct Layout {
    static constexpr int n = kind == ElementKind::T4 ? 4 : kind == ElementKind::T10 ? 10 : 8;
    static constexpr int points = kind == ElementKind::T4 ? 1 : 8;
    static constexpr bool modes = kind == ElementKind::H8;
    static constexpr int point_size = 3 * n + 1 + (modes ? 12 : 0);
    static constexpr int size = points * point_size + (modes ? 3 * n : 0);
    using Gradients = Eigen::Matrix<double, 3, n>;
    using Forces = Eigen::Matrix<double, 3, n>;
};

template <ElementKind kind> struct Numbers {
    using L = Layout<kind>;
    const double* at;
    auto gradients(int q) const
    {
        return Eigen::Map<const typename L::Gradients>(at + q * L::point_size);
    }
    double volume(int q) const { return at[q * L::point_size + 3 * L::n]; }
    auto h(int q) const { return Eigen::Map<const Mat3>(at + q * L::point_size + 3 * L::n + 1); }
    auto c(int q) const { return Eigen::Map<const Vec3>(at + q * L::point_size + 3 * L::n + 10); }
    auto centre() const
    {
        return Eigen::Map<const typename L::Gradients>(at + L::points * L::point_size);
    }
};

template <ElementKind kind>
void fill(const ElementPoints& X, const Mat3& axes, std::vector<double>& numbers)
{
    using L = Layout<kind>;
    numbers.resize(L::size);
    double* at = numbers.data();
    const auto gradients = [&](const Vec3& xi, double& det) {
        const ShapeGradients d = shape_gradients(kind, xi);
        const Mat3 J = X * d.transpose();
        det = J.determinant();
        return typename L::Gradients(axes.transpose() * J.inverse().transpose() * d);
    };
    const auto put = [&](const auto& m) { at = std::copy_n(m.data(), m.size(), at); };
    Mat3 J0 = Mat3::Identity();
    if constexpr (L::modes) J0 = X * shape_gradients(kind, Vec3::Zero()).transpose();
    for (const QuadraturePoint& p : stiffness_points(kind)) {
        double det = 0;
        put(gradients(p.xi, det));
        *at++ = p.weight * det;
        if constexpr (L::modes) {
            const double scale = J0.determinant() / det;
            const Mat3 turned = axes.transpose() * J0.inverse().transpose();
            put(Mat3(scale * turned * p.xi.asDiagonal()));
            put(Vec3(scale * Vec3(p.xi[1] * p.xi[2], p.xi[2] * p.xi[0], p.xi[0] * p.xi[1])));
        }
    }
    if constexpr (L::modes) {
        double det = 0;
        put(gradients(Vec3::Zero(), det));
    }
}

/// The law at a point, with `lambda` of its volumetric part.
struct Point {
    double J = 0;
    Mat3 C_inverse;
    PointResponse r;
};

bool respond(const Hyperelastic& m, double lambda, const Mat3& F, Point& p)
{
    p.J = F.determinant();
    if (!(p.J > 0)) return false;
    const Mat3 C = F.transpose() * F;
    p.C_inverse = C.inverse();
    m.law->respond(m.constants, C, p.r);
    if (lambda > 0) {
        const double ln_J = std::log(p.J);
        p.r.energy += 0.5 * lambda * ln_J * ln_J;
        add_volumetric(p.C_inverse, lambda * ln_J, lambda, lambda * ln_J, p.r);
    }
    return std::isfinite(p.r.energy) && p.r.D.allFinite();
}

Mat3 full(const Vec6& s)
{
    Mat3 m;
    m << s[0], s[3], s[5], s[3], s[1], s[4], s[5], s[4], s[2];
    return m;
}

/// dP/dF.
Mat9 tangent(const Mat3& F, const Mat3& S, const Mat6& D)
{
    constexpr int at[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {0, 2}};
    Eigen::Matrix<double, 6, 9> T = Eigen::Matrix<double, 6, 9>::Zero(); // of E, of vec(F)
    for (int p = 0; p < 6; ++p) {
        const int M = at[p][0], N = at[p][1];
        T.block<1, 3>(p, 3 * N) += F.col(M).transpose();
        if (M != N) T.block<1, 3>(p, 3 * M) += F.col(N).transpose();
    }
    const Eigen::Matrix<double, 6, 9> DT = D * T;
    Mat9 A;
    A.noalias() = T.transpose() * DT;
    for (int J = 0; J < 3; ++J)
        for (int L = 0; L < 3; ++L)
            A.block<3, 3>(3 * J, 3 * L).diagonal().array() += S(J, L);
    return A;
}

/// Adds (gradients)^T A (gradients) for each pair of axes, lower triangle of the pairs.
template <int n> struct NodeBlocks {
    // Whole registers of four: products of ten rows by Eigen's general way took a third of a step.
    static constexpr int rows = (n + 3) / 4 * 4;
    std::array<Eigen::Matrix<double, rows, n>, 6> of;
    NodeBlocks()
    {
        for (auto& b : of)
            b.setZero();
    }
    void add(const Eigen::Matrix<double, 3, n>& g, const Mat9& A, double volume)
    {
        Eigen::Matrix<double, rows, 3> left = Eigen::Matrix<double, rows, 3>::Zero();
        left.template topRows<n>() = g.transpose();
        std::size_t k = 0;
        for (int c = 0; c < 3; ++c)
            for (int d = c; d < 3; ++d) {
                Mat3 part;
                for (int L = 0; L < 3; ++L)
                    for (int J = 0; J < 3; ++J)
                        part(J, L) = volume * A(c + 3 * J, d + 3 * L);
                auto& block = of[k++];
                for (int j = 0; j < n; ++j) {
                    const Vec3 right = part * g.col(j);
                    block.col(j) +=
                        left.col(0) * right[0] + left.col(1) * right[1] + left.col(2) * right[2];
                }
            }
    }
    template <class Matrix> void scatter(Matrix& K) const
    {
        std::size_t k = 0;
        for (int c = 0; c < 3; ++c)
            for (int d = c; d < 3; ++d, ++k)
                for (int j = 0; j < n; ++j)
                    for (int i = 0; i < n; ++i) {
                        K(3 * i + c, 3 * j + d) = of[k](i, j);
                        if (c != d) K(3 * j + d, 3 * i + c) = of[k](i, j);
                    }
    }
};

struct VolumeParts {
    double pointwise = 0, mean = 0; // lambda
};

/// The smallest shear modulus at rest.
double softest_shear(const Hyperelastic& m)
{
    if (!m.law->directed) return m.law->small(m.constants).shear;
    PointResponse at_rest;
    m.law->respond(m.constants, Mat3::Identity(), at_rest);
    return at_rest.D.diagonal().tail<3>().minCoeff();
}

template <ElementKind kind> VolumeParts volume_parts(const Hyperelastic& m)
{
    const double lambda = m.law->volumetric(m.constants);
    if constexpr (kind == ElementKind::T4) return {lambda, 0};
    const double most = kind == ElementKind::T10 ? kPointwiseLambda : kPointwiseLambdaOfH8;
    const double pointwise = std::min(lambda, most * softest_shear(m));
    return {pointwise, lambda - pointwise};
}

/// The mean J, and what it does: lambda/2 V (ln J)^2.
struct MeanVolume {
    double V = 0, J = 1, pressure = 0, stiffness = 0; // U', U''
    double energy = 0;
    MeanVolume(double volume, double now, double lambda) : V(volume), J(now / volume)
    {
        const double ln_J = std::log(J);
        energy = 0.5 * lambda * V * ln_J * ln_J;
        pressure = lambda * ln_J / J;
        stiffness = lambda * (1 - ln_J) / (J * J);
    }
};

// ---- T4 and T10

template <ElementKind kind, class Visit>
bool visit_points(const Numbers<kind>& e, const ElementPoints& x, double lambda,
                  const Hyperelastic& m, Visit visit)
{
    Point p;
    for (int q = 0; q < Layout<kind>::points; ++q) {
        const Mat3 F = x * e.gradients(q).transpose();
        if (!respond(m, lambda, F, p)) return false;
        visit(q, F, p);
    }
    return true;
}

template <ElementKind kind>
MeanVolume mean_volume(const Numbers<kind>& e, const ElementPoints& x, double lambda)
{
    double V = 0, v = 0;
    for (int q = 0; q < Layout<kind>::points; ++q) {
        V += e.volume(q);
        if (lambda > 0) v += e.volume(q) * (x * e.gradients(q).transpose()).determinant();
    }
    return {V, lambda > 0 ? v : V, lambda};
}

template <ElementKind kind>
ElementFault simple_forces(const HyperelasticElement& element, const Hyperelastic& m,
                           const ElementPoints& x, HyperelasticState& state, ElementVector& forces)
{
    using L = Layout<kind>;
    const Numbers<kind> e{element.numbers.data()};
    const VolumeParts lambda = volume_parts<kind>(m);
    const MeanVolume mean = mean_volume<kind>(e, x, lambda.mean);
    if (!(mean.J > 0)) return ElementFault::inverted;
    typename L::Forces f = L::Forces::Zero();
    state.energy = mean.energy;
    state.least_volume = std::numeric_limits<double>::infinity();
    const bool good = visit_points(e, x, lambda.pointwise, m, [&](int q, const Mat3& F, Point& p) {
        if (mean.pressure != 0) add_volumetric(p.C_inverse, mean.pressure * p.J, 0, 0, p.r);
        f.noalias() += (e.volume(q) * F * full(p.r.S)) * e.gradients(q);
        state.energy += e.volume(q) * p.r.energy;
        state.least_volume = std::min(state.least_volume, p.J);
    });
    if (!good) return ElementFault::inverted;
    forces = Eigen::Map<const Eigen::VectorXd>(f.data(), f.size());
    return ElementFault::none;
}

template <ElementKind kind>
void simple_tangent(const HyperelasticElement& element, const Hyperelastic& m,
                    const ElementPoints& x, const HyperelasticState& state, ElementMatrix& K)
{
    using L = Layout<kind>;
    const Numbers<kind> e{element.numbers.data()};
    const VolumeParts lambda = volume_parts<kind>(m);
    MeanVolume mean = mean_volume<kind>(e, x, lambda.mean);
    if (!std::isnan(state.pressure)) mean.pressure = state.pressure;
    NodeBlocks<L::n> blocks;
    typename L::Forces dv = L::Forces::Zero(); // of the volume by the places
    visit_points(e, x, lambda.pointwise, m, [&](int q, const Mat3& F, Point& p) {
        const double pJ = mean.pressure * p.J;
        if (lambda.mean > 0) {
            add_volumetric(p.C_inverse, pJ, pJ, pJ, p.r);
            dv.noalias() += (e.volume(q) * p.J * F * p.C_inverse) * e.gradients(q);
        }
        blocks.add(e.gradients(q), tangent(F, full(p.r.S), p.r.D), e.volume(q));
    });
    K.resize(3 * L::n, 3 * L::n);
    blocks.scatter(K);
    if (lambda.mean > 0) {
        const Eigen::Map<const Eigen::Matrix<double, 3 * L::n, 1>> d(dv.data());
        K.noalias() += (mean.stiffness / mean.V) * d * d.transpose();
    }
}

// ---- H8

/// J F^-T, the derivative of J.
Mat3 cofactor(const Mat3& F)
{
    Mat3 c;
    for (int i = 0; i < 3; ++i)
        c.col(i) = F.col((i + 1) % 3).cross(F.col((i + 2) % 3));
    return c;
}

using Brick = Layout<ElementKind::H8>;
using BrickNumbers = Numbers<ElementKind::H8>;
using Modes = Eigen::Matrix<double, kModes, 1>;

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

} // namespace

HyperelasticElement make_hyperelastic(ElementKind kind, const ElementPoints& X, const Mat3& axes)
{
    // Gradients without the round-off of places far from the origin.
    const Eigen::Matrix3Xd near = X.colwise() - Vec3(X.col(0));
    HyperelasticElement e;
    e.kind = kind;
    switch (kind) {
    case ElementKind::T4:
        fill<ElementKind::T4>(near, axes, e.numbers);
        break;
    case ElementKind::T10:
        fill<ElementKind::T10>(near, axes, e.numbers);
        break;
    case ElementKind::H8:
        fill<ElementKind::H8>(near, axes, e.numbers);
        break;
    }
    return e;
}

ElementFault hyperelastic_forces(const HyperelasticElement& e, const Hyperelastic& material,
                                 const ElementPoints& x, HyperelasticState& state,
                                 ElementVector& forces)
{
    forces.setZero(3 * x.cols());
    switch (e.kind) {
    case ElementKind::T4:
        return simple_forces<ElementKind::T4>(e, material, x, state, forces);
    case ElementKind::T10:
        return simple_forces<ElementKind::T10>(e, material, x, state, forces);
    case ElementKind::H8:
        return brick_forces(e, material, x, state, forces);
    }
    assertion_failed("an element kind", __FILE__, __LINE__);
}

void hyperelastic_tangent(const HyperelasticElement& e, const Hyperelastic& material,
                          const ElementPoints& x, const HyperelasticState& state, ElementMatrix& K)
{
    switch (e.kind) {
    case ElementKind::T4:
        return simple_tangent<ElementKind::T4>(e, material, x, state, K);
    case ElementKind::T10:
        return simple_tangent<ElementKind::T10>(e, material, x, state, K);
    case ElementKind::H8:
        return brick_tangent(e, material, x, state, K);
    }
}

namespace {

template <ElementKind kind>
HyperelasticMean mean(const HyperelasticElement& element, const Hyperelastic& m,
                      const ElementPoints& x, const HyperelasticState& state)
{
    using L = Layout<kind>;
    const Numbers<kind> e{element.numbers.data()};
    const VolumeParts lambda = volume_parts<kind>(m);
    const MeanVolume all = mean_volume<kind>(e, x, lambda.mean);
    HyperelasticMean out;
    Mat3 tau = Mat3::Zero();
    double now = 0;
    Point p;
    for (int q = 0; q < L::points; ++q) {
        Mat3 F = x * e.gradients(q).transpose();
        if constexpr (L::modes)
            if (state.modes.size() == kModes)
                F += (x * e.centre().transpose()) * mode_gradient(e, q, Modes(state.modes));
        if (!respond(m, lambda.pointwise, F, p)) return out;
        tau += e.volume(q) * F * full(p.r.S) * F.transpose();
        now += e.volume(q) * p.J;
    }
    tau.diagonal().array() += all.pressure * all.J * all.V;
    tau /= now;
    out.stress << tau(0, 0), tau(1, 1), tau(2, 2), tau(0, 1), tau(1, 2), tau(0, 2);
    out.energy = state.energy / all.V;
    return out;
}

} // namespace

namespace {

template <ElementKind kind>
double mean_pressure_after(const HyperelasticElement& element, const Hyperelastic& m,
                           const ElementPoints& x, const ElementPoints& move)
{
    const Numbers<kind> e{element.numbers.data()};
    const double lambda = volume_parts<kind>(m).mean;
    if (!(lambda > 0)) return std::numeric_limits<double>::quiet_NaN();
    const MeanVolume mean = mean_volume<kind>(e, x, lambda);
    double dv = 0;
    for (int q = 0; q < Layout<kind>::points; ++q) {
        const Mat3 F = x * e.gradients(q).transpose(), dF = move * e.gradients(q).transpose();
        dv += e.volume(q) * cofactor(F).cwiseProduct(dF).sum();
    }
    return mean.pressure + mean.stiffness * dv / mean.V;
}

} // namespace

double pressure_after(const HyperelasticElement& e, const Hyperelastic& material,
                      const ElementPoints& x, const ElementPoints& move)
{
    switch (e.kind) {
    case ElementKind::T4:
        return mean_pressure_after<ElementKind::T4>(e, material, x, move);
    case ElementKind::T10:
        return mean_pressure_after<ElementKind::T10>(e, material, x, move);
    case ElementKind::H8:
        return mean_pressure_after<ElementKind::H8>(e, material, x, move);
    }
    assertion_failed("an element kind", __FILE__, __LINE__);
}

HyperelasticMean hyperelastic_mean(const HyperelasticElement& e, const Hyperelastic& material,
                                   const ElementPoints& x, const HyperelasticState& state)
{
    switch (e.kind) {
    case ElementKind::T4:
        return mean<ElementKind::T4>(e, material, x, state);
    case ElementKind::T10:
        return mean<ElementKind::T10>(e, material, x, state);
    case ElementKind::H8:
        return mean<ElementKind::H8>(e, material, x, state);
    }
    assertion_failed("an element kind", __FILE__, __LINE__);
}

} // namespace amontons
