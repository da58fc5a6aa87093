#include "solver/body/rod_body.hpp"
#include "solver/step/body_simulation_state.hpp"
#include "solver/step/rod_stability.hpp"

#include <fmt/format.h>

// Unstable balances: rods leave them, other bodies get a warning.

namespace amontons {

/// An unstable balance of rods is left along its lowest mode, as over a snap; where that leads to
/// no other balance it is kept, and reported.
/// @param may_cut  a shorter step can be tried
/// @return  false if a shorter step should be tried: with several negative modes the first one that
///          growing loads reach is to be taken
bool BodySimulation::State::leave_unstable(bool may_cut)
{
    constexpr int kMost = 4;     // one after the other
    constexpr int kFewModes = 2; // both ways aside are one
    const bool stood = !unstable_kept;
    for (int i = 0; i < kMost && !*stop; ++i) {
        const auto balance = unstable_rods(*system, last_input, last);
        unstable_kept = balance.has_value();
        if (!balance) return true;
        if (may_cut && stood && i == 0 && balance->modes > kFewModes) {
            unstable_kept = false;
            return false;
        }
        StepInput here = last_input;
        here.start = last_input.end();
        here.h = 0;
        BodyStepReport left = relax_rods(*system, here, step_options(), &*balance);
        if (!left.accepted) {
            why_kept = left.refusal;
            return true;
        }
        left.remarks.insert(left.remarks.begin(), last.remarks.begin(), last.remarks.end());
        left.iterations += last.iterations;
        left.factorisations += last.factorisations;
        last = std::move(left);
        add_seconds();
        add_energy();
    }
    return true;
}

/// Bodies whose balance is unstable: a sentence each, without a full stop.
std::vector<std::string> BodySimulation::State::unstable_bodies() const
{
    std::vector<std::string> sentences;
    if (dynamic() || has_drag()) return sentences;
    for (const BodyRef& b : system->refs)
        if (b.rod && b.rod->negative() > 0)
            sentences.push_back(fmt::format("{} has {} negative mode{}", b.name, b.rod->negative(),
                                            b.rod->negative() > 1 ? "s" : ""));
    for (const std::string& r : last.remarks)
        if (r.find(kNotStable) != r.npos) sentences.push_back(r);
    return sentences;
}

/// Warns once in a run of unstable balances, whose number is reported at its end, and of motions of
/// rods that neither holds nor contacts constrain.
void BodySimulation::State::note_unstable()
{
    if (!unheld_reported)
        if (const std::string what = unheld_rods(*system, last_input, last); !what.empty()) {
            unheld_reported = true;
            summary.warnings.push_back(fmt::format(
                "step {} (t = {:.6g} s): nothing holds {}; it stays where it is, as long as no "
                "load moves it",
                step, time, what));
        }
    const std::vector<std::string> sentences = unstable_bodies();
    if (sentences.empty() || unstable++ > 0) return;
    std::string all;
    for (const std::string& s : sentences)
        all += (all.empty() ? "" : "; ") + s;
    summary.warnings.push_back(
        fmt::format("step {} (t = {:.6g} s): an unstable balance: {}{}", step, time, all,
                    scene.time.path > 0 ? " (time.path follows such balances)"
                    : !why_kept.empty() ? "; along its lowest mode: " + why_kept
                                        : ""));
}

} // namespace amontons
