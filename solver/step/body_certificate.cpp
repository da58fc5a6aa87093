#include "solver/step/body_stepper.hpp"

#include "contact/certificate.hpp"
#include "mesh/base/dense.hpp"
#include "mesh/base/phase_timer.hpp"
#include "solver/body/drive.hpp"
#include "solver/body/rigid_body.hpp"
#include "solver/body/solid_body.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <set>
#include <variant>

namespace amontons {
namespace {

constexpr double kNothing = 1e-14;     // of the largest body's size
constexpr double kAlone = 1e-2;        // of the tolerance
constexpr double kUncontrolled = 1e-5; // share of a mode's size along the rows of contacts

/// Crossings of rods wander along them, and change their numbers: by the trapezoid rule none of
/// them is new, nor left.
bool is_of_crossing_rods(const BodySystem& system, const BodyContact& c)
{
    return system.refs[std::size_t(c.a)].rod && is_crossing(c.id);
}

/// Rows of a body's modes by the contacts that act on it, whole contacts, and by couplings.
/// @param B      the body's rows, as rows.row[b] numbers them, x its modes
/// @param share  of the largest force on the body, below which a contact does not act
Eigen::MatrixXd acting_rows(const Rows& rows, std::size_t b, const Eigen::MatrixXd& B,
                            const ContactProblem& problem, const Eigen::VectorXd& r, double share)
{
    std::vector<Eigen::Index> own(std::size_t(rows.count), -1);
    double most = 0;
    for (std::size_t i = 0; i < rows.row[b].size(); ++i) {
        own[std::size_t(rows.row[b][i])] = Eigen::Index(i);
        most = std::max(most, std::abs(r[rows.row[b][i]]));
    }
    std::vector<Eigen::Index> list;
    for (std::size_t i = 0; i < rows.chosen.size(); ++i) {
        const int first = rows.first[i], count = rows_of(problem.kind[i]);
        if (problem.kind[i] != ContactKind::bilateral && !(r[first] > share * most)) continue;
        for (int row = first; row < first + count; ++row)
            if (own[std::size_t(row)] >= 0) list.push_back(own[std::size_t(row)]);
    }
    return B(list, Eigen::all);
}

/// A ball at rest on one place turns about the normal there without a force or a slip: iterations
/// in which it touched more may leave such a turn, which is taken from that of the step.
/// @param acting  rows of acting contacts and couplings on its modes, the last three its turn
void take_away_spin(RigidBody& body, const Eigen::MatrixXd& acting)
{
    if (!std::holds_alternative<Ball>(body.shape()) || acting.cols() != 6) return;
    Eigen::MatrixXd of_turn = Eigen::MatrixXd::Zero(std::max<Eigen::Index>(acting.rows(), 3), 3);
    of_turn.topRows(acting.rows()) = acting.rightCols(3);
    const RightSingular svd = right_singular(of_turn);
    const bool one_axis = svd.values[1] > kUncontrolled * svd.values[0] &&
                          svd.values[2] <= kUncontrolled * svd.values[0];
    if (!one_axis) return;
    const Vec3 axis = svd.V.col(2);
    const Vec3 turned =
        rotation_vector(body.placement().turn * body.start_placement().turn.conjugate());
    const auto [centre, turn] = body.iterate();
    body.set_iterate(
        {centre, rotation(turned - turned.dot(axis) * axis) * rotation(turned).conjugate() * turn});
}

} // namespace

/// The certificate of r_ with u in place of W r + q.
void BodyStepper::certify_rows(const Eigen::VectorXd& u)
{
    if (rods_only_) return certify_rods(u);
    if (rows_.count == 0) { // only the bodies' own balance is left: a Newton step is cheap
        report_.error = 0;
        report_.threshold = kAlone * options_.tolerance;
        report_.penetration = report_.cone = 0;
        return;
    }
    bool modes = false;
    for (const Eigen::VectorXd& g : mode_load_)
        modes |= g.size() > 0;
    Delassus& W = modes ? measured_W_ : problem_.W;
    const Eigen::VectorXd compliance = W * r_;
    // Motions that are no more than the rounding of places: nothing there to be relative to.
    double size = 0;
    for (std::size_t b = 0; b < bodies(); ++b)
        size = std::max(size, body(b).size());
    const double nothing = kNothing * size / (step_.dynamic ? step_.h : 1);
    if (u.cwiseAbs().maxCoeff() <= nothing && compliance.cwiseAbs().maxCoeff() <= nothing) {
        report_.error = 0;
        report_.threshold = options_.tolerance;
        report_.penetration = report_.cone = 0;
        nothing_ = true;
        return;
    }
    nothing_ = false;
    ContactProblem true_rows;
    true_rows.level = problem_.level;
    true_rows.mu = problem_.mu;
    true_rows.kind = problem_.kind;
    // So are single contacts that neither gap nor slip, whatever their forces move.
    Eigen::VectorXd seen = u;
    for (std::size_t i = 0; i < rows_.chosen.size(); ++i) {
        auto own = seen.segment(rows_.first[i], amontons::rows_of(problem_.kind[i]));
        if (own.cwiseAbs().maxCoeff() <= nothing) own.setZero();
    }
    true_rows.q = seen - compliance;
    std::swap(true_rows.W, W); // and back below, not copied: that of a pile is large
    const Certificate c = certify(true_rows, r_, options_.tolerance, ErrorScope::acting_rows);
    std::swap(true_rows.W, W);
    report_.error = c.error;
    report_.threshold = std::max(c.threshold, options_.tolerance);
    report_.penetration = step_.dynamic ? c.worst_penetration * step_.h : c.worst_penetration;
    report_.cone = step_.dynamic ? c.worst_cone_violation / step_.h : c.worst_cone_violation;
    report_.worst = c.worst_contact < 0 ? -1 : rows_.chosen[std::size_t(c.worst_contact)];
}

/// At the end of the step: gaps, slips and forces there against the problem's laws.
bool BodyStepper::check_end_of_step()
{
    // ---- Reactions of the step on the geometry at its end
    // Forces keep their direction in space; where normals turned, they no longer fit the law.
    std::vector<BodySystem::Key> keys;
    for (const int c : rows_.chosen)
        keys.push_back(key(c));
    // Forces that pass through a light body are far larger than their resultant on it.
    std::vector<double> passing(bodies(), 0);
    for (std::size_t b = 0; b < bodies(); ++b)
        if (!rows_.row[b].empty())
            passing[b] = (rows_.columns[b].cwiseAbs() * own(rows_, r_, b).cwiseAbs()).norm();
    if (!stands_) find();
    stands_ = false;
    for (BodySystem::Key& k : keys)
        if (const auto next = followed_.find(k); next != followed_.end()) k = next->second;
    const std::map<BodySystem::Key, Vec3>& known = force_;
    std::map<BodySystem::Key, int> now; // in motion contacts keep the numbers of the step's start
    for (int c = 0; c < int(value_.size()) && !step_.dynamic; ++c)
        now[key(c)] = c;
    const auto number_now = [&](std::size_t i) {
        if (step_.dynamic) return rows_.chosen[i];
        const auto at = now.find(keys[i]);
        return at == now.end() ? -1 : at->second;
    };
    Eigen::VectorXd r = Eigen::VectorXd::Zero(rows_.count);
    Eigen::VectorXd u(rows_.count);
    std::vector<ActingForce> acting;

    // ---- Error of the contact laws
    std::vector<BodySystem::Key> acting_keys;
    double lost = 0, total = 0;
    for (std::size_t i = 0; i < keys.size(); ++i) {
        const int size = amontons::rows_of(problem_.kind[i]);
        const auto force = known.find(keys[i]);
        const int at = number_now(i);
        const Vec3 f = force == known.end() ? Vec3(Vec3::Zero()) : force->second;
        total += f.norm();
        if (at < 0) { // out of reach, or another piece of the surface
            lost += f.norm();
            u.segment(rows_.first[i], size).setZero();
            u[rows_.first[i]] = motion_[keys[i]][0];
            continue;
        }
        const bool joint = problem_.kind[i] == ContactKind::bilateral;
        const Vec3 own = joint ? f : Vec3(list_.contact[std::size_t(at)].frame.transpose() * f);
        r.segment(rows_.first[i], size) = own.head(size);
        u.segment(rows_.first[i], size) = value_[std::size_t(at)].head(size);
        if (joint) {
            const int c = at - int(list_.contact.size());
            u[rows_.first[i]] += compliance_of_row(std::size_t(c)) * r[rows_.first[i]];
        }
        if (f.isZero(0)) continue;
        const Vec3 along =
            joint ? Vec3(own[0] * joints_[std::size_t(at) - list_.contact.size()].direction)
                  : Vec3(list_.contact[std::size_t(at)].frame.leftCols(size) * own.head(size));
        acting.push_back({at, along});
        acting_keys.push_back(keys[i]);
    }
    r_ = r;
    certify_rows(u);
    if (report_.worst >= 0) report_.worst = -1;

    // ---- Penetration of other contacts
    // A contact that was not in the problem and penetrates now.
    double new_overlap = 0;
    deepest_.clear();
    for (int c = 0; c < int(list_.contact.size()); ++c)
        if (motion_.count(key(c)) == 0 && -value_[std::size_t(c)][0] > new_overlap) {
            new_overlap = -value_[std::size_t(c)][0];
            deepest_ = fmt::format("penetration of {:.2g} m left of {}",
                                   new_overlap * (step_.dynamic ? step_.h : 1), who(c));
        }

    // ---- Balance of the bodies
    double shift = total > 0 && !nothing_ ? lost / total : 0;
    std::vector<Eigen::VectorXd> f;
    forces_on_bodies(contacts(), acting, f);
    double imbalance = nothing_ ? 0 : hanging_imbalance(f);
    int furthest = -1;
    for (std::size_t b = 0; b < bodies(); ++b) {
        const double size = passing[b];
        // Of rods alone the balance with these forces is the whole certificate.
        if (size > 0 && !nothing_ && !rods_only_)
            shift = std::max(shift, (f[b] - body_force_[b]).norm() / size);
        const double own_imbalance = body(b).imbalance(f[b]);
        if (own_imbalance > imbalance) furthest = int(b);
        imbalance = std::max(imbalance, own_imbalance);
    }
    body_force_ = std::move(f);
    log_iteration(report_.error, shift, imbalance, furthest, std::move(acting_keys));
    report_.error = std::max({report_.error, shift, imbalance});
    double size = 0;
    for (std::size_t b = 0; b < bodies(); ++b)
        size = std::max(size, body(b).size());
    errors_.push_back(report_.error);
    if (new_overlap <= options_.tolerance * size) deepest_.clear();
    if (rolls_ && pull_back_ > 0) return false; // what it leaves out of contact is not there yet
    return report_.error <= report_.threshold && deepest_.empty() &&
           left_out_ <= options_.tolerance * size;
}

/// Directions of a body's modes that its active contacts constrain by no more than this share.
Eigen::MatrixXd BodyStepper::unconstrained_modes(std::size_t b, double share) const
{
    const Eigen::Index modes = mode_load_[b].size();
    std::vector<Eigen::Index> acting;
    double scale = 0;
    std::vector<char> joint(std::size_t(rows_.count), 0); // holds without a force, too
    for (std::size_t i = 0; i < rows_.chosen.size(); ++i)
        if (problem_.kind[i] == ContactKind::bilateral) joint[std::size_t(rows_.first[i])] = 1;
    if (B_.size() > b && B_[b].size() > 0)
        for (std::size_t i = 0; i < rows_.row[b].size(); ++i) {
            scale = std::max(scale, B_[b].row(Eigen::Index(i)).norm());
            if (r_[rows_.row[b][i]] != 0 || joint[std::size_t(rows_.row[b][i])])
                acting.push_back(Eigen::Index(i));
        }
    Eigen::MatrixXd rows =
        Eigen::MatrixXd::Zero(std::max(Eigen::Index(acting.size()), modes), modes);
    for (std::size_t i = 0; i < acting.size(); ++i)
        rows.row(Eigen::Index(i)) = B_[b].row(acting[i]);
    const RightSingular svd = right_singular(rows);
    Eigen::Index first = modes;
    while (first > 0 && svd.values[first - 1] <= share * scale)
        --first;
    return svd.V.rightCols(modes - first);
}

/// Modes that no contact constrains: their amplitudes stay 0, which is reported.
void BodyStepper::report_modes()
{
    for (std::size_t b = 0; b < bodies(); ++b) {
        if (mode_load_[b].size() == 0) continue;
        if (RigidBody* const rigid = system_.refs[b].rigid;
            rigid && !step_.dynamic && B_.size() > b && B_[b].size() > 0)
            take_away_spin(*rigid, acting_rows(rows_, b, B_[b], problem_, r_, options_.tolerance));
        const Eigen::MatrixXd unconstrained =
            unloaded_modes(b, unconstrained_modes(b, kUncontrolled));
        for (Eigen::Index m = 0; m < unconstrained.cols(); ++m)
            report_.remarks.push_back(fmt::format(
                "{}: no contact controls its {}; it stays where it is", system_.refs[b].name,
                body(b).matrix().mode_name(unconstrained.col(m))));
    }
}

/// True if an overlap in motion may stay until the next step, which gets a row for it: of two
/// meshes, accepted without a warning, and not so nearly refused that it would be in that step.
bool BodyStepper::may_stay(const BodyOverlap& o) const
{
    constexpr double kFarFromRefused = 0.9; // of BodyOverlap::most
    return o.own.count > 0 && o.b >= 0 && system_.refs[std::size_t(o.a)].solid &&
           system_.refs[std::size_t(o.b)].solid &&
           o.depth <= std::min(o.allowed, kFarFromRefused * o.most);
}

/// Measures the overlaps of bodies and adds rows for the deep places.
/// @return  true if some are new
bool BodyStepper::adds_rows()
{
    constexpr int kMostRounds = 8;
    constexpr double kNearlyRefused = 0.5;
    const Stopwatch watch;
    system_.finder.overlaps(system_.refs, overlaps_);
    std::vector<BodyOverlap> deep = overlaps_;
    if (options_.add_rows == BodyStepOptions::AddRows::refused)
        std::erase_if(deep,
                      [](const BodyOverlap& o) { return !(o.depth > kNearlyRefused * o.most); });
    // In motion rows cost a repetition of the step: not for what is accepted as it is.
    if (step_.dynamic && std::ranges::none_of(deep, [&](const BodyOverlap& o) {
            return o.own.count > 0 && o.depth > o.rows_beyond && !may_stay(o);
        }))
        deep.clear();
    const bool some = options_.add_rows != BodyStepOptions::AddRows::none &&
                      rounds_ < kMostRounds && system_.finder.add_rows(deep);
    rounds_ += some;
    report_.detection += watch.seconds();
    return some;
}

/// A sentence on the deepest overlap for which the step is refused; "" if there is none.
std::string BodyStepper::deepest_overlap_message() const
{
    const BodyOverlap* worst = nullptr;
    for (const BodyOverlap& o : overlaps_)
        if (o.depth > o.most && (!worst || o.depth > worst->depth)) worst = &o;
    return worst ? describe(*worst, system_) : "";
}

std::string describe(const BodyOverlap& o, const BodySystem& system)
{
    const std::string other = o.b >= 0          ? system.refs[std::size_t(o.b)].name
                              : o.obstacle >= 0 ? system.obstacles[std::size_t(o.obstacle)]
                                                : "an obstacle";
    return fmt::format("{} and {} overlap by {:.4g} m at ({:.4g}, {:.4g}, {:.4g})",
                       system.refs[std::size_t(o.a)].name, other, o.depth, o.point.x(), o.point.y(),
                       o.point.z());
}

void BodyStepper::fill_report()
{
    const int n_contacts = int(list_.contact.size());
    report_.contacts = list_;
    report_.force.assign(std::size_t(n_contacts), Vec3::Zero());
    report_.slip.assign(std::size_t(n_contacts), Vec3::Zero());
    report_.coupling_force.assign(system_.couplings.size(), Vec3::Zero());
    report_.coupling_place.clear();
    for (const CouplingRow& row : joints_)
        report_.coupling_place.push_back(row.point_b);
    const double per_force = step_.dynamic ? 1 / step_.h : 1;
    std::set<BodySystem::Key> at_start;
    for (const BodyContact& c : rubbed_.contact)
        at_start.insert({c.pair, c.id});
    std::vector<Vec3> on_body(bodies(), Vec3::Zero()), torque(bodies(), Vec3::Zero());
    std::vector<Vec3> moment(bodies(), Vec3::Zero());
    for (int c = 0; c < n_contacts + int(system_.couplings.size()); ++c) {
        const auto at = force_.find(key(c));
        Vec3 f = at == force_.end() ? Vec3(Vec3::Zero()) : at->second;
        if (c < n_contacts) { // along the normal where it is now, as in the balance
            const BodyContact& contact = list_.contact[std::size_t(c)];
            const Vec3 n = contact.frame.col(0);
            if (!(friction_of(system_.finder.pairs(), contact) > 0)) f = n.dot(f) * n;
        }
        const Vec3 place = step_.dynamic && !f.isZero(0) ? common_place(c) : Vec3(Vec3::Zero());
        for (const Side& side : sides_of(contacts(), c)) {
            if (side.body < 0 || f.isZero(0)) continue;
            const Vec3 on =
                side.sign * per_force *
                (c < n_contacts ? f : Vec3(f.x() * joints_[std::size_t(c - n_contacts)].direction));
            if (side.place.turns) {
                moment[std::size_t(side.body)] += step_.h * on;
                torque[std::size_t(side.body)] += on;
                continue;
            }
            if (SolidBody* solid = system_.refs[std::size_t(side.body)].solid)
                solid->add_reaction(side.place, on);
            on_body[std::size_t(side.body)] += on;
            moment[std::size_t(side.body)] += step_.h * place.cross(on);
            torque[std::size_t(side.body)] += side.place.point.cross(on);
        }
        if (c >= n_contacts) {
            const auto row = std::size_t(c - n_contacts);
            if (step_.dynamic) report_.energy.dissipated += spring_loss(row, per_force * f.x());
            const Vec3& direction = joints_[row].direction;
            report_.coupling_force[row] =
                per_force * f.x() *
                (system_.couplings[row].turns && !system_.couplings[row].square
                     ? Vec3(direction.normalized())
                     : direction);
            continue;
        }
        BodyContact& contact = report_.contacts.contact[std::size_t(c)];
        const Vec3 d = moved(contact);
        const Vec3 n = contact.frame.col(0);
        contact.gap += n.dot(d) - moved_[std::size_t(c)];
        if (!contacts_on_.empty()) contact.point = contacts_on_[std::size_t(c)].end_point;
        report_.slip[std::size_t(c)] = d - n.dot(d) * n;
        report_.force[std::size_t(c)] = per_force * f;
        const Vec3 force = per_force * f;
        const Vec3 tangential = force - n.dot(force) * n;
        // By the trapezoid rule, as the work of all other forces; what acts in motion is a mean
        // already.
        Vec3 mean = tangential;
        if (!step_.dynamic) {
            const auto known = system_.warm_friction.find(key(c));
            const bool rods = is_of_crossing_rods(system_, contact);
            if (known != system_.warm_friction.end() && (rods || at_start.count(key(c)) == 0))
                mean = 0.5 * (tangential + known->second);
            else if (!rods)
                mean *= 0.5;
            if (!tangential.isZero(0)) friction_[key(c)] = tangential;
        }
        report_.friction -= mean.dot(d);
        report_.normal_work += n.dot(force) * n.dot(d);
    }
    report_.friction += friction_of_start();
    for (std::size_t b = 0; b < bodies(); ++b) {
        if (RigidBody* rigid = system_.refs[b].rigid) rigid->add_reaction(on_body[b], torque[b]);
        if (step_.dynamic) body(b).set_contact_moment(moment[b]);
    }
}

/// Where a step at rest begins: what had friction at the end of the one before.
void BodyStepper::note_friction_before()
{
    rubbed_.stencil = list_.stencil;
    for (int c = 0; c < int(list_.contact.size()); ++c)
        if (const BodyContact& k = list_.contact[std::size_t(c)];
            system_.warm_friction.count(key(c)) > 0 && !is_of_crossing_rods(system_, k))
            rubbed_.contact.push_back(k);
}

/// By the trapezoid rule the friction where a step begins acts through half of it, on what it acted
/// on there: faces of both sides have other nodes beneath them where the step ends, and these have
/// moved otherwise.
double BodyStepper::friction_of_start() const
{
    double sum = 0;
    for (const BodyContact& c : rubbed_.contact) {
        // displacement() takes the point where the body is now; known is where it was. Two
        // repetitions leave an error of third order in the turn.
        const auto moved = [](const Body& of, BodyPlace at) {
            const Vec3 before = at.point;
            for (int i = 0; i < 2; ++i)
                at.point = before + of.displacement(at);
            return of.displacement(at);
        };
        Vec3 d = moved(body(std::size_t(c.a)), rubbed_.place_a(c));
        if (c.b >= 0) d -= moved(body(std::size_t(c.b)), rubbed_.place_b(c));
        sum -= 0.5 * system_.warm_friction.at({c.pair, c.id}).dot(d);
    }
    return sum;
}

/// Where a contact's force, or a joint's, acts on both of its bodies: where they touched, moved on
/// as both were moving. Of one rigid body alone, against what stands or is led, as its centre was.
Vec3 BodyStepper::common_place(int c) const
{
    Vec3 place = Vec3::Zero(), moved = Vec3::Zero();
    int sides = 0;
    const RigidBody* rigid = nullptr;
    const bool contact = c < int(list_.contact.size());
    if (step_.follows && contact) // there it is already
        return list_.contact[std::size_t(c)].point;
    for (const Side& side : sides_of(contacts(), c)) {
        if (side.body < 0 || fixed(std::size_t(side.body))) continue;
        place = side.place.point;
        if (step_.follows) continue;
        moved += body(std::size_t(side.body)).velocity(side.place, VelocityAt::past);
        rigid = system_.refs[std::size_t(side.body)].rigid;
        ++sides;
    }
    if (step_.follows) return place;
    if (sides == 1 && rigid) moved = rigid->velocity({{}, rigid->centre()}, VelocityAt::past);
    if (contact) place = list_.contact[std::size_t(c)].point;
    return place + step_.h / std::max(sides, 1) * moved;
}

} // namespace amontons
