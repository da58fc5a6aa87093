#include "haptics/link/wire_link.hpp"

#include "haptics/link/condense_wire.hpp"
#include "haptics/link/held_rod.hpp"
#include "mesh/base/curve.hpp"
#include "solver/step/wire_build.hpp"
#include "solver/step/wire_record.hpp"

#include <algorithm>
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
constexpr double kMostOut = 0.999;  // of the wire's length
constexpr int kLooks = 4;           // ahead, in a period
constexpr double kLeastWay = 1.0;   // of the fastest way in a period: what is looked ahead
constexpr double kAtRest = 1e-2;    // of that, and less
constexpr double kNotTurned = 1e-3; // of that, and less on the wire's surface
constexpr double kSnapWork = 1e5;   // of a snap in parts: Newton's iterations, times elements,
                                    // in a second of the simulation

/// What a step may do to be accepted.
enum class Means {
    newton, ///< Newton's method alone
    relax,  ///< or cross a snap
    look    ///< Newton's method, and whatever its energy balance misses: it is taken back
};

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
    HandPose start, device; // device: that the last step met
    HandPose before;        // the same of the step before
    bool rod = false;
    Vec3 axis = Vec3::Zero(); // of a beam
    double first = 0;         // insertion at the start [m]
    bool started = false;     // the first step is one of no time
    Relaxation snap;          // that the last step left under way
    bool in_parts = false;    // snaps are
    std::string refusal;

    State(const Scene& s, const std::vector<Obstacle>& obstacles, const HandleSpring& spring);
    void build_beam(const std::vector<Obstacle>& obstacles, const HandleSpring& spring);
    const BeamInput& beam() const { return scene.beams[0]; }
    BaseTarget target(const HandPose& pose) const;
    StepReport advance(const HandPose& to, double period, Means means);
    Vec6 way_ahead(const CondenseOptions& options) const;
    std::vector<WireAhead> look(const Vec6& way, const CondenseOptions& options);
    Condensed condense(const CondenseOptions& options);
};

WireLink::State::State(const Scene& s, const std::vector<Obstacle>& obstacles,
                       const HandleSpring& spring)
    : scene(s)
    , rod(!s.rods.empty())
{
    std::vector<Issue> issues;
    if (scene.beams.size() > 1)
        issues.push_back({scene.file, "/bodies/" + scene.beams[1].name, "a second beam",
                          "one: beams beside the one in the hand are not felt yet"});
    if (scene.time.kind == "dynamic")
        issues.push_back({scene.file, "/time/kind", "\"dynamic\"",
                          "\"quasi_static\": a beam in the hand has no dynamics yet"});
    if (scene.haptic.damping > 0)
        issues.push_back({scene.file, "/haptic/damping", std::to_string(scene.haptic.damping),
                          "0: a beam's base hangs on springs only"});
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
                           "gives way beside a wire in the hand",
                           "an obstacle"}});
    body = build_wire(scene, beam(), obstacles, {}, walls);
    std::vector<std::string> names;
    for (const int wall : walls)
        names.push_back(obstacles[std::size_t(wall)].name);
    check_start(scene, beam(), body, names, issues);
    if (!issues.empty()) throw InputError(std::move(issues));
    Sheath& sheath = *body.wire.sheath;
    sheath.give = 1 / spring.stiffness;
    sheath.turn_give = 1 / spring.turn_stiffness;
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

// A rod's snap takes a hundred Newton solves and more, as long as several steps. By the clock it is
// crossed in parts, one a step, and what is handed over in between is the rod on its way, held by
// the pull of the relaxation, while the hand goes on: a rod takes its time, too.
StepReport WireLink::State::advance(const HandPose& to, double period, Means means)
{
    WireGroup group{{&body}, nullptr};
    if (!rod) {
        const std::vector<BaseTarget> base{target(to)};
        return means == Means::relax ? try_or_relax(group, base)
                                     : try_step(group, base, period, means == Means::look);
    }
    const WireState old = body.wire.state;
    const std::vector<BaseTarget> base{{old.base_insertion, old.base_twist}};
    place_device(body.wire, to);
    // The work of a clamp that moves is not in the balance of wires.
    StepReport r;
    if (!snap.under_way) r = try_step(group, base, period, true);
    if (!r.accepted && means == Means::relax)
        r = relax_step(group, base, in_parts ? &snap : nullptr);
    if (!r.accepted) body.wire.state = old;
    return r;
}

/// Where the hand will be by its last motion when the next operator is due.
Vec6 WireLink::State::way_ahead(const CondenseOptions& options) const
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

/// Steps on the way, which are taken back.
std::vector<WireAhead> WireLink::State::look(const Vec6& way, const CondenseOptions& options)
{
    std::vector<WireAhead> ahead;
    const WireState here = body.wire.state;
    const HandPose at = device;
    const StepStart from = mark_step_start(body.wire);
    const int looks = std::min(kMostLooks, kLooks * options.periods_ahead());
    for (int i = 1; i <= looks; ++i) {
        const double share = static_cast<double>(i) / looks;
        const HandPose next = moved(at, share * way);
        if (!advance(next, options.period, Means::look).accepted || !body.wire.outside()) break;
        device = next;
        ahead.push_back(look_ahead(body, from, options.reach()));
        ahead.back().share = share;
    }
    device = at;
    body.wire.state = here;
    return ahead;
}

// The hand goes on: steps to where it will be until the operator after this one comes, which are
// taken back. They tell which contacts stay closed. And a point of the wire that slides along a
// curved wall leaves its tangent by s^2 / 2R, which is what the force of the next millimetre is
// made of; no first derivative knows it.
Condensed WireLink::State::condense(const CondenseOptions& options)
{
    const Vec6 way = options.periods_ahead() * way_ahead(options);
    std::vector<WireAhead> ahead;
    if (!way.isZero() && body.wire.outside()) ahead = look(way, options);
    while (!ahead.empty()) {
        Condensed condensed = condense_wire(body, options, {}, ahead);
        const std::size_t good = condensed.solvable ? add_bends(condensed, ahead, way) : 0;
        if (good == ahead.size()) return condensed;
        ahead.resize(condensed.solvable ? good : ahead.size() / 2);
    }
    return condense_wire(body, options);
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
            s.advance(next, condense_.period, may_relax ? Means::relax : Means::newton);
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
        ++count_.not_met;
        return false;
    }
    count_.not_met += done < 1 - 1e-9;
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
    CondenseOptions options = condense_;
    options.most_contacts = most;
    if (!state_->snap.under_way) return state_->condense(options);
    Condensed condensed;
    Anchor pull = state_->snap.anchor[0];
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
