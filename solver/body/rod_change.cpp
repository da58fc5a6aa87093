#include "solver/body/drive.hpp"
#include "solver/body/node_index.hpp"
#include "solver/body/rod_body.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

// How Newton's method moves a rod.

namespace amontons {
namespace {

constexpr double kSmallTurn = 1e-3; // of a node in one iteration [rad]
constexpr double kLongestTurn = 1;  // of an element in one iteration [rad]
constexpr double kTaken = 0.8;      // of a rope's tension in one iteration
constexpr double kTaut = 1e3;       // tension times length squared of EI: a rope

} // namespace

/// The share of a motion that turns no element by more than Newton's method can bear.
double RodBody::safe_share(const Motion& m, const Eigen::VectorXd& y) const
{
    double most = 0;
    for (int e = std::max(first_outside() - 1, 0); e < rod_.element_count(); ++e) {
        const std::size_t a = std::size_t(e), b = std::size_t(rod_.second(e));
        const Vec3 turn = rotation_matrix(m.nodes[b].q) * y.segment<3>(at6(b) + 3) -
                          rotation_matrix(m.nodes[a].q) * y.segment<3>(at6(a) + 3);
        most = std::max(most, turn.norm());
    }
    return most > kLongestTurn ? kLongestTurn / most : 1;
}

void RodBody::move_nodes(Motion& m, const Eigen::VectorXd& y)
{
    for (std::size_t i = 0; i < m.nodes.size(); ++i) {
        for (int k = 0; k < 3; ++k)
            m.nodes[i].move(k, y[at6(i) + k]);
        const Vec3 turn = y.segment<3>(at6(i) + 3);
        if (!turn.isZero(0)) rotate_in_body(m.nodes[i].q, turn);
        moved_[i] += y.segment<6>(at6(i));
    }
}

/// A large motion of a rod that one node holds: what y does to the strains, to first order, and the
/// nodes then placed by the strains, from the held one on. Along straight lines the same y would
/// stretch the rod by the square of its turns, and EA is large: Newton's method would have to undo
/// that for many iterations, or fail.
void RodBody::unroll(Motion& m, const Eigen::VectorXd& y)
{
    const std::vector<BeamNode> before = m.nodes;
    const auto turned = [&](const BeamNode& node, int element, int end, bool back) {
        BeamNode n = node;
        for (const RodCorner& c : rod_.corners)
            if (c.element == element && c.end == end) {
                const double inverse[4] = {c.turn.q[0], -c.turn.q[1], -c.turn.q[2], -c.turn.q[3]};
                quaternion_product(n.q, back ? inverse : c.turn.q, n.q);
            }
        return n;
    };
    const auto turn_of = [&](int element, int end) {
        Mat3 R = Mat3::Identity();
        for (const RodCorner& c : rod_.corners)
            if (c.element == element && c.end == end) R = rotation_matrix(c.turn.q);
        return R;
    };
    const auto step = [&](int from, int to) {
        const int e = std::min(from, to);
        const double L = rod_.law[std::size_t(e)].length;
        const BeamNode a = turned(before[std::size_t(e)], e, 0, false),
                       b = turned(before[std::size_t(e) + 1], e, 1, false);
        const ElementLaw& law = rod_.law[std::size_t(e)];
        std::array<double, 6> strain = element_strain(a, b, L);
        const std::array<double, 6> old = strain;
        Eigen::Matrix<double, 12, 1> own = y.segment<12>(6 * e);
        own.segment<3>(3) = turn_of(e, 0).transpose() * Vec3(own.segment<3>(3));
        own.segment<3>(9) = turn_of(e, 1).transpose() * Vec3(own.segment<3>(9));
        for (std::size_t i = 0; i < 6; ++i) {
            std::array<double, 6> unit{};
            unit[i] = 1;
            const std::array<double, 12> row = element_force(a, b, L, unit);
            strain[i] += Eigen::Map<const Eigen::Matrix<double, 12, 1>>(row.data()).dot(own);
        }
        // Of the mean stretch, too, the change is that of first order.
        if (kind_ == RodElement::exact)
            for (std::size_t i : {1, 2}) {
                const double change = strain[i] - old[i];
                strain[0] -= 0.5 * law.bowing[i - 1] * change * change;
            }
        // The exponential of the pose.
        const Vec3 gamma = L * Vec3(strain[0], strain[1], strain[2]),
                   turn = L * Vec3(strain[3], strain[4], strain[5]);
        const double angle = turn.norm(), small = angle * angle;
        const double s = angle > 1e-4 ? (1 - std::cos(angle)) / small : 0.5 - small / 24;
        const double c =
            angle > 1e-4 ? (angle - std::sin(angle)) / (small * angle) : 1.0 / 6 - small / 120;
        const Vec3 chord = gamma + s * turn.cross(gamma) + c * turn.cross(turn.cross(gamma));
        if (to > from) {
            BeamNode n = turned(m.nodes[std::size_t(from)], e, 0, false);
            const Vec3 d = rotation_matrix(n.q) * chord;
            rotate_in_body(n.q, turn);
            for (int k = 0; k < 3; ++k)
                n.move(k, d[k]);
            m.nodes[std::size_t(to)] = turned(n, e, 1, true);
        } else {
            BeamNode n = turned(m.nodes[std::size_t(from)], e, 1, false);
            rotate_in_body(n.q, -turn);
            const Vec3 d = rotation_matrix(n.q) * chord;
            for (int k = 0; k < 3; ++k)
                n.move(k, -d[k]);
            m.nodes[std::size_t(to)] = turned(n, e, 0, true);
        }
    };
    BeamNode& root = m.nodes[std::size_t(root_)];
    for (int k = 0; k < 3; ++k)
        root.move(k, y[6 * root_ + k]);
    rotate_in_body(root.q, y.segment<3>(6 * root_ + 3));
    for (int i = root_; i + 1 < rod_.node_count(); ++i)
        step(i, i + 1);
    for (int i = root_; i > 0; --i)
        step(i, i - 1);
    note_motion(before, y);
}

/// Adds what the nodes have done to the sum of the step; turns of many times 2 pi are near y's.
void RodBody::note_motion(const std::vector<BeamNode>& before, const Eigen::VectorXd& y)
{
    constexpr double kTurn = 2 * 3.14159265358979323846;
    for (std::size_t i = 0; i < before.size(); ++i) {
        const auto quaternion = [](const BeamNode& n) {
            return Eigen::Quaterniond(n.q[0], n.q[1], n.q[2], n.q[3]);
        };
        Vec3 turn = rotation_vector(quaternion(before[i]).conjugate() * quaternion(now_.nodes[i]));
        const Vec3 near = y.segment<3>(at6(i) + 3);
        const double angle = turn.norm();
        if (angle > 1e-9) {
            const double whole = std::round((near.dot(turn) / angle - angle) / kTurn);
            turn *= 1 + whole * kTurn / angle;
        }
        for (int k = 0; k < 3; ++k)
            moved_[i][k] += now_.nodes[i].difference(before[i], k);
        moved_[i].tail<3>() += turn;
    }
}

/// The share of a motion that takes no more than most of a rope's tension away: what its shape can
/// take up grows with the third power of one over the tension, of which the tangent contains the
/// first.
double RodBody::slack_share(const Eigen::VectorXd& y) const
{
    if (root_ >= 0 || !expected_.empty() || kind_ != RodElement::exact || !is_taut()) return 1;
    // A beam that is not one is stretched on the way alone, by its turns, and is soon no more.
    double pulled = 0, soft = std::numeric_limits<double>::infinity();
    for (const ElementLaw& law : rod_.law)
        soft = std::min(soft, std::min(law.S[4], law.S[5]) / law.length);
    const int out = first_outside(); // in a sheath nothing pulls
    for (int e = out; e < rod_.element_count(); ++e)
        pulled = std::max(pulled, rod_resultants(rod_, state_.nodes, kind_, e)[0]);
    if (!(pulled * size_ * size_ > kTaut * soft)) return 1;
    double now = 0, then = 0; // tension times length
    for (int e = out; e < rod_.element_count(); ++e) {
        const std::size_t a = std::size_t(e), b = std::size_t(rod_.second(e));
        const ElementLaw& law = rod_.law[a];
        const std::array<double, 6> after = predicted_strain(
            now_.nodes[a], now_.nodes[b], law.length, y.data() + at6(a), y.data() + at6(b));
        now += element_stress(law, strain(e))[0];
        then += element_stress(law, after)[0];
    }
    return now > 0 && then < (1 - kTaken) * now ? kTaken * now / (now - then) : 1;
}

void RodBody::update(const Eigen::VectorXd& y, const Eigen::VectorXd&, const Eigen::VectorXd&)
{
    before_last_ = last_motion_;
    whole_matrix_ = false;
    if (!step_.dynamic) {
        Eigen::VectorXd own = y;
        const std::array<double, 2> past = past_sheath_end(own);
        double share = std::min(safe_share(now_, own), share_past_end(past[0]));
        double turn = 0;
        for (std::size_t i = 0; i < now_.nodes.size(); ++i)
            turn = std::max(turn, own.segment<3>(at6(i) + 3).norm());
        if (root_ >= 0 && turn > kSmallTurn) {
            unroll(now_, share * own);
        } else {
            share = std::min(share, slack_share(own));
            move_nodes(now_, share * own);
        }
        if (compliant_in_sheath()) pass_sheath_end(share * past[0], share * past[1]);
        last_motion_ = 0;
        for (std::size_t i = 0; i < now_.nodes.size(); ++i)
            last_motion_ = std::max(last_motion_, y.segment<3>(at6(i)).norm());
        if (!std::isfinite(last_motion_)) last_motion_ = std::numeric_limits<double>::infinity();
        return;
    }
    double most = 0;
    if (material_) { // its base is where it is led
        now_.end.fed = led_.fed;
        now_.end.turned = led_.turned;
    }
    for (std::size_t i = 0; i < now_.nodes.size(); ++i) {
        now_.velocity[i] += y.segment<6>(at6(i));
        most = std::max(most, step_.h * y.segment<3>(at6(i)).norm());
    }
    last_motion_ = most;
    place_by_velocity();
}

} // namespace amontons
