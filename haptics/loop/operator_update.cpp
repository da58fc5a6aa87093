#include "haptics/loop/proxy_loop.hpp"

#include "contact/cone.hpp"

#include <algorithm>

// A new operator comes 25 to 100 times a second, made for a pose that the handle has left. Solved
// as it is, its force differs from that of the tick before: by what the old one's linearisation had
// wrong, and by the slip since its pose, which it does not contain. At 25 Hz this difference is
// felt.
//
// So at the hand-over, at the pose d of the last tick, every contact that is known by its identity
// keeps its reaction (in world axes), and its q gets an offset such that
//
//     u' = W' r + q'(d) + offset  has  u'_t = 0,  and u'_n = 0 where r_n > 0, else u'_n >= 0:
//
// r is then a solution of the new problem, too: no jump, whatever W' and q' are. The offset is of
// two kinds. Where the contact has slipped (or was open) since the operator's pose was read, its
// tangential part is slip that has happened: an anchor, which stays. All else is what the two
// operators disagree on, and fades linearly to zero over one period. A contact that was not there
// starts with r = 0 in the same way; the force of one that no longer exists, and the change by a
// new J, fade as a wrench over the same time.
//
// Where the simulation has snapped to another state, offsets are as long as its jump, and contacts
// would open and close in a tick or two while they fade; or normals have turned so far that a
// reaction has left its cone, and the premise does not hold for that r. Then the new operator is
// solved by itself, and the whole difference fades as a wrench. The same where the last tick held
// the force of one before, since it had found no solution: its reactions are undefined. If one tick
// has no time for it, the next ones continue, and the force waits for them.

namespace amontons {

namespace {
constexpr double kOutside = 0.05; // of a reaction: what its cone has no room for
}

template <class Real> double ProxyLoop<Real>::fading_at(double time) const
{
    if (!(handover_.time > 0)) return 0;
    return std::clamp(1 - (time - handover_.start) / handover_.time, 0.0, 1.0);
}

/// Stores reactions and anchors by identity, for the next operator.
template <class Real> void ProxyLoop<Real>::store_tick()
{
    memory_.count = contacts_.op->contacts;
    const double newton = contacts_.op->length / contacts_.op->compliance;
    for (int i = 0; i < memory_.count; ++i)
        memory_.of[at(i)] = {contact(i).id, newton * (contact(i).frame * contacts_.r[at(i)]),
                             newton * (contact(i).frame * contacts_.before[at(i)]),
                             contacts_.slip_time[at(i)]};
    std::sort(memory_.of.begin(), memory_.of.begin() + memory_.count,
              [](const ReactionMemory::OfContact& a, const ReactionMemory::OfContact& b) {
                  return a.id < b.id;
              });
}

/// Continues at the pose of the last tick without a jump of the force.
/// @param anew  the reactions so far are nothing to continue from
template <class Real> void ProxyLoop<Real>::adopt(double time, bool anew)
{
    const auto end = memory_.of.begin() + memory_.count;
    const double newton = contacts_.op->length / contacts_.op->compliance;
    for (int i = 0; i < contacts_.op->contacts; ++i) {
        const auto known = std::lower_bound(
            memory_.of.begin(), end, contact(i).id,
            [](const ReactionMemory::OfContact& m, std::int64_t id) { return m.id < id; });
        contacts_.r[at(i)].setZero();
        contacts_.before[at(i)].setZero();
        contacts_.slip_time[at(i)] = time;
        if (known == end || known->id != contact(i).id) continue;
        contacts_.r[at(i)] = contact(i).frame.transpose() * known->r / newton;
        contacts_.before[at(i)] =
            contact(i).frame.transpose() * known->before / newton; // the trend continues
        contacts_.slip_time[at(i)] = known->slip_time;
        ++memory_.matched;
    }

    const Wrench before = last_;
    handover_.jump = {};
    set_pose(device_);
    free_motion(0);
    for (int i = 0; i < contacts_.op->contacts; ++i) {
        Vec3 gap = contacts_.cone[at(i)].transpose() *
                   slip_of(contacts_, i); // normal and tangential as the law sees them
        Vec3 slipped = Vec3::Zero();
        if (contacts_.r[at(i)].isZero(0)) gap[0] = std::min(gap[0], 0.0);
        if (contacts_.slip_time[at(i)] >= contacts_.op->time) {
            slipped.tail<2>() = gap.tail<2>();
            gap.tail<2>().setZero();
        }
        contacts_.anchor[at(i)] = -slipped;
        contacts_.fade[at(i)] = -gap;
    }
    if (anew || has_jumped()) start_anew();
    const Wrench after = wrench(0);
    handover_.jump.force = before.force - after.force;
    handover_.jump.torque = before.torque - after.torque;
}

/// Whether the two operators disagree by more than the handle can have moved bodies meanwhile, or
/// about where the cones are.
template <class Real> bool ProxyLoop<Real>::has_jumped() const
{
    for (int i = 0; i < contacts_.op->contacts; ++i) {
        const Vec3 r = contacts_.cone[at(i)].transpose() * contacts_.r[at(i)];
        if ((project_cone(r, contact(i).mu) - r).norm() > kOutside * r.norm()) return true;
        if (contacts_.op->validity > 0 &&
            contacts_.op->length * contacts_.fade[at(i)].norm() > contacts_.op->validity)
            return true;
    }
    return false;
}

/// Solves the new operator by itself, at the last pose, as far as the tick has time for it.
template <class Real> void ProxyLoop<Real>::start_anew()
{
    for (int i = 0; i < contacts_.op->contacts; ++i) {
        contacts_.r[at(i)] = contact(i).r * (contacts_.op->compliance / contacts_.op->length);
        contacts_.before[at(i)] = contacts_.anchor[at(i)] = contacts_.fade[at(i)] = Vec3::Zero();
    }
    free_motion(0);
    for (int k = 0; k < options_.max_sweeps; ++k) {
        unsettled_ = error() > options_.tolerance;
        if (!unsettled_ || !in_time()) break;
        sweep();
    }
}

template double ProxyLoop<float>::fading_at(double) const;
template double ProxyLoop<double>::fading_at(double) const;
template void ProxyLoop<float>::store_tick();
template void ProxyLoop<double>::store_tick();
template void ProxyLoop<float>::adopt(double, bool);
template bool ProxyLoop<float>::has_jumped() const;
template void ProxyLoop<float>::start_anew();
template void ProxyLoop<double>::adopt(double, bool);
template bool ProxyLoop<double>::has_jumped() const;
template void ProxyLoop<double>::start_anew();

} // namespace amontons
