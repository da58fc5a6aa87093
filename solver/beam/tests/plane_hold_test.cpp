#include "solver/beam/plane_hold.hpp"

#include "mesh/tests/relative.hpp"
#include "mesh/wall.hpp"
#include "solver/beam/tests/random_wire.hpp"

#include <cmath>
#include <doctest/doctest.h>

using namespace amontons;

namespace {

/// A wire in a skew plane, bent at random within it, natural curvature of the tip in it too.
Wire planar_wire(unsigned seed)
{
    test::RandomNumbers random(seed);
    std::vector<BeamSegment> segments = test::three_segments();
    segments.back().curvature_angle = 0;
    Wire w;
    w.material = make_material(segments, 0.2);
    Sheath s;
    s.end = {0.3, -0.2, 0.1};
    Quaternion q;
    rotate_in_body(q.q, {0.4, -0.9, 0.3});
    s.frame = rotation_matrix(q.q);
    w.sheath = s;
    w.plane = s.frame.col(2);
    w.state.reaction.assign(w.material.point.size(), {});
    start_in_sheath(w, 7.2, 0);
    for (int i = w.state.first + 1; i <= w.last(); ++i) {
        BeamNode& n = w.state.nodes[std::size_t(i)];
        const Vec3 d = s.frame * Vec3(random(1e-4), random(1e-4), 0);
        for (int k = 0; k < 3; ++k)
            n.move(k, d[k]);
        rotate_in_body(n.q, Vec3(0, 0, random(0.01)));
    }
    return w;
}

double out_of(const Vec3& plane, const Node6& n)
{
    const double along = plane[0] * n.value[0] + plane[1] * n.value[1] + plane[2] * n.value[2];
    return std::max({std::abs(along), std::abs(n.value[3]), std::abs(n.value[4])});
}

} // namespace

TEST_CASE("what is pushed out of the plane moves nothing and in the plane the wire is the same")
{
    const Wire w = planar_wire(3);
    const std::size_t nodes = w.material.node.size();
    BlockTridiagonal free(w.last() + 1), held(w.last() + 1);
    std::vector<Node6> gradient(nodes);
    std::vector<ElementLaw> laws = w.material.law;
    for (BlockTridiagonal* K : {&free, &held}) {
        K->set_first(w.state.first);
        K->set_zero();
        for (Node6& n : gradient)
            n.column = Column6{};
        assemble_wire(w, laws, *K, gradient);
    }
    hold_in_plane(w, held, gradient);
    test::RandomNumbers random(4);
    std::vector<Node6> in(nodes), x(nodes);
    for (std::size_t i = 0; i < nodes; ++i) {
        in[i].column = Column6{};
        if (int(i) <= w.state.first) continue;
        const Vec3 f = w.sheath->frame * Vec3(random(), random(), 0);
        for (int k = 0; k < 3; ++k)
            in[i].value[k] = f[k];
        in[i].value[5] = random();
    }
    REQUIRE(held.factor(w.state.first) == 0);
    x = in;
    held.solve(x);
    double size = 0, out = 0;
    for (int i = w.state.first; i <= w.last(); ++i)
        for (int k = 0; k < 6; ++k)
            size = std::max(size, std::abs(x[std::size_t(i)].value[k]));
    for (int i = w.state.first + 1; i <= w.last(); ++i)
        out = std::max(out, out_of(*w.plane, x[std::size_t(i)]));
    CHECK(out < 1e-14 * size);

    // The full wire answers loads in the plane with the same motion: it is symmetric about it.
    free.factor(w.state.first);
    std::vector<Node6> y = in;
    free.solve(y);
    for (int i = w.state.first; i <= w.last(); ++i)
        for (int k = 0; k < 6; ++k)
            CHECK(std::abs(x[std::size_t(i)].value[k] - y[std::size_t(i)].value[k]) < 1e-9 * size);

    for (int i = w.state.first; i <= w.last(); ++i)
        CHECK(out_of(i > w.state.first ? *w.plane : Vec3(Vec3::Zero()), gradient[std::size_t(i)]) <
              1e-12);
}

TEST_CASE("friction across the plane is none and rows of contact lie in the plane")
{
    Wire w = planar_wire(5);
    // A wall below the wire, across the plane's second axis.
    const Vec3 up = w.sheath->frame.col(1);
    const Wall wall = make_plane_wall(w.sheath->end - 0.3 * up, up);
    std::vector<WireWall> walls(1);
    walls[0].wall = &wall;
    walls[0].friction.assign(w.material.point.size(), 0.3);
    const StepStart start = mark_step_start(w);
    for (int i = w.state.first + 1; i <= w.last(); ++i)
        for (int k = 0; k < 3; ++k)
            w.state.nodes[std::size_t(i)].move(k,
                                               0.01 * w.sheath->frame(k, 0) + 1e-3 * (*w.plane)[k]);
    for (Reaction& r : w.state.reaction)
        r = {1, 0.1 * w.sheath->frame.col(0) + 0.2 * *w.plane, false, {}};
    std::vector<Proximity> proximity(w.material.point.size());
    std::vector<Candidate> candidates;
    find_candidates(w, walls, start, 10, proximity, candidates);
    REQUIRE(candidates.size() > 10);
    for (const Candidate& c : candidates) {
        if (c.place.element > w.state.first) // the whole of it was moved by 10 mm in the plane
            CHECK(std::hypot(c.slip[0], c.slip[1]) == test::relative(0.01).epsilon(0.01));
        CHECK(std::hypot(c.tangential[0], c.tangential[1]) == test::relative(0.1).epsilon(1e-12));
        for (const ContactRow* row : {&c.hn, &c.ht[0], &c.ht[1]}) {
            CHECK(out_of(*w.plane, row->b) < 1e-15);
            if (c.place.element > w.state.first) CHECK(out_of(*w.plane, row->a) < 1e-15);
        }
    }
}
