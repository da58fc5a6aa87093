#include "solver/body/rod_body.hpp"
#include "mesh/base/dense.hpp"
#include "solver/body/node_index.hpp"

#include "mesh/base/curve.hpp"
#include "mesh/base/error.hpp"
#include "solver/body/drive.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace amontons {
namespace {

constexpr double kForceRoundOff = 2e-15; // of the stiffest element's force at a strain of 1
constexpr double kSettled = 1e-9;        // of the rod's size: Newton's last motion
constexpr double kStillRounding = 1e-5;  // of it: no error of a balance is that large

ConstMap6 view(const Node6& n)
{
    return ConstMap6(n.value);
}

std::vector<Node6> as_nodes(const Eigen::VectorXd& v)
{
    std::vector<Node6> n(std::size_t(v.size() / 6), Node6{});
    for (std::size_t i = 0; i < n.size(); ++i)
        Map6(n[i].value) = v.segment<6>(at6(i));
    return n;
}

Eigen::VectorXd as_vector(const std::vector<Node6>& n)
{
    Eigen::VectorXd v(at6(n.size()));
    for (std::size_t i = 0; i < n.size(); ++i)
        v.segment<6>(at6(i)) = view(n[i]);
    return v;
}

} // namespace

RodBody::RodBody(const RodInput& input, const Centreline* curve, double damping,
                 std::span<const Vec3> joined)
    : input_(input)
    , damping_(damping)
    , K_(1, false)
    , M_(1, false)
{
    nonlinear_ = true;
    // ---- Nodes at holds, loads and couplings
    std::vector<double> places;
    for (const RodHold& h : input_.hold)
        if (h.at) places.push_back(*h.at);
    for (const RodLoad& l : input_.loads)
        if (l.at) places.push_back(*l.at);
    kind_ = input_.elements == "corotational" ? RodElement::corotational : RodElement::exact;
    rod_ = make_rod(input_.segments, input_.shape, curve, places);
    if (!joined.empty()) {
        // Where it would stand beside a node that is there, it is that node: its arm is short.
        constexpr double kSameNode = 1e-3; // of the element's length
        const std::size_t before = places.size();
        for (const Vec3& x : joined) {
            const Nearest at = nearest(x);
            const double s = rod_.s[std::size_t(at.node)];
            const int e = std::min(at.node, rod_.element_count() - 1);
            const bool same =
                std::abs(at.s - s) < kSameNode * rod_.law[std::size_t(e)].length ||
                (rod_.closed && rod_.length - at.s < kSameNode * rod_.law[std::size_t(e)].length);
            places.push_back(same ? s : at.s);
        }
        std::sort(places.begin() + std::ptrdiff_t(before), places.end());
        // Two joints at one place have one node.
        const double least = kSameNode * rod_.length / rod_.element_count();
        for (std::size_t k = before + 1; k < places.size(); ++k)
            if (places[k] - places[k - 1] < least) places[k] = places[k - 1];
        rod_ = make_rod(input_.segments, input_.shape, curve, places);
    }
    const std::size_t n = rod_.nodes.size();
    K_ = RodMatrix(int(n), rod_.closed);
    M_ = RodMatrix(int(n), rod_.closed);
    Vec3 low = rod_.nodes[0].position(), high = low;
    for (const BeamNode& node : rod_.nodes) {
        low = low.cwiseMin(node.position());
        high = high.cwiseMax(node.position());
    }
    size_ = std::max((high - low).norm(), 0.1 * rod_.length);
    const auto node_of = [&](const std::string& set, const std::optional<double>& at) {
        if (set == "start") return 0;
        if (set == "end") return rod_.closed ? 0 : int(n) - 1;
        return rod_.node_at(at.value_or(0));
    };

    // ---- Holds and loads
    std::vector<Issue> issues;
    for (std::size_t k = 0; k < input_.hold.size(); ++k) {
        const RodHold& h = input_.hold[k];
        if (h.at && *h.at > rod_.length * (1 + 1e-3))
            issues.push_back({"", "/hold/" + std::to_string(k) + "/at", std::to_string(*h.at),
                              "<= " + std::to_string(rod_.length) + " [m], the rod's length"});
        Hold hold{&h, {}, {}};
        if (h.set == "all")
            for (std::size_t i = 0; i < n; ++i)
                hold.nodes.push_back(int(i));
        else
            hold.nodes.push_back(node_of(h.set, h.at));
        const bool all = h.x.empty() && h.y.empty() && h.z.empty();
        if (h.places == "held")
            hold.axis = {all || !h.x.empty(), all || !h.y.empty(), all || !h.z.empty()};
        holds_.push_back(std::move(hold));
    }
    for (std::size_t k = 0; k < input_.loads.size(); ++k) {
        const RodLoad& l = input_.loads[k];
        if (l.at && *l.at > rod_.length * (1 + 1e-3))
            issues.push_back({"", "/loads/" + std::to_string(k) + "/at", std::to_string(*l.at),
                              "<= " + std::to_string(rod_.length) + " [m], the rod's length"});
        loads_.push_back({&l, l.set == "all" ? -1 : node_of(l.set, l.at)});
    }
    if (input_.plane) {
        const Vec3 normal = input_.plane->normalized();
        for (const BeamNode& node : rod_.nodes)
            if (std::abs(normal.dot(node.position() - rod_.nodes[0].position())) > 1e-6 * size_ ||
                std::abs(normal.dot(first_axis(node.q))) > 1e-6) {
                issues.push_back({"", "/plane", "a plane that the rod's shape leaves",
                                  "the normal of a plane in which the rod begins"});
                break;
            }
    }
    if (!issues.empty()) throw InputError(std::move(issues));
    std::vector<int> nodes_held;
    for (const Hold& h : holds_)
        nodes_held.insert(nodes_held.end(), h.nodes.begin(), h.nodes.end());
    if (!rod_.closed && !nodes_held.empty() &&
        std::count(nodes_held.begin(), nodes_held.end(), nodes_held[0]) ==
            std::ptrdiff_t(nodes_held.size()))
        root_ = nodes_held[0];
    if (!input_.fed.empty()) root_ = -1; // the sheath holds it, too

    // ---- Masses and state
    state_.nodes = rod_.nodes;
    if (!input_.fed.empty()) start_at_sheath();
    state_.velocity.assign(n, Vec6::Zero());
    Vec3 centre = Vec3::Zero();
    double mass = 0;
    for_mass_points(rod_, [&](int e, double m, double xi) {
        centre += m * rod_point(rod_, rod_.nodes, e, xi);
        mass += m;
    });
    if (mass > 0) centre /= mass;
    for (std::size_t i = 0; i < n; ++i) {
        const Mat3 R = rotation_matrix(state_.nodes[i].q);
        state_.velocity[i].head<3>() =
            input_.velocity + input_.spin.cross(state_.nodes[i].position() - centre);
        state_.velocity[i].tail<3>() = R.transpose() * input_.spin;
    }
    accepted_.velocity = state_.velocity;
    now_ = state_;
    moved_.assign(n, Vec6::Zero());
    past_velocity_ = past_force_ = moved_;
    modes_.resize(unknowns(), 0);
    stations_ = amontons::stations(curve_of(state_), input_.contact_spacing);
}

