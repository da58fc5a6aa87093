#pragma once

#include "mesh/base/error.hpp"
#include "mesh/base/types.hpp"

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <span>
#include <string>
#include <string_view>
#include <vector>

// Hyperelastic materials: energy, stress and tangent of one point. All laws stand in law.cpp, one
// entry of a table each with its constants and their ranges; elements work with any of them.
//
// A law is a function of C = F^T F, so that it is objective by construction. The volumetric part is
// separate and the same for all laws that have one: lambda/2 (ln J)^2, which elements may evaluate
// at a mean J (solver/solid/hyperelastic.hpp). Symmetric tensors are vectors of
// six in VTK's order XX YY ZZ XY YZ XZ, strains with engineering shears. Laws with a direction have
// it along x: elements bring C into the fibres' axes.

namespace amontons {

// The same names as in solver/solid/material.hpp, which is of linear elasticity.
using Vec6 = Eigen::Matrix<double, 6, 1>;
using Mat6 = Eigen::Matrix<double, 6, 6>;

/// Most constants of a law.
constexpr int kMostConstants = 8;
using MaterialConstants = std::array<double, kMostConstants>;

#ifdef __GNUC__ // how vectors are passed depends on the registers: here they stay within a file
#pragma GCC diagnostic ignored "-Wpsabi"
#endif

/// Values at four points in one vector register: laws are evaluated at one point or at four.
typedef double Four __attribute__((vector_size(32)));

/// Natural logarithm, of one number or four.
inline double ln(double x)
{
    return std::log(x);
}
inline Four ln(const Four& x)
{
    return Four{std::log(x[0]), std::log(x[1]), std::log(x[2]), std::log(x[3])};
}
/// exp(x) - 1 without cancellation, of one number or four.
inline double exp_less_one(double x)
{
    return std::expm1(x);
}
inline Four exp_less_one(const Four& x)
{
    return Four{std::expm1(x[0]), std::expm1(x[1]), std::expm1(x[2]), std::expm1(x[3])};
}

/// A 3 x 3 by columns. @tparam Number  here and below: double or Four
template <class Number> using Gradient = std::array<Number, 9>;

/// Where entry (i, j) of a symmetric tensor stands in its six numbers.
constexpr std::size_t kSix[3][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}};
/// ... and of a symmetric 6 x 6 in the rows of its lower triangle.
constexpr std::size_t of_triangle(std::size_t i, std::size_t j)
{
    return i >= j ? i * (i + 1) / 2 + j : j * (j + 1) / 2 + i;
}

/// The strain at which a law is evaluated; shear components are those of the tensor (not doubled).
template <class Number> struct Strain {
    /// Right Cauchy-Green strain and its inverse, in VTK's order.
    std::array<Number, 6> C, C_inverse;
    /// det F and its logarithm.
    Number J, ln_J;
};
/// @param F  det F > 0, or ln_J is no number
template <class Number> Number determinant(const Gradient<Number>& F);
/// Strain of a deformation gradient.
template <class Number> Strain<Number> strain_of(const Gradient<Number>& F);

/// Energy, stress and tangent of a point, to which each part of a law adds its own.
template <class Number> struct Response {
    Number energy{};            ///< W, 0 at rest [J/m^3]
    std::array<Number, 6> S{};  ///< 2 dW/dC, second Piola-Kirchhoff stress [Pa]
    std::array<Number, 21> D{}; ///< 2 dS/dC [Pa]
    /// Coefficients of the terms of functions of J alone [Pa], which add_volume() adds: a C^-1 to
    /// S, and b C^-1 (x) C^-1 - 2 c I_(C^-1) to D, (I_X)_ijkl = (X_ik X_jl + X_il X_jk) / 2.
    Number a{}, b{}, c{};

    /// Adds these terms. @param tangent  to D, too
    void add_volume(const Strain<Number>& at, bool tangent);
};

/// Energy, stress and tangent of a point at a strain C.
struct PointResponse {
    double energy = 0;     ///< W, 0 at rest [J/m^3]
    Vec6 S = Vec6::Zero(); ///< 2 dW/dC, second Piola-Kirchhoff stress [Pa]
    Mat6 D = Mat6::Zero(); ///< 2 dS/dC, symmetric [Pa]
};

/// One constant of a law.
struct MaterialConstant {
    const char* name = "";
    /// Unit, "" for none.
    const char* unit = "";
    /// What it is, for the reference page.
    const char* doc = "";
    double lower = 0, upper = 0; ///< upper 0: none [its unit]
    bool above = true;           ///< the lower bound itself is not allowed
};

