#pragma once

#include "mesh/base/error.hpp"

#include <Eigen/Core>
#include <cmath>

// Symmetric tensors are vectors of six in VTK's order, XX YY ZZ XY YZ XZ. Stresses hold the
// tensor's components, strains twice the mixed ones (engineering shears), so that stress . strain
// is twice the energy density.

namespace amontons {

using Vec6 = Eigen::Matrix<double, 6, 1>;
using Mat6 = Eigen::Matrix<double, 6, 6>;

/// Linear isotropic elasticity.
struct SolidMaterial {
    double youngs_modulus = 0; ///< E [Pa], > 0
    double poissons_ratio = 0; ///< nu [-], > -1 and < 0.5
    double density = 0;        ///< [kg/m^3], >= 0; 0: no inertia and no weight
};

/// Everything that is wrong with a material; empty if nothing is.
/// @param file, place  where it was read, for the messages: place + "/youngs_modulus" and so on
std::vector<Issue> issues_of(const SolidMaterial& m, const std::string& file,
                             const std::string& place);

double lame_lambda(const SolidMaterial& m);   ///< E nu / ((1 + nu) (1 - 2 nu)) [Pa]
double shear_modulus(const SolidMaterial& m); ///< E / (2 (1 + nu)) [Pa]
double bulk_modulus(const SolidMaterial& m);  ///< E / (3 (1 - 2 nu)) [Pa]

/// C in stress = C strain, symmetric positive definite [Pa].
Mat6 elasticity_matrix(const SolidMaterial& m);

/// Of a stress [Pa].
inline double von_mises(const Vec6& s)
{
    const double a = s[0] - s[1], b = s[1] - s[2], c = s[2] - s[0];
    return std::sqrt(0.5 * (a * a + b * b + c * c) + 3 * (s[3] * s[3] + s[4] * s[4] + s[5] * s[5]));
}

} // namespace amontons
