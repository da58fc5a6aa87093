#include "solver/step/rod_problem.hpp"

#include "solver/step/pivot_method.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

namespace amontons {
namespace {

using Vec24 = Eigen::Matrix<double, 24, 1>;
using Mat24 = Eigen::Matrix<double, 24, 24>;

// Of a node's stiffness along a contact's row (of EA / l along the rod): with kRhoNormal 100 times
// that. Multipliers that are renewed in one iterate bring the rest.
constexpr double kHeld = 0.01;
constexpr int kMultipliers = 5;
constexpr double kHeldJoint = 1e3; // of a joint's rows, of the stiffness of their two nodes
constexpr double kHardly = 1e-2;   // of the freer tangent of a contact, squared

/// Rods and their contacts for pivoting::solve.
struct RodSystem : FourNodeRows<RodContact> {
    RodProblem& p;

    explicit RodSystem(RodProblem& problem) : p(problem) {}

    static void add_product(NodeMatrix& K, Place at, const Row& f, const Row& h, double s, int from)
    {
        for (int a = 0; a < at.nodes; ++a)
            for (int b = 0; b < at.nodes; ++b)
                if (std::min(at.slot[std::size_t(a)], at.slot[std::size_t(b)]) >= from)
                    K.add(at.slot[std::size_t(a)], at.slot[std::size_t(b)], f.node[a].column,
                          h.node[b], s);
        if (K.is_chain()) return;
        for (int a = 0; a < at.nodes; ++a)
            for (int i = 0; i < 6; ++i)
                if (f.node[a].value[i] != h.node[a].value[i]) return K.set_unsymmetric();
    }

