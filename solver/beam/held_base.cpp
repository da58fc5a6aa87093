#include "solver/beam/held_base.hpp"

#include "solver/beam/table_law.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace amontons {
namespace {

/// How the natural strains of the first element change with its length: a section is put before its
/// pose, log(exp(e) exp(x)) = x + sum_n B_n/n! ad_x^n e to first order in e.
std::array<double, 6> natural_growth(const std::array<double, 6>& natural, double length,
                                     const std::array<double, 6>& section)
{
    constexpr double kBernoulli[] = {1.0 / 12,           -1.0 / 720,
                                     1.0 / 30240,        -1.0 / 1209600,
                                     1.0 / 47900160,     -691.0 / 1307674368000.0,
                                     1.0 / 74724249600., -3617.0 / 10670622842880000.0};
    struct Strain {
        Vec3 way, turn;
    };
    const auto strain_of = [](const std::array<double, 6>& v, double scale) {
        return Strain{scale * Vec3(v[0], v[1], v[2]), scale * Vec3(v[3], v[4], v[5])};
    };
    const Strain x = strain_of(natural, length);
    const auto commuted = [&](const Strain& e) {
        return Strain{x.turn.cross(e.way) + x.way.cross(e.turn), x.turn.cross(e.turn)};
    };
    Strain term = strain_of(section, 1), sum = term;
    term = commuted(term);
    sum = {sum.way - 0.5 * term.way, sum.turn - 0.5 * term.turn};
    for (const double b : kBernoulli) {
        term = commuted(term);
        sum.way += b * term.way;
        sum.turn += b * term.turn;
        term = commuted(term);
    }
    std::array<double, 6> rate{};
    for (std::size_t i = 0; i < 6; ++i)
        rate[i] =
            ((i < 3 ? sum.way[Eigen::Index(i)] : sum.turn[Eigen::Index(i) - 3]) - natural[i]) /
            length;
    return rate;
}

/// What tables add to the growth of the first element: the section at the sheath's end comes to
/// its shares, and its strains and natural curvatures change.
/// @param e   its strains
/// @param dk  how its natural strains grow
/// @param dS  how its bending stiffness law.S[4] grows
void grow_beyond(const WireMaterial& m, const ElementLaw& law, double end,
                 const std::array<double, 6>& e, const std::array<double, 6>& dk, double dS,
                 Growth& g)
{
    const double L = law.length;
    std::array<double, 6> elastic{}, rate{}; // -rate: of the elastic strain with the length
    for (std::size_t i : {4, 5}) {
        elastic[i] = e[i] - (law.S[i] > 0 ? law.P[i] / law.S[i] : 0);
        rate[i] = dk[i] + e[i] / L;
    }
    std::vector<TableShare> section = tables_at(m, end);
    share_bending(section, law);
    const BeyondLinear own = beyond_linear(law.beyond, elastic),
                       added = beyond_linear(section, elastic);
    // What share of the curvature a section takes changes with the element's EI.
    const double shift = dS / law.S[4] - 1 / L;
    for (std::size_t i : {4, 5})
        rate[i] -= shift * elastic[i];
    g.slope += added.energy;
    for (std::size_t i : {4, 5}) {
        g.slope -= own.stress[i] * rate[i];
        g.tau[i] += added.stress[i] + (shift - 1 / L) * own.stress[i];
    }
    g.tau[4] -= own.bend22 * rate[4] + own.bend23 * rate[5];
    g.tau[5] -= own.bend23 * rate[4] + own.bend33 * rate[5];
}

} // namespace

HeldWire held_part(const HeldBase& base, double end)
{
    HeldWire held = held_between_base_and(base.material, end);
    held.axial += base.compliance;
    held.torsion += base.turn_compliance;
    return held;
}

ElementLaw law_at_end(const HeldBase& base, double further)
{
    const WireMaterial& m = base.material;
    ElementLaw law = law_between(m, base.end() - further, base.next);
    // Times EA over its length it is a force: no digits are lost to the length of the wire, which
    // the end's place on it would cost.
    law.length = ((base.next - m.length) + base.inserted) + (base.inserted_rest + further);
    return law;
}

double straight_energy(const WireMaterial& m, double s)
{
    const Section c = section_at(m, s);
    double energy = straightening_energy(c);
    if (!m.table.empty()) energy += beyond_linear(tables_at(m, s), straightened(c)).energy;
    return energy;
}

