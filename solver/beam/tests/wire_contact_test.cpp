#include "solver/beam/wire_contact.hpp"

#include "mesh/distance_field.hpp"
#include "mesh/tests/relative.hpp"
#include "solver/beam/tests/random_wire.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <doctest/doctest.h>

using namespace amontons;
using test::is_free;
using test::moved_wire;

namespace {

/// A bent wire, clamped or in its sheath, in a ball that it touches here and there.
struct InBall {
    Wire wire;
    Wall wall = make_ball_wall(Vec3(2, 0.5, -0.5), 4, true);
    std::vector<WireWall> walls;
    explicit InBall(double bend, unsigned seed) : wire(test::shaken_wire(6.3, 0, seed))
    {
        test::RandomNumbers random(seed);
        start_in_sheath(wire, 6.3, 0.1);
        for (int i = wire.state.first + 1; i <= wire.last(); ++i)
            test::shake(wire.state.nodes[std::size_t(i)], random, 0.3 * bend, bend);
        walls.resize(1);
        walls[0].wall = &wall;
        walls[0].friction.assign(wire.material.point.size(), 0.4);
    }
    InBall(const InBall&) = delete;
};

std::vector<Candidate> candidates_of(const InBall& s, const Wire& w, const StepStart& start)
{
    std::vector<Proximity> proximity(w.material.point.size());
    std::vector<Candidate> c;
    find_candidates(w, s.walls, start, 100, proximity, c);
    return c;
}

double row_value(const Candidate& c, const ContactRow& row, int node, int unknown)
{
    if (node == c.place.element) return row.a.value[unknown];
    if (node == c.place.element + 1) return row.b.value[unknown];
    return 0;
}

} // namespace

TEST_CASE("a contact's gap is the distance of the wire's surface and its frame orthonormal")
{
    const InBall s(0.2, 3);
    const std::vector<Candidate> all = candidates_of(s, s.wire, mark_step_start(s.wire));
    REQUIRE(!all.empty());
    for (const Candidate& c : all) {
        CHECK(c.gap == test::relative(4 - (c.x - Vec3(2, 0.5, -0.5)).norm() - 0.05));
        CHECK(std::abs(c.n.norm() - 1) < 1e-14);
        CHECK(std::abs(c.t1.norm() - 1) < 1e-14);
        CHECK((c.n.cross(c.t1) - c.t2).norm() < 1e-14);
    }
}

TEST_CASE("gap rows are the derivatives of the gap in every element and for the sheath")
{
    const InBall s(0.2, 4);
    const StepStart start = mark_step_start(s.wire);
    const auto here = candidates_of(s, s.wire, start);
    REQUIRE(!here.empty());
    const double h = 1e-6;
    double wrong = 0;
    for (int i = s.wire.state.first; i <= s.wire.last(); ++i)
        for (int k = 0; k < 6; ++k) {
            if (!is_free(s.wire, i, k)) continue;
            const auto up = candidates_of(s, moved_wire(s.wire, i, k, h), start);
            const auto down = candidates_of(s, moved_wire(s.wire, i, k, -h), start);
            REQUIRE(up.size() == here.size());
            REQUIRE(down.size() == here.size());
            for (std::size_t c = 0; c < here.size(); ++c)
                wrong = std::max(wrong, std::abs((up[c].gap - down[c].gap) / (2 * h) -
                                                 row_value(here[c], here[c].hn, i, k)));
        }
    CHECK(wrong < 1e-8);
}

TEST_CASE("in contact the gap's row is its derivative also where a sampled distance is too steep")
{
    // 1.3 times the distance from a skew plane that the wire's middle point touches
    struct Steep : DistanceSource {
        Vec3 normal, point;
        void sample_cube(const Vec3& corner, const Mat3& edges, int n,
                         double* out) const override
        {
            for (int i = 0; i < n; ++i)
                for (int j = 0; j < n; ++j)
                    for (int k = 0; k < n; ++k)
                        *out++ = 1.3 * normal.dot(corner + edges * Vec3(i, j, k) - point);
        }
    };
    InBall s(0.2, 6);
    const StepStart start = mark_step_start(s.wire);
    const std::size_t middle = 12;
    const Candidate at = candidates_of(s, s.wire, start)[middle];
    auto source = std::make_unique<Steep>();
    source->normal = Vec3(0.3, -0.8, 0.5).normalized();
    source->point = at.x - at.radius / 1.3 * source->normal;
    const Wall steep = make_wall(DistanceField(std::move(source), Vec3::Zero(), 0.5));
    s.walls[0].wall = &steep;
    const Candidate here = candidates_of(s, s.wire, start)[middle];
    REQUIRE(std::abs(here.gap) < 1e-12);
    const double h = 1e-6;
    for (int i : {here.place.element, here.place.element + 1})
        for (int k = 0; k < 6; ++k) {
            const double up = candidates_of(s, moved_wire(s.wire, i, k, h), start)[middle].gap;
            const double down = candidates_of(s, moved_wire(s.wire, i, k, -h), start)[middle].gap;
            CHECK(std::abs((up - down) / (2 * h) - row_value(here, here.hn, i, k)) < 1e-8);
        }
}