std::array<double, 6> RodBody::strain(int element) const
{
    return rod_strain(rod_, now_.nodes, kind_, element);
}

std::array<double, 6> RodBody::resultants(int element) const
{
    std::array<double, 6> f = rod_resultants(rod_, now_.nodes, kind_, element);
    if (material_ && element < sheath_.node) {
        f[0] = -push_;
        f[3] = torque_;
    }
    return f;
}

AxisBox RodBody::box() const
{
    return box_of(now_.nodes);
}

AxisBox RodBody::box_before() const
{
    return box_of(state_.nodes);
}

AxisBox RodBody::box_of(const std::vector<BeamNode>& nodes) const
{
    const double thickest = *std::max_element(rod_.radius.begin(), rod_.radius.end());
    AxisBox box{nodes[0].position(), nodes[0].position()};
    for (const BeamNode& n : nodes) {
        box.low = box.low.cwiseMin(n.position());
        box.high = box.high.cwiseMax(n.position());
    }
    // The middle line of an element is within an eighth of its length of the chord at most times.
    double longest = 0;
    for (const ElementLaw& law : rod_.law)
        longest = std::max(longest, law.length);
    const Vec3 more = Vec3::Constant(thickest + 0.25 * longest);
    return {box.low - more, box.high + more};
}

