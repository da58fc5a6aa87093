#include "solver/scene/tapers.hpp"

#include "solver/scene/section_layers.hpp"

#include <algorithm>
#include <cmath>

namespace amontons {
namespace {

bool tapers(const BeamSegment& g)
{
    return (g.end_radius > 0 && g.end_radius != g.radius) ||
           std::ranges::any_of(
               g.layers, [](const SectionLayer& l) { return radii_of(l, 0) != radii_of(l, 1); });
}

/// Between the two ends'.
double stiffness_at(const std::array<double, 2>& ends, const std::array<double, 2>& radius,
                    double share)
{
    const double r = radius[0] + share * (radius[1] - radius[0]);
    if (radius[0] == radius[1]) return ends[0] + share * (ends[1] - ends[0]);
    if (!(ends[0] > 0) || !(ends[1] > 0)) return 0;
    const double power = std::log(ends[1] / ends[0]) / std::log(radius[1] / radius[0]);
    return ends[0] * std::pow(r / radius[0], power);
}

} // namespace

std::vector<BeamSegment> without_tapers(const std::vector<BeamSegment>& segments)
{
    std::vector<BeamSegment> pieces;
    for (const BeamSegment& g : segments) {
        if (!tapers(g)) {
            pieces.push_back(g);
            continue;
        }
        const std::array<double, 2> ends{g.radius, g.end_radius > 0 ? g.end_radius : g.radius};
        const int count = std::max(1, int(std::lround(g.length / g.element)));
        BeamSegment piece = g;
        piece.length = piece.element = g.length / count;
        piece.end_radius = 0;
        piece.layers.clear();
        using Of = double SectionStiffness::*;
        const auto cut = [&](std::array<double, 2>& own, const std::array<double, 2>& whole, int i,
                             Of of = nullptr) {
            const double share = double(i + 1) / count;
            const bool layered = of && !g.layers.empty() &&
                                 whole[0] == stiffness_of(g.layers, 0).*of &&
                                 whole[1] == stiffness_of(g.layers, 1).*of;
            own[0] = i > 0 ? own[1] : whole[0]; // the same number on both sides: no step
            own[1] = i + 1 == count ? whole[1]
                     : layered      ? stiffness_of(g.layers, share).*of
                                    : stiffness_at(whole, ends, share);
        };
        for (int i = 0; i < count; ++i) {
            piece.radius = ends[0] + (i + 0.5) / count * (ends[1] - ends[0]);
            cut(piece.EI, g.EI, i, &SectionStiffness::EI);
            cut(piece.EI_across, g.EI_across, i);
            cut(piece.GJ, g.GJ, i, &SectionStiffness::GJ);
            cut(piece.EA, g.EA, i, &SectionStiffness::EA);
            cut(piece.GA, g.GA, i);
            pieces.push_back(piece);
        }
    }
    return pieces;
}

} // namespace amontons
