#pragma once

#include "mesh/base/error.hpp"
#include "mesh/base/types.hpp"

#include <Eigen/Core>
#include <array>
#include <span>
#include <string>
#include <string_view>
#include <vector>

// Hyperelastic materials: energy, stress and tangent of one point. All laws stand in law.cpp, one
// entry of a table each with its constants and their ranges; the elements follow from it.
//
// A law is a function of C = F^T F, so that it is objective by construction. What resists a change
// of volume alone is apart from it, the same for all laws that have it: lambda/2 (ln J)^2, which
// elements may take at a mean J (solver/solid/hyperelastic.hpp). Symmetric tensors are vectors of
// six in VTK's order XX YY ZZ XY YZ XZ, strains with engineering shears. Laws with a direction have
// it along x: elements bring C into the fibres' axes.

namespace amontons {

// The same names as in solver/solid/material.hpp, which is of linear elasticity.
using Vec6 = Eigen::Matrix<double, 6, 1>;
using Mat6 = Eigen::Matrix<double, 6, 6>;

constexpr int kMostConstants = 8;
using MaterialConstants = std::array<double, kMostConstants>;

/// What a point answers to C.
struct PointResponse {
    double energy = 0;     ///< W, 0 at rest [J/m^3]
    Vec6 S = Vec6::Zero(); ///< 2 dW/dC, second Piola-Kirchhoff stress [Pa]
    Mat6 D = Mat6::Zero(); ///< 2 dS/dC, symmetric [Pa]
};

/// One number that a law asks for.
struct MaterialConstant {
    const char* name = "";
    const char* unit = "";
    const char* doc = "";
    double lower = 0, upper = 0; ///< upper 0: none
    bool above = true;           ///< the lower bound itself is not allowed
};

/// How a material answers to small strains at rest.
struct SmallStrains {
    double shear = 0;  ///< mu [Pa]; of a directed law the largest
    double lambda = 0; ///< Lame's [Pa]
};

struct MaterialLaw {
    std::string_view name;
    const char* doc = "";
    std::vector<MaterialConstant> constants;
    bool directed = false; ///< stiffer along fibres, which a body must then have
    /// The law without what is counted by volumetric().
    void (*respond)(const MaterialConstants& c, const Mat3& C, PointResponse& out) = nullptr;
    /// lambda of lambda/2 (ln J)^2 [Pa]; 0: the law has no such part.
    double (*volumetric)(const MaterialConstants& c) = nullptr;
    SmallStrains (*small)(const MaterialConstants& c) = nullptr;
    double least_stretch = 0; ///< pressed below it, a bar of it is unstable; 0: never
};

/// All of them, in the order in which they are told.
std::span<const MaterialLaw> material_laws();
/// @returns  nullptr if there is none of that name
const MaterialLaw* find_law(std::string_view name);

/// A law with its numbers.
struct Hyperelastic {
    const MaterialLaw* law = nullptr;
    MaterialConstants constants{};
};

/// Everything that is wrong with a material's numbers, each and together; empty if nothing is.
std::vector<Issue> issues_of(const Hyperelastic& m, const std::string& file,
                             const std::string& place);

/// Young's modulus [Pa] and Poisson's ratio at rest.
double youngs_modulus(const Hyperelastic& m);
double poissons_ratio(const Hyperelastic& m);

/// The whole response of a point, volume included.
/// @param F  det F > 0; along a directed law's fibres F = (gradient) Q, Q's first column the fibre
PointResponse point_response(const Hyperelastic& m, const Mat3& F);

/// Adds a C^-1 to S and b C^-1 (x) C^-1 - 2 c I_(C^-1) to D, with (I_X)_ijkl = (X_ik X_jl + X_il
/// X_jk) / 2: what any function of J alone adds.
void add_volumetric(const Mat3& C_inverse, double a, double b, double c, PointResponse& out);

} // namespace amontons
