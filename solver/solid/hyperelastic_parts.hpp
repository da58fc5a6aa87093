#pragma once

// What the two kinds of hyperelastic elements share: those of points alone (hyperelastic.cpp), and
// H8 with internal modes (hyperelastic_brick.cpp).

#include "solver/solid/hyperelastic.hpp"

#include <array>
#include <cmath>
#include <cstring>
#include <type_traits>

namespace amontons::hyperelastic_parts {

using Mat9 = Eigen::Matrix<double, 9, 9>;
/// Modes of the brick.
constexpr int kModes = kMostInternalModes;
using Modes = Eigen::Matrix<double, kModes, 1>;

/// How the numbers of an element lie: gradients of shapes and volume of each point, of H8 those of
/// its modes besides; each number of four points side by side, a group (T4: of its only point).
template <ElementKind kind> struct Layout {
    /// Nodes of an element.
    static constexpr int n = kind == ElementKind::T4 ? 4 : kind == ElementKind::T10 ? 10 : 8;
    /// Integration points.
    static constexpr int points = kind == ElementKind::T4 ? 1 : 8;
    /// Points in one register.
    static constexpr int width = kind == ElementKind::T4 ? 1 : 4;
    /// Registers of points.
    static constexpr int groups = points / width;
    /// True if the element has internal modes.
    static constexpr bool modes = kind == ElementKind::H8;
    static constexpr int volume = 3 * n, e = volume + 1, c = e + 3; ///< after the gradients
    static constexpr int of_point = modes ? c + 3 : volume + 1;
    /// Numbers stored for an element.
    static constexpr int size = points * of_point + (modes ? 3 * n + 9 : 0);
    /// One number, or one for each of four points.
    using Number = std::conditional_t<kind == ElementKind::T4, double, Four>;
    using Gradients = Eigen::Matrix<double, 3, n>;
    using Forces = Eigen::Matrix<double, 3, n>;
};

/// Access to the numbers stored for an element.
template <ElementKind kind> struct Numbers {
    /// Its layout.
    using L = Layout<kind>;
    /// One number, or one for each of four points.
    using Number = typename L::Number;
    /// The first number.
    const double* at;
    /// Number k of the points of a group.
    Number of_group(int group, int k) const
    {
        Number v;
        std::memcpy(&v, at + (group * L::of_point + k) * L::width, sizeof v);
        return v;
    }
    /// Volumes of a group of points [m^3].
    Number volumes(int group) const { return of_group(group, L::volume); }
    /// Of one point.
    auto gradients(int q) const
    {
        using Apart = Eigen::Stride<3 * L::width, L::width>;
        return Eigen::Map<const typename L::Gradients, 0, Apart>(of(q, 0));
    }
    /// Volume of point q [m^3].
    double volume(int q) const { return *of(q, L::volume); }
    /// Modes h of point q.
    Mat3 h(int q) const { return turned() * three(q, L::e).asDiagonal(); }
    /// Volume modes of point q.
    Vec3 c(int q) const { return three(q, L::c); }
    /// Gradients at the centre.
    auto centre() const
    {
        return Eigen::Map<const typename L::Gradients>(at + L::points * L::of_point);
    }
    /// Modes rotated with F0.
    auto turned() const { return Eigen::Map<const Mat3>(at + L::points * L::of_point + 3 * L::n); }

private:
    const double* of(int q, int k) const
    {
        return at + (q / L::width * L::of_point + k) * L::width + q % L::width;
    }
    Vec3 three(int q, int k) const { return {*of(q, k), *of(q, k + 1), *of(q, k + 2)}; }
};

/// Sum over lanes (the value itself of one).
inline double sum(double x)
{
    return x;
}
inline double sum(const Four& x)
{
    return (x[0] + x[1]) + (x[2] + x[3]);
}
/// The value of one lane.
inline double one_of(double x, int)
{
    return x;
}
inline double one_of(const Four& x, int lane)
{
    return x[lane];
}
/// Least value over lanes.
inline double least(double x)
{
    return x;
}
inline double least(const Four& x)
{
    return std::min(std::min(x[0], x[1]), std::min(x[2], x[3]));
}

/// sum_i x_i (x) g_i at the points of a group.
template <ElementKind kind>
Gradient<typename Layout<kind>::Number> gradient(const Numbers<kind>& e, int group,
                                                 const ElementPoints& x)
{
    Gradient<typename Layout<kind>::Number> F{};
    for (int i = 0; i < Layout<kind>::n; ++i)
        for (int J = 0; J < 3; ++J) {
            const auto g = e.of_group(group, 3 * i + J);
            for (int c = 0; c < 3; ++c)
                F[std::size_t(c + 3 * J)] += x(c, i) * g;
        }
    return F;
}

/// The law at the points of a group.
template <class Number> struct Answer {
    /// The strain.
    Strain<Number> at;
    /// The law's response.
    Response<Number> r;
};
/// @param lambda    its volumetric part that acts here
/// @param pressure  what besides acts on J
/// @param tangent   D too
/// @return  false where a point is inverted, or beyond numbers
template <class Number>
bool respond(const Hyperelastic& m, double lambda, double pressure, const Gradient<Number>& F,
             bool tangent, Answer<Number>& out)
{
    Strain<Number>& at = out.at;
    Response<Number>& r = out.r;
    at = strain_of(F);
    if (!(least(at.J) > 0)) return false;
    r = {};
    if constexpr (std::is_same_v<Number, double>)
        m.law->respond(m.constants, at, r);
    else
        m.law->respond_four(m.constants, at, r);
    const Number p = lambda * at.ln_J, pJ = pressure * at.J;
    r.energy += 0.5 * p * at.ln_J;
    r.a += p + pJ;
    r.b += lambda + pJ;
    r.c += p + pJ;
    r.add_volume(at, tangent);
    Number all = r.energy;
    for (const Number& s : r.S)
        all += s;
    for (std::size_t k = 0; tangent && k < r.D.size(); ++k)
        all += r.D[k];
    return std::isfinite(sum(all));
}

/// Volume times P = F S.
template <class Number>
Gradient<Number> stress(const Gradient<Number>& F, const Response<Number>& r, const Number& volume)
{
    Gradient<Number> P;
    for (std::size_t J = 0; J < 3; ++J) {
        const Number S[3] = {volume * r.S[kSix[0][J]], volume * r.S[kSix[1][J]],
                             volume * r.S[kSix[2][J]]};
        for (std::size_t c = 0; c < 3; ++c)
            P[c + 3 * J] = F[c] * S[0] + F[c + 3] * S[1] + F[c + 6] * S[2];
    }
    return P;
}

/// Adds P's forces on nodes, at the points of a group.
template <ElementKind kind, class Number>
void add_forces(const Numbers<kind>& e, int group, const Gradient<Number>& P,
                std::array<Number, 3 * Layout<kind>::n>& f)
{
    for (std::size_t i = 0; i < Layout<kind>::n; ++i)
        for (std::size_t J = 0; J < 3; ++J) {
            const Number g = e.of_group(group, int(3 * i + J));
            for (std::size_t c = 0; c < 3; ++c)
                f[3 * i + c] += P[c + 3 * J] * g;
        }
}

/// State of one integration point.
struct Point {
    /// Determinant of F.
    double J = 0;
    /// Deformation gradient and second Piola-Kirchhoff stress [Pa].
    Mat3 F, S;
};
/// State of the point in one lane of a group. @param answer  of the law at F
template <class Number>
Point point_of(const Gradient<Number>& F, const Answer<Number>& answer, int lane)
{
    Point p;
    p.J = one_of(answer.at.J, lane);
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
            p.F(i, j) = one_of(F[std::size_t(i + 3 * j)], lane);
            p.S(i, j) = one_of(answer.r.S[kSix[i][j]], lane);
        }
    return p;
}

