#include "solver/scene/section_layers.hpp"

#include <cmath>

namespace amontons {

SectionStiffness stiffness_of(const std::vector<SectionLayer>& layers)
{
    constexpr double kPi = 3.14159265358979323846;
    SectionStiffness sum;
    for (const SectionLayer& l : layers) {
        const double a = l.inner_radius, b = l.outer_radius, E = l.youngs_modulus,
                     G = E / (2 * (1 + l.poisson_ratio));
        if (l.pitch > 0) {
            const double R = 0.5 * (a + b), I = kPi / 4 * std::pow(0.5 * (b - a), 4);
            sum.EI += l.pitch / (kPi * R * (1 / (E * I) + 1 / (2 * G * I)));
            sum.GJ += l.pitch * E * I / (2 * kPi * R);
            sum.EA += l.pitch * 2 * G * I / (2 * kPi * R * R * R);
            continue;
        }
        const double I = kPi / 4 * (std::pow(b, 4) - std::pow(a, 4));
        sum.EI += E * I;
        sum.GJ += 2 * G * I;
        sum.EA += kPi * E * (b * b - a * a);
    }
    return sum;
}

} // namespace amontons
