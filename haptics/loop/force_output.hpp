#pragma once

#include "haptics/loop/limiter.hpp"
#include "haptics/loop/passivity.hpp"
#include "haptics/loop/safety.hpp"

namespace amontons {

/// The last stage of a tick: every wrench for the device passes through it, in every state.
///
/// largest force -> ramp of the state -> what may be sent (Limiter) -> passivity. What comes after
/// the limiter scales the wrench down, or adds damping that the limiter admits. So, in every tick,
/// with s sent, c computed (F and M alike):
///
///   - |s - damping| <= max(|c|, |s_before|), and damping opposes the motion;
///   - |s| rises by at most max_rise more than |c| does, and may fall at once;
///   - in a fault, and in a tick without a new pose, |s| does not grow.
class ForceOutput {
public:
    ForceOutput(const SafetyOptions& s, const LimiterOptions& l, const PassivityOptions& p)
        : safety(s)
        , limiter(l)
        , passivity(p)
        , controls_(p.control)
    {
    }

    /// The wrench sent to the device in this tick; call Safety::watch and Passivity::observe
    /// before.
    /// @param computed  null: nothing was
    /// @param new_pose  of the device, measured since the tick before
    Wrench send(const Wrench* computed, bool new_pose);
    /// That share in [0, 1] of what was sent last: when the run ends.
    Wrench fade_out(double share);

    Safety safety;
    Limiter limiter;
    Passivity passivity;

private:
    Wrench finish(const Wrench& wrench, Motion motion);
    bool controls_;
    Wrench sent_;
};

} // namespace amontons
