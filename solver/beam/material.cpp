#include "solver/beam/material.hpp"

#include "solver/beam/table_law.hpp"

#include <Eigen/Geometry>
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

Section segment_section(const BeamSegment& g, double t)
{
    const double EI = blend(g.EI, t), GA = blend(g.GA, t);
    const double EI_across = g.EI_across[0] > 0 ? blend(g.EI_across, t) : EI;
    return {{blend(g.EA, t), GA, GA, blend(g.GJ, t), EI_across, EI},
            {1, 0, 0, g.twist, -g.curvature * std::sin(g.curvature_angle),
             g.curvature * std::cos(g.curvature_angle)}};
}

Section between(const Section& a, const Section& b, double t)
{
    Section r;
    for (std::size_t i = 0; i < 6; ++i) {
        r.stiffness[i] = a.stiffness[i] + (b.stiffness[i] - a.stiffness[i]) * t;
        r.natural[i] = a.natural[i] + (b.natural[i] - a.natural[i]) * t;
    }
    return r;
}

Section section_in(const SectionStretch& p, double s)
{
    return between(p.at_start, p.at_end, (s - p.start) / (p.end - p.start));
}

bool equal(const Section& a, const Section& b)
{
    return a.stiffness == b.stiffness && a.natural == b.natural;
}

std::vector<SectionStretch> make_stretches(const WireMaterial& m)
{
    std::vector<SectionStretch> list;
    double start = 0; // of what the segment keeps of its own law
    const std::size_t n = m.segments.size();
    for (std::size_t k = 0; k < n; ++k) {
        const BeamSegment& g = m.segments[k];
        const double end = k + 1 < n ? m.segment_start[k + 1] : m.length;
        double own_end = end;
        const auto own = [&](double s) {
            return segment_section(g, std::clamp((s - m.segment_start[k]) / g.length, 0.0, 1.0));
        };
        if (k + 1 < n) {
            const BeamSegment& next = m.segments[k + 1];
            if (!equal(segment_section(g, 1), segment_section(next, 0)) ||
                g.bending != next.bending || g.stretching != next.stretching)
                own_end = end - 0.5 * std::min({g.radius, 0.5 * g.length, 0.5 * next.length});
        }
        list.push_back({start, own_end, own(start), own(own_end), {int(k), int(k)}});
        start = end;
        if (own_end < end) {
            const BeamSegment& next = m.segments[k + 1];
            start = end + (end - own_end);
            list.push_back({own_end,
                            start,
                            own(own_end),
                            segment_section(next, (start - end) / next.length),
                            {int(k), int(k) + 1}});
        }
    }
    return list;
}

const SectionStretch& stretch_at(const WireMaterial& m, double s)
{
    const auto it = std::upper_bound(m.stretch.begin(), m.stretch.end(), s,
                                     [](double v, const SectionStretch& p) { return v < p.start; });
    return it == m.stretch.begin() ? *it : *(it - 1);
}

/// Calls visit(start, end, section at start, middle and end) for each stretch in [a, b]: with
/// these, Simpson's rule is exact for products of three.
template <class Visit> void for_stretches(const WireMaterial& m, double a, double b, Visit visit)
{
    for (const SectionStretch* p = &stretch_at(m, a); p != m.stretch.data() + m.stretch.size();
         ++p) {
        const double start = std::max(a, p->start), end = std::min(b, p->end);
        if (p->start >= b) break;
        if (end <= start) continue;
        visit(start, end, section_in(*p, start), section_in(*p, 0.5 * (start + end)),
              section_in(*p, end));
    }
}

/// Shares of the tables on [a, b]: across a step one segment's changes over into the other's.
std::vector<TableShare> shares_between(const WireMaterial& m, double a, double b)
{
    std::vector<TableShare> all;
    if (m.table.empty()) return all;
    const auto add = [&](int segment, double length) {
        TableShare s = m.table[std::size_t(segment)];
        if (!s.bending && !s.stretching) return;
        s.length = length;
        all.push_back(std::move(s));
    };
    for (const SectionStretch& p : m.stretch) {
        const double start = std::max(a, p.start), end = std::min(b, p.end);
        if (end <= start) continue;
        if (p.segment[0] == p.segment[1]) {
            add(p.segment[0], end - start);
            continue;
        }
        const double second = (0.5 * (start + end) - p.start) / (p.end - p.start);
        add(p.segment[0], (1 - second) * (end - start));
        add(p.segment[1], second * (end - start));
    }
    return all;
}