/// Motion of a node by (shift, turn at the size).
Mat6 RodBody::rigid_motion(const BeamNode& node) const
{
    const Vec3 middle = rod_.nodes[rod_.nodes.size() / 2].position();
    Mat6 rigid = Mat6::Zero();
    rigid.topLeftCorner<3, 3>().setIdentity();
    rigid.topRightCorner<3, 3>() = -skew_matrix(node.position() - middle) / size_;
    rigid.bottomRightCorner<3, 3>() = rotation_matrix(node.q).transpose();
    return rigid;
}

Eigen::MatrixXd RodBody::rigid_motions() const
{
    Eigen::MatrixXd R(unknowns(), 6);
    for (std::size_t i = 0; i < state_.nodes.size(); ++i) {
        R.middleRows<6>(at6(i)) = rigid_motion(state_.nodes[i]);
        R.block<3, 3>(at6(i) + 3, 3) /= size_;
    }
    return R;
}

Mat6 RodBody::held_rigid_motions() const
{
    if (material_) return Mat6::Identity(); // its base is held
    Mat6 seen = Mat6::Zero();
    for (const Held& h : held_at(state_, 0)) {
        const Mat6 taken =
            (Mat6::Identity() - h.free) * rigid_motion(state_.nodes[std::size_t(h.node)]);
        seen += taken.transpose() * taken;
    }
    return seen;
}

std::vector<std::string> RodBody::free_motions() const
{
    if (has_drag()) return {}; // it holds whatever moves
    const SymmetricEigen6 eigen = symmetric_eigen(held_rigid_motions());
    std::vector<std::string> names;
    for (int k = 0; k < 6; ++k)
        if (eigen.values[k] < 1e-10)
            names.push_back(
                name_of_motion(eigen.vectors.col(k).head<3>(), eigen.vectors.col(k).tail<3>()));
    return names;
}

void RodBody::begin(const StepInput& step)
{
    step_ = step;
    whole_matrix_ = false;
    held_size_ = -1;
    if (material_) step.dynamic ? begin_motion_at_sheath() : begin_at_sheath();
    now_ = state_;
    expected_.clear();
    for (Vec6& m : moved_)
        m.setZero();
    if (material_ && !step.dynamic) turn_with_sheath();
    last_motion_ = before_last_ = std::numeric_limits<double>::infinity();
    if (!step.dynamic) return;
    begun_ = state_;
    begin_memory();
    // The iterate stands where the step starts.
    for (std::size_t i = 0; i < now_.velocity.size(); ++i)
        now_.velocity[i] = -past_velocity_[i] / step.rule.end;
}

bool RodBody::reset_to_start()
{
    return false; // what is prescribed is part of the free motion
}

void RodBody::forces(const Motion& m, double t, std::vector<Node6>& inner, std::vector<Node6>& load)
{
    whole_matrix_ = false;
    K_.set_zero(material_ && !step_.dynamic ? sheath_.node : 0);
    inner.assign(m.nodes.size(), Node6{});
    load.assign(m.nodes.size(), Node6{});
    add_rod_elements(rod_, m.nodes, kind_, K_, inner, material_ ? sheath_.node : 0);
    add_loads(m, t, load, &K_);
}

/// The same at the iterate, into inner_ and load_, where imbalance() has not left it there.
void RodBody::forces_at_iterate()
{
    if (!std::exchange(whole_matrix_, false)) forces(now_, step_.end(), inner_, load_);
}