/// Moduli of a material for small strains about its reference state.
struct SmallStrains {
    double shear = 0;  ///< mu [Pa]; of a directed law the largest
    double lambda = 0; ///< Lame's [Pa]
};

/// A hyperelastic law: its constants and functions.
struct MaterialLaw {
    std::string_view name;
    /// What it is, for the reference page.
    const char* doc = "";
    std::vector<MaterialConstant> constants;
    bool directed = false; ///< stiffer along fibres, which a body must then have
    /// The response without the volumetric() part.
    void (*respond)(const MaterialConstants& c, const Strain<double>& at,
                    Response<double>& out) = nullptr;
    void (*respond_four)(const MaterialConstants& c, const Strain<Four>& at,
                         Response<Four>& out) = nullptr;
    /// lambda of lambda/2 (ln J)^2 [Pa]; 0: the law has no such part.
    double (*volumetric)(const MaterialConstants& c) = nullptr;
    /// Moduli at small strains.
    SmallStrains (*small)(const MaterialConstants& c) = nullptr;
    double least_stretch = 0; ///< pressed below it, a bar of it is unstable; 0: never (ratio)
};

/// All laws, in the order of the reference page.
std::span<const MaterialLaw> material_laws();
/// @returns  nullptr if there is none of that name
const MaterialLaw* find_law(std::string_view name);

/// A law with its constants.
struct Hyperelastic {
    const MaterialLaw* law = nullptr;
    MaterialConstants constants{};
};

/// Everything that is wrong with a material's constants, each and in combination; empty if valid.
std::vector<Issue> issues_of(const Hyperelastic& m, const std::string& file,
                             const std::string& place);

/// Young's modulus [Pa] and Poisson's ratio at rest.
double youngs_modulus(const Hyperelastic& m);
/// Poisson's ratio at small strains.
double poissons_ratio(const Hyperelastic& m);

/// The whole response of a point, with the volumetric part.
/// @param F  det F > 0; along a directed law's fibres F = (gradient) Q, Q's first column the fibre
PointResponse point_response(const Hyperelastic& m, const Mat3& F);

template <class Number> Number determinant(const Gradient<Number>& F)
{
    return F[0] * (F[4] * F[8] - F[5] * F[7]) + F[1] * (F[5] * F[6] - F[3] * F[8]) +
           F[2] * (F[3] * F[7] - F[4] * F[6]);
}

template <class Number> Strain<Number> strain_of(const Gradient<Number>& F)
{
    Strain<Number> s;
    std::array<Number, 6>& C = s.C;
    for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j <= i; ++j)
            C[kSix[i][j]] =
                F[3 * i] * F[3 * j] + F[3 * i + 1] * F[3 * j + 1] + F[3 * i + 2] * F[3 * j + 2];
    s.J = determinant(F);
    s.ln_J = ln(s.J);
    s.C_inverse = {C[1] * C[2] - C[4] * C[4], C[0] * C[2] - C[5] * C[5], C[0] * C[1] - C[3] * C[3],
                   C[4] * C[5] - C[3] * C[2], C[3] * C[5] - C[0] * C[4], C[3] * C[4] - C[1] * C[5]};
    const Number share =
        1 / (C[0] * s.C_inverse[0] + C[3] * s.C_inverse[3] + C[5] * s.C_inverse[5]);
    for (Number& entry : s.C_inverse)
        entry *= share;
    return s;
}

/// Adds the volumetric part: energy, stress and, if requested, tangent.
template <class Number> void Response<Number>::add_volume(const Strain<Number>& at, bool tangent)
{
    constexpr std::size_t axes[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {0, 2}};
    const std::array<Number, 6>& X = at.C_inverse;
    for (std::size_t p = 0; p < 6; ++p)
        S[p] += a * X[p];
    if (!tangent) return;
    for (std::size_t p = 0; p < 6; ++p)
        for (std::size_t q = 0; q <= p; ++q) {
            const std::size_t i = axes[p][0], j = axes[p][1], k = axes[q][0], l = axes[q][1];
            D[of_triangle(p, q)] += b * X[p] * X[q] - c * (X[kSix[i][k]] * X[kSix[j][l]] +
                                                           X[kSix[i][l]] * X[kSix[j][k]]);
        }
}

} // namespace amontons
