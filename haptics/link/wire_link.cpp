#include "haptics/link/wire_link.hpp"

#include "haptics/link/condense_wire.hpp"
#include "haptics/link/held_rod.hpp"
#include "mesh/base/curve.hpp"
#include "solver/step/wire_build.hpp"
#include "solver/step/wire_record.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

namespace amontons {
namespace {

constexpr double kSmallest = 1.0 / 64; // of the way to the device: a try that is still made
constexpr double kRelaxFrom = 1.0 / 8; // a try as short as this may cross a snap
constexpr double kRelaxPart = 1.0 / 2; // the same in parts: a try less is time for one
// Of a snap's operator, over the pull of its last increment: what is just stable is as good as
// singular. Where it is singular yet, the same again.
constexpr double kStiffer = 10;
constexpr int kPulls = 3;
constexpr double kMostOut = 0.999; // of the wire's length
constexpr int kSamplesAhead = 10;  // ahead, in a period ...
constexpr int kAside = 4;          // ... and back and aside
// The same in real time, and how much of a period they may take.
constexpr int kSamplesInTime = 4, kAsideInTime = 2;
constexpr double kSampleTime = 0.4;
constexpr double kLeastWay = 1.0;   // of the fastest way in a period: what is predicted
constexpr double kAtRest = 1e-2;    // of that, and less
constexpr double kNotTurned = 1e-3; // of that, and less on the wire's surface
// Of q beyond first order, over the way of the contacts: more is a jump. Where the hand is moving
// what holds after it is handed over, too, and it may be called one for little.
constexpr double kMostBend = 0.5, kMostAside = 2;
constexpr int kMostJumps = 4;         // of the wire on the way, that are predicted
constexpr double kJumpAt = 1.0 / 128; // of the way predicted: that a jump is known to
constexpr double kSnapWork = 1e5;     // of a snap in parts: Newton's iterations, times elements,
                                      // in a second of the simulation

using Clock = std::chrono::steady_clock;

/// What a step may do to be accepted.
enum class StepPolicy {
    newton, ///< Newton's method alone
    relax,  ///< or cross a snap
    sample  ///< Newton's method, and whatever its energy balance misses: it is taken back
};

/// What the samples after a step found.
struct Lookahead {
    std::vector<LookaheadPath> ways; ///< first where the hand is moving; none if it is not known
    bool falls = false;              ///< beyond the last sample on the first way
    LookaheadSample landed;          ///< where the wire is after a jump that a step did not notice
};

std::size_t samples_before_jump(const CondensedPath& way, double most)
{
    const auto jump =
        std::ranges::find_if(way.samples, [&](const CondensedSample& l) { return l.jump > most; });
    return static_cast<std::size_t>(jump - way.samples.begin());
}

HandPose moved(const HandPose& from, const Vec6& way)
{
    return {from.position + way.head<3>(), (turn(way.tail<3>()) * from.rotation).normalized()};
}

} // namespace

bool holds_wire(const Scene& scene)
{
    const auto has = [&](const auto& bodies) {
        return std::any_of(bodies.begin(), bodies.end(),
                           [&](const auto& b) { return b.name == scene.haptic.handle; });
    };
    return scene.haptic.given && (has(scene.beams) || has(scene.rods));
}

struct WireLink::State {
    Scene scene;
    std::vector<Issue> warnings;
    std::vector<int> walls; // obstacles that the wire can touch
    WireBody body;
    HandPose start, device; // device: of the last step
    HandPose before;        // the same of the step before
    bool rod = false;
    Vec3 axis = Vec3::Zero(); // of a beam
    double first = 0;         // insertion at the start [m]
    bool started = false;     // the first step is one of no time
    GradientFlow snap;        // that the last step left under way
    bool in_parts = false;    // snaps are, since the clock counts
    ReductionOptions options;
    Clock::time_point began; // condensing
    std::string refusal;

