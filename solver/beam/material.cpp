#include "solver/beam/material.hpp"

#include <algorithm>
#include <cmath>

namespace amontons {
namespace {

int segment_of(const WireMaterial& m, double s, bool before)
{
    int k = 0;
    const int last = int(m.segments.size()) - 1;
    while (k < last) {
        const double end = m.segment_start[std::size_t(k) + 1];
        if (before ? s <= end : s < end) break;
        ++k;
    }
    return k;
}

double blend(const std::array<double, 2>& ends, double t)
{
    return ends[0] + (ends[1] - ends[0]) * t;
}

Section section_in(const WireMaterial& m, int k, double s)
{
    const BeamSegment& g = m.segments[std::size_t(k)];
    const double t =
        std::clamp((s - m.segment_start[std::size_t(k)]) / g.length, 0.0, 1.0);
    const double EI = blend(g.EI, t), GA = blend(g.GA, t);
    return {{blend(g.EA, t), GA, GA, blend(g.GJ, t), EI, EI},
            {1, 0, 0, 0, -g.curvature * std::sin(g.curvature_angle),
             g.curvature * std::cos(g.curvature_angle)}};
}

/// integral of dx / (a + (b - a) x / length) over [0, length]
double integral_of_inverse(double a, double b, double length)
{
    if (!(a > 0) || !(b > 0)) return 0;
    const double d = (b - a) / a;
    return std::abs(d) < 1e-6 ? length / a * (1 - d / 2 + d * d / 3)
                              : length / a * std::log1p(d) / d;
}

} // namespace

WireMaterial make_material(const std::vector<BeamSegment>& segments, double contact_spacing)
{
    WireMaterial m;
    m.segments = segments;
    double shortest = std::numeric_limits<double>::infinity();
    m.node.push_back(0);
    for (const BeamSegment& g : segments) {
        m.segment_start.push_back(m.length);
        const int count = std::max(1, int(std::lround(g.length / g.element)));
        for (int i = 1; i <= count; ++i) m.node.push_back(m.length + g.length * i / count);
        m.length += g.length;
        m.node.back() = m.length;
        shortest = std::min(shortest, g.length / count);
    }
    const std::size_t elements = m.node.size() - 1;
    m.flexibility_axial.assign(1, 0);
    m.flexibility_torsion.assign(1, 0);
    m.bending_energy.assign(1, 0);
    for (std::size_t i = 0; i < elements; ++i) {
        const double a = m.node[i], b = m.node[i + 1];
        m.law.push_back(law_between(m, a, b));
        m.stiffness.push_back(m.law[i].S[4] / std::pow(b - a, 4));
        const Section sa = section_at(m, a, false), sb = section_at(m, b, true);
        m.flexibility_axial.push_back(
            m.flexibility_axial.back() +
            integral_of_inverse(sa.stiffness[0], sb.stiffness[0], b - a));
        m.flexibility_torsion.push_back(
            m.flexibility_torsion.back() +
            integral_of_inverse(sa.stiffness[3], sb.stiffness[3], b - a));
        const double k2 = sa.natural[4] * sa.natural[4] + sa.natural[5] * sa.natural[5];
        m.bending_energy.push_back(m.bending_energy.back() + 0.5 * m.law[i].S[4] * k2);
    }

    const double spacing = contact_spacing > 0 ? contact_spacing : shortest;
    const int count = int(std::floor(m.length / spacing * (1 - 1e-12)));
    std::size_t element = elements - 1;
    for (int j = 0; j <= count; ++j) {
        MaterialPoint p;
        p.s = m.length - j * spacing;
        while (element > 0 && p.s <= m.node[element]) --element;
        p.element = int(element);
        p.xi = (p.s - m.node[element]) / (m.node[element + 1] - m.node[element]);
        p.segment = segment_of(m, p.s, true);
        p.radius = segments[std::size_t(p.segment)].radius;
        p.spacing = spacing;
        m.point.push_back(p);
    }
    return m;
}

Section section_at(const WireMaterial& m, double s, bool before)
{
    return section_in(m, segment_of(m, s, before), s);
}

ElementLaw law_between(const WireMaterial& m, double a, double b)
{
    ElementLaw law;
    law.length = b - a;
    double shear_flexibility = 0, natural_energy = 0;
    // Stiffness is linear and natural strain constant within a segment.
    for (int k = segment_of(m, a, false); k < int(m.segments.size()); ++k) {
        const double start = std::max(a, m.segment_start[std::size_t(k)]);
        const double end = std::min(
            b, k + 1 < int(m.segments.size()) ? m.segment_start[std::size_t(k) + 1] : b);
        if (end <= start) break;
        const Section middle = section_in(m, k, 0.5 * (start + end));
        for (std::size_t i = 0; i < 6; ++i) {
            const double c = (i == 1 || i == 2 ? 0 : middle.stiffness[i]) * (end - start);
            law.S[i] += c;
            law.P[i] += c * middle.natural[i];
            natural_energy += 0.5 * c * middle.natural[i] * middle.natural[i];
        }
        if (middle.stiffness[1] > 0) shear_flexibility += (end - start) / middle.stiffness[1];
    }
    // Residual bending flexibility of a constant-strain element: L^2/12 EI.
    if (law.S[4] > 0) {
        const double L = law.length;
        const double f = shear_flexibility / L + L * L * L / (12 * law.S[4]);
        law.S[1] = law.S[2] = L / f;
    }
    law.constant = natural_energy;
    return law;
}

HeldWire held_between_base_and(const WireMaterial& m, double s)
{
    const auto after = std::upper_bound(m.node.begin(), m.node.end(), s);
    const std::size_t i =
        std::min(std::size_t(std::max<std::ptrdiff_t>(after - m.node.begin() - 1, 0)),
                 m.node.size() - 2);
    const double a = m.node[i];
    const Section sa = section_at(m, a, false), sb = section_at(m, s, true);
    const double k2 = sa.natural[4] * sa.natural[4] + sa.natural[5] * sa.natural[5];
    return {m.flexibility_axial[i] + integral_of_inverse(sa.stiffness[0], sb.stiffness[0], s - a),
            m.flexibility_torsion[i] +
                integral_of_inverse(sa.stiffness[3], sb.stiffness[3], s - a),
            m.bending_energy[i] +
                0.25 * (sa.stiffness[4] + sb.stiffness[4]) * (s - a) * k2};
}

} // namespace amontons