/// integral of dx / (a + (b - a) x / length) over [0, length]
double integral_of_inverse(double a, double b, double length)
{
    if (!(a > 0) || !(b > 0)) return 0;
    const double d = (b - a) / a;
    return std::abs(d) < 1e-6 ? length / a * (1 - d / 2 + d * d / 3)
                              : length / a * std::log1p(d) / d;
}

HeldWire held_between(const WireMaterial& m, double a, double b)
{
    HeldWire held;
    for_stretches(m, a, b,
                  [&](double start, double end, const Section& first, const Section& middle,
                      const Section& last) {
                      const double h = end - start;
                      held.axial += integral_of_inverse(first.stiffness[0], last.stiffness[0], h);
                      held.torsion += integral_of_inverse(first.stiffness[3], last.stiffness[3], h);
                      held.bending +=
                          h / 6 *
                          (straightening_energy(first) + 4 * straightening_energy(middle) +
                           straightening_energy(last));
                      if (m.table.empty()) return;
                      const auto beyond = [&](double s, const Section& c) {
                          return beyond_linear(tables_at(m, s), straightened(c)).energy;
                      };
                      held.bending += h / 6 *
                                      (beyond(start, first) +
                                       4 * beyond(0.5 * (start + end), middle) + beyond(end, last));
                  });
    return held;
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
        for (int i = 1; i <= count; ++i)
            m.node.push_back(m.length + g.length * i / count);
        m.length += g.length;
        m.node.back() = m.length;
        shortest = std::min(shortest, g.length / count);
    }
    m.stretch = make_stretches(m);
    const bool linear = std::all_of(segments.begin(), segments.end(), [](const BeamSegment& g) {
        return g.bending.empty() && g.stretching.empty();
    });
    for (const BeamSegment& g : segments) {
        if (linear) break;
        const auto law = [](const CurvePoints& table) {
            return table.empty() ? nullptr
                                 : std::make_shared<const TableLaw>(make_table_law(table));
        };
        m.table.push_back({0, law(g.bending), law(g.stretching)});
    }
    const std::size_t elements = m.node.size() - 1;
    m.flexibility_axial.assign(1, 0);
    m.flexibility_torsion.assign(1, 0);
    m.bending_energy.assign(1, 0);
    for (std::size_t i = 0; i < elements; ++i) {
        const double a = m.node[i], b = m.node[i + 1];
        m.law.push_back(law_between(m, a, b));
        const double reach =
            std::max(b - a, 5 * segments[std::size_t(segment_of(m, 0.5 * (a + b), true))].radius);
        m.stiffness.push_back(std::min(m.law[i].S[4], m.law[i].S[5]) /
                              ((b - a) * reach * reach * reach));
        const HeldWire held = held_between(m, a, b);
        m.flexibility_axial.push_back(m.flexibility_axial.back() + held.axial);
        m.flexibility_torsion.push_back(m.flexibility_torsion.back() + held.torsion);
        m.bending_energy.push_back(m.bending_energy.back() + held.bending);
    }

    place_contact_points(m, contact_spacing > 0 ? contact_spacing : 0.5 * shortest);
    return m;
}

std::size_t contact_point_count(double length, double spacing)
{
    return std::size_t(std::floor(length / spacing * (1 - 1e-12))) + 1;
}

void place_contact_points(WireMaterial& m, double spacing)
{
    m.point.clear();
    const std::size_t count = contact_point_count(m.length, spacing);
    std::size_t element = m.node.size() - 2;
    for (std::size_t j = 0; j < count; ++j) {
        MaterialPoint p;
        p.s = m.length - double(j) * spacing;
        while (element > 0 && p.s <= m.node[element])
            --element;
        p.element = int(element);
        p.xi = (p.s - m.node[element]) / (m.node[element + 1] - m.node[element]);
        p.segment = segment_of(m, p.s, true);
        p.radius = m.segments[std::size_t(p.segment)].radius;
        p.spacing = spacing;
        m.point.push_back(p);
    }
}

Section section_at(const WireMaterial& m, double s)
{
    return section_in(stretch_at(m, s), s);
}

double straightening_energy(const Section& c)
{
    return 0.5 * (c.stiffness[4] * c.natural[4] * c.natural[4] +
                  c.stiffness[5] * c.natural[5] * c.natural[5]);
}