    std::size_t contacts() const { return p.contact.size(); }
    const Candidate& contact(std::size_t k) const { return p.contact[k].law; }
    Place place(std::size_t k) const { return p.contact[k]; }
    const Row& normal(std::size_t k) const { return p.contact[k].normal; }
    const Row& tangent(std::size_t k, int i) const { return p.contact[k].tangent[i]; }
    int lowest(std::size_t k) const
    {
        return p.base.is_chain() ? *std::ranges::min_element(slots_of(k)) : 0;
    }
    int highest(std::size_t k) const
    {
        return p.base.is_chain() ? *std::ranges::max_element(slots_of(k)) : last();
    }
    bool follows(std::size_t k) const { return p.contact[k].follows; }
    // Of neighbours that all released one does in a trial: as many trials as the longest line
    // needs.
    int most_trials() const
    {
        return pivoting::kTrials + pivoting::StallCounter::kApart + (p.hasty ? 0 : p.most_on_one);
    }
    int shift_levels() const { return p.hasty ? 1 : pivoting::kShiftLevels; }
    std::size_t bodies() const { return p.rods.size(); }
    std::array<int, 2> bodies_of(std::size_t k) const { return p.contact[k].on; }
    int first() const { return 0; }
    int last() const { return p.base.size() - 1; }
    std::vector<Node6>& gradient() { return p.gradient; }
    std::vector<Node6>& right() { return p.right; }
    std::vector<Node6>& increment() { return p.increment; }
    std::vector<Trial>& trial() { return p.trial; }
    NodeMatrix& matrix() { return p.system; }
    double& last_shift() { return p.shift; }
    double min_stiffness() const { return p.min_stiffness; }
    void start_matrix(double shift, int from)
    {
        p.system.copy_values(p.base, from);
        if (!(shift > 0)) return;
        for (int i = from; i <= last(); ++i) {
            const double h = p.length[std::size_t(i)];
            Block6& d = p.system.block(i, i);
            for (int k = 0; k < 3; ++k) {
                d(k, k) += shift;
                d(k + 3, k + 3) += shift * h * h;
            }
        }
    }

private:
    std::span<const int> slots_of(std::size_t k) const
    {
        return std::span(p.contact[k].slot).first(std::size_t(p.contact[k].nodes));
    }
};

/// Of a contact's geometry: -r Hess(gap) and -(dJ/dy)^T t, on the nodes of a and then of b. Places
/// where the distance is least move along their curves as these move.
Mat24 geometry(const RodBody& a, const RodBody* b, const RodContactState& s, const Vec3& force)
{
    const BodyContact& c = *s.contact;
    const Vec3 n = c.frame.col(0);
    const double r = n.dot(force);
    const RodBody::Line p = a.line(s.a);
    RodBody::Line q;
    Mat3 S = c.curvature;
    Eigen::Matrix<double, 3, 24> J = Eigen::Matrix<double, 3, 24>::Zero();
    J.leftCols<12>() = p.J;
    Mat24 k = Mat24::Zero();
    k.topLeftCorner<12, 12>() += a.force_stiffness(s.a, force);
    if (b) {
        q = b->line(s.b);
        J.rightCols<12>() = -q.J;
        // Along n: a place in a sheath is stood for by its end, along the sheath and so across n.
        // In a bore n is from the outer middle line to the inner one: the sign is the other one.
        S = (Mat3::Identity() - n * n.transpose()) / n.dot(p.x - q.x);
        k.bottomRightCorner<12, 12>() += b->force_stiffness(s.b, -force);
    }
    k -= r * (J.transpose() * S * J);
    const int slides = (c.slides_a ? 1 : 0) + (c.slides_b ? 1 : 0);
    if (slides == 0) return k;
    Eigen::Matrix<double, 24, 2> mixed = Eigen::Matrix<double, 24, 2>::Zero();
    Eigen::Matrix2d own = Eigen::Matrix2d::Identity();
    if (c.slides_a) {
        mixed.col(0) = J.transpose() * (S * p.slope);
        mixed.col(0).head<12>() += p.J_slope.transpose() * n;
        own(0, 0) = p.slope.dot(S * p.slope) + n.dot(p.bend);
    }
    if (c.slides_b) {
        mixed.col(1) = -J.transpose() * (S * q.slope);
        mixed.col(1).tail<12>() -= q.J_slope.transpose() * n;
        own(1, 1) = q.slope.dot(S * q.slope) - n.dot(q.bend);
    }
    if (slides == 2) own(0, 1) = own(1, 0) = -p.slope.dot(S * q.slope);
    // The distance is least there: the gap as well, and in a bore it is largest.
    const double sign = b && n.dot(p.x - q.x) < 0 ? -1 : 1;
    const double det = own.determinant();
    if (slides == 1 ? sign * det > 0 : own(0, 0) > 0 && det > 1e-6 * own(0, 0) * own(1, 1))
        k += r * (mixed * own.inverse() * mixed.transpose());
    return k;
}

/// Whose nodes a contact's rows stand on, and their projectors.
void place_contact(const RodProblem& w, const RodContactState& s, RodContact& c)
{
    c.nodes = 0;
    const auto add = [&](int body, const BodyPlace& at) {
        if (body < 0 || !w.rods[std::size_t(body)]) return;
        const int element = at.nodes[0].node;
        for (const int node : {element, w.rods[std::size_t(body)]->model().second(element)})
            c.slot[std::size_t(c.nodes++)] = w.slot(body, node);
        c.on[body == s.contact->a ? 0 : 1] = body;
    };
    add(s.contact->a, s.a);
    add(s.contact->b, s.b);
}

struct Projectors {
    std::vector<Mat6> free;     // of each slot
    Eigen::VectorXd prescribed; // of all slots
};

/// The rows of a contact, `axes` of them, along its frame.
/// @return  what prescribed motions do to their values
Vec3 place_rows(const RodProblem& w, const RodContactState& s, RodContact& c, int axes,
                const Projectors& held)
{
    FourNodeRow* const row[] = {&c.normal, &c.tangent[0], &c.tangent[1]};
    Vec3 moved = Vec3::Zero();
    int k = 0;
    const auto add = [&](int body, const BodyPlace& at, double sign) {
        if (body < 0 || !w.rods[std::size_t(body)]) return;
        const Mat12x3 v = sign * w.rods[std::size_t(body)]->rows(at, s.contact->frame);
        for (int i = 0; i < 2; ++i, ++k) {
            const int slot = c.slot[std::size_t(k)];
            const Mat6& free = held.free[std::size_t(slot)];
            const bool whole = free.isIdentity(0);
            for (int axis = 0; axis < axes; ++axis) {
                const Vec6 own = v.col(axis).segment<6>(6 * i);
                moved[axis] += own.dot(held.prescribed.segment<6>(6 * slot));
                Eigen::Map<Vec6> to(row[axis]->node[k].value);
                if (whole)
                    to = own;
                else
                    to = free * own;
            }
        }
    };
    add(s.contact->a, s.a, 1);
    add(s.contact->b, s.b, -1);
    return moved;
}

/// How far a unit motion of the nodes moves a row, squared.
double size_of(const RodContact& c, const FourNodeRow& row)
{
    double size = 0;
    for (int a = 0; a < c.nodes; ++a)
        size += Eigen::Map<const Vec3>(row.node[a].value).squaredNorm();
    return size;
}

/// Of the nodes alone in a row's direction [N/m].
double stiffness_along(const RodProblem& w, const RodContact& c, const FourNodeRow& row)
{
    double energy = 0;
    const double size = size_of(c, row);
    for (int a = 0; a < c.nodes; ++a) {
        const int slot = c.slot[std::size_t(a)];
        const Vec3 v = Eigen::Map<const Vec3>(row.node[a].value);
        Mat3 own;
        for (int j = 0; j < 3; ++j)
            for (int i = 0; i < 3; ++i)
                own(i, j) = w.base.block(slot, slot)(i, j);
        energy += v.dot(own * v);
    }
    constexpr double kNone = 1e-6; // of a row on nodes that are held
    return size > kNone ? std::max(energy, 0.0) / (size * size) : 0;
}

void add_geometry(RodProblem& w, const RodContactState& s, const RodContact& c,
                  const Projectors& held)
{
    if (s.force.isZero(0)) return;
    const RodBody& a = *w.rods[std::size_t(s.contact->a)];
    const RodBody* b = s.contact->b < 0 ? nullptr : w.rods[std::size_t(s.contact->b)];
    const Mat24 k = geometry(a, b, s, s.contact->frame * s.force);
    for (int i = 0; i < c.nodes; ++i)
        for (int j = 0; j < c.nodes; ++j) {
            const int row = c.slot[std::size_t(i)], col = c.slot[std::size_t(j)];
            add_to_block(w.base.block(row, col), held.free[std::size_t(row)] *
                                                     k.block<6, 6>(6 * i, 6 * j) *
                                                     held.free[std::size_t(col)]);
        }
}

/// Which nodes are coupled: in the rods, by contacts and by joints.
/// @return  the number of nodes
int couple_nodes(RodProblem& w, const std::vector<RodContact>& contact)
{
    int nodes = 0, rods = 0;
    bool alone = w.held_joints.empty(); // an open rod that touches no rod, itself included
    for (std::size_t b = 0; b < w.rods.size(); ++b) {
        if (!w.rods[b]) continue;
        nodes += w.nodes_of(b);
        alone = alone && ++rods == 1 && !w.rods[b]->model().closed;
    }
    alone = alone && std::ranges::all_of(contact, [](const RodContact& c) { return c.nodes <= 2; });
    if (alone) { // whose blocks are all copied
        w.base.set_chain(nodes);
        w.system.set_chain(nodes);
        return nodes;
    }
    std::vector<std::array<int, 2>> coupled;
    for (std::size_t b = 0; b < w.rods.size(); ++b) {
        if (!w.rods[b]) continue;
        const int n = w.nodes_of(b), first = w.first[b];
        for (int i = 0; i + 1 < n; ++i)
            coupled.push_back({first + i, first + i + 1});
        if (w.rods[b]->model().closed) coupled.push_back({first, first + n - 1});
    }
    for (const RodContact& c : contact)
        for (int i = 0; i < c.nodes; ++i)
            for (int j = 0; j < i; ++j)
                coupled.push_back({c.slot[std::size_t(i)], c.slot[std::size_t(j)]});
    for (const HeldJoint& j : w.held_joints)
        if (j.slot[0] >= 0 && j.slot[1] >= 0) coupled.push_back({j.slot[0], j.slot[1]});
    w.base.set_pattern(nodes, coupled);
    w.system.set_pattern(nodes, std::move(coupled));
    return nodes;
}

/// The rods' own matrices and right sides.
void take_rods(RodProblem& w, const std::vector<RodContact>& contact, Projectors& held)
{
    const int nodes = couple_nodes(w, contact);
    for (auto* v : {&w.gradient, &w.right, &w.increment})
        v->assign(std::size_t(nodes), Node6{});
    held.free.clear();
    held.prescribed.resize(6 * nodes);
    w.stiffness.assign(std::size_t(nodes), 0);
    w.length.assign(std::size_t(nodes), 0);
    w.min_stiffness = std::numeric_limits<double>::infinity();
    for (std::size_t b = 0; b < w.rods.size(); ++b) {
        const RodBody* const rod = w.rods[b];
        if (!rod) continue;
        const RodMatrix& K = rod->rod_matrix();
        const int n = w.nodes_of(b), from = w.from[b], first = w.first[b];
        for (int i = 0; i < n; ++i) {
            w.base.block(first + i, first + i) = K.chain.diagonal(from + i);
            if (i + 1 < n) {
                w.base.block(first + i, first + i + 1) = K.chain.upper(from + i);
                w.base.block(first + i + 1, first + i) = K.chain.lower(from + i);
            }
            const int e = std::min(from + i, rod->model().element_count() - 1);
            w.length[std::size_t(first + i)] = rod->element_length(e);
            w.stiffness[std::size_t(first + i)] = rod->element_stiffness(e);
            w.min_stiffness = std::min(w.min_stiffness, rod->element_stiffness(e));
            Eigen::Map<Vec6>(w.gradient[std::size_t(first + i)].value) =
                -rod->right().segment<6>(6 * (from + i));
        }
        if (rod->model().closed) {
            add_to_block(w.base.block(first, first + n - 1), dense(K.first_with_last));
            add_to_block(w.base.block(first + n - 1, first), dense(K.last_with_first));
        }
        held.prescribed.segment(6 * first, 6 * n) = rod->prescribed().tail(6 * n);
        rod->add_free_of_nodes(from, held.free);
    }
}

/// A node's stiffness along its part of a row [N/m]; 0: the row is none of what it may do.
/// @param row   whole
/// @param free  the part that holds leave; a row of which almost nothing is left is dropped
double stiffness_of_node(const RodProblem& w, int slot, const Vec6& row, const Vec6& free)
{
    constexpr double kNone = 1e-12; // of places; turns alone
    const bool turns = row.head<3>().squaredNorm() <= kNone * row.tail<3>().squaredNorm();
    const int first = turns ? 3 : 0;
    const Vec3 v = free.segment<3>(first);
    Mat3 own;
    for (int j = 0; j < 3; ++j)
        for (int i = 0; i < 3; ++i)
            own(i, j) = w.base.block(slot, slot)(first + i, first + j);
    const double size = row.segment<3>(first).squaredNorm();
    return size > 0 ? std::max(v.dot(own * v), 0.0) / (size * size) : 0;
}

void place_joints(RodProblem& w)
{
    w.held_joints.assign(w.joints.size(), HeldJoint());
    for (std::size_t k = 0; k < w.joints.size(); ++k)
        for (std::size_t i = 0; i < 2; ++i)
            if (const int rod = w.joints[k].on[i]; rod >= 0)
                w.held_joints[k].slot[i] = w.slot(rod, w.joints[k].node[i]);
}

/// Adds a force along a joint's row to what acts.
void push_joint(RodProblem& w, const HeldJoint& j, double force)
{
    for (std::size_t i = 0; i < 2; ++i)
        if (j.slot[i] >= 0)
            Eigen::Map<Vec6>(w.gradient[std::size_t(j.slot[i])].value) -= force * j.row[i];
}

/// Joints hold by their weight, F = force - weight (value + row . motion), and the force is renewed
/// until the values are zero. Springs' weights are their stiffness: nothing is left.
void add_joints(RodProblem& w, const Projectors& held)
{
    for (std::size_t k = 0; k < w.joints.size(); ++k) {
        const RodJoint& joint = w.joints[k];
        HeldJoint& j = w.held_joints[k];
        j.value = joint.value;
        j.force = joint.force;
        for (std::size_t i = 0; i < 2; ++i) {
            if (j.slot[i] < 0) continue;
            j.value += joint.row[i].dot(held.prescribed.segment<6>(6 * j.slot[i]));
            j.row[i] = held.free[std::size_t(j.slot[i])] * joint.row[i];
            j.weight += kHeldJoint * stiffness_of_node(w, j.slot[i], joint.row[i], j.row[i]);
        }
        j.springs = joint.compliance > 0;
        if (j.springs) j.weight = 1 / joint.compliance;
    }
    for (std::size_t k = 0; k < w.joints.size(); ++k) { // weights are those of the rods alone
        const RodJoint& joint = w.joints[k];
        const HeldJoint& j = w.held_joints[k];
        for (std::size_t i = 0; i < 2; ++i)
            for (std::size_t l = 0; l < 2; ++l) {
                if (j.slot[i] < 0 || j.slot[l] < 0) continue;
                const Mat6 bend = joint.bend.block<6, 6>(6 * Eigen::Index(i), 6 * Eigen::Index(l));
                add_to_block(w.base.block(j.slot[i], j.slot[l]),
                             Mat6(j.weight * j.row[i] * j.row[l].transpose() -
                                  joint.force * held.free[std::size_t(j.slot[i])] * bend *
                                      held.free[std::size_t(j.slot[l])]));
            }
        push_joint(w, j, (j.springs ? 0 : j.force) - j.weight * j.value);
    }
}

/// A joint's value after the increment [m].
double value_after(const RodProblem& w, const HeldJoint& j)
{
    double value = j.value;
    for (std::size_t i = 0; i < 2; ++i)
        if (j.slot[i] >= 0)
            value +=
                j.row[i].dot(Eigen::Map<const Vec6>(w.increment[std::size_t(j.slot[i])].value));
    return value;
}

/// Remaining gaps and slips of closed rows [m].
double left_open(const RodProblem& w)
{
    double most = 0;
    for (const HeldJoint& j : w.held_joints)
        if (!j.springs) most = std::max(most, std::abs(value_after(w, j)));
    for (std::size_t k = 0; k < w.contact.size(); ++k) {
        const Trial& t = w.trial[k];
        if (t.status != 0) most = std::max(most, std::abs(t.gap));
        if (t.status == 1 && w.contact[k].law.mu > 0) most = std::max(most, std::hypot(t.v1, t.v2));
    }
    return most;
}

double length_scale(const RodProblem& w)
{
    double least = std::numeric_limits<double>::infinity();
    for (const RodBody* rod : w.rods)
        for (int e = 0; rod && e < rod->model().element_count(); ++e)
            least = std::min(least, rod->element_radius(e));
    return least;
}

/// Takes the forces of the last trials as the known ones.
void renew_multipliers(RodProblem& w)
{
    for (HeldJoint& j : w.held_joints) {
        if (j.springs) continue;
        const double more = -j.weight * value_after(w, j);
        push_joint(w, j, more);
        j.force += more;
    }
    for (std::size_t k = 0; k < w.contact.size(); ++k) {
        RodContact& c = w.contact[k];
        const Trial& t = w.trial[k];
        Candidate& law = c.law;
        const double r[3] = {t.normal, law.mu > 0 ? t.t1 : 0, law.mu > 0 ? t.t2 : 0};
        if (law.normal > 0) {
            RodSystem::add_force(w.gradient, c, c.normal, law.normal);
            for (int i = 0; i < 2; ++i)
                RodSystem::add_force(w.gradient, c, c.tangent[i], law.tangential[i]);
        }
        law.normal = std::max(r[0], 0.0);
        for (int i = 0; i < 2; ++i)
            law.tangential[i] = r[0] > 0 ? r[i + 1] : 0;
        law.sticks = t.status == 1;
        if (law.normal > 0) {
            RodSystem::add_force(w.gradient, c, c.normal, -law.normal);
            for (int i = 0; i < 2; ++i)
                RodSystem::add_force(w.gradient, c, c.tangent[i], -law.tangential[i]);
        }
    }
}

/// The slots of nodes: those in a sheath have none, but for what touches them.
void number_nodes(RodProblem& w, const std::vector<RodContactState>& contacts)
{
    w.from.assign(w.rods.size(), 0);
    for (std::size_t b = 0; b < w.rods.size(); ++b)
        if (w.rods[b]) w.from[b] = w.rods[b]->first_outside();
    const auto reach = [&](int body, int node) {
        if (body >= 0) w.from[std::size_t(body)] = std::min(w.from[std::size_t(body)], node);
    };
    for (const RodContactState& s : contacts) {
        reach(s.contact->a, s.a.nodes[0].node);
        if (s.contact->b >= 0 && w.rods[std::size_t(s.contact->b)])
            reach(s.contact->b, s.b.nodes[0].node);
    }
    for (const RodJoint& j : w.joints)
        for (std::size_t i = 0; i < 2; ++i)
            reach(j.on[i], j.node[i]);
    w.first.assign(w.rods.size(), 0);
    for (std::size_t b = 1; b < w.rods.size(); ++b)
        w.first[b] = w.first[b - 1] + w.nodes_of(b - 1);
}

/// The base matrix, the contacts' rows and weights, and the gradient without contact forces.
/// @return  the scale of forces
Residual set_up(RodProblem& w, const std::vector<RodContactState>& contacts, Projectors& held)
{
    w.contact.assign(contacts.size(), RodContact());
    number_nodes(w, contacts);
    for (std::size_t k = 0; k < contacts.size(); ++k)
        place_contact(w, contacts[k], w.contact[k]);
    std::vector<int> on_rod(w.rods.size(), 0);
    for (const RodContact& c : w.contact)
        for (const int rod : c.on)
            if (rod >= 0) ++on_rod[std::size_t(rod)];
    w.most_on_one = on_rod.empty() ? 0 : *std::ranges::max_element(on_rod);
    place_joints(w);
    take_rods(w, w.contact, held);
    add_joints(w, held);

    Residual scale;
    for (const RodBody* rod : w.rods)
        if (rod) scale.scale = std::max(scale.scale, rod->force_scale());
    for (const RodJoint& j : w.joints)
        scale.scale = std::max(scale.scale, std::abs(j.force));
    for (std::size_t k = 0; k < contacts.size(); ++k) {
        const RodContactState& s = contacts[k];
        RodContact& c = w.contact[k];
        const Vec3 moved = place_rows(w, s, c, s.friction > 0 ? 3 : 1, held);
        Candidate& law = c.law;
        law.gap = s.value[0] + moved[0];
        for (int i = 0; i < 2; ++i)
            law.slip[i] = s.friction > 0 ? s.value[i + 1] + moved[i + 1] : 0;
        law.mu = s.friction;
        law.normal = std::max(s.force[0], 0.0);
        for (int i = 0; i < 2; ++i)
            law.tangential[i] = s.friction > 0 ? s.force[i + 1] : 0;
        law.sticks = s.sticks;
        law.stiffness = std::numeric_limits<double>::infinity();
        for (int i = 0; i < c.nodes; ++i)
            law.stiffness =
                std::min(law.stiffness, w.stiffness[std::size_t(c.slot[std::size_t(i)])]);
        law.held[0] = kHeld * stiffness_along(w, c, c.normal);
        // A tangent along which almost no motion is possible (rods held in nearly the same plane)
        // takes the weight of the other one: its own would be that over a square near zero.
        const double freest =
            s.friction > 0 ? std::max(size_of(c, c.tangent[0]), size_of(c, c.tangent[1])) : 0;
        for (int i = 0; i < 2 && s.friction > 0; ++i)
            if (size_of(c, c.tangent[i]) > kHardly * freest)
                law.held[1] = std::max(law.held[1], kHeld * stiffness_along(w, c, c.tangent[i]));
        scale.scale = std::max(scale.scale, law.normal);
        if (k > 0) {
            const RodContact& before = w.contact[k - 1];
            const int way = c.slot[0] - before.slot[0];
            c.follows = contacts[k - 1].contact->pair == s.contact->pair && (way == 0 || way == 1);
        }
        add_geometry(w, s, c, held);
        if (law.normal > 0) { // present forces are in the gradient: see set_right_side
            RodSystem::add_force(w.gradient, c, c.normal, -law.normal);
            for (int i = 0; i < 2 && s.friction > 0; ++i)
                RodSystem::add_force(w.gradient, c, c.tangent[i], -law.tangential[i]);
        }
    }
    return scale;
}

/// Solves with the last factors for the present multipliers: the states of the last trial, whose
/// matrix that is, may still fit. Leaves the increment and the trials.
bool fits_as_it_is(RodSystem& system, const Residual& scale, const NewtonOptions& options)
{
    pivoting::set_right_side(system);
    system.increment() = system.right();
    system.matrix().solve(system.increment());
    const double force = least_violation(scale, options);
    bool fits = true;
    for (std::size_t k = 0; k < system.contacts(); ++k) {
        const Candidate& c = system.contact(k);
        pivoting::evaluate(system, k);
        fits = fits &&
               violation(c, system.trial()[k], force, force / c.stiffness).kind == Change::none;
    }
    return fits;
}

/// A motion without symmetry: the same in each section's axes, however the scene is turned.
std::vector<Node6> any_motion(const RodProblem& w, const Projectors& held)
{
    std::vector<Node6> x(w.gradient.size());
    for (std::size_t b = 0; b < w.rods.size(); ++b) {
        if (!w.rods[b]) continue;
        const std::vector<BeamNode>& nodes = w.rods[b]->nodes();
        for (auto i = std::size_t(w.from[b]); i < nodes.size(); ++i) {
            const auto slot = std::size_t(w.slot(int(b), int(i)));
            Vec6 v;
            for (int k = 0; k < 6; ++k)
                v[k] = std::sin(1 + double(6 * i) + double(k) * 1.7);
            v.head<3>() = rotation_matrix(nodes[i].q) * v.head<3>();
            v.tail<3>() /= w.length[slot];
            Eigen::Map<Vec6>(x[slot].value) = held.free[slot] * v;
        }
    }
    return x;
}

/// Of each body, of its largest part 1: places, and turns times their element's length.
std::vector<Eigen::VectorXd> motion_of_bodies(const RodProblem& w, const std::vector<Node6>& x)
{
    double most = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
        const Eigen::Map<const Vec6> v(x[i].value);
        most = std::max({most, v.head<3>().norm(), w.length[i] * v.tail<3>().norm()});
    }
    std::vector<Eigen::VectorXd> motion(w.rods.size());
    for (std::size_t b = 0; b < w.rods.size(); ++b) {
        if (!w.rods[b]) continue;
        motion[b].setZero(w.rods[b]->unknowns());
        for (int i = 0; i < w.nodes_of(b); ++i)
            motion[b].segment<6>(6 * (w.from[b] + i)) =
                Eigen::Map<const Vec6>(x[std::size_t(w.first[b] + i)].value) / most;
    }
    return motion;
}

/// The symmetric part of the rods' matrix, closed contacts held by so many times their weights.
/// @return  whether it is positive definite
bool factor_held(RodSystem& system, double hold, double shift)
{
    RodProblem& w = system.p;
    system.start_matrix(shift, 0);
    for (const RodContact& c : w.contact) {
        if (!(c.law.normal > 0)) continue;
        RodSystem::add_product(w.system, c, c.normal, c.normal, hold * normal_weight(c.law), 0);
        if (c.law.mu > 0 && c.law.sticks)
            for (const FourNodeRow& t : c.tangent)
                RodSystem::add_product(w.system, c, t, t, hold * stick_weight(c.law), 0);
    }
    return w.system.factor(0) == 0;
}

} // namespace

