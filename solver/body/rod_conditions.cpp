#include "mesh/base/curve.hpp"
#include "solver/body/drive.hpp"
#include "solver/body/rod_body.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

// What acts on a rod, and what holds it.

namespace amontons {
namespace {

double value(const CurvePoints& c, double t, double otherwise)
{
    return c.empty() ? otherwise : curve_value(c, t);
}

void add_stiffness(RodMatrix* K, int node, const Mat6& m)
{
    if (K) add_to_block(K->chain.diagonal(node), m);
}

/// Directions that are held, made orthonormal one by one.
struct Directions {
    Eigen::Matrix<double, 6, 6> Q;
    int count = 0;

    void hold_all() { count = 6; }
    void hold(Vec6 v)
    {
        if (count == 6) return;
        for (int i = 0; i < count; ++i)
            v -= Q.col(i).dot(v) * Q.col(i);
        const double size = v.norm();
        if (size < 1e-6) return;
        Q.col(count++) = v / size;
    }
    /// Places across this direction.
    void hold_across(const Vec3& along)
    {
        const Vec3 a = along.unitOrthogonal();
        for (const Vec3& d : {a, Vec3(along.cross(a))}) {
            Vec6 v = Vec6::Zero();
            v.head<3>() = d;
            hold(v);
        }
    }
    /// Turns across this axis of the section.
    void hold_turns_across(const Vec3& axis)
    {
        const Vec3 a = axis.unitOrthogonal();
        for (const Vec3& t : {a, Vec3(axis.cross(a))}) {
            Vec6 v = Vec6::Zero();
            v.tail<3>() = t;
            hold(v);
        }
    }
    Mat6 free() const
    {
        if (count == 6) return Mat6::Zero();
        return Mat6::Identity() - Q.leftCols(count) * Q.leftCols(count).transpose();
    }
};

} // namespace

std::vector<LiveCurve> RodBody::live_curves()
{
    std::vector<LiveCurve> all;
    for (std::size_t k = 0; k < input_.loads.size(); ++k)
        all.push_back(
            {fmt::format("{}.loads.{}.over", input_.name, k), "", &input_.loads[k].over, 1});
    // What is held and moved must stay out of the sheath, as the scene's curve leaves it; what the
    // scene leaves at rest may enter it, and cannot be led.
    double least = 0;
    const auto moves = [](const CurvePoints& c) {
        return std::ranges::any_of(c, [](const auto& p) { return p[1] != 0; });
    };
    for (std::size_t k = 0; k < input_.hold.size(); ++k) {
        RodHold& h = input_.hold[k];
        const bool of_base = moves(h.angle) && h.set == "start"; // turns what is in the sheath, too
        const bool moved = moves(h.x) || moves(h.y) || moves(h.z) || (moves(h.angle) && !of_base);
        if (moved)
            least = std::max(least, rod_.length - (h.at             ? *h.at
                                                   : h.set == "end" ? rod_.length
                                                                    : 0));
        const auto add = [&](const char* name, const char* unit, CurvePoints& curve, bool held) {
            if (curve.empty()) return;
            // Without a name it cannot be led, and no step passes its knots all the same.
            const bool led = held && (moved || input_.fed.empty());
            all.push_back(
                {led ? fmt::format("{}.hold.{}.{}", input_.name, k, name) : "", unit, &curve});
        };
        add("x", "m", h.x, h.places == "held");
        add("y", "m", h.y, h.places == "held");
        add("z", "m", h.z, h.places == "held");
        if (!input_.instrument || h.set != "start") add("angle", "rad", h.angle, h.turns == "held");
    }
    if (input_.fed.empty()) return all;
    all.push_back({input_.name + (input_.instrument ? ".insertion" : ".fed"), "m", &input_.fed, 0,
                   least, rod_.length});
    for (RodHold& h : input_.hold)
        if (input_.instrument && h.set == "start")
            all.push_back({input_.name + ".twist", "rad", &h.angle});
    return all;
}

std::vector<RodBody::Held> RodBody::held_at(const Motion& m, double t) const
{
    std::vector<Held> all;
    std::vector<Directions> directions;
    const int in_sheath = nodes_in_sheath();
    all.reserve(std::size_t(in_sheath) + holds_.size());
    directions.reserve(all.capacity());
    std::vector<int> index(m.nodes.size(), -1);
    const auto of = [&](int node) -> std::size_t {
        int& i = index[std::size_t(node)];
        if (i < 0) {
            i = int(all.size());
            all.push_back({});
            all.back().node = node;
            directions.push_back({});
        }
        return std::size_t(i);
    };
    // ---- Holds: move = target - place, or in a dynamic step the change of velocity v' that
    // reaches the target at its end, h (end v' + past) = target - place at the start
    for (const Hold& h : holds_) {
        const Vec3 shift(value(h.input->x, t, 0), value(h.input->y, t, 0), value(h.input->z, t, 0));
        const Vec3 axis = h.input->axis.normalized();
        for (const int node : h.nodes) {
            if (node < in_sheath) continue; // the sheath holds it
            const std::size_t i = of(node);
            const BeamNode &now = m.nodes[std::size_t(node)],
                           &first = rod_.nodes[std::size_t(node)],
                           &start = state_.nodes[std::size_t(node)];
            for (int k = 0; k < 3; ++k) {
                if (!h.axis[std::size_t(k)]) continue;
                directions[i].hold(Vec6::Unit(k));
                const double target = shift[k] + first.difference(now, k);
                all[i].move[k] = target;
                if (step_.dynamic) // as a change of velocity
                    all[i].move[k] = ((shift[k] + first.difference(start, k)) / step_.h -
                                      past_velocity_[std::size_t(node)][k]) /
                                         step_.rule.end -
                                     m.velocity[std::size_t(node)][k];
            }
            if (h.input->turns == "about") {
                directions[i].hold_turns_across(rotation_matrix(now.q).transpose() * axis);
            } else if (h.input->turns == "held") {
                for (int k = 3; k < 6; ++k)
                    directions[i].hold(Vec6::Unit(k));
                const Eigen::Quaterniond turn = rotation(value(h.input->angle, t, 0) * axis);
                const Eigen::Quaterniond q0(first.q[0], first.q[1], first.q[2], first.q[3]);
                const auto left = [&](const BeamNode& from) {
                    const Eigen::Quaterniond q(from.q[0], from.q[1], from.q[2], from.q[3]);
                    return rotation_vector(q.conjugate() * (turn * q0));
                };
                all[i].move.tail<3>() = left(now);
                if (step_.dynamic)
                    all[i].move.tail<3>() =
                        (left(start) / step_.h - past_velocity_[std::size_t(node)].tail<3>()) /
                            step_.rule.end -
                        m.velocity[std::size_t(node)].tail<3>();
            }
        }
    }
    // ---- Nodes in the sheath
    const double torsion = in_sheath > 0 ? torsion_to(sheath_, sheath_.s) : 0;
    for (int node = 0; node < in_sheath; ++node) {
        const std::size_t i = of(node);
        const BeamNode &now = m.nodes[std::size_t(node)], first = held_in_sheath(node, torsion);
        if (node == sheath_.node && compliant_in_sheath()) {
            directions[i].hold_across(along_sheath());
            directions[i].hold_turns_across(Vec3::UnitX());
        } else {
            directions[i].hold_all();
        }
        if (step_.dynamic) {
            all[i].move = velocity_in_sheath() - m.velocity[std::size_t(node)];
            if (node == sheath_.node && compliant_in_sheath()) { // along and about it is free
                all[i].move.head<3>() -= along_sheath().dot(all[i].move.head<3>()) * along_sheath();
                all[i].move[3] = 0;
            }
            continue;
        }
        for (int k = 0; k < 3; ++k)
            all[i].move[k] = first.difference(now, k);
        const auto turn = [](const BeamNode& n) {
            return Eigen::Quaterniond(n.q[0], n.q[1], n.q[2], n.q[3]);
        };
        all[i].move.tail<3>() = rotation_vector(turn(now).conjugate() * turn(first));
    }
    // ---- A plane: no displacement along its normal, no rotation across it
    if (input_.plane) {
        const Vec3 normal = input_.plane->normalized();
        for (std::size_t node = 0; node < m.nodes.size(); ++node) {
            const std::size_t i = of(int(node));
            Vec6 out = Vec6::Zero();
            out.head<3>() = normal;
            directions[i].hold(out);
            directions[i].hold_turns_across(rotation_matrix(m.nodes[node].q).transpose() * normal);
        }
    }
    for (std::size_t i = 0; i < all.size(); ++i)
        all[i].free = directions[i].free();
    return all;
}

Vec3 RodBody::line_load(double t) const
{
    Vec3 line = Vec3::Zero();
    for (const Load& l : loads_)
        if (l.input->line) line += step_.load * value(l.input->over, t, 1) * *l.input->line;
    return line;
}

void RodBody::add_loads(const Motion& m, double t, std::vector<Node6>& f, RodMatrix* K) const
{
    const Vec3 line = line_load(t);
    for (const Load& l : loads_) {
        if (l.node < 0) continue;
        const double factor = step_.load * value(l.input->over, t, 1);
        Map6 own(f[std::size_t(l.node)].value);
        const Mat3 R = rotation_matrix(m.nodes[std::size_t(l.node)].q);
        Mat6 stiffness = Mat6::Zero();
        if (l.input->force) {
            const Vec3 F = factor * *l.input->force;
            own.head<3>() += l.input->follows ? Vec3(R * F) : F;
            if (l.input->follows) stiffness.topRightCorner<3, 3>() += R * skew_matrix(F);
        }
        if (l.input->moment) {
            const Vec3 M = factor * *l.input->moment;
            const Vec3 body = l.input->follows ? M : Vec3(R.transpose() * M);
            own.tail<3>() += body;
            // Of the two, and of the inner moment that balances it: see docs/theory/beams.md.
            stiffness.bottomRightCorner<3, 3>() +=
                (l.input->follows ? 0.5 : -0.5) * skew_matrix(body);
        }
        add_stiffness(K, l.node, stiffness);
    }
    if (line.isZero(0) && step_.gravity.isZero(0)) return;
    // The work of a load q along an element of cubic middle line:
    // q . (L/2 (x1 + x2) + L^2/12 (d1 - d2)).
    // An instrument's weight in its introducer, which lies on it, does not push.
    for (int e = input_.instrument ? sheath_.node : 0; e < rod_.element_count(); ++e) {
        const double L = rod_.law[std::size_t(e)].length;
        const Vec3 q = line + rod_.mass[std::size_t(e)].per_length * step_.gravity;
        const int node[2] = {e, rod_.second(e)};
        for (int i = 0; i < 2; ++i) {
            Map6 own(f[std::size_t(node[i])].value);
            const Vec3 a = rod_.axis(e, i);
            const Vec3 body = rotation_matrix(m.nodes[std::size_t(node[i])].q).transpose() * q;
            const double c = (i == 0 ? 1 : -1) * L * L / 12;
            own.head<3>() += 0.5 * L * q;
            own.tail<3>() += c * a.cross(body);
            Mat6 stiffness = Mat6::Zero();
            stiffness.bottomRightCorner<3, 3>() =
                -c * (0.5 * (body * a.transpose() + a * body.transpose()) -
                      body.dot(a) * Mat3::Identity());
            add_stiffness(K, node[i], stiffness);
        }
    }
}

} // namespace amontons