/// Takes what is held from the matrix.
/// @param first  rows of the nodes before it are not used
void RodBody::hold_matrix(RodMatrix& A, int first) const
{
    const int n = rod_.node_count();
    const auto rows = [](Block6& b, const Mat6& P) { set_block(b, P * dense(b)); };
    const auto columns = [](Block6& b, const Mat6& P) { set_block(b, dense(b) * P); };
    for (const Held& h : held_) {
        if (h.node < first) continue;
        const Mat6& P = h.free;
        Block6& d = A.chain.diagonal(h.node);
        const Mat6 own = dense(d);
        Mat6 left = Mat6::Zero();
        if (!P.isZero(0)) left = P * own * P;
        // The diagonal of what never moves: of the size of its own.
        Mat6 scale = Mat6::Zero();
        for (int k = 0; k < 6; ++k)
            scale(k, k) = own(k, k) > 0 ? own(k, k) : 1;
        // In a sheath no element has a stiffness.
        const ElementLaw& law = rod_.law[std::size_t(std::min(h.node, rod_.element_count() - 1))];
        const auto mean = [&](const Mat3& m, int strain) {
            return m.trace() > 0 ? m.trace() / 3
                                 : law.S[std::size_t(strain)] / (law.length * law.length);
        };
        scale.topLeftCorner<3, 3>().diagonal().setConstant(mean(own.topLeftCorner<3, 3>(), 0));
        scale.bottomRightCorner<3, 3>().diagonal().setConstant(
            mean(own.bottomRightCorner<3, 3>(), 4));
        left += (Mat6::Identity() - P) * scale * (Mat6::Identity() - P);
        set_block(d, left);
        if (!rod_.closed && P.isZero(0)) {
            if (h.node + 1 < n) A.chain.upper(h.node) = A.chain.lower(h.node) = Block6{};
            if (h.node > 0) A.chain.upper(h.node - 1) = A.chain.lower(h.node - 1) = Block6{};
            continue;
        }
        if (h.node + 1 < n) {
            rows(A.chain.upper(h.node), P);
            columns(A.chain.lower(h.node), P);
        }
        if (h.node > 0) {
            columns(A.chain.upper(h.node - 1), P);
            rows(A.chain.lower(h.node - 1), P);
        }
        if (rod_.closed && h.node == 0) {
            rows(A.first_with_last, P);
            columns(A.last_with_first, P);
        }
        if (rod_.closed && h.node == n - 1) {
            columns(A.first_with_last, P);
            rows(A.last_with_first, P);
        }
    }
}

Eigen::VectorXd RodBody::projected(const Eigen::VectorXd& f) const
{
    Eigen::VectorXd p = f;
    const int first = first_outside();
    p.head(6 * first).setZero();
    for (const Held& h : held_)
        if (h.node >= first) p.segment<6>(6 * h.node) = h.free * Vec6(p.segment<6>(6 * h.node));
    return p;
}

void RodBody::linearise()
{
    set_up_system();
    negative_ = K_.factor(first_outside());
    free_change_ = solve(right_) + prescribed_;
}

void RodBody::set_up_system()
{
    if (step_.dynamic || !whole_matrix_) held_ = held_at(now_, step_.end()); // else imbalance() did
    if (step_.dynamic) {
        dynamic_residual();
    } else {
        forces_at_iterate();
        residual_ = as_vector(load_) - as_vector(inner_);
        add_drag();
        add_viscous_pull();
    }
    Eigen::VectorXd move = Eigen::VectorXd::Zero(unknowns());
    for (const Held& h : held_)
        move.segment<6>(6 * h.node) = h.move;
    Eigen::VectorXd rest = residual_;
    add_contact_stiffness(rest);
    if (!move.isZero(0)) {
        std::vector<Node6> Kd;
        K_.multiply(as_nodes(move), Kd, first_outside());
        rest -= as_vector(Kd);
    }
    if (material_ && step_.dynamic) lead_base(rest);
    if (out_of_sheath() && !step_.dynamic) {
        const SheathBalance b = sheath_balance(now_, step_.end(), true);
        balance_at_sheath(b, move, rest);
        balance_at_sheath(b, {}, residual_);
        if (compliant_in_sheath()) stiffness_at_sheath(b);
    }
    hold_matrix(K_, first_outside());
    negative_ = -1;
    right_ = projected(rest);
    prescribed_ = std::move(move);
}