RodAnswer solve_rod_contacts(RodProblem& w, const std::vector<RodContactState>& contacts,
                             double tolerance)
{
    Projectors held;
    const Residual scale = set_up(w, contacts, held);
    w.system.guarded = w.guarded;
    NewtonOptions options;
    options.tolerance = tolerance;
    options.stop = w.stop;
    NewtonReport report;
    RodSystem system(w);
    double shift = 0;
    RodAnswer out;
    for (int k = 0; k < kMultipliers; ++k) {
        out.fits = (k > 0 && out.fits && fits_as_it_is(system, scale, options)) ||
                   pivoting::solve(system, scale, options, shift, report);
        if (shift > 0 || k + 1 == kMultipliers) break;
        if (left_open(w) <= tolerance * length_scale(w)) break;
        renew_multipliers(w);
    }

    out.factorisations = report.factorisations;
    out.shifted = shift > 0;
    out.motion.resize(w.rods.size());
    for (std::size_t b = 0; b < w.rods.size(); ++b) {
        if (!w.rods[b]) {
            out.motion[b] = Eigen::VectorXd();
            continue;
        }
        Eigen::VectorXd& y = out.motion[b];
        y = w.rods[b]->prescribed();
        for (int i = 0; i < w.nodes_of(b); ++i) {
            const std::size_t slot = std::size_t(w.first[b] + i);
            y.segment<6>(6 * (w.from[b] + i)) +=
                held.free[slot] * Eigen::Map<const Vec6>(w.increment[slot].value);
        }
    }
    for (const HeldJoint& j : w.held_joints) {
        out.joint_value.push_back(value_after(w, j));
        out.joint_force.push_back((j.springs ? 0 : j.force) - j.weight * out.joint_value.back());
    }
    for (std::size_t k = 0; k < contacts.size(); ++k) {
        const Trial& t = w.trial[k];
        const double normal = std::max(t.normal, 0.0), bound = contacts[k].friction * normal,
                     size = std::hypot(t.t1, t.t2);
        const double share = size > bound ? bound / size : 1;
        out.force.push_back({normal, share * t.t1, share * t.t2});
        out.value.push_back({t.gap, t.v1, t.v2});
        out.sticks.push_back(t.status == 1);
    }
    return out;
}

