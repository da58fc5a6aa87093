#include "contact/surface/choose_slave.hpp"

#include "contact/tests/contact_surfaces.hpp"

#include <doctest/doctest.h>
#include <limits>

using namespace amontons;
using namespace amontons::test;

namespace {

bool first(const TouchingBody& a, double Ea, const TouchingBody& b, double Eb,
           bool covered_first = false)
{
    return first_is_slave(a.surface, a.mesh.nodes, Ea, b.surface, b.mesh.nodes, Eb, covered_first);
}

} // namespace

TEST_CASE("the coarser surface is the slave or the softer at a contrast of 30 and the order does "
          "not matter")
{
    for (const ElementKind a : kKinds)
        for (const ElementKind b : kKinds) {
            const TouchingBody coarse = box_body(a, {0, 0, 0.1}, {1, 1, 1}, {3, 3, 3});
            const TouchingBody fine = box_body(b, {-1, -1, -1}, {2, 2, 0}, {30, 30, 3});
            const double inf = std::numeric_limits<double>::infinity();
            const struct {
                double of_coarse, of_fine;
                bool coarse_is_slave;
            } cases[] = {{1, 1, true},   {20, 1, true},   {1, 20, true},  {40, 1, false},
                         {1, 40, true},  {1e6, 1, false}, {1, 1e6, true}, {inf, 1, false},
                         {1, inf, true}, {inf, inf, true}};
            for (const auto& c : cases) {
                CHECK(first(coarse, c.of_coarse, fine, c.of_fine) == c.coarse_is_slave);
                CHECK(first(fine, c.of_fine, coarse, c.of_coarse) == !c.coarse_is_slave);
            }
        }
}

TEST_CASE("of equal surfaces the softer one, otherwise the first")
{
    const TouchingBody upper = box_body(ElementKind::H8, {0, 0, 0}, {1, 1, 1}, {3, 3, 3});
    const TouchingBody lower = box_body(ElementKind::H8, {0, 0, -1}, {1, 1, 0}, {3, 3, 3});
    CHECK(first(upper, 1, lower, 2));
    CHECK(!first(upper, 2, lower, 1));
    CHECK(first(upper, 1, lower, 1));
    CHECK(first(lower, 1, upper, 1));
}

TEST_CASE("what counts is the mesh near the other body")
{
    // Fine below, where the lower block is, and coarse above: on the whole coarser than the lower.
    SolidBoxOptions box;
    box.cells = {4, 4, 1};
    box.kind = ElementKind::H8;
    VolumeMesh mesh = make_solid_box(box);
    const auto count = static_cast<std::int32_t>(mesh.nodes.size());
    box.lowest.z() = -0.1;
    box.highest.z() = 0;
    box.cells = {20, 20, 1};
    const VolumeMesh below = make_solid_box(box);
    for (const Vec3& x : below.nodes)
        mesh.nodes.push_back(x);
    for (const std::int32_t n : below.blocks[0].nodes)
        mesh.blocks[0].nodes.push_back(n + count);
    const TouchingBody upper = with_surface(mesh);
    const TouchingBody lower = box_body(ElementKind::H8, {0, 0, -1}, {1, 1, -0.11}, {9, 9, 1});
    CHECK(!first(upper, 1, lower, 1));
    CHECK(first(lower, 1, upper, 1));
}

TEST_CASE("the choice does not change where both are turned")
{
    // Boxes around turned bodies take in more faces, of other sizes.
    for (const ElementKind kind : kKinds)
        for (int i = 0; i < 20; ++i) {
            CAPTURE(i);
            TouchingBody lower = box_body(kind, {0, 0, -0.13}, {0.14, 0.18, 0}, {3, 3, 3});
            TouchingBody upper =
                box_body(kind, {0.02, 0.03, 0}, {0.12, 0.155, 0.06 + 0.01 * i}, {2, 2, 2});
            const bool as_it_is = first(lower, 1, upper, 3);
            lower.move(turn(0.3 + i, {0.3, -0.8, 0.1 * i}));
            upper.move(turn(0.3 + i, {0.3, -0.8, 0.1 * i}));
            CHECK(first(lower, 1, upper, 3) == as_it_is);
        }
}

TEST_CASE(
    "a side that the other covers wholly is the slave though it is finer, up to a factor of 4")
{
    for (const ElementKind kind : kKinds) {
        const TouchingBody wide = box_body(kind, {0, 0, -0.5}, {1, 1, 0}, {10, 10, 4});
        const auto end_at = [&](double x, std::int32_t cells) {
            return box_body(kind, {x, 0.3, 0.01}, {x + 0.4, 0.7, 0.4}, {cells, cells, 4});
        };
        CHECK(first(end_at(0.3, 6), 1, wide, 1, true));
        CHECK(!first(wide, 1, end_at(0.3, 6), 1, true));
        CHECK(!first(end_at(0.3, 20), 1, wide, 1, true)); // far finer
        CHECK(first(wide, 1, end_at(0.3, 20), 1, true));
        CHECK(!first(end_at(0.8, 6), 1, wide, 1, true)); // hangs over
        CHECK(first(wide, 1, end_at(0.8, 6), 1, true));
    }
}
