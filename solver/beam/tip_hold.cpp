#include "solver/beam/tip_hold.hpp"

#include <algorithm>
#include <cmath>

namespace amontons {
namespace {

int held_unknowns(const Wire& wire)
{
    return wire.tip->turns ? 6 : 3;
}

} // namespace

void hold_tip_here(Wire& wire, bool turns)
{
    TipHold hold;
    hold.turns = turns;
    const BeamNode& tip = wire.state.nodes[std::size_t(wire.last())];
    hold.place = tip.position();
    std::copy(tip.q, tip.q + 4, hold.section.q);
    wire.tip = hold;
}

void move_held_tip(Wire& wire, const Vec3& moved)
{
    WireState& s = wire.state;
    s.tip_moved = moved;
    const int last = wire.last();
    const std::vector<double>& at = wire.material.node;
    const double begin = wire.material.length - s.inserted;
    const Vec3 way = wire.tip->place + moved - s.nodes[std::size_t(last)].position();
    for (int i = s.first + 1; i < last; ++i) {
        const double share = (at[std::size_t(i)] - begin) / (wire.material.length - begin);
        for (int k = 0; k < 3; ++k)
            s.nodes[std::size_t(i)].move(k, share * way[k]);
    }
    BeamNode& tip = s.nodes[std::size_t(last)];
    tip = BeamNode{};
    for (int k = 0; k < 3; ++k)
        tip.x[k] = wire.tip->place[k] + moved[k];
    std::copy(wire.tip->section.q, wire.tip->section.q + 4, tip.q);
}

TipLoad hold_tip(const Wire& wire, BlockTridiagonal& K, std::vector<Node6>& g)
{
    const int last = wire.last(), held = held_unknowns(wire);
    TipLoad load;
    double* const of_tip = g[std::size_t(last)].value;
    const Mat3 R = rotation_matrix(wire.state.nodes[std::size_t(last)].q);
    load.force = Vec3(of_tip[0], of_tip[1], of_tip[2]);
    if (wire.tip->turns) load.moment = R * Vec3(of_tip[3], of_tip[4], of_tip[5]);
    Block6 &d = K.diagonal(last), &up = K.upper(last - 1), &low = K.lower(last - 1);
    for (int k = 0; k < held; ++k) {
        const double own = d(k, k) != 0 ? std::abs(d(k, k)) : 1;
        for (int j = 0; j < 6; ++j)
            d(k, j) = d(j, k) = up(j, k) = low(k, j) = 0;
        d(k, k) = own;
        of_tip[k] = 0;
    }
    return load;
}

void hold_tip(const Wire& wire, int element, ContactRow& row)
{
    if (element + 1 != wire.last()) return;
    for (int k = 0; k < held_unknowns(wire); ++k)
        row.b.value[k] = 0;
}

bool is_held(const Wire& wire, int element, double xi)
{
    constexpr double kThere = 1e-9; // of an element
    return element + 1 == wire.last() && xi > 1 - kThere;
}

} // namespace amontons
