#include "solver/scene/section_layers.hpp"

#include <cmath>

namespace amontons {

std::array<double, 2> radii_of(const SectionLayer& l, double share)
{
    const auto between = [&](double from, double to) { return (1 - share) * from + share * to; };
    return {between(l.inner_radius, l.end_inner_radius.value_or(l.inner_radius)),
            between(l.outer_radius, l.end_outer_radius.value_or(l.outer_radius))};
}

SectionStiffness stiffness_of(const std::vector<SectionLayer>& layers, double share)
{
    constexpr double kPi = 3.14159265358979323846;
    SectionStiffness sum;
    for (const SectionLayer& l : layers) {
        const auto [a, b] = radii_of(l, share);
        const double E = l.youngs_modulus, G = E / (2 * (1 + l.poisson_ratio));
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