/// At rest: the tangent of the iterate, not of the one before: it shows stability.
void RodBody::factor_at_iterate()
{
    forces_at_iterate();
    Eigen::VectorXd unused = residual_;
    add_contact_stiffness(unused);
    if (compliant_in_sheath()) stiffness_at_sheath(sheath_balance(now_, step_.end(), true));
    hold_matrix(K_, first_outside());
    negative_ = K_.factor(first_outside());
}

Eigen::VectorXd RodBody::solve(const Eigen::VectorXd& force)
{
    std::vector<Node6> x = as_nodes(projected(force));
    K_.solve(x);
    return projected(as_vector(x));
}

void RodBody::compliance(const SparseColumns& C, Eigen::MatrixXd& W)
{
    Eigen::MatrixXd X(unknowns(), C.cols());
    for (Eigen::Index j = 0; j < C.cols(); ++j)
        X.col(j) = solve(Eigen::VectorXd(C.col(j)));
    W = C.transpose() * X;
    W = 0.5 * (W + W.transpose()).eval();
}

double RodBody::force_size(const Motion& m, const std::vector<Node6>& load)
{
    double most = 0;
    const auto take = [&](const Vec3& force, const Vec3& moment) {
        most = std::max({most, force.norm(), moment.norm() / size_});
    };
    const auto take_elements = [&](int from, int to) {
        for (int e = from; e < to; ++e) {
            const std::array<double, 6> f = rod_resultants(rod_, m.nodes, kind_, e);
            take({f[0], f[1], f[2]}, {f[3], f[4], f[5]});
        }
    };
    // In the sheath it stays straight, and its twist hardly changes in a step.
    if (held_size_ < 0 || step_.dynamic) {
        take_elements(0, first_outside());
        held_size_ = most;
    }
    most = held_size_;
    take_elements(first_outside(), rod_.element_count());
    for (const Node6& n : load)
        take(view(n).head<3>(), view(n).tail<3>());
    return most;
}

double RodBody::floor() const
{
    double stiffest = 0;
    for (const ElementLaw& law : rod_.law)
        stiffest = std::max(stiffest, std::max(law.S[0], law.S[1]) / law.length);
    return kForceRoundOff * stiffest;
}

double RodBody::imbalance(const Eigen::VectorXd& force)
{
    const double infinite = std::numeric_limits<double>::infinity();
    if (!std::isfinite(last_motion_)) return infinite;
    const double per_force = step_.dynamic ? 1 / step_.h : 1;
    if (step_.dynamic) {
        dynamic_residual();
    } else {
        forces(now_, step_.end(), inner_, load_);
        residual_ = as_vector(load_) - as_vector(inner_);
        add_drag();
        whole_matrix_ = drag() == 0;
        if (out_of_sheath())
            balance_at_sheath(sheath_balance(now_, step_.end(), false), {}, residual_);
    }
    Eigen::VectorXd missing = residual_;
    if (force.size() == missing.size()) missing += force;
    if (step_.dynamic && material_ && (broken_ || base_off() > 0)) return infinite;
    held_ = held_at(now_, step_.end());
    for (const Held& h : held_) {
        const double way = std::hypot(h.move.head<3>().norm(), size_ * h.move.tail<3>().norm());
        if (!(way * (step_.dynamic ? step_.h : 1) <= 1e-9 * size_)) return 1;
    }
    missing = per_force * projected(missing);
    double most = 0, scale = force_size(now_, load_);
    for (Eigen::Index i = 0; i < missing.size(); i += 6) {
        most = std::max(
            {most, missing.segment<3>(i).norm(), missing.segment<3>(i + 3).norm() / size_});
        if (force.size() == missing.size())
            scale = std::max(scale, per_force * force.segment<3>(i).norm());
    }
    if (step_.dynamic) scale = std::max(scale, inertia_size_);
    if (!std::isfinite(most) || !std::isfinite(scale)) return infinite;
    if (most > floor()) return scale > 0 ? most / scale : 1;
    // At round-off of forces; a soft motion may still be far from where they balance.
    const bool settled =
        last_motion_ <= kSettled * size_ ||
        (last_motion_ > 0.3 * before_last_ && last_motion_ <= kStillRounding * size_);
    return settled ? 0 : 1;
}