    State(const Scene& s, const std::vector<Obstacle>& obstacles, const HandleSpring& spring);
    void build_beam(const std::vector<Obstacle>& obstacles, const HandleSpring& spring);
    const BeamInput& beam() const { return scene.beams[0]; }
    BaseTarget target(const HandPose& pose) const;
    StepReport advance(const HandPose& to, double period, StepPolicy means);
    Vec6 way_ahead() const;
    bool in_time() const;
    std::vector<Vec6> ways_aside(const Vec6& way) const;
    bool advance_to(const HandPose& to, StepPolicy means);
    bool follow_path(LookaheadPath& way, double longest);
    Lookahead sample_paths(const Vec6& way);
    Condensed condense(Lookahead& lookahead);
    Condensed condense();
    Condensed condense(const Vec6& way, int jumps);
};

WireLink::State::State(const Scene& s, const std::vector<Obstacle>& obstacles,
                       const HandleSpring& spring)
    : scene(s)
    , rod(!s.rods.empty())
{
    std::vector<Issue> issues;
    if (scene.beams.size() > 1)
        issues.push_back({scene.file, "/bodies/" + scene.beams[1].name, "a second beam",
                          "one: further beams beside the one in the hand are not supported yet"});
    if (scene.time.kind == "dynamic")
        issues.push_back({scene.file, "/time/kind", "\"dynamic\"",
                          "\"quasi_static\": a beam in the hand has no dynamics yet"});
    if (scene.haptic.damping > 0)
        issues.push_back({scene.file, "/haptic/damping", std::to_string(scene.haptic.damping),
                          "0: a beam's base is coupled by springs only"});
    if (!issues.empty()) throw InputError(std::move(issues));
    if (rod) {
        body = make_held_rod(scene, scene.rods[0], obstacles, spring, walls, warnings);
        start = device_of(body.wire);
    } else {
        build_beam(obstacles, spring);
    }
    device = before = start;
}

void WireLink::State::build_beam(const std::vector<Obstacle>& obstacles, const HandleSpring& spring)
{
    std::vector<Issue> issues;
    if (!scene.solids.empty())
        throw InputError({{scene.file, "/bodies/" + scene.solids[0].name,
                           "the wall of a vessel that "
                           "is compliant beside a held wire",
                           "an obstacle"}});
    body = build_wire(scene, beam(), obstacles, {}, walls);
    std::vector<std::string> names;
    for (const int wall : walls)
        names.push_back(obstacles[std::size_t(wall)].name);
    check_start(scene, beam(), body, names, obstacles, issues);
    if (!issues.empty()) throw InputError(std::move(issues));
    Sheath& sheath = *body.wire.sheath;
    sheath.compliance = 1 / spring.stiffness;
    sheath.turn_compliance = 1 / spring.turn_stiffness;
    axis = sheath.frame.col(0);
    first = body.wire.state.base_insertion;
    start.position = beam().introducer.at;
}

/// The base for a device, from where it stands: turns are endless.
BaseTarget WireLink::State::target(const HandPose& pose) const
{
    const WireState& s = body.wire.state;
    const double length = body.wire.material.length;
    const double insertion = first + axis.dot(pose.position - start.position);
    return {std::clamp(insertion, 0.0, kMostOut * length),
            s.base_twist + axis.dot(displacement(device, pose).tail<3>())};
}

// A rod's snap takes a hundred Newton solves and more, as long as several steps. In real time it is
// crossed in parts, one a step, and what is handed over in between is the rod on its way, held by
// the pull of the relaxation, while the hand continues: the fall of a rod takes time, too.
StepReport WireLink::State::advance(const HandPose& to, double period, StepPolicy means)
{
    WireGroup group{{&body}, nullptr};
    if (!rod) {
        const std::vector<BaseTarget> base{target(to)};
        return means == StepPolicy::relax
                   ? try_or_relax(group, base)
                   : try_step(group, base, period, means == StepPolicy::sample);
    }
    const WireState old = body.wire.state;
    const std::vector<BaseTarget> base{{old.base_insertion, old.base_twist}};
    place_device(body.wire, to);
    // The work of a clamp that moves is not in the balance of wires.
    StepReport r;
    if (!snap.under_way) r = try_step(group, base, period, true);
    if (!r.accepted && means == StepPolicy::relax)
        r = relax_step(group, base, in_parts ? &snap : nullptr);
    if (!r.accepted) body.wire.state = old;
    return r;
}

/// Where the hand will be by its last motion when the next operator is due.
Vec6 WireLink::State::way_ahead() const
{
    Vec6 way = displacement(before, device);
    const double least = kLeastWay * options.speed * options.period, shift = way.head<3>().norm(),
                 turned = body.wire.material.segments.front().radius * way.tail<3>().norm();
    if (shift < kAtRest * least) {
        if (turned > kNotTurned * least)
            way.head<3>().setZero();
        else
            way << least * axis, Vec3::Zero();
    } else if (shift < least) {
        way.head<3>() *= least / shift;
    }
    return way;
}

bool WireLink::State::in_time() const
{
    return !in_parts || std::chrono::duration<double>(Clock::now() - began).count() <=
                            kSampleTime * options.period;
}

/// Back along the path, and for a rod, which is held in space, to all sides.
std::vector<Vec6> WireLink::State::ways_aside(const Vec6& way) const
{
    std::vector<Vec6> aside{-way};
    const double shift = way.head<3>().norm();
    if (!rod || !(shift > 0)) return aside;
    const Vec3 left = way.head<3>().unitOrthogonal(), up = way.head<3>().normalized().cross(left);
    for (const Vec3& side : {left, Vec3(-left), up, Vec3(-up)})
        aside.emplace_back() << shift * side, Vec3::Zero();
    return aside;
}

/// A step on the way.
bool WireLink::State::advance_to(const HandPose& to, StepPolicy means)
{
    if (!advance(to, options.period, means).accepted || !body.wire.outside()) return false;
    device = to;
    return true;
}

/// Steps on a way, which stay taken; shorter ones where they are refused.
/// @param longest  of them [-]
/// @return  true if the wire loses its stability beyond the last of them
bool WireLink::State::follow_path(LookaheadPath& way, double longest)
{
    const HandPose from = device;
    const StepStart begin = mark_step_start(body.wire);
    double done = 0, step = longest;
    while (done < 1 && way.ahead.size() < kMostPathSamples && in_time()) {
        const double share = std::min(done + step, 1.0);
        if (advance_to(moved(from, share * way.way), StepPolicy::sample)) {
            done = share;
            step = std::min(2 * step, longest);
            way.ahead.push_back(sample_ahead(body, begin, options.reach()));
            way.ahead.back().share = share;
        } else {
            step /= 2;
            if (step < kJumpAt) return true;
        }
    }
    return false;
}

/// Samples the path of the hand ahead, and other directions.
Lookahead WireLink::State::sample_paths(const Vec6& way)
{
    Lookahead out;
    if (way.isZero() || !body.wire.outside()) return out;
    const WireState here = body.wire.state;
    const HandPose at = device;
    const auto sample_path = [&](const Vec6& along, int samples) {
        const bool falls = follow_path(out.ways.emplace_back(LookaheadPath{along, {}}),
                                       1.0 / (samples * options.periods_ahead()));
        device = at;
        body.wire.state = here;
        return falls;
    };
    out.falls = sample_path(way, in_parts ? kSamplesInTime : kSamplesAhead);
    for (const Vec6& aside : ways_aside(way)) {
        if (!in_time()) break;
        sample_path(aside, in_parts ? kAsideInTime : kAside);
        if (out.ways.back().ahead.empty()) out.ways.pop_back();
    }
    return out;
}

/// Condenses with the samples before the first that is a jump, on each way; half of them at a time
/// where the operator cannot be solved.
Condensed WireLink::State::condense(Lookahead& lookahead)
{
    std::vector<LookaheadPath>& ways = lookahead.ways;
    for (;;) {
        Condensed condensed = condense_wire(body, options, {}, ways);
        bool cut = false;
        for (std::size_t i = 0; i < ways.size(); ++i) {
            std::vector<LookaheadSample>& ahead = ways[i].ahead;
            const std::size_t good =
                condensed.solvable
                    ? samples_before_jump(condensed.way[i], i == 0 ? kMostBend : kMostAside)
                    : ahead.size() / 2;
            if (good == ahead.size()) continue;
            if (i == 0) {
                lookahead.falls = false;
                lookahead.landed = condensed.solvable ? ahead[good] : LookaheadSample{};
            }
            ahead.resize(good);
            cut = true;
        }
        if (!cut) return condensed;
    }
}

// The hand continues: steps to where it will be until the operator after this one comes, which are
// taken back. They show which contacts stay closed. And a point of the wire that slides along a
// curved wall leaves its tangent by s^2 / 2R, which is what the force of the next millimetre is
// made of; no first derivative contains it. Where the wire jumps on the way, what holds from there
// on is handed over with what holds until then.
Condensed WireLink::State::condense(const Vec6& way, int jumps)
{
    Lookahead lookahead = sample_paths(way);
    Condensed condensed = condense(lookahead);
    const bool falls = lookahead.falls, landed = lookahead.landed.share > 0;
    if (jumps == 0 || !condensed.solvable || (!falls && !landed)) return condensed;

    const WireState here = body.wire.state;
    const HandPose at = device;
    const std::vector<LookaheadSample>& ahead = lookahead.ways[0].ahead;
    const double last = ahead.empty() ? 0 : ahead.back().share;
    const double there = falls ? last + kJumpAt : lookahead.landed.share;
    if (falls && !ahead.empty()) {
        body.wire.state = ahead.back().state;
        device = moved(at, last * way);
    }
    if (landed) {
        body.wire.state = lookahead.landed.state;
        device = moved(at, there * way);
    }
    if (landed || advance_to(moved(at, there * way), StepPolicy::relax)) {
        condensed.after.push_back(condense(std::max(0.0, 1 - there) * way, jumps - 1));
        condensed.after[0].handle = device;
        condensed.jump_at = falls ? there : (last + there) / 2;
    }
    device = at;
    body.wire.state = here;
    return condensed;
}

Condensed WireLink::State::condense()
{
    began = Clock::now();
    return condense(options.periods_ahead() * way_ahead(), in_parts ? 0 : kMostJumps);
}

WireLink::WireLink(const Scene& scene, const std::vector<Obstacle>& obstacles,
                   const LinkOptions& options)
    : HandleLink(options.condense)
    , state_(std::make_unique<State>(scene, obstacles, options.spring))
{
    state_->in_parts = options.snap_in_parts;
    state_->snap.most = static_cast<int>(kSnapWork * options.condense.period /
                                         double(state_->body.wire.material.law.size()));
}

WireLink::~WireLink() = default;

HandPose WireLink::start() const
{
    return state_->start;
}

Vec6 WireLink::path(double t) const
{
    const State& s = *state_;
    const auto along = [&](const CurvePoints& c) {
        return c.empty() ? 0 : curve_value(c, t) - curve_value(c, 0);
    };
    Vec6 x = Vec6::Zero();
    if (!s.rod)
        x << along(s.beam().insertion) * s.axis, along(s.beam().twist) * s.axis;
    else if (!s.scene.rods[0].hold.empty()) {
        const RodHold& h = s.scene.rods[0].hold[0];
        x << along(h.x), along(h.y), along(h.z), along(h.angle) * h.axis.normalized();
    }
    return x;
}

Vec3 WireLink::axis() const
{
    return state_->axis;
}

const std::vector<Issue>& WireLink::warnings() const
{
    return state_->warnings;
}

bool WireLink::step(const HandPose& device)
{
    State& s = *state_;
    const HandPose from = s.before = s.device;
    double done = 0;
    for (double share = 1; done < 1;) {
        const HandPose next = between(from, device, done + share);
        const bool may_relax = s.snap.under_way || share <= (s.in_parts ? kRelaxPart : kRelaxFrom);
        const StepReport report =
            s.advance(next, condense_.period, may_relax ? StepPolicy::relax : StepPolicy::newton);
        if (report.accepted) {
            s.device = next;
            done += share;
            if (s.snap.under_way) break;
            share = std::min(2 * share, 1 - done);
            if (1 - done < 1e-9) break;
            continue;
        }
        ++count_.refused;
        s.refusal = report.refusal;
        share /= 2;
        if (share < kSmallest) break;
    }
    if (done == 0) {
        ++count_.not_touched;
        return false;
    }
    count_.not_touched += done < 1 - 1e-9;
    if (s.started) {
        count_.time += condense_.period;
        ++count_.steps;
    }
    count_.snapping += s.snap.under_way;
    s.started = true;
    return true;
}

Condensed WireLink::condense_step(int most)
{
    ReductionOptions& options = state_->options = condense_;
    options.most_contacts = most;
    if (!state_->snap.under_way) return state_->condense();
    Condensed condensed;
    ViscousPull pull = state_->snap.anchor[0];
    for (int i = 0; i < kPulls; ++i) {
        for (std::size_t k = 0; k < pull.linear.size(); ++k) {
            pull.linear[k] *= kStiffer;
            pull.angular[k] *= kStiffer;
        }
        condensed = condense_wire(state_->body, options, pull);
        if (condensed.solvable) break;
    }
    return condensed;
}

bool WireLink::take_over(const HandleLink& before)
{
    const auto* link = dynamic_cast<const WireLink*>(&before);
    if (!link) return false;
    State& s = *state_;
    const State& old = *link->state_;
    const Wire &a = s.body.wire, &b = old.body.wire;
    if (a.material.node != b.material.node || a.state.reaction.size() != b.state.reaction.size() ||
        a.sheath.has_value() != b.sheath.has_value())
        return false;
    s.body.wire.state = b.state;
    s.device = old.device;
    s.before = old.before;
    s.start = old.start;
    s.first = old.first;
    s.started = old.started;
    s.snap = old.snap;
    count_ = link->count_;
    return true;
}

StepRecord WireLink::record() const
{
    StepRecord out;
    record_wire(state_->body, state_->scene.haptic.handle, 0, state_->walls, "",
                state_->scene.output.cluster, out);
    return out;
}

std::vector<BeamRecord> WireLink::beam_records() const
{
    return record().beams;
}

std::vector<ContactRecord> WireLink::contact_records() const
{
    return record().contacts;
}

HandPose WireLink::device() const
{
    return state_->device;
}

Wrench WireLink::force() const
{
    return force_on_hand(state_->body.wire);
}

std::string WireLink::refusal() const
{
    return state_->refusal;
}

} // namespace amontons
