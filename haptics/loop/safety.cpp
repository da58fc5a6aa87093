#include "haptics/loop/safety.hpp"

#include <algorithm>
#include <cmath>

namespace amontons {
namespace {

bool is_good(SafetyState s)
{
    return s == SafetyState::no_operator || s == SafetyState::starting ||
           s == SafetyState::running || s == SafetyState::aged_operator;
}

bool stays(SafetyState s)
{
    return s == SafetyState::not_a_number || s == SafetyState::simulation_stopped;
}

} // namespace

const char* name(SafetyState state)
{
    switch (state) {
    case SafetyState::no_operator:
        return "no operator";
    case SafetyState::starting:
        return "starting";
    case SafetyState::running:
        return "running";
    case SafetyState::limited:
        return "limited";
    case SafetyState::aged_operator:
        return "aged operator";
    case SafetyState::stale_operator:
        return "stale operator";
    case SafetyState::device_lost:
        return "device lost";
    case SafetyState::too_fast:
        return "too fast";
    case SafetyState::pose_jump:
        return "pose jump";
    case SafetyState::not_a_number:
        return "not a number";
    case SafetyState::simulation_stopped:
        return "simulation stopped";
    }
    return "";
}

const char* reason(SafetyState state)
{
    switch (state) {
    case SafetyState::no_operator:
        return "no force: the simulation has published nothing yet";
    case SafetyState::starting:
        return "the force is scaled up";
    case SafetyState::running:
        return "the force is as computed";
    case SafetyState::limited:
        return "the force is not as computed: passivity control or a limit of the device reduces "
               "it";
    case SafetyState::aged_operator:
        return "the force is weaker: the simulation published nothing for several of its periods";
    case SafetyState::stale_operator:
        return "force removed: the simulation published nothing for many of its periods";
    case SafetyState::device_lost:
        return "force removed: no sample from the device";
    case SafetyState::too_fast:
        return "force removed: the device moves faster than allowed";
    case SafetyState::pose_jump:
        return "force removed: the device's pose jumped";
    case SafetyState::not_a_number:
        return "force removed until a restart: a pose or force was not a finite number";
    case SafetyState::simulation_stopped:
        return "force removed until a restart: the simulation has stopped";
    }
    return "";
}

void Safety::fail(SafetyState state)
{
    if (stays(state_)) return;
    if (is_good(state_)) {
        ++faults_;
        left_ = 1;
    }
    state_ = last_fault_ = state;
    level_ = 0;
    calm_since_ = -1;
}

/// What is wrong now; running if nothing.
SafetyState Safety::examine(const SafetyInput& in)
{
    if (in.simulation_stopped) return SafetyState::simulation_stopped;
    if (!in.sample_valid) {
        if (last_sample_ < 0) last_sample_ = in.time;
        // One sample less is repeated; silence is not.
        return in.time - last_sample_ >= options_.lost_after ? SafetyState::device_lost
                                                             : SafetyState::running;
    }
    if (is_broken(in.device)) return SafetyState::not_a_number;
    SafetyState found = SafetyState::running;
    const double measured = std::isinf(in.sample_time) ? in.time : in.sample_time;
    if (has_pose_) {
        const double elapsed = std::max(measured - last_measured_, options_.period);
        const Vec6 d = displacement(last_pose_, in.device);
        jump_ = d.head<3>().norm() > options_.max_jump;
        if (jump_)
            found = SafetyState::pose_jump;
        else if (d.head<3>().norm() > options_.max_speed * elapsed ||
                 d.tail<3>().norm() > options_.max_turn_speed * elapsed)
            found = SafetyState::too_fast;
    }
    last_pose_ = in.device;
    last_measured_ = measured;
    has_pose_ = true;
    last_sample_ = in.time;
    if (found == SafetyState::running && in.operator_time >= 0 && in.operator_period > 0) {
        const double age = (in.time - in.operator_time) / in.operator_period;
        const double aged = options_.aged_periods, stale = options_.stale_periods;
        stiff_ = age <= aged ? 1 : age < stale ? (stale - age) / (stale - aged) : 0;
        if (stiff_ == 0) found = SafetyState::stale_operator;
    }
    return found;
}

bool Safety::in_fault() const
{
    return !is_good(state_);
}

bool Safety::watch(const SafetyInput& in)
{
    elapsed_ = time_ < 0 ? options_.period : in.time - time_;
    time_ = in.time;
    jump_ = false;
    const SafetyState found = examine(in);
    if (found != SafetyState::running) {
        fail(found);
    } else if (!is_good(state_) && !stays(state_)) {
        if (calm_since_ < 0) calm_since_ = in.time;
        if (in.time - calm_since_ >= options_.calm) state_ = SafetyState::starting;
    }
    if (state_ == SafetyState::no_operator && in.operator_time >= 0) state_ = SafetyState::starting;
    if (state_ == SafetyState::aged_operator && stiff_ == 1) state_ = SafetyState::starting;
    if (is_good(state_) && state_ != SafetyState::no_operator && stiff_ < 1)
        state_ = SafetyState::aged_operator;
    return in.sample_valid && is_good(state_) && state_ != SafetyState::no_operator;
}

Wrench Safety::apply(const Wrench& wrench)
{
    if (is_good(state_) && is_broken(wrench)) fail(SafetyState::not_a_number);
    if (!is_good(state_)) {
        double next = std::max(0.0, left_ - elapsed_ / options_.ramp_down);
        if (next < 1e-9) next = 0; // the steps' rounding
        const double share = left_ > 0 ? next / left_ : 0;
        left_ = next;
        return {share * sent_.force, share * sent_.torque};
    }
    if (state_ == SafetyState::no_operator) return {};
    if (state_ == SafetyState::starting) {
        const double step = std::min(elapsed_, options_.period);
        level_ = options_.ramp_up > 0 ? level_ + step / options_.ramp_up : 1;
        if (level_ >= 1 - 1e-9) {
            level_ = 1;
            state_ = SafetyState::running;
        }
    }
    if (state_ == SafetyState::aged_operator) level_ = std::min(level_, stiff_);
    return {level_ * wrench.force, level_ * wrench.torque};
}

void Safety::hold_back(double share)
{
    if (state_ == SafetyState::starting) level_ *= std::clamp(share, 0.0, 1.0);
}

} // namespace amontons
