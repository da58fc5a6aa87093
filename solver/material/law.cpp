#include "solver/material/law.hpp"

#include "mesh/base/text.hpp"

#include <algorithm>
#include <cmath>

// A new material is a namespace and an entry of the table at the end; nothing else changes.

namespace amontons {
namespace {

constexpr MaterialConstant kYoung{"youngs_modulus", "Pa", "Young's modulus at rest.", 0, 0, true};
constexpr double kMostPoisson = 0.4999999;

/// Green's strain with engineering shears.
template <class Number> std::array<Number, 6> green(const std::array<Number, 6>& C)
{
    return {0.5 * (C[0] - 1), 0.5 * (C[1] - 1), 0.5 * (C[2] - 1), C[3], C[4], C[5]};
}

template <class Number> Number trace(const std::array<Number, 6>& C)
{
    return C[0] + C[1] + C[2];
}

/// Adds it to a diagonal of D: v where axes touch themselves, half of it to shears.
template <class Number> void add_diagonal(double v, Response<Number>& out)
{
    for (std::size_t p = 0; p < 6; ++p)
        out.D[of_triangle(p, p)] += p < 3 ? v : 0.5 * v;
}

/// Adds it for pairs of axes.
template <class Number> void add_block(double v, Response<Number>& out)
{
    for (std::size_t p = 0; p < 3; ++p)
        for (std::size_t q = 0; q <= p; ++q)
            out.D[of_triangle(p, q)] += v;
}

double shear_of(double E, double nu)
{
    return E / (2 * (1 + nu));
}

double lambda_of(double mu, double nu)
{
    return 2 * mu * nu / (1 - 2 * nu);
}

// Linear in Green's strain: lambda/2 (tr E)^2 + mu E : E. It softens under compression: a bar that
// is pressed below 1/sqrt(3) of its length loses its stiffness, and nothing keeps J above 0.
namespace svk {
constexpr MaterialConstant kPoisson{"poisson_ratio", "",  "Poisson's ratio at rest.", -1,
                                    kMostPoisson,    true};
template <class Number>
void respond(const MaterialConstants& c, const Strain<Number>& at, Response<Number>& out)
{
    const double mu = shear_of(c[0], c[1]), lambda = lambda_of(mu, c[1]);
    const std::array<Number, 6> e = green(at.C);
    add_block(lambda, out);
    add_diagonal(2 * mu, out);
    const Number of_all = lambda * trace(e);
    for (std::size_t p = 0; p < 6; ++p) {
        out.S[p] = p < 3 ? of_all + 2 * mu * e[p] : mu * e[p];
        out.energy += 0.5 * e[p] * out.S[p];
    }
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
template <class Number>
void respond(const MaterialConstants& c, const Strain<Number>& at, Response<Number>& out)
{
    const double mu = shear_of(c[0], c[1]);
    out.energy = 0.5 * mu * (trace(at.C) - 3) - mu * at.ln_J;
    for (std::size_t p = 0; p < 3; ++p)
        out.S[p] += mu;
    out.a -= mu;
    out.c -= mu;
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
template <class Number>
void respond(const MaterialConstants& c, const Strain<Number>& at, Response<Number>& out)
{
    const double c1 = c[0], c2 = c[1], d = 2 * c1 + 4 * c2;
    const std::array<Number, 6>& C = at.C;
    const Number I1 = trace(C), I2 = C[0] * C[1] + C[1] * C[2] + C[2] * C[0] - C[3] * C[3] -
                                     C[4] * C[4] - C[5] * C[5];
    out.energy = c1 * (I1 - 3) + c2 * (I2 - 3) - d * at.ln_J;
    for (std::size_t p = 0; p < 6; ++p)
        out.S[p] = p < 3 ? 2 * c1 + 2 * c2 * (I1 - C[p]) : -2 * c2 * C[p];
    add_block(4 * c2, out);
    add_diagonal(-4 * c2, out);
    out.a -= d;
    out.c -= d;
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
template <class Number>
void respond(const MaterialConstants& c, const Strain<Number>& at, Response<Number>& out)
{
    const double bf = c[1], bt = c[2], bfs = c[3];
    const std::array<double, 6> b{bf, bt, bt, 0.5 * bfs, 0.5 * bt, 0.5 * bfs};
    const std::array<Number, 6> e = green(at.C);
    std::array<Number, 6> be;
    Number Q{};
    for (std::size_t p = 0; p < 6; ++p) {
        be[p] = b[p] * e[p];
        Q += e[p] * be[p];
    }
    const Number rise = exp_less_one(Q), w = c[0] * (rise + 1);
    out.energy = 0.5 * c[0] * rise;
    for (std::size_t p = 0; p < 6; ++p) {
        out.S[p] = w * be[p];
        for (std::size_t q = 0; q <= p; ++q)
            out.D[of_triangle(p, q)] = 2 * w * be[p] * be[q];
        out.D[of_triangle(p, p)] += w * b[p];
    }
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
         svk::respond<double>,
         svk::respond<Four>,
         svk::volumetric,
         svk::small,
         0.57735026918962576},
        {"neo_hooke",
         "mu/2 (tr C - 3) - mu ln J + lambda/2 (ln J)^2.",
         {kYoung, neo_hooke::kPoisson},
         false,
         neo_hooke::respond<double>,
         neo_hooke::respond<Four>,
         neo_hooke::volumetric,
         neo_hooke::small},
        {"mooney_rivlin",
         "c1 (I1 - 3) + c2 (I2 - 3) - (2 c1 + 4 c2) ln J + lambda/2 (ln J)^2.",
         {{"c1", "Pa", "Of the first invariant.", 0, 0, true},
          {"c2", "Pa", "Of the second invariant.", 0, 0, false},
          {"poisson_ratio", "", "Poisson's ratio at rest; no less than c2 allows.", 0, kMostPoisson,
           false}},
         false,
         mooney_rivlin::respond<double>,
         mooney_rivlin::respond<Four>,
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
         guccione::respond<double>,
         guccione::respond<Four>,
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

PointResponse point_response(const Hyperelastic& m, const Mat3& F)
{
    Gradient<double> columns;
    std::copy_n(F.data(), 9, columns.begin());
    const Strain<double> at = strain_of(columns);
    Response<double> r;
    m.law->respond(m.constants, at, r);
    if (const double lambda = m.law->volumetric(m.constants); lambda > 0) {
        r.energy += 0.5 * lambda * at.ln_J * at.ln_J;
        r.a += lambda * at.ln_J;
        r.b += lambda;
        r.c += lambda * at.ln_J;
    }
    r.add_volume(at, true);
    PointResponse out;
    out.energy = r.energy;
    for (std::size_t p = 0; p < 6; ++p) {
        out.S[Eigen::Index(p)] = r.S[p];
        for (std::size_t q = 0; q < 6; ++q)
            out.D(Eigen::Index(p), Eigen::Index(q)) = r.D[of_triangle(p, q)];
    }
    return out;
}

} // namespace amontons
