#include "solver/beam/table_law.hpp"

#include <algorithm>

namespace amontons {
namespace {

constexpr double kRounded = 0.05; // of the shorter side of a corner

TableLaw::Value value(const TableLaw::Piece& p, double strain)
{
    const double d = strain - p.start;
    return {p.energy + d * (p.force + d * (p.stiffness / 2 + d * p.bend / 6)),
            p.force + d * (p.stiffness + d * p.bend / 2), p.stiffness + d * p.bend};
}

} // namespace

TableLaw::Value TableLaw::at(double strain) const
{
    const auto after = std::upper_bound(pieces.begin(), pieces.end(), strain,
                                        [](double x, const Piece& p) { return x < p.start; });
    return value(after == pieces.begin() ? *after : *(after - 1), strain);
}

TableLaw::Value TableLaw::beyond(double strain) const
{
    const Value v = at(strain), linear{0.5 * at_rest * strain * strain, at_rest * strain, at_rest};
    return {v.energy - linear.energy, v.force - linear.force, v.stiffness - linear.stiffness};
}

TableLaw scaled(TableLaw law, double scale)
{
    law.at_rest *= scale * scale;
    for (TableLaw::Piece& p : law.pieces) {
        p.start /= scale;
        p.force *= scale;
        p.stiffness *= scale * scale;
        p.bend *= scale * scale * scale;
    }
    return law;
}

TableLaw make_table_law(const CurvePoints& table)
{
    TableLaw law;
    const auto width = [&](std::size_t i) { return table[i + 1][0] - table[i][0]; };
    const auto slope = [&](std::size_t i) { return (table[i + 1][1] - table[i][1]) / width(i); };
    const auto begin = [&](double start, double force, double stiffness, double bend) {
        const double energy = law.pieces.empty() ? 0 : value(law.pieces.back(), start).energy;
        law.pieces.push_back({start, energy, force, stiffness, bend});
    };
    begin(table[0][0], table[0][1], slope(0), 0);
    for (std::size_t i = 1; i + 1 < table.size(); ++i) {
        const auto [at, force] = table[i];
        const double before = slope(i - 1), after = slope(i);
        const double w = at == 0 ? 0 : kRounded * std::min(width(i - 1), width(i));
        if (w > 0) begin(at - w, force - w * before, before, (after - before) / (2 * w));
        begin(at + w, force + w * after, after, 0);
    }
    const TableLaw::Value rest = law.at(0);
    for (TableLaw::Piece& p : law.pieces)
        p.energy -= rest.energy;
    law.at_rest = rest.stiffness;
    return law;
}

} // namespace amontons
