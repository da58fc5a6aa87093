#pragma once

#include "haptics/tests/scenes.hpp"
#include "haptics/time/virtual_time.hpp"

#include <algorithm>
#include <limits>

// F01 of the benchmarks, a mass on a virtual wall: for this room's tests and for `validate`.

namespace amontons::test {

/// Nothing between contact and hand: no ramp, no limit, no control.
inline HapticOptions bare()
{
    HapticOptions o;
    o.proxy.tolerance = 1e-10;
    o.proxy.max_sweeps = 500;
    o.safety.ramp_up = 0;
    o.safety.max_speed = o.safety.max_jump = o.safety.max_turn_speed = 1e300;
    o.limiter.max_rise = o.limiter.max_torque_rise = std::numeric_limits<double>::infinity();
    o.passivity.control = false;
    return o;
}

inline Bed wall(double k)
{
    Bed bed;
    bed.points = {{0, 0, 0}};
    bed.mu = 0;
    bed.k = k;
    return bed;
}

/// @param disagree  every other operator is stiffer by this: as of a body that is not linear
template <class Real> Publisher<Real> publisher(const Bed& bed, double disagree = 1)
{
    return
        [sim = BedSimulation(bed), bed, disagree](ReducedOperator<Real>& op, const HandPose& pose,
                                                  double time, std::uint64_t sequence) mutable {
            sim.bed.shear = bed.shear * (sequence % 2 ? disagree : 1);
            sim.step(op, pose, time, sequence);
            return true;
        };
}

/// F01: a mass on a virtual wall at 1 kHz.
struct VirtualWall {
    double B = 0;         ///< damper of the wall [N s/m]
    double mass = 0.1;    ///< [kg]
    double damping = 0.5; ///< of the device [N s/m]
    int delay = 0;        ///< ticks until the motors act
};

/// Is a free mass on a wall that pulls as well as pushes stable? The contact is kept closed by
/// starting deep: the growth of a small motion about the depth is what counts.
inline bool stable(const VirtualWall& w, double K)
{
    HapticOptions o = bare();
    o.coupling_stiffness = K;
    o.coupling_damping = w.B;
    HandOptions h;
    h.mass = h.damping = 0;
    h.device_mass = w.mass;
    h.device_damping = w.damping;
    h.delay = w.delay;
    h.substeps = 1;
    h.stiffness = 1e-9 * K; // a weight that holds the mass down at -1 m: far from lift-off
    h.path = [](double) { return (Vec6() << 0, 0, -1e9, 0, 0, 0).finished(); };
    h.start << 0, 0, -1.001, 0, 0, 0; // 1 mm from rest, at -1 m
    SimulatedHand hand(h);
    HapticLoop<double> loop(1, o);
    VirtualOptions v;
    v.duration = 4;
    double early = 0, late = 0;
    for (const TickRecord& r : run_in_virtual_time<double>(
             loop, hand, 1, publisher<double>(wall(coupling(o))), o.period, v)) {
        double& peak = r.time < 2 ? early : late;
        if (r.time >= 0.5) peak = std::max(peak, std::abs(r.handle.position[2] + 1));
    }
    return late < early && late < 0.9;
}

/// The largest stiffness that is stable [N/m], to 1e-3 of it.
inline double stable_limit(const VirtualWall& w)
{
    double low = 10, high = 4000;
    while (high - low > 1e-3 * low)
        (stable(w, (low + high) / 2) ? low : high) = (low + high) / 2;
    return low;
}

} // namespace amontons::test