// Strains are proportional to 1/length: dU/dl = 1/2 C (e - e0)^2 at the end - stress.e / length.
// The mean stretch's part of second order, 1/2 bowing e^2, is proportional to bowing/length^2.
Growth growth(const HeldBase& base, const BeamNode& a, const BeamNode& b, const ElementLaw& law,
              double further)
{
    const WireMaterial& m = base.material;
    const double end = base.end() - further;
    const Section c = section_at(m, end);
    const double L = law.length;
    const std::array<double, 6> e = element_strain(a, b, L);

    // U = 1/2 S (e - k)^2 with S = L^2 / flexibility and k the mean natural strain, both growing
    // by the section at the sheath's end.
    Growth g;
    std::array<double, 6> dS{};
    for (std::size_t i : {0, 3, 4, 5})
        if (c.stiffness[i] > 0)
            dS[i] = 2 * law.S[i] / L - law.S[i] * law.S[i] / (L * L * c.stiffness[i]);
    for (const auto& [shear, bend] : {std::pair{1u, 5u}, {2u, 4u}}) {
        if (!(law.S[bend] > 0)) continue;
        const double k = law.S[shear] / L, EI = law.S[bend] / L;
        const double dEI = (dS[bend] - EI) / L;
        dS[shear] = k - L * k * k * (L / (6 * EI) - L * L / (12 * EI * EI) * dEI);
    }
    const std::array<double, 2> growing = bowing_growth(law, dS);
    const double stretch = mean_stretch(law, e);
    double shrinks = (2 * stretch - e[0]) / L; // the mean stretch, with the length
    for (std::size_t i : {1, 2})
        shrinks -= 0.5 * growing[i - 1] * e[i] * e[i];
    const std::array<double, 6> natural = natural_strain(law);
    std::array<double, 6> dk = natural_growth(natural, L, c.natural);
    for (std::size_t i : {1, 2}) // of the mean stretch
        dk[0] += (law.bowing[i - 1] * dk[i] + 0.5 * growing[i - 1] * natural[i]) * natural[i];
    for (std::size_t i = 0; i < 6; ++i) {
        if (!(law.S[i] > 0)) continue;
        const double S = law.S[i], elastic = (i == 0 ? stretch : e[i]) - law.P[i] / S,
                     rate = dk[i] + (i == 0 ? shrinks : e[i] / L);
        g.slope += 0.5 * dS[i] * elastic * elastic - S * elastic * rate;
        g.tau[i] = dS[i] * elastic - S * rate - S * elastic / L;
    }
    // Tension along what bows acts across the section.
    const double tension = law.S[0] * stretch - law.P[0], grows = g.tau[0] + tension / L;
    for (std::size_t i : {1, 2})
        g.tau[i] +=
            (grows * law.bowing[i - 1] + tension * (growing[i - 1] - 2 * law.bowing[i - 1] / L)) *
            e[i];
    if (!law.beyond.empty() || !m.table.empty()) grow_beyond(m, law, end, e, dk, dS[4], g);
    const HeldWire held = held_part(base, end);
    g.axial = held.axial;
    g.torsion = held.torsion;
    g.force = ((base.inserted - base.base_insertion) + base.inserted_rest + further) / held.axial;
    g.torque = (base.base_twist - base.rotation) / held.torsion;
    const double EA = c.stiffness[0], GJ = c.stiffness[3];
    g.slope += g.force + 0.5 * g.force * g.force / EA + 0.5 * g.torque * g.torque / GJ;
    g.slope -= straight_energy(m, end);
    return g;
}

double growth_stiffness(const HeldBase& base, const BeamNode& a, const BeamNode& b)
{
    const double end = base.end();
    // its strains follow 1/length: short against that as well
    const double length = law_at_end(base, 0).length;
    const double step =
        std::min({1e-3 * base.material.segments.back().radius, 0.25 * end, 0.01 * length});
    const auto slope = [&](double further) {
        return growth(base, a, b, law_at_end(base, further), further).slope;
    };
    const double near = (slope(step) - slope(-step)) / (2 * step),
                 far = (slope(2 * step) - slope(-2 * step)) / (4 * step);
    return (4 * near - far) / 3;
}

} // namespace amontons
