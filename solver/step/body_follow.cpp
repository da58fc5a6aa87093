#include "solver/step/body_stepper.hpp"

#include "contact/rigid/shape.hpp"
#include "mesh/base/dense.hpp"
#include "solver/body/rigid_body.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <span>
#include <tuple>

// Steps of motion of second order: joints, springs and the contacts of rigid bodies hold where the
// step ends, and their forces act half way (docs/theory/motion.md, decision 0015).
//
// With places x and velocities v of the start, x' and v' of the end, a rule that takes mean rates
// of second order, and a constraint g, the step solves g(x') = 0 and applies its impulse along D
// with D . (x' - x) = g(x') - g(x): no work is done by what holds, and none is lost by linearising.
// Every iteration solves the one contact problem with D as the last iterate has it; each leaves of
// the error about the step's length times the speed at which directions turn.

namespace amontons {
namespace {

constexpr int kMostFollowed =
    16; // iterations that find contacts anew; then they move as found last
constexpr double kSameFace = 0.9; // cosine of normals: beyond, a contact is with another face

} // namespace

Mat3 turned_frame(const Mat3& frame, const Vec3& normal)
{
    return rotation_between(frame.col(0), normal).toRotationMatrix() * frame;
}

/// Steps that have joints, or rigid bodies that may touch on round surfaces: normals of flat ones
/// rotate only with the bodies, and piles of them converge slowly. Not in implicit Euler's steps,
/// which are dissipative anyway.
StepInput BodyStepper::followed(const BodySystem& system, StepInput step)
{
    if (!step.dynamic || !(step.rule.end < 1)) return step;
    const auto round = [&](int b) {
        const RigidBody* rigid = system.refs[std::size_t(b)].rigid;
        return rigid && is_round(rigid->shape());
    };
    const auto curved = [&](const ContactPair& p) {
        if (!system.refs[std::size_t(p.a)].rigid) return false;
        if (p.b < 0) return round(p.a) || !p.plane;
        return system.refs[std::size_t(p.b)].rigid && (round(p.a) || round(p.b));
    };
    step.follows = !system.couplings.empty() || std::ranges::any_of(system.finder.pairs(), curved);
    for (int b = 0; system.finder.has_rest() && !step.follows && b < int(system.refs.size()); ++b)
        step.follows = round(b);
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
        Vec3 velocity = body(std::size_t(c.a)).velocity(list_.place_a(c), VelocityAt::start);
        if (c.b >= 0)
            velocity -= body(std::size_t(c.b)).velocity(list_.place_b(c), VelocityAt::start);
        ways.approach = c.frame.col(0).dot(velocity);
        contacts_on_.push_back(ways);
    }
}

namespace {

/// How far joints are from where they hold [m].
double joints_off(std::span<const Coupling> couplings, std::span<const double> values)
{
    double sum = 0;
    for (std::size_t c = 0; c < couplings.size(); ++c)
        if (!(couplings[c].softness > 0)) sum += values[c] * values[c];
    return std::sqrt(sum);
}

} // namespace

/// The iterate continues by the forces of the step before: directions half way are then known
/// up to the square of the step. Of rigid bodies alone, whose motion needs nothing else. A body
/// that is far lighter than what its joints carry may be thrown off by them, about places that have
/// moved: then the iterate is that without forces.
void BodyStepper::expect_motion()
{
    constexpr double kThrownOff = 0.05; // joints, of the motion in the step
    constexpr double kStill = 1e-9;     // of a body's size: motion that does not count
    if (!follows_some()) return;
    for (const BodyRef& b : system_.refs)
        if (!b.rigid) return;
    std::vector<ActingForce> acting;
    const int contacts_here = int(list_.contact.size());
    for (int c = 0; c < int(value_.size()); ++c)
        if (const auto known = force_.find(key(c)); known != force_.end())
            acting.push_back({c, c < contacts_here
                                     ? known->second
                                     : Vec3(known->second.x() *
                                            joints_[std::size_t(c - contacts_here)].direction)});
    if (acting.empty()) return;
    double way = 0;
    for (std::size_t b = 0; b < bodies(); ++b)
        way = std::max({way, step_.h * body(b).speed(), kStill * body(b).size()});
    std::vector<Eigen::VectorXd> forces;
    forces_on_bodies(contacts(), acting, forces);
    const auto move = [&] {
        for (std::size_t b = 0; b < bodies(); ++b)
            body(b).update(Eigen::VectorXd(), Eigen::VectorXd(), forces[b]);
        find();
    };
    move();
    if (!(joints_off(system_.couplings, joint_value_) > kThrownOff * way)) return;
    for (Eigen::VectorXd& f : forces)
        f.setZero();
    move();
}