BodyEnergy RodBody::accept(const Eigen::VectorXd& force)
{
    BodyEnergy e;
    const double per_force = step_.dynamic ? 1 / step_.h : 1;
    // What holds need, beside loads, inner forces and contacts.
    Eigen::VectorXd missing = -residual_;
    if (force.size() == missing.size()) missing -= force;
    reaction_.assign(now_.nodes.size(), Node6{});
    for (const Held& h : held_)
        Map6(reaction_[std::size_t(h.node)].value) =
            per_force * (Mat6::Identity() - h.free) * Vec6(missing.segment<6>(6 * h.node));
    std::vector<Node6> acting = load_;
    for (std::size_t i = 0; i < acting.size(); ++i)
        acting[i].column += reaction_[i].column;
    if (material_) {
        e.work = step_.dynamic ? accept_motion_at_sheath(acting) : accept_at_sheath(acting);
        e.work_absolute = std::abs(e.work);
    }
    if (acting_.empty()) acting_ = acting;
    if (step_.dynamic)
        for (std::size_t i = 0; i < moved_.size(); ++i) {
            for (int k = 0; k < 3; ++k)
                moved_[i][k] = now_.nodes[i].difference(state_.nodes[i], k);
            moved_[i].tail<3>() = step_.h * (step_.rule.end * now_.velocity[i].tail<3>() +
                                             past_velocity_[i].tail<3>());
        }
    if (step_.dynamic && out_of_sheath()) // of the material that is out
        moved_[std::size_t(sheath_.node)].head<3>() =
            (first_length(now_.end) - first_length(state_.end)) * along_sheath();
    for (std::size_t i = 0; i < acting.size(); ++i) {
        Vec6 mean = view(acting[i]);
        if (!step_.dynamic) mean = 0.5 * (mean + view(acting_[i]));
        const double work = mean.dot(moved_[i]);
        e.work += work;
        e.work_absolute += std::abs(work);
    }
    acting_ = acting;
    if (step_.dynamic) {
        e.dissipated = end_memory();
    } else {
        e.dissipated = taken_by_drag();
        factor_at_iterate();
        stable_ = negative_ == 0;
    }
    state_ = now_;
    e.elastic = rod_energy(rod_, state_.nodes, kind_, material_ ? sheath_.node : 0);
    if (material_) {
        e.elastic += energy_in_sheath();
        accepted_ = {sheath_, state_.nodes, state_.velocity, acting_};
    }
    e.kinetic = kinetic_energy();
    return e;
}

std::vector<std::array<Vec3, 2>> RodBody::reactions() const
{
    std::vector<std::array<Vec3, 2>> sums;
    for (const Hold& h : holds_) {
        std::array<Vec3, 2> sum{Vec3::Zero(), Vec3::Zero()};
        for (const int node : h.nodes) {
            if (reaction_.empty()) break;
            Vec6 r = view(reaction_[std::size_t(node)]);
            if (material_ && node == 0) { // its base: what pushes and turns it
                sum[0] += push_ * along_sheath();
                sum[1] += torque_ * along_sheath();
                if (sheath_.node == 0) r.setZero();
            }
            for (int k = 0; k < 3; ++k)
                if (h.axis[std::size_t(k)]) sum[0][k] += r[k];
            if (h.input->turns != "free")
                sum[1] += rotation_matrix(state_.nodes[std::size_t(node)].q) * r.tail<3>();
        }
        sums.push_back(sum);
    }
    return sums;
}

std::vector<double> RodBody::frequencies(int count)
{
    std::vector<Node6> inner, load;
    K_.set_zero();
    forces(now_, step_.end(), inner, load);
    held_ = held_at(now_, step_.end());
    if (compliant_in_sheath()) stiffness_at_sheath(sheath_balance(now_, step_.end(), true));
    hold_matrix(K_, 0);
    negative_ = K_.factor();
    M_.set_zero();
    add_rod_mass(rod_, now_.nodes, 1, M_);
    hold_matrix(M_, 0);
    for (const Held& h : held_) { // what is held has no inertia
        Block6& d = M_.chain.diagonal(h.node);
        set_block(d, h.free * dense(d) * h.free);
    }
    return rod_frequencies(K_, M_, rod_.node_count(), count);
}

} // namespace amontons