// The section between two nodes turns by the interpolated rotation; the rows take the two
// nodes' spins in proportion, which differs by a share of the element's bend, on an arm as short
// as the radius.
TEST_CASE(
    "slip rows are the derivatives of the surface's slip up to an element's bend times the radius")
{
    const double h = 1e-6;
    for (double bend : {0.0, 0.02, 0.04, 0.08}) {
        CAPTURE(bend);
        const InBall s(bend, 5);
        const StepStart start = mark_step_start(s.wire);
        const auto here = candidates_of(s, s.wire, start);
        double wrong = 0, largest_turn = 0;
        for (int i = s.wire.state.first; i <= s.wire.last(); ++i)
            for (int k = 0; k < 6; ++k) {
                if (!is_free(s.wire, i, k)) continue;
                const auto up = candidates_of(s, moved_wire(s.wire, i, k, h), start);
                const auto down = candidates_of(s, moved_wire(s.wire, i, k, -h), start);
                REQUIRE(up.size() == here.size());
                REQUIRE(down.size() == here.size());
                for (std::size_t c = 0; c < here.size(); ++c)
                    for (int t = 0; t < 2; ++t) {
                        const double exact = (up[c].slip[t] - down[c].slip[t]) / (2 * h);
                        const double got = row_value(here[c], here[c].ht[t], i, k);
                        wrong = std::max(wrong, std::abs(exact - got));
                        if (k == 3) largest_turn = std::max(largest_turn, std::abs(exact));
                    }
            }
        // The tip's curve alone bends an element by 0.2 rad.
        CHECK(wrong < 0.05 * (0.03 + 1.6 * bend));
        CHECK(largest_turn > 0.04); // the wire's rotation slides its surface: radius 0.05
    }
}

TEST_CASE("a wire that only turns about itself slips around: twist times radius and nothing along")
{
    // A plane below a straight wire.
    Wire w;
    BeamSegment g = test::three_segments()[0];
    w.material = make_material({g}, 0.25);
    w.sheath = Sheath{};
    w.state.reaction.assign(w.material.point.size(), {});
    start_in_sheath(w, 3, 0);
    const Wall plane = make_plane_wall(Vec3(0, 0, -0.05), Vec3::UnitZ());
    std::vector<WireWall> walls(1);
    walls[0].wall = &plane;
    walls[0].friction.assign(w.material.point.size(), 0.3);
    const StepStart start = mark_step_start(w);
    for (int i = w.state.first + 1; i <= w.last(); ++i)
        rotate_in_body(w.state.nodes[std::size_t(i)].q, 0.2 * Vec3::UnitX());
    std::vector<Proximity> proximity(w.material.point.size());
    std::vector<Candidate> c;
    find_candidates(w, walls, start, 0.1, proximity, c);
    REQUIRE(c.size() > 8);
    for (std::size_t k = 0; k < 8; ++k) { // beyond the growing element
        const Vec3 slip = c[k].slip[0] * c[k].t1 + c[k].slip[1] * c[k].t2;
        CHECK(std::abs(slip.x()) < 1e-14);
        CHECK(std::abs(slip.z()) < 1e-14);
        // The point at the wall now came there along the arc: its chord's tangential part.
        CHECK(slip.y() == test::relative(0.05 * std::sin(0.2)).epsilon(1e-12));
        CHECK(std::abs(c[k].gap) < 1e-14);
    }
}

TEST_CASE("the tangent of the reactions is the derivative of their force with the geometry")
{
    // Frictionless: the force r_n n turns with the wall's normal and the point's place.
    InBall s(0.1, 6);
    s.walls[0].friction.assign(s.wire.material.point.size(), 0);
    for (std::size_t p = 0; p < s.wire.state.reaction.size(); ++p)
        s.wire.state.reaction[p].normal = 1 + 0.1 * double(p % 7);
    const StepStart start = mark_step_start(s.wire);
    const auto assemble = [&](const Wire& w, BlockTridiagonal& K) {
        std::vector<Node6> g(w.material.node.size());
        for (Node6& n : g)
            n.column = Column6{};
        K.set_first(w.state.first);
        K.set_zero();
        assemble_reactions(w, candidates_of(s, w, start), K, g);
        return g;
    };
    BlockTridiagonal K(s.wire.last() + 1), other(s.wire.last() + 1);
    const auto g = assemble(s.wire, K);
    const double h = 1e-6;
    double wrong = 0, largest = 0;
    // Beyond the growing element, whose own second derivatives are left out of the tangent.
    for (int j = s.wire.state.first + 2; j <= s.wire.last(); ++j)
        for (int b = 0; b < 6; ++b) {
            const auto up = assemble(moved_wire(s.wire, j, b, h), other);
            const auto down = assemble(moved_wire(s.wire, j, b, -h), other);
            for (int i = std::max(s.wire.state.first + 2, j - 1);
                 i <= std::min(s.wire.last(), j + 1); ++i)
                for (int a = 0; a < 6; ++a) {
                    const std::size_t row = std::size_t(i);
                    double exact = (up[row].value[a] - down[row].value[a]) / (2 * h);
                    if (i == j && a >= 3 && b >= 3) {
                        const double* v = g[row].value;
                        exact -=
                            0.5 *
                            Vec3(v[3], v[4], v[5]).dot(Vec3::Unit(b - 3).cross(Vec3::Unit(a - 3)));
                    }
                    const double got = i == j  ? K.diagonal(i)(a, b)
                                       : i < j ? K.upper(i)(a, b)
                                               : K.lower(j)(a, b);
                    largest = std::max(largest, std::abs(exact));
                    wrong = std::max(wrong, std::abs(exact - got));
                }
        }
    CHECK(wrong < 1e-7 * largest);
}
