#include "solver/solid/hyperelastic_parts.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>

namespace amontons {
namespace hyperelastic_parts {

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

Mat3 cofactor(const Mat3& F)
{
    Mat3 c;
    for (int i = 0; i < 3; ++i)
        c.col(i) = F.col((i + 1) % 3).cross(F.col((i + 2) % 3));
    return c;
}

double softest_shear(const Hyperelastic& m)
{
    if (!m.law->directed) return m.law->small(m.constants).shear;
    PointResponse at_rest;
    m.law->respond(m.constants, Mat3::Identity(), at_rest);
    return at_rest.D.diagonal().tail<3>().minCoeff();
}

} // namespace hyperelastic_parts

using namespace hyperelastic_parts;

namespace {

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