/// Where all rows hold and all contacts stick, their forces are those of linear equations: most
/// iterations of steps that are followed have no lower tolerance. Dependent rows (a closed chain of
/// hinges) that are inconsistent are an error of the iterate, which decreases with the iterations.
/// @return  false if that is not so, or not known: nothing has changed
bool BodyStepper::all_rows_hold()
{
    constexpr int kMostRows = 100, kMostJoints = 400; // of a dense factor; where none may open
    constexpr double kContradict = 1e-3;              // of the values that rows have to close
    closed_ = {};
    const int contacts_here = int(list_.contact.size());
    const bool joints_only = rows_.chosen.empty() || rows_.chosen.front() >= contacts_here;
    if (options_.outside || !step_.follows || problem_.W.is_of_bodies() ||
        rows_.count > (joints_only ? kMostJoints : kMostRows))
        return false;
    for (const int c : rows_.chosen)
        if (c < contacts_here && list_.contact[std::size_t(c)].sliding_at_start) return false;
    const Eigen::MatrixXd from_sparse =
        problem_.W.is_dense() ? Eigen::MatrixXd() : Eigen::MatrixXd(problem_.W.as_sparse());
    const Eigen::MatrixXd& W = problem_.W.is_dense() ? problem_.W.dense() : from_sparse;
    closed_ = close_rows(W);
    const Eigen::VectorXd warm = r_;
    r_.setZero(rows_.count);
    bool holds = !closed_.empty() && close(problem_.q);
    if (holds && !closed_.left.empty())
        holds = (W * r_ + problem_.q).norm() <= kContradict * problem_.q.norm();
    if (holds) return true;
    closed_ = {};
    r_ = warm;
    return false;
}

/// Changes r_ by what makes these values 0.
/// @return  false if a contact pulls then, or slides: nothing has changed
bool BodyStepper::close(const Eigen::VectorXd& u)
{
    Eigen::VectorXd r = r_ + closing_forces(closed_, u);
    for (std::size_t i = 0; i < rows_.chosen.size(); ++i) {
        const int first = rows_.first[i];
        if (problem_.kind[i] == ContactKind::bilateral) continue;
        if (!(r[first] > 0)) return false;
        if (problem_.kind[i] == ContactKind::frictional &&
            !(std::hypot(r[first + 1], r[first + 2]) <=
              kStickShare * problem_.mu[Eigen::Index(i)] * r[first]))
            return false;
    }
    r_ = std::move(r);
    return true;
}

/// Iterations of rigid bodies on linear equations, with their factor as it is: what holds at the
/// iterate, and forces where the iterate has them, at negligible cost.
void BodyStepper::refine()
{
    constexpr int kMost = 5;
    constexpr double kFiner = 0.1; // of the tolerance
    if (closed_.empty()) return;
    for (const BodyRef& b : system_.refs)
        if (!b.rigid) return;
    const int contacts_here = int(list_.contact.size());
    const double enough = kFiner * options_.tolerance * (problem_.W * r_).norm();
    double least = std::numeric_limits<double>::infinity();
    std::vector<ActingForce> acting;
    for (int i = 0; i < kMost; ++i) {
        find();
        Eigen::VectorXd u = values(rows_);
        for (std::size_t k = 0; k < rows_.chosen.size(); ++k)
            if (const int joint = rows_.chosen[k] - contacts_here; joint >= 0)
                u[rows_.first[k]] += compliance_of_row(std::size_t(joint)) * r_[rows_.first[k]];
        const double left = u.norm();
        stands_ = left <= enough;
        if (stands_ || !(left < 0.5 * least)) return;
        least = left;
        if (!close(u)) return; // the contact problem is due
        stands_ = false;
        acting.clear();
        for (std::size_t k = 0; k < rows_.chosen.size(); ++k) {
            const int c = rows_.chosen[k], first = rows_.first[k];
            if (c >= contacts_here) {
                force_[key(c)] = Vec3(r_[first], 0, 0);
                acting.push_back(
                    {c, r_[first] * joints_[std::size_t(c - contacts_here)].direction});
                continue;
            }
            const int rows = amontons::rows_of(problem_.kind[k]);
            const Vec3 f =
                list_.contact[std::size_t(c)].frame.leftCols(rows) * r_.segment(first, rows);
            force_[key(c)] = f;
            acting.push_back({c, f});
        }
        forces_on_bodies(contacts(), acting, body_force_);
        for (std::size_t b = 0; b < bodies(); ++b)
            body(b).update(Eigen::VectorXd(), Eigen::VectorXd(), body_force_[b]);
    }
}

namespace {

/// No point of the body moves farther in the step [m].
double most_moved(const RigidBody& body)
{
    BodyPlace centre, turn;
    centre.point = body.centre();
    turn.turns = true;
    return body.displacement(centre).norm() + 2 * body.size() * body.displacement(turn).norm();
}

/// No point of the body moves by more than rounding in the step.
bool is_still(const RigidBody& body)
{
    constexpr double kRounding = 1e-11; // of its size
    return most_moved(body) <= kRounding * body.size();
}

} // namespace