std::optional<NegativeMotion> negative_motion(RodProblem& w,
                                              const std::vector<RodContactState>& contacts)
{
    constexpr double kHolds[] = {1, 1e3, 1e6}; // of closed contacts, times their weights
    constexpr double kRounding = 1e-12;        // of the stiffest node's
    Projectors held;
    set_up(w, contacts, held);
    w.base.take_symmetric_part();
    w.system.guarded = true;
    RodSystem system(w);
    const auto factor = [&](double hold, double shift) { return factor_held(system, hold, shift); };
    for (const double hold : kHolds)
        if (factor(hold, 0)) return {};
    double shift = pivoting::kLeastShift * w.min_stiffness;
    while (!factor(kHolds[1], shift)) {
        shift *= 4;
        if (!(shift <= pivoting::kLargestShift * w.min_stiffness)) return {};
    }

    // Inverse iteration: the lowest eigenvalue of the shifted matrix is its smallest.
    const std::size_t n = w.gradient.size();
    const auto weigh = [&](std::vector<Node6>& x) {
        for (std::size_t i = 0; i < n; ++i)
            for (int k = 3; k < 6; ++k)
                x[i].value[k] *= w.length[i] * w.length[i];
    };
    std::vector<Node6> x = any_motion(w, held);
    const double value =
        pivoting::smallest_eigenvalue(x, weigh, [&](std::vector<Node6>& v) { w.system.solve(v); });
    const double stiffest = *std::ranges::max_element(w.stiffness);
    if (!(value > 0 && value - shift < -kRounding * stiffest)) return {};

    NegativeMotion out;
    out.stiffness = value - shift;
    out.motion = motion_of_bodies(w, x);
    return out;
}

