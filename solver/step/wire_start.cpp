#include "solver/step/wire_start.hpp"

#include "solver/beam/nesting.hpp"
#include "solver/step/coaxial.hpp"
#include "solver/step/wire_group.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <fmt/format.h>
#include <numeric>

namespace amontons {
namespace {

// As in a run, an increment of insertion that fails is halved or relaxed; at this share of the
// longest one the search ends.
constexpr double kShortest = 1.0 / 1024;
constexpr double kTries = 3; // times the longest pushes that the way takes: beyond it jams

/// Places the wires straight out of their sheaths; nested ones along the one that is out furthest.
void lay_straight(WireGroup& g, const std::vector<BaseTarget>& to)
{
    for (std::size_t w = 0; w < to.size(); ++w) {
        Wire& wire = g.wires[w]->wire;
        start_in_sheath(wire, to[w].insertion, to[w].twist);
        std::fill(wire.state.reaction.begin(), wire.state.reaction.end(), Reaction{});
    }
    if (g.coaxial)
        for (Nesting& n : g.coaxial->nestings)
            std::fill(n.reaction.begin(), n.reaction.end(), Reaction{});
    const WireBody* guide = g.wires[0];
    for (const WireBody* b : g.wires)
        if (b->wire.state.inserted > guide->wire.state.inserted) guide = b;
    for (WireBody* b : g.wires)
        if (b != guide) lie_along(b->wire, guide->wire);
}

StepReport settle(WireGroup& g, const std::vector<BaseTarget>& to)
{
    lay_straight(g, to);
    StepReport r = try_step(g, to, 0);
    if (!r.accepted) r = relax_step(g, to);
    return r;
}

/// Inserts one wire of a group up to the target of its base.
/// @param at  of all, in and out
StepReport push_one(WireGroup& g, std::size_t w, double insertion, std::vector<BaseTarget>& at,
                    const std::atomic<bool>& stop)
{
    StepReport r;
    r.accepted = true;
    const double longest = g.wires[w]->element_size;
    double push = longest, tries = kTries * std::ceil((insertion - at[w].insertion) / longest);
    while (at[w].insertion < insertion) {
        if (stop || tries-- <= 0) {
            r.accepted = false;
            r.refusal = "insertion stalls below the smallest step";
            return r;
        }
        std::vector<BaseTarget> next = at;
        next[w].insertion = std::min(insertion, at[w].insertion + push);
        const bool unstable = r.refusal == "unstable";
        const bool relax = push <= (unstable ? kRelaxUnstable : kRelaxFailed) * longest;
        r = relax ? try_or_relax(g, next) : try_step(g, next, 0);
        if (r.accepted) {
            at = next;
            push = std::min(2 * push, longest);
        } else if (push <= kShortest * longest) {
            return r;
        } else {
            push *= 0.5;
        }
    }
    return r;
}

} // namespace

StepReport start_wires(WireGroup& g, const std::vector<BaseTarget>& to,
                       const std::atomic<bool>& stop)
{
    StepReport r = settle(g, to);
    if (r.accepted || g.wires[0]->wire.tip) return r;
    std::vector<BaseTarget> at = to;
    for (std::size_t w = 0; w < at.size(); ++w)
        at[w].insertion = std::min(to[w].insertion, g.wires[w]->wire.sheath->fade);
    StepReport pushed = settle(g, at);
    if (!pushed.accepted) return r;
    std::vector<std::size_t> order(to.size());
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
        return to[a].insertion > to[b].insertion;
    });
    for (const std::size_t w : order) {
        if (!(at[w].insertion < to[w].insertion)) continue;
        pushed = push_one(g, w, to[w].insertion, at, stop);
        if (pushed.accepted) continue;
        pushed.refusal = fmt::format("pushed in by {:.4g} m: {}", at[w].insertion, pushed.refusal);
        return pushed;
    }
    return pushed;
}

} // namespace amontons