/// Volume times dP/dF at the points of a group, by pairs of components: of P at c + 3 J, of F at
/// d + 3 L, A[9 (c + 3 J) + d + 3 L].
template <class Number> using Tangent = std::array<Number, 81>;
/// dP/dF at a point.
template <class Number>
void tangent(const Gradient<Number>& F, const Response<Number>& r, const Number& volume,
             Tangent<Number>& A)
{
    for (std::size_t c = 0; c < 3; ++c)
        for (std::size_t J = 0; J < 3; ++J) {
            Number by_strain[6]; // dP by the strain of each pair of axes
            for (std::size_t six = 0; six < 6; ++six)
                by_strain[six] = volume * (F[c] * r.D[of_triangle(kSix[0][J], six)] +
                                           F[c + 3] * r.D[of_triangle(kSix[1][J], six)] +
                                           F[c + 6] * r.D[of_triangle(kSix[2][J], six)]);
            for (std::size_t L = 0; L <= J; ++L)
                for (std::size_t d = 0; d < (L < J ? 3 : c + 1); ++d) {
                    Number a = by_strain[kSix[0][L]] * F[d] + by_strain[kSix[1][L]] * F[d + 3] +
                               by_strain[kSix[2][L]] * F[d + 6];
                    if (c == d) a += volume * r.S[kSix[J][L]];
                    A[9 * (c + 3 * J) + d + 3 * L] = A[9 * (d + 3 * L) + c + 3 * J] = a;
                }
        }
}
/// The tangent of the point in one lane, as a matrix.
template <class Number> Mat9 tangent_of(const Tangent<Number>& A, int lane)
{
    Mat9 one; // symmetric: rows are columns
    for (std::size_t k = 0; k < A.size(); ++k)
        one.data()[k] = one_of(A[k], lane);
    return one;
}

/// J F^-T, the derivative of J.
Mat3 cofactor(const Mat3& F);
template <class Number> Gradient<Number> cofactor(const Gradient<Number>& F)
{
    return {F[4] * F[8] - F[5] * F[7], F[5] * F[6] - F[3] * F[8], F[3] * F[7] - F[4] * F[6],
            F[7] * F[2] - F[8] * F[1], F[8] * F[0] - F[6] * F[2], F[6] * F[1] - F[7] * F[0],
            F[1] * F[5] - F[2] * F[4], F[2] * F[3] - F[0] * F[5], F[0] * F[4] - F[1] * F[3]};
}