std::optional<std::vector<Eigen::VectorXd>>
unheld_motion(RodProblem& w, const std::vector<RodContactState>& contacts)
{
    constexpr double kHold = 1e3;  // of closed contacts, times their weights
    constexpr double kNothing = 1; // of a rod's stabilising spring: less counts as none
    Projectors held;
    set_up(w, contacts, held);
    w.base.take_symmetric_part();
    w.system.guarded = true;
    RodSystem system(w);
    if (!factor_held(system, kHold, 0)) return {};
    // With the springs as weights a motion that nothing else holds has the eigenvalue 1.
    std::vector<Node6> springs(w.gradient.size());
    for (std::size_t b = 0; b < w.rods.size(); ++b)
        for (int i = 0; i < w.nodes_of(b); ++i) {
            const std::array<double, 2> s = w.rods[b]->anchor_on(w.from[b] + i);
            for (int k = 0; k < 6; ++k)
                springs[std::size_t(w.first[b] + i)].value[k] = s[k < 3 ? 0 : 1];
        }
    const auto weigh = [&](std::vector<Node6>& x) {
        for (std::size_t i = 0; i < x.size(); ++i)
            for (int k = 0; k < 6; ++k)
                x[i].value[k] *= springs[i].value[k];
    };
    std::vector<Node6> x = any_motion(w, held);
    const double value =
        pivoting::smallest_eigenvalue(x, weigh, [&](std::vector<Node6>& v) { w.system.solve(v); });
    if (!(value > 0 && value < 1 + kNothing)) return {};
    return motion_of_bodies(w, x);
}

} // namespace amontons
