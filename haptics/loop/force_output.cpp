#include "haptics/loop/force_output.hpp"

#include <algorithm>

namespace amontons {

Wrench ForceOutput::send(const Wrench* computed, bool new_pose)
{
    const Wrench clamped = computed ? limiter.clamp(*computed) : Wrench();
    const Wrench ramped = safety.apply(clamped);
    if (safety.in_fault()) {
        limiter.begin(nullptr, false);
        return finish(ramped, Motion::fault);
    }
    limiter.begin(computed ? &clamped : nullptr, new_pose);
    return finish(limiter.approach(ramped), new_pose ? Motion::known : Motion::unknown);
}

Wrench ForceOutput::fade_out(double share)
{
    limiter.begin(nullptr, false);
    share = std::clamp(share, 0.0, 1.0);
    return finish({share * sent_.force, share * sent_.torque}, Motion::fault);
}

Wrench ForceOutput::finish(const Wrench& wrench, Motion motion)
{
    // A force that is being scaled up is larger on the way out than it was on the way in. Where
    // control is switched off it is scaled up no faster than the hand supplies the energy.
    const bool pays = !controls_ && safety.state() == SafetyState::starting;
    sent_ = passivity.allow(wrench, limiter, pays ? Motion::fault : motion, pays);
    limiter.sent(sent_);
    safety.sent(sent_);
    if (pays && wrench.force.norm() > 0) safety.hold_back(sent_.force.norm() / wrench.force.norm());
    return sent_;
}

} // namespace amontons
