#include "solver/scene/tapers.hpp"

#include <algorithm>
#include <cmath>

namespace amontons {
namespace {

/// At a radius between the two ends'.
double power_law(const std::array<double, 2>& ends, const std::array<double, 2>& radius, double r)
{
    if (!(ends[0] > 0) || !(ends[1] > 0)) return 0;
    const double power = std::log(ends[1] / ends[0]) / std::log(radius[1] / radius[0]);
    return ends[0] * std::pow(r / radius[0], power);
}

} // namespace

std::vector<BeamSegment> without_tapers(const std::vector<BeamSegment>& segments)
{
    std::vector<BeamSegment> pieces;
    for (const BeamSegment& g : segments) {
        if (!(g.end_radius > 0) || g.end_radius == g.radius) {
            pieces.push_back(g);
            continue;
        }
        const std::array<double, 2> ends{g.radius, g.end_radius};
        const int count = std::max(1, int(std::lround(g.length / g.element)));
        const auto radius_at = [&](double share) { return ends[0] + share * (ends[1] - ends[0]); };
        BeamSegment piece = g;
        piece.length = piece.element = g.length / count;
        piece.end_radius = 0;
        const auto cut = [&](std::array<double, 2>& own, const std::array<double, 2>& whole,
                             int i) {
            own[0] = i > 0 ? own[1] : whole[0]; // the same number on both sides: no step
            own[1] =
                i + 1 < count ? power_law(whole, ends, radius_at(double(i + 1) / count)) : whole[1];
        };
        for (int i = 0; i < count; ++i) {
            piece.radius = radius_at((i + 0.5) / count);
            cut(piece.EI, g.EI, i);
            cut(piece.GJ, g.GJ, i);
            cut(piece.EA, g.EA, i);
            cut(piece.GA, g.GA, i);
            pieces.push_back(piece);
        }
    }
    return pieces;
}

} // namespace amontons
