#include "haptics/loop/proxy_loop.hpp"

#include "contact/cone.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

// With w = trace(W) / 3n and a length l, the tick works on W' = W / w, q' = q / l, r' = r w / l:
// the natural map's rho = 3n / trace(W') is then 1.
//
// Only W' and u' = W' r' + q' have the precision of Real: they are what memory traffic is made of.
// u' is formed anew in each tick, so rounding does not add up over ticks. What is small but
// decides, q(d), the local solution and F, is in double.

namespace amontons {
namespace {

/// A frame that turned further than this gets its local block prepared anew [-]. The blocks only
/// steer the iteration: the fixed point does not depend on them.
constexpr double kPreparedTurn = 1e-3;
/// |r_t| of a contact that slips is mu r_n to round-off; this distinguishes it from one that sticks
/// [-].
constexpr double kOnCone = 1e-9;
/// A tick that ends with a larger error is far from its solution: its force depends on the solver
/// [-].
constexpr double kLost = 5e-3;
/// A sweep in which the error was below this, in the tolerance, may have been the last one.
constexpr double kNear = 4;
constexpr double kBetter = 0.9; // or sweeps that cycle
constexpr int kFailures = 3;    // of solving the closed contacts together, in a tick

double wall_time()
{
    const auto now = std::chrono::steady_clock::now().time_since_epoch();
    return std::chrono::duration<double>(now).count();
}

} // namespace

template <class Real> void ProxyContacts<Real>::reserve(int most_contacts)
{
    const auto n = std::size_t(most_contacts);
    for (auto* vectors : {&r, &before, &q, &anchor, &fade})
        vectors->assign(n, Vec3::Zero());
    cone.assign(n, Mat3::Identity());
    block.resize(n);
    slip_time.assign(n, 0);
    u.resize(3 * n * sizeof(Real) / sizeof(Line) + 1);
}

template <class Real>
ProxyLoop<Real>::ProxyLoop(int most_contacts, const ProxyOptions& options)
    : options_(options)
    , capacity_(most_contacts)
    , history_(3 * most_contacts)
{
    if (!options_.now) options_.now = wall_time;
    contacts_.add = add_columns<Real>(options.simd);
    contacts_.reserve(most_contacts);
    memory_.of.resize(at(most_contacts));
}

template <class Real> void ProxyLoop<Real>::set_pose(const HandPose& device)
{
    device_ = device;
    moved_ = displacement(contacts_.op->handle, device);
    turn_ = (device.rotation * contacts_.op->handle.rotation.conjugate()).toRotationMatrix();
    for (int i = 0; i < contacts_.op->contacts; ++i)
        if (contact(i).turns)
            contacts_.cone[at(i)] = contact(i).frame.transpose() * turn_ * contact(i).frame;
    if ((turn_ - prepared_turn_).norm() > kPreparedTurn) prepare_blocks();
}

template <class Real> void ProxyLoop<Real>::prepare_blocks()
{
    for (int i = 0; i < contacts_.op->contacts; ++i)
        if (contact(i).turns)
            contacts_.block[at(i)] = prepare(contacts_.cone[at(i)].transpose() *
                                             contacts_.op->own[at(i)] * contacts_.cone[at(i)]);
    prepared_turn_ = turn_;
}

/// Extrapolates the reactions of the last two ticks, as hands move smoothly.
template <class Real> void ProxyLoop<Real>::extrapolate()
{
    for (int i = 0; i < contacts_.op->contacts; ++i) {
        const Vec3 now = contacts_.r[at(i)];
        // A contact that opens or closes has no trend.
        if (!now.isZero(0) && !contacts_.before[at(i)].isZero(0)) {
            const Vec3 next = 2 * now - contacts_.before[at(i)];
            const Mat3& axes = contacts_.cone[at(i)];
            contacts_.r[at(i)] =
                contact(i).turns ? Vec3(axes * project_cone(axes.transpose() * next, contact(i).mu))
                                 : project_cone(next, contact(i).mu);
        }
        contacts_.before[at(i)] = now;
    }
}

/// u = W r + q(d).
template <class Real> void ProxyLoop<Real>::free_motion(double fading)
{
    Real* u = contacts_.u.data()->number;
    const double inverse_length = 1 / contacts_.op->length;
    const Mat3 tilt = turn_ - Mat3::Identity();
    for (int w = 0; w < contacts_.op->ways; ++w)
        blend_[at(w)] =
            blend_of_samples(contacts_.op->way[at(w)], contacts_.op->way[at(w)].ahead.dot(moved_));
    for (int i = 0; i < contacts_.op->contacts; ++i) {
        const CandidateContact& c = contact(i);
        Vec3 q = c.q;
        if (c.rigid)
            q.noalias() += c.frame.transpose() * (moved_.head<3>() + tilt * c.arm);
        else
            q.noalias() += c.J * moved_;
        for (int w = 0; w < contacts_.op->ways; ++w) {
            const PathBlend& blend = blend_[at(w)];
            const Vec3* bend =
                &contacts_.op->way[at(w)].bend[at(kMostPathSamples * i + blend.sample)];
            q += blend.there * bend[0];
            if (blend.sample > 0) q += blend.before * bend[-1];
        }
        contacts_.q[at(i)] = inverse_length * q;
        const Vec3 offset = contacts_.anchor[at(i)] + fading * contacts_.fade[at(i)];
        if (c.turns)
            contacts_.q[at(i)].noalias() += contacts_.cone[at(i)] * offset;
        else
            contacts_.q[at(i)] += offset;
        for (int k = 0; k < 3; ++k)
            u[3 * i + k] = static_cast<Real>(contacts_.q[at(i)][k]);
    }
    std::fill(u + 3 * contacts_.op->contacts, u + contacts_.op->stride, Real{0});
    for (int i = 0; i < contacts_.op->contacts; ++i)
        if (!contacts_.r[at(i)].isZero(0)) add_reaction(contacts_, i, contacts_.r[at(i)]);
}

template <class Real> Vec3 ProxyLoop<Real>::residual(int i) const
{
    const CandidateContact& c = contact(i);
    if (!c.turns) return natural_map(contacts_.r[at(i)], slip_of(contacts_, i), c.mu, 1);
    const Mat3& axes = contacts_.cone[at(i)];
    return natural_map(axes.transpose() * contacts_.r[at(i)],
                       axes.transpose() * slip_of(contacts_, i), c.mu, 1);
}

template <class Real> bool ProxyLoop<Real>::is_on_cone(int i) const
{
    const Vec3 r = contact(i).turns ? Vec3(contacts_.cone[at(i)].transpose() * contacts_.r[at(i)])
                                    : contacts_.r[at(i)];
    return r[0] >= 0 && r.tail<2>().norm() <= (1 + kOnCone) * contact(i).mu * r[0];
}

/// Solves contact i with the others held, if its residual is above `content`.
/// @returns the square of the residual it had
template <class Real> double ProxyLoop<Real>::visit(int i, double content)
{
    const CandidateContact& c = contact(i);
    Vec3& r = contacts_.r[at(i)];
    const double square = residual(i).squaredNorm();
    // An extrapolated reaction may have left its cone by little.
    if (square <= content * content && is_on_cone(i)) return square;

    Vec3 u = slip_of(contacts_, i), old = r, b = u - contacts_.op->own[at(i)] * r;
    const Mat3& axes = contacts_.cone[at(i)];
    if (c.turns) {
        u = axes.transpose() * u;
        old = axes.transpose() * old;
        b = axes.transpose() * b;
    }
    // Neighbours change again before it counts: one step of Newton's method is enough of a slip.
    const double rt = old.tail<2>().norm();
    const LocalReaction local =
        solve_local(contacts_.block[at(i)], c.mu, b, rt > 0 ? u.tail<2>().norm() / rt : 0, true);
    Vec3 next = local.r;
    if (local.state == LocalState::unsolved) {
        const double trace = contacts_.op->own[at(i)].trace();
        if (!(trace > 0) || !u.allFinite()) return square;
        next = project_cone(old - 3 / trace * shifted_slip(u, c.mu), c.mu);
    }
    if (c.turns) next = axes * next;
    const Vec3 change = next - r;
    r = next;
    add_reaction(contacts_, i, change);
    return square;
}

/// The natural-map error of `contact`, over the acting rows; leaves their size.
template <class Real> double ProxyLoop<Real>::error()
{
    double sum = 0, acting = 0, all = 0;
    for (int i = 0; i < contacts_.op->contacts; ++i) {
        const double q = contacts_.q[at(i)].squaredNorm();
        const bool open = contacts_.r[at(i)].isZero(0) && slip_of(contacts_, i)[0] >= 0;
        all += q;
        if (open) continue; // its residual is 0, but for rounding of a turned frame
        acting += q;
        sum += residual(i).squaredNorm();
    }
    size_ = std::sqrt(acting > 0 ? acting : all);
    if (sum == 0) return 0;
    return size_ > 0 ? std::sqrt(sum) / size_ : std::numeric_limits<double>::infinity();
}

/// One sweep over the contacts, by the size that error() left.
/// @returns the error found at its contacts, between the one before the sweep and the one after
template <class Real> double ProxyLoop<Real>::sweep()
{
    // If the residual of every contact is below this, that of all is below the tolerance.
    const double share = 0.5 * options_.tolerance / std::sqrt(std::max(contacts_.op->contacts, 1));
    double square = 0;
    for (int i = 0; i < contacts_.op->contacts; ++i)
        square += visit(i, share * size_);
    return std::sqrt(square) / size_;
}

template <class Real> Wrench ProxyLoop<Real>::wrench(double fading) const
{
    Wrench w;
    for (int i = 0; i < contacts_.op->contacts; ++i) {
        if (contacts_.r[at(i)].isZero(0)) continue;
        const CandidateContact& c = contact(i);
        if (c.rigid) {
            const Vec3 force = c.frame * contacts_.r[at(i)];
            w.force += force;
            w.torque += (turn_ * c.arm).cross(force);
        } else {
            const Vec6 both = c.J.transpose() * contacts_.r[at(i)];
            w.force += both.head<3>();
            w.torque += both.tail<3>();
        }
    }
    const double scale = contacts_.op->length / contacts_.op->compliance;
    const Vec6 own = contacts_.op->stiffness * moved_;
    Wrench rest = contacts_.op->rest;
    for (int i = 0; i < contacts_.op->ways; ++i) {
        const auto add_bend = [&](int sample, double share) {
            const Wrench& bend = contacts_.op->way[at(i)].rest[at(sample)];
            rest.force += share * bend.force;
            rest.torque += share * bend.torque;
        };
        const PathBlend& blend = blend_[at(i)];
        add_bend(blend.sample, blend.there);
        if (blend.sample > 0) add_bend(blend.sample - 1, blend.before);
    }
    w.force = scale * w.force + rest.force - own.head<3>() + fading * handover_.jump.force;
    w.torque = scale * w.torque + rest.torque - own.tail<3>() + fading * handover_.jump.torque;
    return w;
}

/// The slip of this tick has happened: the next one counts from here.
template <class Real> void ProxyLoop<Real>::anchor_slip(double time)
{
    for (int i = 0; i < contacts_.op->contacts; ++i) {
        const CandidateContact& c = contact(i);
        Vec3 r = contacts_.r[at(i)], u = slip_of(contacts_, i);
        if (c.turns) {
            r = contacts_.cone[at(i)].transpose() * r;
            u = contacts_.cone[at(i)].transpose() * u;
        }
        const bool open = r.isZero(0);
        // What a contact that sticks has left is the solver's error: anchored, it would creep. The
        // same for a slip along the friction: it has begun to stick.
        const bool slips =
            r.tail<2>().norm() >= (1 - kOnCone) * c.mu * r[0] && r.tail<2>().dot(u.tail<2>()) <= 0;
        if (!open && !slips) continue;
        u[0] = 0;
        contacts_.anchor[at(i)] -= u;
        contacts_.slip_time[at(i)] = time;
    }
}

template <class Real> void ProxyLoop<Real>::clear()
{
    for (auto* vectors : {&contacts_.r, &contacts_.before, &contacts_.anchor, &contacts_.fade})
        std::fill(vectors->begin(), vectors->end(), Vec3::Zero());
    handover_.jump = {};
    unsettled_ = false;
    last_ = {};
}

template <class Real> void ProxyLoop<Real>::begin()
{
    begun_ = true;
    contacts_.products = 0;
    if (options_.budget > 0) start_ = options_.now();
}

template <class Real> bool ProxyLoop<Real>::in_time() const
{
    return !(options_.budget > 0) || options_.now() - start_ <= options_.budget;
}

template <class Real> ProxyTick ProxyLoop<Real>::tick(const HandPose& device, double time)
{
    ProxyTick result;
    if (!begun_) begin();
    begun_ = false;
    if (!contacts_.op || is_broken(device)) return result;

    // ---- The problem at this pose: u = W r + q(d). The body in the hand jumps where that was
    // predicted, and its force with it
    while (has_jumped_by(device))
        begin_operator(contacts_.op->after[0]);
    set_pose(device);
    const double fading = fading_at(time);
    // An unsolved tick gives no trend but that of the solver.
    if (options_.extrapolate && converged_) extrapolate();
    free_motion(fading);
    result.error = error();
    // ---- Sweeps with extrapolation; after each the closed contacts together, kept where it is
    // better
    double least = std::numeric_limits<double>::infinity();
    history_.begin();
    bool known = true;     // the error as it is now
    bool together = false; // the closed contacts were solved together since the last sweep
    int failed = 0;        // tries of that
    double best = std::numeric_limits<double>::infinity(); // error of those that did not
    while (result.error > options_.tolerance && result.sweeps < options_.max_sweeps && in_time()) {
        if (!together && history_.can_extrapolate())
            history_.extrapolate(contacts_.r.data()->data(), contacts_.u.data()->number);
        history_.before_sweep(contacts_.r.data()->data(), 3 * contacts_.op->contacts);
        const double error_now = sweep();
        history_.after_sweep(contacts_.r.data()->data(), contacts_.u.data()->number);
        if (error_now > least) history_.clear(); // it no longer predicts the next error
        least = std::min(least, error_now);
        ++result.sweeps;
        // Far from the end the error need not be known.
        known = error_now <= kNear * options_.tolerance;
        if (known) result.error = error();
        together = false;
        if (known && result.error <= options_.tolerance) break;
        if (failed >= kFailures) continue;
        const double before = known ? result.error : error();
        if (!solve_closed(contacts_, closed_, 0.5 * options_.tolerance * size_)) continue;
        const double after = error();
        if (after < std::min(before, kBetter * best)) {
            best = after;
            known = together = true;
            result.error = after;
        } else {
            restore_closed(contacts_, closed_);
            ++failed;
            error();
        }
    }
    if (!known) result.error = error();
    result.converged = converged_ = result.error <= options_.tolerance;
    // ---- The force F = J^T r; where the problem was not solved, that of the last tick until one
    // is
    result.wrench = wrench(fading);
    unsettled_ |= result.error > kLost;
    if (unsettled_ && !is_broken(result.wrench)) {
        const Wrench own = wrench(0);
        handover_.jump = {last_.force - own.force, last_.torque - own.torque};
        handover_.start = time;
        result.wrench = last_;
        unsettled_ = !result.converged;
    }
    if (is_broken(result.wrench)) { // the operator contains numbers that are not finite
        clear();
        result.wrench = {};
        result.error = std::numeric_limits<double>::infinity();
        result.converged = false;
        return result;
    }
    anchor_slip(time);
    last_ = result.wrench;

    // ---- Report
    result.products = contacts_.products;
    result.contacts = contacts_.op->contacts;
    for (int i = 0; i < contacts_.op->contacts; ++i)
        result.closed += !contacts_.r[at(i)].isZero(0);
    result.new_operator = taken_;
    result.matched = memory_.matched;
    taken_ = false;
    result.distance = moved_.head<3>().norm();
    result.valid = !(contacts_.op->validity > 0) || result.distance <= contacts_.op->validity;
    return result;
}

/// On the way to this pose the operator's body has jumped.
template <class Real> bool ProxyLoop<Real>::has_jumped_by(const HandPose& device) const
{
    return std::isfinite(contacts_.op->jump_at) &&
           contacts_.op->way[0].ahead.dot(displacement(contacts_.op->handle, device)) >=
               contacts_.op->jump_at;
}

/// With its own reactions, and no slip yet.
template <class Real> void ProxyLoop<Real>::begin_operator(const ReducedOperator<Real>& op)
{
    contacts_.op = &op;
    history_.clear();
    turn_ = prepared_turn_ = Mat3::Identity();
    for (int i = 0; i < op.contacts; ++i) {
        contacts_.cone[at(i)] = Mat3::Identity();
        contacts_.block[at(i)] = op.block[at(i)];
        contacts_.r[at(i)] = contact(i).r * (op.compliance / op.length);
        contacts_.before[at(i)] = contacts_.anchor[at(i)] = contacts_.fade[at(i)] = Vec3::Zero();
        contacts_.slip_time[at(i)] = op.time;
    }
}

template <class Real> bool ProxyLoop<Real>::take(const ReducedOperator<Real>& op, double time)
{
    if (!begun_) begin();
    if (op.contacts > capacity_) return false;
    // Without a tick since the last one there is no force to continue from, nor a pose it was felt
    // at.
    const bool first = contacts_.op == nullptr || taken_;
    if (!first) store_tick();
    begin_operator(op);
    while (!first && has_jumped_by(device_))
        begin_operator(contacts_.op->after[0]);
    taken_ = true;
    memory_.matched = 0;
    handover_.jump = {};
    const bool held = unsettled_; // the force is not that of the reactions: they are no answer
    unsettled_ = false;
    handover_.start = time;
    handover_.time = first ? 0 : options_.blend * op.period;
    if (handover_.time > 0) adopt(time, held);
    return true;
}

template <class Real> void ProxyLoop<Real>::release(const HandPose& device, double time)
{
    if (!contacts_.op) return;
    clear();
    device_ = device;
    memory_.count = 0;
    handover_.start = time;
    handover_.time = options_.blend * contacts_.op->period;
    adopt(time, false);
}

template struct ProxyContacts<float>;
template struct ProxyContacts<double>;
template class ProxyLoop<float>;
template class ProxyLoop<double>;

} // namespace amontons
