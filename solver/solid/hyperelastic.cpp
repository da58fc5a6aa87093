#include "solver/solid/hyperelastic_parts.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>

namespace amontons {
namespace hyperelastic_parts {

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
    const Mat6 D = point_response(m, Mat3::Identity()).D;
    return D.diagonal().tail<3>().minCoeff();
}

} // namespace hyperelastic_parts

using namespace hyperelastic_parts;

namespace {

template <ElementKind kind>
void fill(const ElementPoints& X, const Mat3& axes, std::vector<double>& numbers)
{
    using L = Layout<kind>;
    numbers.resize(L::size);
    const auto gradients = [&](const Vec3& xi, double& det) {
        const ShapeGradients d = shape_gradients(kind, xi);
        const Mat3 J = X * d.transpose();
        det = J.determinant();
        return typename L::Gradients(axes.transpose() * J.inverse().transpose() * d);
    };
    Mat3 J0 = Mat3::Identity();
    if constexpr (L::modes) J0 = X * shape_gradients(kind, Vec3::Zero()).transpose();
    int q = 0;
    for (const QuadraturePoint& p : stiffness_points(kind)) {
        double det = 0;
        const typename L::Gradients g = gradients(p.xi, det);
        double* at = numbers.data() + q / L::width * L::width * L::of_point + q % L::width;
        const auto put = [&](double v) {
            *at = v;
            at += L::width;
        };
        for (Eigen::Index k = 0; k < g.size(); ++k)
            put(g.data()[k]);
        put(p.weight * det);
        if constexpr (L::modes) {
            const double scale = J0.determinant() / det;
            for (int k = 0; k < 3; ++k)
                put(scale * p.xi[k]);
            for (int k = 0; k < 3; ++k)
                put(scale * p.xi[(k + 1) % 3] * p.xi[(k + 2) % 3]);
        }
        ++q;
    }
    if constexpr (L::modes) {
        double det = 0;
        const typename L::Gradients g = gradients(Vec3::Zero(), det);
        const Mat3 turned = axes.transpose() * J0.inverse().transpose();
        std::copy_n(turned.data(), 9,
                    std::copy_n(g.data(), g.size(), numbers.data() + L::points * L::of_point));
    }
}

template <ElementKind kind>
ElementFault simple_forces(const HyperelasticElement& element, const Hyperelastic& m,
                           const ElementPoints& x, HyperelasticState& state, ElementVector& forces)
{
    using L = Layout<kind>;
    using Number = typename L::Number;
    const Numbers<kind> e{element.numbers.data()};
    const VolumeParts lambda = volume_parts<kind>(m);
    const MeanVolume mean = mean_volume<kind>(e, x, lambda.mean);
    if (!(mean.J > 0)) return ElementFault::inverted;
    std::array<Number, 3 * L::n> f{};
    Number energy{};
    Answer<Number> answer;
    state.least_volume = std::numeric_limits<double>::infinity();
    for (int group = 0; group < L::groups; ++group) {
        const Gradient<Number> F = gradient(e, group, x);
        if (!respond(m, lambda.pointwise, mean.pressure, F, false, answer))
            return ElementFault::inverted;
        const Number volume = e.volumes(group);
        add_forces(e, group, stress(F, answer.r, volume), f);
        energy += volume * answer.r.energy;
        state.least_volume = std::min(state.least_volume, least(answer.at.J));
    }
    state.energy = mean.energy + sum(energy);
    for (std::size_t k = 0; k < f.size(); ++k)
        forces[Eigen::Index(k)] = sum(f[k]);
    return ElementFault::none;
}

template <ElementKind kind>
void simple_tangent(const HyperelasticElement& element, const Hyperelastic& m,
                    const ElementPoints& x, const HyperelasticState& state, ElementMatrix& K)
{
    using L = Layout<kind>;
    using Number = typename L::Number;
    const Numbers<kind> e{element.numbers.data()};
    const VolumeParts lambda = volume_parts<kind>(m);
    MeanVolume mean = mean_volume<kind>(e, x, lambda.mean);
    if (!std::isnan(state.pressure)) mean.pressure = state.pressure;
    NodeBlocks<L::n> blocks;
    std::array<Number, 3 * L::n> dv{}; // of the volume by the places
    Answer<Number> answer;
    Tangent<Number> A;
    for (int group = 0; group < L::groups; ++group) {
        const Gradient<Number> F = gradient(e, group, x);
        if (!respond(m, lambda.pointwise, mean.pressure, F, true, answer)) break; // cannot be
        const Number volume = e.volumes(group);
        tangent(F, answer.r, volume, A);
        blocks.add(e, group, A);
        if (!(lambda.mean > 0)) continue;
        Gradient<Number> c = cofactor(F);
        for (Number& entry : c)
            entry *= volume;
        add_forces(e, group, c, dv);
    }
    K.resize(3 * L::n, 3 * L::n);
    blocks.scatter(K);
    if (lambda.mean > 0) {
        Eigen::Matrix<double, 3 * L::n, 1> d;
        for (std::size_t k = 0; k < dv.size(); ++k)
            d[Eigen::Index(k)] = sum(dv[k]);
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
    Answer<typename L::Number> answer;
    for (int group = 0; group < L::groups; ++group) {
        auto F = gradient(e, group, x);
        if constexpr (L::modes)
            if (state.modes.size() == kModes)
                add_modes(e, group, x * e.centre().transpose(), Modes(state.modes), F);
        if (!respond(m, lambda.pointwise, 0, F, false, answer)) return out;
        for (int lane = 0; lane < L::width; ++lane) {
            const Point p = point_of(F, answer, lane);
            const double volume = e.volume(group * L::width + lane);
            tau += volume * p.F * p.S * p.F.transpose();
            now += volume * p.J;
        }
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
