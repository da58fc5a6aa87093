#include "validation/cases/cases.hpp"

namespace amontons::validation {

const std::vector<Case>& cases()
{
    static const std::vector<Case> list{
        {"elastica", "benchmarks",
         "Bisshopp & Drucker 1945; elliptic integrals, recomputed by shooting to 1e-13", elastica},
        {"bend45", "benchmarks",
         "Bathe & Bolourchi 1979; shooting of the Cosserat equations to 3e-11 (J = 1/6, ks = 1)",
         bend45},
        {"rollup", "benchmarks", "closed form: a circle; Simo & Vu-Quoc 1986", rollup},
        {"capstan", "benchmarks", "Euler 1769, Eytelwein 1808; equilibrium of a polygon's corner",
         capstan_cable},
        {"capstan-beam", "benchmarks", "Euler 1769, Eytelwein 1808: exp(mu theta)", capstan_beam},
        {"torus", "benchmarks", "closed form: EI/(2 (R+c)^2), EI/(R+c)^3 per length", torus},
        {"torus-friction", "benchmarks", "planar discrete elastic rod, independent code",
         torus_friction},
        {"double-u", "benchmarks", "two independent planar codes, sheath's end fading over 5 mm",
         double_u},
        {"double-u-rigid-end", "benchmarks", "two independent codes, rigid sheath's end",
         double_u_rigid_end},
        {"cantilever-frequency", "benchmarks",
         "closed form: Euler-Bernoulli, cosh x cos x = -1; implicit Euler of an oscillator",
         cantilever_frequency},
        {"stiffness-doubled", "stability", "rigid walls: forces are linear in the stiffness",
         stiffness_doubled},
        {"lengths-scaled", "stability", "dimensional analysis", lengths_scaled},
        {"retrace", "stability", "without friction the path does not depend on its direction",
         retrace},
        {"millimetres", "stability", "dimensional analysis", millimetres},
        {"frame-turned", "stability", "frame indifference", frame_turned},
        {"refinement", "stability", "the same scene with half the element, spacing, step",
         refinement},
        {"double-u-curved", "stability", "energy balance and certificates of a spatial run",
         double_u_curved},
        {"double-u-unheld", "stability", "energy balance and certificates of a spatial run",
         double_u_unheld},
        {"double-u-dynamic", "stability",
         "slow dynamics is the quasi-static run; energy balance and certificates",
         double_u_dynamic},
        {"j-tip-twist", "stability", "energy balance and certificates of a spatial run",
         j_tip_twist},
    };
    return list;
}

} // namespace amontons::validation
