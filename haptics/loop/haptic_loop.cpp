#include "haptics/loop/haptic_loop.hpp"

// The damper between device d and tool p, over a tick T, backward in time:
//     F = K (p - d) + B ((p - d) - (p - d)_last) / T = (K + B/T) (p - (d + lag)),
//     lag = B/T / (K + B/T) (p - d)_last:
// a stiffer spring, which is in the operator, at a shifted device.

#include <algorithm>
#include <cmath>

namespace amontons {
namespace {

constexpr double kLateFor = 2; // how long a late tick counts [s] ...
constexpr double kLatest = 20; // ... and how late it counts at most [periods]

HapticOptions with_period(HapticOptions options)
{
    options.safety.period = options.limiter.period = options.passivity.period = options.period;
    return options;
}

} // namespace

double coupling(const HapticOptions& options)
{
    return options.coupling_stiffness + options.coupling_damping / options.period;
}

template <class Real>
HapticLoop<Real>::HapticLoop(int most_contacts, const HapticOptions& options)
    : options_(with_period(options))
    , proxy_(most_contacts, options_.proxy)
    , output_(options_.safety, options_.limiter, options_.passivity)
{
}

template <class Real> bool HapticLoop<Real>::is_jump(const HandPose& device) const
{
    return displacement(last_device_, device).head<3>().norm() > options_.safety.max_jump;
}

template <class Real> HandPose HapticLoop<Real>::handle_of(const HandPose& device) const
{
    if (!seen_ && proxy_.current()) return proxy_.current()->handle;
    if (!clutched_) return device;
    return clutched_pose(is_jump(device) ? last_device_ : device);
}

template <class Real> HandPose HapticLoop<Real>::clutched_pose(const HandPose& device) const
{
    return {handle_origin_.position + device.position - device_origin_.position,
            (device.rotation * device_origin_.rotation.conjugate() * handle_origin_.rotation)
                .normalized()};
}

template <class Real>
TickRecord HapticLoop<Real>::tick(const DeviceSample& sample,
                                  TripleBuffer<ReducedOperator<Real>>& operators, double time,
                                  bool simulation_stopped)
{
    TickRecord record;
    record.time = time;
    Safety& safety = output_.safety;
    Passivity& passivity = output_.passivity;
    const double periods = last_time_ < 0 ? 1 : std::round((time - last_time_) / options_.period);
    late_ = std::clamp(periods, 1 + (late_ - 1) * std::exp(-options_.period / kLateFor), kLatest);
    passivity.expect_delayed(static_cast<int>(std::ceil(late_ - 0.5)));
    last_time_ = time;
    proxy_.begin();
    if (operators.fetch() && proxy_.take(operators.front(), time)) {
        arrival_ = time;
        next_period_ = operators.front().period;
    }
    const ReducedOperator<Real>* op = proxy_.current();
    const bool usable = sample.valid && !is_broken(sample.pose);
    const SafetyState before = safety.state();
    const bool compute = safety.watch(
        {time, sample.valid, sample.pose, arrival_, next_period_, simulation_stopped, sample.time});
    // A slow device's pose is repeated until the next one comes: then it has moved all the way.
    const bool is_new =
        sample.time != measured_ || displacement(last_device_, sample.pose) != Vec6::Zero();
    const bool jumped = usable && safety.jumped();
    if (jumped) {
        if (clutched_) {
            handle_origin_ = clutched_pose(last_device_);
            device_origin_ = sample.pose;
        }
        passivity.restart(sample.pose, sample.time);
    } else if (usable && is_new) {
        passivity.observe(sample.pose, sample.time);
    }
    if (usable) {
        last_device_ = sample.pose;
        measured_ = sample.time;
    }
    if (options_.clutch && !clutched_ && op && usable) {
        device_origin_ = sample.pose;
        handle_origin_ = op->handle;
        clutched_ = true;
    }
    seen_ |= usable && op && clutched_ == options_.clutch;
    // Of an operator that came late the device's motion is known all the same.
    const SafetyState state = safety.state();
    unknown_ |= safety.in_fault() && state != SafetyState::stale_operator;
    if (unknown_ && state == SafetyState::starting && before != state) {
        passivity.drop_credit();
        unknown_ = false;
    }
    bool is_computed = compute;
    if (compute) {
        record.handle = handle_of(sample.pose);
        HandPose held = record.handle;
        held.position += lag_;
        record.proxy = proxy_.tick(held, time);
        record.computed = record.proxy.wrench;
        if (!options_.torque) record.computed.torque.setZero();
        const double k = coupling(options_);
        if (options_.coupling_damping > 0 && k > 0)
            lag_ = options_.coupling_damping / options_.period / k *
                   (lag_ + record.computed.force / k);
        last_computed_ = record.computed;
    } else if (!sample.valid && !safety.in_fault() && state != SafetyState::no_operator) {
        record.computed = last_computed_;
        is_computed = true;
    }
    record.sent =
        output_.send(is_computed ? &record.computed : nullptr, usable && is_new && !jumped);
    record.state = safety.state();
    if (record.state == SafetyState::running && (record.sent.force != record.computed.force ||
                                                 record.sent.torque != record.computed.torque))
        record.state = SafetyState::limited;
    record.energy = passivity.energy();
    if (op) record.operator_age = time - op->time;
    return record;
}

template class HapticLoop<float>;
template class HapticLoop<double>;

} // namespace amontons
