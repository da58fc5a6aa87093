#include "solver/beam/nesting.hpp"

#include "solver/beam/tests/random_wire.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <doctest/doctest.h>

using namespace amontons;
using test::unit_increment;

namespace {

/// A bent wire in a bent catheter, out of one sheath; neither in a plane.
struct InBore {
    Wire inner, outer;
    Nesting nesting;

    /// @param out_inner, out_outer  lengths past the sheath
    InBore(double out_inner, double out_outer, double friction, unsigned seed = 5)
    {
        test::RandomNumbers random(seed);
        std::vector<BeamSegment> segments = test::three_segments();
        inner.material = make_material(segments, 0.2);
        for (BeamSegment& s : segments) {
            s.radius = 0.2;
            s.inner_radius = 0.12;
            s.curvature = 0;
        }
        outer.material = make_material(segments, 0.3);
        const Vec3 bend(0, 0.03, -0.08);
        for (Wire* w : {&inner, &outer}) {
            Sheath s;
            s.end = {0.3, -0.2, 0.1};
            Quaternion q;
            rotate_in_body(q.q, {0.4, -0.9, 0.3});
            s.frame = rotation_matrix(q.q);
            w->sheath = s;
            w->state.reaction.assign(w->material.point.size(), {});
            start_in_sheath(*w, w == &inner ? out_inner : out_outer, 0);
            // A helix by rotations along it, then some noise.
            Vec3 x = s.end;
            for (int i = w->state.first; i <= w->last(); ++i) {
                BeamNode& n = w->state.nodes[std::size_t(i)];
                const double at = i == w->state.first ? 0
                                                      : w->material.node[std::size_t(i)] -
                                                            w->material.length + w->state.inserted;
                Quaternion turned = quaternion_of(s.frame);
                rotate_in_body(turned.q, at * bend);
                std::copy(turned.q, turned.q + 4, n.q);
                if (i > w->state.first) {
                    const BeamNode& before = w->state.nodes[std::size_t(i) - 1];
                    const double step =
                        at - (i - 1 == w->state.first ? 0
                                                      : w->material.node[std::size_t(i) - 1] -
                                                            w->material.length + w->state.inserted);
                    Quaternion middle = quaternion_of(s.frame);
                    rotate_in_body(middle.q, (at - 0.5 * step) * bend);
                    x = before.position() + step * first_axis(middle.q);
                    for (int k = 0; k < 3; ++k)
                        n.x[k] = x[k];
                }
            }
            for (int i = w->state.first + 1; i <= w->last(); ++i)
                test::shake(w->state.nodes[std::size_t(i)], random, 0.03, 0.03);
        }
        nesting = make_nesting(inner, outer, friction, 0.3);
    }
    InBore(const InBore&) = delete;

    std::vector<NestedContact> contacts(const NestingStart& start) const
    {
        std::vector<NestedContact> c;
        find_nested(nesting, start, 100, c);
        return c;
    }
    NestingStart now() const { return {inner.state, outer.state}; }
    Wire& wire(int which) { return which == 0 ? inner : outer; }
};

double nested_row_value(const NestedContact& c, int which, const ContactRow& in,
                        const ContactRow& out, int node, int unknown)
{
    const ContactRow& row = which == 0 ? in : out;
    const int e = which == 0 ? c.on_inner.place.element : c.outer.element;
    if (node == e) return row.a.value[unknown];
    if (node == e + 1) return row.b.value[unknown];
    return 0;
}

/// Calls visit(wire, node, unknown) for every free unknown.
template <class Visit> void for_unknowns(const InBore& s, const Visit& visit)
{
    for (int which : {0, 1}) {
        const Wire& w = which == 0 ? s.inner : s.outer;
        for (int i = w.state.first; i <= w.last(); ++i)
            for (int k = 0; k < 6; ++k)
                if (test::is_free(w, i, k)) visit(which, i, k);
    }
}

/// Against differences of the forces that the contact's reaction makes.
void check_tangent(InBore& s, const NestingStart& start, const std::vector<NestedContact>& here,
                   std::size_t c)
{
    const NestedTangent K = nested_tangent(s.nesting, here[c]);
    const double size = K.cwiseAbs().maxCoeff(), h = 1e-5;
    if (s.nesting.friction == 0) CHECK((K - K.transpose()).cwiseAbs().maxCoeff() < 1e-12 * size);
    const int element[2] = {here[c].on_inner.place.element, here[c].outer.element};
    const auto force_of = [](const NestedContact& k) {
        const Candidate& a = k.on_inner;
        Eigen::Matrix<double, 24, 1> f;
        for (int i = 0; i < 24; ++i) {
            const auto of = [&](const ContactRow& in, const ContactRow& out) {
                const ContactRow& row = i < 12 ? in : out;
                return (i % 12 < 6 ? row.a : row.b).value[i % 6];
            };
            f[i] = a.normal * of(a.hn, k.hn) + a.tangential[0] * of(a.ht[0], k.ht[0]) +
                   a.tangential[1] * of(a.ht[1], k.ht[1]);
        }
        return f;
    };
    double wrong = 0;
    int compared = 0;
    // Nodes that are held have moving lengths of their own second order: left out.
    for_unknowns(s, [&](int which, int node, int unknown) {
        Wire& w = s.wire(which);
        const int of_element = node - element[which];
        if (of_element < 0 || of_element > 1 || node == w.state.first) return;
        const int col = 12 * which + 6 * of_element;
        const WireState keep = w.state;
        Eigen::Matrix<double, 24, 1> force[2];
        for (int k : {0, 1}) {
            move_wire(w, unit_increment(w, node, unknown), k ? h : -h);
            force[k] = force_of(s.contacts(start)[c]);
            w.state = keep;
        }
        for (int row = 0; row < 24; ++row) {
            const int side = row / 12;
            if (element[side] + row % 12 / 6 == s.wire(side).state.first) continue;
            // Rows of body rotations: the symmetric second derivative differs from the
            // derivative of the gradient by half a commutator.
            if (row % 6 >= 3 && unknown >= 3 && row / 6 == col / 6) continue;
            ++compared;
            const double g = -(force[1][row] - force[0][row]) / (2 * h);
            wrong = std::max(wrong, std::abs(g - K(row, col + unknown)));
        }
    });
    CHECK(compared > 0);
    CHECK(wrong < 1e-5 * size);
}

} // namespace

