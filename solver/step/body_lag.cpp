#include "solver/step/body_stepper.hpp"

#include "solver/body/solid_body.hpp"

#include <algorithm>
#include <map>

// Where the geometry of contacts jumps. A quasi-static step searches for a balance with contacts as
// they are at its end. Contacts between facets appear and disappear there, and their normals jump:
// between two geometries that the iteration reaches alternately there need be no balance on either.
// What there is then, in this order:
//
//   1 a contact that carried a force when it was lost for the second time in a step is kept until
//     the step's end: the balance with the contacts of both geometries (Filippov's, of laws that
//     jump). In steps from bodies without contact, which begin far from their end: for the fifth
//     time, since what is kept stays as an iterate on the way was;
//   2 in a step that was shortened without success: the balance with contacts as the last iteration
//   found
//     them, moved along their normals. How far that is from the contacts at the end is measured,
//     reported, and bounded: the lag.

namespace amontons {
namespace {

constexpr int kOften = 2;         // lost that often, a contact stays,
constexpr int kOftenFromRest = 5; // and in a step from bodies without contact
constexpr double kJump = 0.03;    // of a unit normal
constexpr double kAside = 0.01;   // of the smaller body: one that has moved farther along is lost
constexpr double kMostLag = 0.01; // of the forces, or of what the law is relative to
constexpr int kMostFreezes = 3;

/// The same contacts in the same order, and no normal has jumped: of nearly all iterations.
bool same_contacts(const BodyContacts& a, const BodyContacts& b)
{
    return std::ranges::equal(a.contact, b.contact, [](const BodyContact& p, const BodyContact& q) {
        return p.pair == q.pair && p.id == q.id &&
               (p.frame.col(0) - q.frame.col(0)).norm() <= kJump;
    });
}

} // namespace

/// Keeps contacts of the last iteration that appear and disappear, and the other normal of those
/// whose normal alternates, as they were found.
void BodyStepper::hold_lost(const BodyContacts& before, std::span<const double> moved_before)
{
    if (stays_.empty() && same_contacts(list_, before)) return;
    std::map<BodySystem::Key, int> now;
    for (int c = 0; c < int(list_.contact.size()); ++c)
        now[key(c)] = c;
    if (!measuring_) std::erase_if(stays_, [&](const auto& h) { return now.count(h.first) > 0; });
    for (std::size_t c = 0; !measuring_ && c < before.contact.size(); ++c) {
        const BodyContact& k = before.contact[c];
        BodySystem::Key name{k.pair, k.id};
        if (k.id >= kOtherNormal || system_.refs[std::size_t(k.a)].rod) continue;
        const auto force = force_.find(name);
        if (const auto found = now.find(name); found != now.end()) {
            const Vec3 n = list_.contact[std::size_t(found->second)].frame.col(0);
            if (!((n - k.frame.col(0)).norm() > kJump)) continue;
            name.id += kOtherNormal;
            const auto other = stays_.find(name);
            if (other != stays_.end() && (n - other->second.contact.frame.col(0)).norm() > kJump)
                continue;
            if (other != stays_.end())
                stays_.erase(other); // it is found now, the one before is not
        } else if (stays_.count(name) > 0) {
            continue;
        }
        if (force == force_.end() || force->second.isZero(0)) continue;
        if (++lost_[name] < (from_ ? kOftenFromRest : kOften)) continue;
        const auto a = before.place_a(k).nodes, b = before.place_b(k).nodes;
        HeldContact held{k, {a.begin(), a.end()}, {b.begin(), b.end()}, moved_before[c], {}};
        held.contact.id = name.id;
        stays_[name] = std::move(held);
    }
    const auto vanished = [&](HeldContact& held) {
        BodyContact& k = held.contact;
        const auto add = [&](const std::vector<StencilEntry>& nodes, std::int32_t& begin,
                             std::int32_t& end) {
            begin = std::int32_t(list_.stencil.size());
            list_.stencil.insert(list_.stencil.end(), nodes.begin(), nodes.end());
            end = std::int32_t(list_.stencil.size());
        };
        const auto stencils = list_.stencil.size();
        add(held.a, k.a_begin, k.a_end);
        add(held.b, k.b_begin, k.b_end);
        list_.contact.push_back(k);
        BodyContact& own = list_.contact.back();
        const Vec3 d = moved(own), n = k.frame.col(0), along = d - n.dot(d) * n;
        if (!held.along) held.along = along;
        double size = body(std::size_t(k.a)).size();
        if (k.b >= 0) size = std::min(size, body(std::size_t(k.b)).size());
        if ((along - *held.along).norm() > kAside * size) {
            list_.contact.pop_back();
            list_.stencil.resize(stencils);
            return true;
        }
        own.gap += n.dot(d) - held.moved;
        return false;
    };
    for (auto h = stays_.begin(); h != stays_.end();) {
        const bool found = measuring_ && now.count(h->first) > 0;
        h = !found && vanished(h->second) && !measuring_ ? stays_.erase(h) : std::next(h);
    }
}

/// Contacts stay as they were found last, and move along their normals.
/// @return  false if that has been tried often enough
bool BodyStepper::freeze()
{
    // Rods that find no balance snap: relax_rods follows them.
    if (!options_.may_lag || frozen_ || freezes_ == kMostFreezes || system_.has_rods())
        return false;
    ++freezes_;
    frozen_ = true;
    relaxing_ = false;
    relaxation_ = 1;
    motion_before_.resize(0);
    changes_.resize(0, 0);
    made_.resize(0, 0);
    return true;
}

/// How far the contacts of a balance with frozen ones are from those that are found at its end: of
/// forces that turn or are lost, of what the law is relative to.
/// @return  false if that is too far
bool BodyStepper::lags_little()
{
    const BodyContacts list = list_;
    const auto joints = joints_;
    const auto value = value_;
    const auto moved = moved_;
    const auto force = body_force_;
    const BodyStepReport report = report_;
    frozen_ = false;
    measuring_ = true;
    check_end_of_step();
    measuring_ = false;
    frozen_ = true;
    const IterationLog& now = iteration_log_.back();
    lag_ = std::max({now.law, now.turned, now.imbalance});
    const double error = report_.error;
    report_ = report;
    errors_.pop_back();
    list_ = list;
    joints_ = joints;
    value_ = value;
    moved_ = moved;
    body_force_ = force;
    if (lag_ <= kMostLag) return true;
    report_.error = error;
    return false;
}

} // namespace amontons