/// Bound of the gaps that the contacts of a pair of rigid bodies have now [m].
double BodyStepper::farthest_gap(int pair) const
{
    constexpr double kTurned = 2; // of the motion: the places that touch, and the normal's turn
    double farthest = 0;
    for (std::size_t i = 0; i < list_.contact.size(); ++i)
        if (list_.contact[i].pair == pair) farthest = std::max(farthest, contacts_on_[i].gap);
    const ContactPair& p = system_.finder.pairs()[std::size_t(pair)];
    for (const int b : {p.a, p.b})
        if (b >= 0) farthest += kTurned * most_moved(*system_.refs[std::size_t(b)].rigid);
    return farthest;
}

/// Contacts between rigid bodies are found at the iterate, others move with their bodies, and so do
/// those of bodies at rest, which are what they were at the start.
void BodyStepper::follow_to_end()
{
    if (list_.contact.empty()) return;
    std::map<BodySystem::Key, BodyContact> found;
    std::vector<char> still;
    for (const BodyRef& b : system_.refs)
        still.push_back(b.rigid && is_still(*b.rigid));
    const bool anew = follows_++ < kMostFollowed;
    bool stand = false;
    int pair = -1;
    for (const BodyContact& c : list_.contact) {
        const bool rigid = system_.refs[std::size_t(c.a)].rigid &&
                           (c.b < 0 || system_.refs[std::size_t(c.b)].rigid);
        if (!anew || !rigid || c.pair == pair) continue;
        if (still[std::size_t(c.a)] && (c.b < 0 || still[std::size_t(c.b)])) {
            stand = true;
            continue;
        }
        pair = c.pair;
        BodyContacts of_pair;
        system_.finder.find_rigid(system_.refs, pair, farthest_gap(pair), of_pair);
        for (const BodyContact& k : of_pair.contact)
            found.emplace(BodySystem::Key{k.pair, k.id}, k);
    }
    for (std::size_t i = 0; i < list_.contact.size(); ++i) {
        BodyContact& c = list_.contact[i];
        FollowedContact& ways = contacts_on_[i];
        const auto at = found.find({c.pair, c.id});
        if (at != found.end() && at->second.frame.col(0).dot(ways.frame.col(0)) > kSameFace) {
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
            if (found.empty() && !stand) { // along the normal that was found last
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

/// What a turn is of the mean spin times the step, by which its row turns. Below 1e-6 rad the two
/// are the same.
double BodyStepper::of_turn(const Coupling& coupling, const CouplingRow& row, double before) const
{
    constexpr double kSmall = 1e-6;
    double turned = 0;
    for (const auto& [side, sign, place] :
         {std::tuple{coupling.a.body, 1.0, row.place_a(coupling)},
          std::tuple{coupling.b.body, -1.0, row.place_b(coupling)}})
        if (side >= 0)
            turned += sign * row.direction.dot(body(std::size_t(side)).displacement(place));
    return std::abs(turned) > kSmall ? (row.value - before) / turned : 1;
}

/// Couplings as rows of the iterate.
void BodyStepper::find_joints()
{
    joints_.resize(system_.couplings.size());
    joint_value_.resize(joints_.size());
    JointFrames frames;
    for (std::size_t c = 0; c < system_.couplings.size(); ++c) {
        const Coupling& coupling = system_.couplings[c];
        const CouplingMemory& memory = system_.coupling_memory[c];
        CouplingRow& row = joints_[c];
        find_row(system_.refs, coupling, memory.value, frames, row);
        joint_value_[c] = row.value;
        if (!joints_start_.empty()) {
            row_between(coupling, joints_start_[c], row);
            if (coupling.turns && !coupling.square)
                row.direction *= of_turn(coupling, row, joints_start_[c].value);
        }
        if (step_.dynamic && coupling.softness > 0)
            row.value = spring_row(coupling, step_.rule, step_.h, memory, row.value).value;
    }
}

/// After a step that has been accepted.
void BodyStepper::store_joints()
{
    for (std::size_t c = 0; c < system_.couplings.size(); ++c) {
        if (!(system_.couplings[c].softness > 0)) continue; // of joints nothing is carried on
        CouplingMemory& m = system_.coupling_memory[c];
        const double value = coupling_row(system_.refs, system_.couplings[c], m.value).value;
        m.filtered = step_.dynamic && step_.rule.filtered
                         ? step_.rule.next(value, m.value, m.filtered)
                         : value;
        m.value = value;
    }
}

/// What a spring takes in a step of motion beside what it stores: the work of its damping and of
/// the rule [J].
/// @param force  its mean, as its rows have it [N]
double BodyStepper::spring_loss(std::size_t coupling, double force) const
{
    const Coupling& c = system_.couplings[coupling];
    if (!(c.softness > 0)) return 0;
    const double before = system_.coupling_memory[coupling].value;
    if (!joints_start_.empty()) {
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