TEST_CASE("the gap in a bore is the clearance less the distance across the centreline")
{
    for (double out_outer : {3.1, 7.9}) { // the wire past the catheter's tip, and within it
        const InBore s(6.3, out_outer, 0);
        const auto all = s.contacts(s.now());
        CHECK(all.size() > 8);
        CHECK(all.back().moves_on_inner == (out_outer < 6.3));
        for (const NestedContact& k : all) {
            const Candidate& c = k.on_inner;
            const Vec3 off = c.x - k.x_outer;
            CHECK(c.gap == doctest::Approx(0.12 - 0.05 - off.norm()).epsilon(1e-13));
            CHECK(std::abs(off.dot(c.t1)) < 1e-12);
            CHECK((c.n + off.normalized()).norm() < 1e-12);
        }
    }
}

TEST_CASE("rows in a bore are derivatives of gap and slip for all unknowns of both")
{
    for (double out_outer : {3.1, 7.9}) {
        InBore s(6.3, out_outer, 0.3);
        const NestingStart start = s.now();
        const auto here = s.contacts(start);
        REQUIRE(!here.empty());
        const double h = 1e-6;
        double gap = 0, slip = 0;
        for_unknowns(s, [&](int which, int node, int unknown) {
            Wire& w = s.wire(which);
            const WireState keep = w.state;
            std::vector<NestedContact> side[2];
            for (int k : {0, 1}) {
                move_wire(w, unit_increment(w, node, unknown), k ? h : -h);
                side[k] = s.contacts(start);
                w.state = keep;
            }
            REQUIRE(side[0].size() == here.size());
            REQUIRE(side[1].size() == here.size());
            for (std::size_t c = 0; c < here.size(); ++c) {
                const Candidate &a = here[c].on_inner, &up = side[1][c].on_inner,
                                &down = side[0][c].on_inner;
                gap = std::max(gap, std::abs((up.gap - down.gap) / (2 * h) -
                                             nested_row_value(here[c], which, a.hn, here[c].hn,
                                                              node, unknown)));
                // Slip from the start itself: its frame does not matter yet.
                for (int i : {0, 1})
                    slip = std::max(slip, std::abs((up.slip[i] - down.slip[i]) / (2 * h) -
                                                   nested_row_value(here[c], which, a.ht[i],
                                                                    here[c].ht[i], node, unknown)));
            }
        });
        CHECK(gap < 1e-8);
        CHECK(slip < 0.12 * 0.1); // the bore times the bend of an element, as on a wall
    }
}

TEST_CASE("the tangent in a bore is the derivative of its forces")
{
    // With friction its force and its arm turn with the contact.
    for (const double friction : {0.0, 0.5})
        for (const double out_outer : {3.1, 7.9}) {
            CAPTURE(friction);
            InBore s(6.3, out_outer, friction);
            const NestingStart start = s.now();
            for (Reaction& r : s.nesting.reaction)
                r.normal = 0.7;
            if (friction > 0)
                for (const NestedContact& k : s.contacts(start))
                    s.nesting.reaction[std::size_t(k.on_inner.index)].tangential =
                        0.2 * k.on_inner.t1 + 0.15 * k.on_inner.t2;
            const auto here = s.contacts(start);
            REQUIRE(!here.empty());
            for (std::size_t c = 0; c < here.size(); ++c)
                check_tangent(s, start, here, c);
        }
}
