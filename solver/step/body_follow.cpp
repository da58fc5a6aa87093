#include "solver/step/body_stepper.hpp"

#include "mesh/base/dense.hpp"
#include "solver/body/rigid_body.hpp"

#include <algorithm>
#include <map>

// Steps of motion of second order: joints, springs and the contacts of rigid bodies hold where the
// step ends, and their forces act half way (docs/theory/motion.md, decision 0015).
//
// With places x and velocities v of the start, x' and v' of the end, a rule that takes mean rates
// of second order, and a constraint g, the step asks for g(x') = 0 and applies its impulse along D
// with D . (x' - x) = g(x') - g(x): no work is done by what holds, and none is lost by linearising.
// Every iteration solves the one contact problem with D as the last iterate has it; each leaves of
// the error about the step's length times the speed at which directions turn.

namespace amontons {
namespace {

constexpr int kMostFollowed = 8; // iterations that find contacts anew; then they move as found last
constexpr double kSameFace = 0.9; // cosine of normals: beyond, a contact is with another face

Mat3 turned_frame(const Mat3& frame, const Vec3& normal)
{
    return rotation_between(frame.col(0), normal).toRotationMatrix() * frame;
}

} // namespace

/// Steps that have joints, or rigid bodies that may meet something rigid. Implicit Euler's do not:
/// they damp, and keep what they have.
StepInput BodyStepper::followed(const BodySystem& system, StepInput step)
{
    const auto rigid = [&](const ContactPair& p) {
        return system.refs[std::size_t(p.a)].rigid &&
               (p.b < 0 || system.refs[std::size_t(p.b)].rigid);
    };
    step.follows = step.dynamic && step.rule.end < 1 && !system.has_rods() &&
                   (!system.couplings.empty() || system.finder.has_rest() ||
                    std::ranges::any_of(system.finder.pairs(), rigid));
    return step;
}

bool BodyStepper::follows_some() const
{
    return step_.follows && (!system_.couplings.empty() || !list_.contact.empty());
}

/// Contacts as they are where the step starts.
void BodyStepper::start_following()
{
    contacts_on_.clear();
    for (const BodyContact& c : list_.contact) {
        FollowedContact ways;
        ways.frame = ways.end_frame = c.frame;
        ways.point = ways.end_point = c.point;
        ways.gap = c.gap;
        Vec3 velocity = body(std::size_t(c.a)).start_velocity(list_.place_a(c));
        if (c.b >= 0) velocity -= body(std::size_t(c.b)).start_velocity(list_.place_b(c));
        ways.approach = c.frame.col(0).dot(velocity);
        contacts_on_.push_back(ways);
    }
}

/// Contacts between rigid bodies are found at the iterate, others move with their bodies.
void BodyStepper::follow_to_end()
{
    std::map<BodySystem::Key, BodyContact> found;
    const bool anew = follows_++ < kMostFollowed;
    int pair = -1;
    for (const BodyContact& c : list_.contact) {
        const bool rigid = system_.refs[std::size_t(c.a)].rigid &&
                           (c.b < 0 || system_.refs[std::size_t(c.b)].rigid);
        if (!anew || !rigid || c.pair == pair) continue;
        pair = c.pair;
        BodyContacts of_pair;
        system_.finder.find_rigid(system_.refs, pair, of_pair);
        for (const BodyContact& k : of_pair.contact)
            found.emplace(BodySystem::Key{k.pair, k.id}, k);
    }
    for (std::size_t i = 0; i < list_.contact.size(); ++i) {
        BodyContact& c = list_.contact[i];
        FollowedContact& ways = contacts_on_[i];
        const auto at = found.find({c.pair, c.id});
        if (at != found.end() &&
            at->second.frame.col(0).dot(ways.frame.col(0)) > kSameFace) {
            const Vec3 n = at->second.frame.col(0);
            ways.end_frame = turned_frame(ways.frame, n);
            ways.end_point = at->second.point;
            c.frame = turned_frame(ways.frame, (n + ways.frame.col(0)).normalized());
            c.gap = at->second.gap;
        } else {
            Vec3 moved = body(std::size_t(c.a)).displacement(list_.place_a(c)), mean = moved;
            if (c.b >= 0) {
                const Vec3 other = body(std::size_t(c.b)).displacement(list_.place_b(c));
                mean = fixed(std::size_t(c.a))   ? other
                       : fixed(std::size_t(c.b)) ? moved
                                                 : Vec3(0.5 * (moved + other));
                moved -= other;
            }
            if (found.empty()) { // along the normal that was found last
                c.gap += c.frame.col(0).dot(moved) - moved_[i];
            } else {
                c.gap = ways.gap + ways.frame.col(0).dot(moved);
                c.frame = ways.end_frame = ways.frame;
            }
            ways.end_point = ways.point + mean;
        }
        c.point = 0.5 * (ways.point + ways.end_point);
    }
}

/// Couplings as rows of the iterate.
void BodyStepper::find_joints()
{
    joints_.clear();
    joint_value_.clear();
    for (std::size_t c = 0; c < system_.couplings.size(); ++c) {
        const Coupling& coupling = system_.couplings[c];
        const CouplingMemory& memory = system_.coupling_memory[c];
        CouplingRow row = coupling_row(system_.refs, coupling, memory.value);
        joint_value_.push_back(row.value);
        if (step_.follows) row = row_between(coupling, joints_start_[c], row);
        if (step_.dynamic && coupling.softness > 0)
            row.value = spring_row(coupling, step_.rule, step_.h, memory, row.value).value;
        joints_.push_back(row);
    }
}

/// After a step that has been accepted.
void BodyStepper::remember_joints()
{
    for (std::size_t c = 0; c < system_.couplings.size(); ++c) {
        CouplingMemory& m = system_.coupling_memory[c];
        const double value = coupling_row(system_.refs, system_.couplings[c], m.value).value;
        m.filtered = step_.dynamic && step_.rule.filtered
                         ? step_.rule.next(value, m.value, m.filtered)
                         : value;
        m.value = value;
    }
}

/// What a spring takes in a step of motion beside what it stores: the work of its damping and of the
/// rule [J].
/// @param force  its mean, as its rows have it [N]
double BodyStepper::spring_loss(std::size_t coupling, double force) const
{
    const Coupling& c = system_.couplings[coupling];
    if (!(c.softness > 0)) return 0;
    const double before = system_.coupling_memory[coupling].value;
    if (step_.follows) {
        const double after = joint_value_[coupling];
        return -(force + 0.5 * (after + before) / c.softness) * (after - before);
    }
    double stretched = 0; // along a direction that stays; the force is that of the end
    for (const Side& side : sides_of(contacts(), int(list_.contact.size() + coupling)))
        if (side.body >= 0)
            stretched += side.sign * joints_[coupling].direction.dot(
                                         body(std::size_t(side.body)).displacement(side.place));
    return (0.5 / c.softness + c.damping / step_.h) * stretched * stretched;
}

} // namespace amontons
