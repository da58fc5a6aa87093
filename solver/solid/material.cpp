#include "solver/solid/material.hpp"

#include "mesh/base/text.hpp"

#include <cmath>

namespace amontons {

std::vector<Issue> issues_of(const SolidMaterial& m, const std::string& file,
                             const std::string& place)
{
    std::vector<Issue> issues;
    const auto require = [&](bool holds, double value, const char* name, const char* allowed) {
        if (!holds || !std::isfinite(value))
            issues.push_back({file, place + "/" + name, number_text(value), allowed});
    };
    require(m.youngs_modulus > 0, m.youngs_modulus, "youngs_modulus", "> 0 and finite [Pa]");
    require(m.poissons_ratio > -1 && m.poissons_ratio < 0.5, m.poissons_ratio, "poissons_ratio",
            "> -1 and < 0.5");
    require(m.density >= 0, m.density, "density", ">= 0 and finite [kg/m^3]");
    return issues;
}

double lame_lambda(const SolidMaterial& m)
{
    const double nu = m.poissons_ratio;
    return m.youngs_modulus * nu / ((1 + nu) * (1 - 2 * nu));
}

double shear_modulus(const SolidMaterial& m)
{
    return m.youngs_modulus / (2 * (1 + m.poissons_ratio));
}

double bulk_modulus(const SolidMaterial& m)
{
    return m.youngs_modulus / (3 * (1 - 2 * m.poissons_ratio));
}

Mat6 elasticity_matrix(const SolidMaterial& m)
{
    const double mu = shear_modulus(m);
    Mat6 C = Mat6::Zero();
    C.topLeftCorner<3, 3>().setConstant(lame_lambda(m));
    C.diagonal() += (Vec6{} << 2 * mu, 2 * mu, 2 * mu, mu, mu, mu).finished();
    return C;
}

} // namespace amontons