/// Adds (gradients)^T A (gradients) for each pair of axes, lower triangle of the pairs.
template <int n> struct NodeBlocks {
    /// Whole registers of four: products of ten rows by Eigen's general way took a third of a step.
    static constexpr int rows = (n + 3) / 4 * 4;
    /// The six parts of symmetric 3 x 3 blocks.
    std::array<Eigen::Matrix<double, rows, n>, 6> of;
    NodeBlocks()
    {
        for (auto& b : of)
            b.setZero();
    }
    /// At one point. @param A  dP/dF, with the volume
    void add(const Eigen::Matrix<double, 3, n>& g, const Mat9& A)
    {
        const Left left = rows_of(g);
        visit([&](int c, int d, auto& block) {
            Mat3 part;
            for (int L = 0; L < 3; ++L)
                for (int J = 0; J < 3; ++J)
                    part(J, L) = A(c + 3 * J, d + 3 * L);
            for (int j = 0; j < n; ++j) {
                const Vec3 right = part * g.col(j);
                block.col(j) +=
                    left.col(0) * right[0] + left.col(1) * right[1] + left.col(2) * right[2];
            }
        });
    }
    /// At the points of a group, with the element's own gradients.
    template <ElementKind kind, class Number>
    void add(const Numbers<kind>& e, int group, const Tangent<Number>& A)
    {
        constexpr int width = Layout<kind>::width;
        std::array<Left, std::size_t(width)> left;
        for (int lane = 0; lane < width; ++lane)
            left[std::size_t(lane)] = rows_of(e.gradients(group * width + lane));
        visit([&](int c, int d, auto& block) {
            for (int j = 0; j < n; ++j) {
                Number right[3];
                for (int J = 0; J < 3; ++J) {
                    const Number* const row = A.data() + 9 * (c + 3 * J) + d;
                    right[J] = row[0] * e.of_group(group, 3 * j) +
                               row[3] * e.of_group(group, 3 * j + 1) +
                               row[6] * e.of_group(group, 3 * j + 2);
                }
                Eigen::Matrix<double, rows, 1> sum = block.col(j);
                for (int lane = 0; lane < width; ++lane)
                    for (int J = 0; J < 3; ++J)
                        sum += left[std::size_t(lane)].col(J) * one_of(right[J], lane);
                block.col(j) = sum;
            }
        });
    }
    /// Adds the blocks to K.
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

private:
    using Left = Eigen::Matrix<double, rows, 3>;
    template <class G> static Left rows_of(const G& g)
    {
        Left left = Left::Zero();
        left.template topRows<n>() = g.transpose();
        return left;
    }
    template <class Work> void visit(Work work)
    {
        std::size_t k = 0;
        for (int c = 0; c < 3; ++c)
            for (int d = c; d < 3; ++d)
                work(c, d, of[k++]);
    }
};

/// Shares of lambda at the points and at the mean.
struct VolumeParts {
    double pointwise = 0, mean = 0; ///< lambda [Pa]
};

/// The smallest shear modulus at rest [Pa].
double softest_shear(const Hyperelastic& m);

/// The shares of a law for a kind of element.
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
    double V = 0, J = 1, pressure = 0, stiffness = 0; ///< volume [m^3], J, U' and U'' [Pa]
    /// Of the mean part [J].
    double energy = 0;
    MeanVolume(double volume, double now, double lambda) : V(volume), J(now / volume)
    {
        const double ln_J = std::log(J);
        energy = 0.5 * lambda * V * ln_J * ln_J;
        pressure = lambda * ln_J / J;
        stiffness = lambda * (1 - ln_J) / (J * J);
    }
};

/// The mean part of an element at places x. @param lambda  Lame's, its mean part [Pa]
template <ElementKind kind>
MeanVolume mean_volume(const Numbers<kind>& e, const ElementPoints& x, double lambda)
{
    typename Layout<kind>::Number V{}, v{};
    for (int group = 0; group < Layout<kind>::groups; ++group) {
        V += e.volumes(group);
        if (lambda > 0) v += e.volumes(group) * determinant(gradient(e, group, x));
    }
    return {sum(V), sum(lambda > 0 ? v : V), lambda};
}

/// Adds what H8's modes are of F at the points of a group. @param F0  F at the centre
void add_modes(const Numbers<ElementKind::H8>& e, int group, const Mat3& F0, const Modes& a,
               Gradient<Four>& F);

/// Forces of an H8; its modes are brought to equilibrium.
ElementFault brick_forces(const HyperelasticElement& element, const Hyperelastic& m,
                          const ElementPoints& x, HyperelasticState& state, ElementVector& forces);
/// Tangent of an H8, condensed, at the equilibrium of brick_forces().
void brick_tangent(const HyperelasticElement& element, const Hyperelastic& m,
                   const ElementPoints& x, const HyperelasticState& state, ElementMatrix& result);

} // namespace amontons::hyperelastic_parts
