#include "solver/material/law.hpp"

#include "mesh/format/text.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

// A new material is a namespace and an entry of the table at the end; nothing else changes.

namespace amontons {
namespace {

constexpr MaterialConstant kYoung{"youngs_modulus", "Pa", "Young's modulus at rest.", 0, 0, true};
constexpr double kMostPoisson = 0.4999999;

Vec6 six(const Mat3& A)
{
    return {A(0, 0), A(1, 1), A(2, 2), A(0, 1), A(1, 2), A(0, 2)};
}

/// Green's strain with engineering shears.
Vec6 green(const Mat3& C)
{
    return {
        0.5 * (C(0, 0) - 1), 0.5 * (C(1, 1) - 1), 0.5 * (C(2, 2) - 1), C(0, 1), C(1, 2), C(0, 2)};
}

double shear_of(double E, double nu)
{
    return E / (2 * (1 + nu));
}

double lambda_of(double mu, double nu)
{
    return 2 * mu * nu / (1 - 2 * nu);
}

// Linear in Green's strain: lambda/2 (tr E)^2 + mu E : E. It gives way to compression: a bar that
// is pressed below 1/sqrt(3) of its length loses its stiffness, and nothing keeps J above 0.
namespace svk {
constexpr MaterialConstant kPoisson{"poisson_ratio", "",  "Poisson's ratio at rest.", -1,
                                    kMostPoisson,    true};
void respond(const MaterialConstants& c, const Mat3& C, PointResponse& out)
{
    const double mu = shear_of(c[0], c[1]), lambda = lambda_of(mu, c[1]);
    const Vec6 e = green(C);
    out.D.setZero();
    out.D.topLeftCorner<3, 3>().setConstant(lambda);
    out.D.diagonal() += (Vec6{} << 2 * mu, 2 * mu, 2 * mu, mu, mu, mu).finished();
    out.S = out.D * e;
    out.energy = 0.5 * e.dot(out.S);
}
double volumetric(const MaterialConstants&)
{
    return 0;
}
SmallStrains small(const MaterialConstants& c)
{
    const double mu = shear_of(c[0], c[1]);
    return {mu, lambda_of(mu, c[1])};
}
} // namespace svk

// mu/2 (tr C - 3) - mu ln J + lambda/2 (ln J)^2
namespace neo_hooke {
constexpr MaterialConstant kPoisson{"poisson_ratio", "",   "Poisson's ratio at rest.", 0,
                                    kMostPoisson,    false};
void respond(const MaterialConstants& c, const Mat3& C, PointResponse& out)
{
    const double mu = shear_of(c[0], c[1]), ln_J = 0.5 * std::log(C.determinant());
    out.energy = 0.5 * mu * (C.trace() - 3) - mu * ln_J;
    out.S << mu, mu, mu, 0, 0, 0;
    out.D.setZero();
    add_volumetric(C.inverse(), -mu, 0, -mu, out);
}
double volumetric(const MaterialConstants& c)
{
    return lambda_of(shear_of(c[0], c[1]), c[1]);
}
SmallStrains small(const MaterialConstants& c)
{
    return svk::small(c);
}
} // namespace neo_hooke

// c1 (I1 - 3) + c2 (I2 - 3) - (2 c1 + 4 c2) ln J + lambda/2 (ln J)^2; the first three alone have
// Lame's lambda 4 c2 at rest.
namespace mooney_rivlin {
void respond(const MaterialConstants& c, const Mat3& C, PointResponse& out)
{
    const double c1 = c[0], c2 = c[1], d = 2 * c1 + 4 * c2;
    const double ln_J = 0.5 * std::log(C.determinant()), I1 = C.trace();
    const double I2 = 0.5 * (I1 * I1 - C.squaredNorm());
    out.energy = c1 * (I1 - 3) + c2 * (I2 - 3) - d * ln_J;
    out.S = -2 * c2 * six(C);
    out.S.head<3>().array() += 2 * c1 + 2 * c2 * I1;
    out.D.setZero();
    out.D.topLeftCorner<3, 3>().setConstant(4 * c2);
    out.D.diagonal() -= (Vec6{} << 4, 4, 4, 2, 2, 2).finished() * c2;
    add_volumetric(C.inverse(), -d, 0, -d, out);
}
double volumetric(const MaterialConstants& c)
{
    return lambda_of(2 * (c[0] + c[1]), c[2]) - 4 * c[1];
}
SmallStrains small(const MaterialConstants& c)
{
    const double mu = 2 * (c[0] + c[1]);
    return {mu, lambda_of(mu, c[2])};
}
} // namespace mooney_rivlin

// c/2 (exp Q - 1) + K/2 (ln J)^2, Q = bf E_ff^2 + bt (E_ss^2 + E_nn^2 + 2 E_sn^2)
// + 2 bfs (E_fs^2 + E_fn^2): passive muscle, fibres f, sheets s, across them n.
namespace guccione {
void respond(const MaterialConstants& c, const Mat3& C, PointResponse& out)
{
    const double bf = c[1], bt = c[2], bfs = c[3];
    const Vec6 b{bf, bt, bt, 0.5 * bfs, 0.5 * bt, 0.5 * bfs}, e = green(C);
    const Vec6 be = b.cwiseProduct(e);
    const double Q = e.dot(be), w = c[0] * std::exp(Q);
    out.energy = 0.5 * c[0] * std::expm1(Q);
    out.S = w * be;
    out.D = 2 * w * be * be.transpose();
    out.D.diagonal() += w * b;
}
double volumetric(const MaterialConstants& c)
{
    return c[4];
}
SmallStrains small(const MaterialConstants& c)
{
    return {0.5 * c[0] * std::max({c[1], c[2], c[3]}), c[4]};
}
} // namespace guccione

const std::array<MaterialLaw, 4>& table()
{
    static const std::array<MaterialLaw, 4> laws{{
        {"st_venant_kirchhoff",
         "Linear between Green's strain and the second Piola-Kirchhoff stress; for large turns and "
         "moderate strains.",
         {kYoung, svk::kPoisson},
         false,
         svk::respond,
         svk::volumetric,
         svk::small,
         0.57735026918962576},
        {"neo_hooke",
         "mu/2 (tr C - 3) - mu ln J + lambda/2 (ln J)^2.",
         {kYoung, neo_hooke::kPoisson},
         false,
         neo_hooke::respond,
         neo_hooke::volumetric,
         neo_hooke::small},
        {"mooney_rivlin",
         "c1 (I1 - 3) + c2 (I2 - 3) - (2 c1 + 4 c2) ln J + lambda/2 (ln J)^2.",
         {{"c1", "Pa", "Of the first invariant.", 0, 0, true},
          {"c2", "Pa", "Of the second invariant.", 0, 0, false},
          {"poisson_ratio", "", "Poisson's ratio at rest; no less than c2 allows.", 0, kMostPoisson,
           false}},
         false,
         mooney_rivlin::respond,
         mooney_rivlin::volumetric,
         mooney_rivlin::small},
        {"guccione",
         "c/2 (exp Q - 1) + K/2 (ln J)^2, Q = bf E_ff^2 + bt (E_ss^2 + E_nn^2 + 2 E_sn^2) + 2 bfs "
         "(E_fs^2 + E_fn^2), f along the fibres.",
         {{"c", "Pa", "Stiffness.", 0, 0, true},
          {"bf", "", "Along the fibres.", 0, 0, true},
          {"bt", "", "Across them.", 0, 0, true},
          {"bfs", "", "Of shear along them.", 0, 0, true},
          {"bulk_modulus", "Pa", "K, against a change of volume.", 0, 0, true}},
         true,
         guccione::respond,
         guccione::volumetric,
         guccione::small},
    }};
    return laws;
}

} // namespace

std::span<const MaterialLaw> material_laws()
{
    return table();
}

const MaterialLaw* find_law(std::string_view name)
{
    for (const MaterialLaw& law : table())
        if (law.name == name) return &law;
    return nullptr;
}

std::vector<Issue> issues_of(const Hyperelastic& m, const std::string& file,
                             const std::string& place)
{
    AMONTONS_ASSERT(m.law != nullptr);
    std::vector<Issue> issues;
    for (std::size_t i = 0; i < m.law->constants.size(); ++i) {
        const MaterialConstant& k = m.law->constants[i];
        const double v = m.constants[i];
        const bool low = k.above ? v > k.lower : v >= k.lower;
        if (low && (k.upper == 0 || v <= k.upper) && std::isfinite(v)) continue;
        std::string allowed = (k.above ? "> " : ">= ") + number_text(k.lower);
        if (k.upper != 0) allowed += " and <= " + number_text(k.upper);
        if (*k.unit) allowed += std::string(" [") + k.unit + "]";
        issues.push_back({file, place + "/" + k.name, number_text(v), allowed});
    }
    if (issues.empty() && m.law->volumetric(m.constants) < 0)
        issues.push_back({file, place + "/poisson_ratio", number_text(poissons_ratio(m)),
                          "a larger one (or a smaller c2): the resistance to a change of volume "
                          "would be negative"});
    return issues;
}

double youngs_modulus(const Hyperelastic& m)
{
    const SmallStrains s = m.law->small(m.constants);
    return s.shear * (3 * s.lambda + 2 * s.shear) / (s.lambda + s.shear);
}

double poissons_ratio(const Hyperelastic& m)
{
    const SmallStrains s = m.law->small(m.constants);
    return s.lambda / (2 * (s.lambda + s.shear));
}

void add_volumetric(const Mat3& C_inverse, double a, double b, double c, PointResponse& out)
{
    constexpr int at[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {0, 2}};
    const Vec6 x = six(C_inverse);
    const Mat3& X = C_inverse;
    out.S += a * x;
    for (int p = 0; p < 6; ++p)
        for (int q = 0; q <= p; ++q) {
            const int i = at[p][0], j = at[p][1], k = at[q][0], l = at[q][1];
            const double value = b * x[p] * x[q] - c * (X(i, k) * X(j, l) + X(i, l) * X(j, k));
            out.D(p, q) += value;
            if (q < p) out.D(q, p) += value;
        }
}

PointResponse point_response(const Hyperelastic& m, const Mat3& F)
{
    PointResponse out;
    const Mat3 C = F.transpose() * F;
    m.law->respond(m.constants, C, out);
    const double lambda = m.law->volumetric(m.constants);
    if (lambda > 0) {
        const double ln_J = std::log(F.determinant());
        out.energy += 0.5 * lambda * ln_J * ln_J;
        add_volumetric(C.inverse(), lambda * ln_J, lambda, lambda * ln_J, out);
    }
    return out;
}

} // namespace amontons