void share_bending(std::vector<TableShare>& shares, const ElementLaw& law)
{
    constexpr double kSame = 1e-9;
    for (TableShare& s : shares) {
        if (!s.bending) continue;
        const double share = law.S[4] / law.length / s.bending->at_rest;
        if (std::abs(share - 1) > kSame)
            s.bending = std::make_shared<const TableLaw>(scaled(*s.bending, share));
    }
}

std::vector<TableShare> tables_at(const WireMaterial& m, double s)
{
    if (m.table.empty()) return {};
    const SectionStretch& p = stretch_at(m, s);
    TableShare a = m.table[std::size_t(p.segment[0])], b = m.table[std::size_t(p.segment[1])];
    if (p.segment[0] == p.segment[1]) {
        a.length = 1;
        return {a};
    }
    b.length = (s - p.start) / (p.end - p.start);
    a.length = 1 - b.length;
    return {a, b};
}

ElementLaw law_between(const WireMaterial& m, double a, double b)
{
    ElementLaw law;
    law.length = b - a;
    double shear_flexibility = 0;
    std::array<double, 6> flexibility{}, natural{}, steady = section_at(m, a).natural;
    bool varies = false; // the natural strain, along the element
    for_stretches(m, a, b,
                  [&](double start, double end, const Section& first, const Section& middle,
                      const Section& last) {
                      const double h = end - start;
                      varies = varies || first.natural != steady || last.natural != steady;
                      for (std::size_t i : {0, 3, 4, 5}) {
                          flexibility[i] +=
                              integral_of_inverse(first.stiffness[i], last.stiffness[i], h);
                          natural[i] += h * middle.natural[i];
                      }
                      if (middle.stiffness[1] > 0) shear_flexibility += h / middle.stiffness[1];
                  });
    // A constant section force along the element: flexibilities add up.
    const double L = law.length;
    for (std::size_t i : {0, 3, 4, 5})
        if (flexibility[i] > 0) law.S[i] = L * L / flexibility[i];
    // Residual bending flexibility of a constant-strain element: L^2/12 EI. A shear along axis 2
    // follows bending about axis 3.
    for (const auto& [shear, bend] : {std::pair{1u, 5u}, {2u, 4u}})
        if (law.S[bend] > 0)
            law.S[shear] = L / (shear_flexibility / L + L * L * L / (12 * law.S[bend]));
    set_bowing(law);

    for (double& k : natural)
        k /= L;
    if (varies && law.S[4] > 0 && law.S[5] > 0) {
        BeamNode end;
        move_along_wire(end, m, a, b, {});
        natural = element_strain(BeamNode{}, end, L);
    }
    natural[0] = mean_stretch(law, natural);
    for (std::size_t i = 0; i < 6; ++i) {
        law.P[i] = law.S[i] * natural[i];
        law.constant += 0.5 * law.P[i] * natural[i];
    }
    law.beyond = shares_between(m, a, b);
    share_bending(law.beyond, law);
    return law;
}

void move_along_wire(BeamNode& node, const WireMaterial& m, double a, double b,
                     const std::array<double, 6>& more)
{
    const Vec3 stretch(more[0], more[1], more[2]), bend(more[3], more[4], more[5]);
    for_stretches(m, a, b,
                  [&](double start, double end, const Section& first, const Section& middle,
                      const Section& last) {
                      // The first two terms of Magnus's series (1954), of strains that are linear
                      // along the piece: an error of order 5.
                      const auto part = [](const Section& c, std::size_t at) {
                          return Vec3(c.natural[at], c.natural[at + 1], c.natural[at + 2]);
                      };
                      const double h = end - start;
                      const Vec3 own = part(middle, 0) + stretch, turning = part(middle, 3) + bend,
                                 rise = part(last, 3) - part(first, 3),
                                 way = own + h / 12 * own.cross(rise),
                                 turn = turning + h / 12 * turning.cross(rise);
                      move_along(node, {way[0], way[1], way[2], turn[0], turn[1], turn[2]}, h);
                  });
}

HeldWire held_between_base_and(const WireMaterial& m, double s)
{
    const auto after = std::upper_bound(m.node.begin(), m.node.end(), s);
    const std::size_t i = std::min(
        std::size_t(std::max<std::ptrdiff_t>(after - m.node.begin() - 1, 0)), m.node.size() - 2);
    const HeldWire rest = held_between(m, m.node[i], s);
    return {m.flexibility_axial[i] + rest.axial, m.flexibility_torsion[i] + rest.torsion,
            m.bending_energy[i] + rest.bending};
}

} // namespace amontons
