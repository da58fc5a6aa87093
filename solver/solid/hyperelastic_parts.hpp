#pragma once

// What the two kinds of hyperelastic elements share: those of points alone (hyperelastic.cpp), and
// H8 with internal modes (hyperelastic_brick.cpp).

#include "solver/solid/hyperelastic.hpp"

#include <array>
#include <cmath>

namespace amontons::hyperelastic_parts {

using Mat9 = Eigen::Matrix<double, 9, 9>;
constexpr int kModes = kMostInternalModes;
using Modes = Eigen::Matrix<double, kModes, 1>;

/// How the numbers of an element lie: gradients of shapes and volume of each point, of H8 those of
/// its modes besides.
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

/// The law at a point, with `lambda` of its volumetric part.
struct Point {
    double J = 0;
    Mat3 C_inverse;
    PointResponse r;
};

/// False where it is inverted.
bool respond(const Hyperelastic& m, double lambda, const Mat3& F, Point& p);
Mat3 full(const Vec6& s);
/// dP/dF.
Mat9 tangent(const Mat3& F, const Mat3& S, const Mat6& D);
/// J F^-T, the derivative of J.
Mat3 cofactor(const Mat3& F);

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
double softest_shear(const Hyperelastic& m);

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

/// F of H8's modes at point q, over F at the centre.
Mat3 mode_gradient(const Numbers<ElementKind::H8>& e, int q, const Modes& a);

ElementFault brick_forces(const HyperelasticElement& element, const Hyperelastic& m,
                          const ElementPoints& x, HyperelasticState& state, ElementVector& forces);
void brick_tangent(const HyperelasticElement& element, const Hyperelastic& m,
                   const ElementPoints& x, const HyperelasticState& state, ElementMatrix& result);

} // namespace amontons::hyperelastic_parts
