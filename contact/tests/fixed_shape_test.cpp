#include "contact/surface/fixed_shape.hpp"

#include "contact/tests/contact_surfaces.hpp"

#include <algorithm>
#include <doctest/doctest.h>
#include <string>

using namespace amontons;
using namespace amontons::test;

namespace {

/// A ball of radius 1 or a box, of triangles.
TouchingBody body_of_triangles(bool round, std::int32_t cells)
{
    if (!round)
        return box_body(ElementKind::T4, {-0.8, -0.8, -0.8}, {0.8, 0.8, 0.8},
                        {cells, cells, cells});
    SolidBallOptions options;
    options.radius = 1;
    options.cells = cells;
    options.kind = ElementKind::T4;
    return with_surface(make_solid_ball(options));
}

/// A block that is a little out of shape, its upper side near the lowest place of the body.
TouchingBody bent_block(ElementKind kind, double out_of_shape)
{
    TouchingBody block = box_body(kind, {-0.9, -0.8, -0.5}, {0.7, 0.9, 0}, {4, 4, 2});
    std::mt19937 random(7);
    std::uniform_real_distribution<double> off(-out_of_shape, out_of_shape);
    for (Vec3& x : block.mesh.nodes)
        x += Vec3(off(random), off(random), 0.3 * off(random));
    return block;
}

} // namespace

TEST_CASE("a surface that does not bend has the contacts of one that may")
{
    for (const ElementKind kind : kKinds)
        for (const bool round : {true, false})
            for (const std::int32_t cells : {6, 24}) {
                CAPTURE(std::string(shape_of(kind).name));
                CAPTURE(round);
                CAPTURE(cells);
                const TouchingBody master = body_of_triangles(round, cells);
                TouchingBody slave = bent_block(kind, 0.02);
                slave.move(turn(0.3, {1, 0.5, 0.2}, {0.1, 0.05, round ? -1 : -0.85}));
                const SharpFeatures sharp = sharp_features(master.surface, master.mesh.nodes);
                const FixedShape fixed(master.surface, sharp, master.mesh.nodes);
                MortarOptions options;
                options.reach = 0.2;
                options.master_normals = options.smooth_normals = true;
                const SurfaceContacts expected = mortar_contacts(
                    slave.surface, slave.mesh.nodes, master.surface, master.mesh.nodes, options);
                const SurfaceContacts found =
                    mortar_contacts(slave.surface, slave.mesh.nodes, fixed, options);
                REQUIRE(expected.contact.size() >= 4);
                REQUIRE(found.contact.size() == expected.contact.size());
                for (std::size_t i = 0; i < found.contact.size(); ++i) {
                    const SurfaceContact &a = expected.contact[i], &b = found.contact[i];
                    CHECK(a.id == b.id);
                    // Small segments of triangles are integrated to 1e-7, normals between corners
                    // that differ much to what the rule leaves of their length.
                    const double tolerance = round && cells == 6 ? 2e-4 : 1e-5;
                    CHECK(std::abs(a.area - b.area) < 1e-7 * a.area);
                    CHECK((a.normal - b.normal).norm() < tolerance);
                    CHECK((a.point - b.point).norm() < 1e-6);
                    CHECK(std::abs(a.gap - b.gap) < tolerance);
                    CHECK(b.master_end == b.master_begin);
                }
            }
}

TEST_CASE("sharp features touch a surface that does not bend as one that may")
{
    for (const ElementKind kind : kKinds)
        for (const double tilt : {0.0, 0.4, 0.75}) {
            CAPTURE(std::string(shape_of(kind).name));
            CAPTURE(tilt);
            const TouchingBody master = body_of_triangles(false, 5);
            TouchingBody slave = bent_block(kind, 0);
            slave.move(turn(tilt, {1, 0.5, 0.2}, {0.35, 0.25, -0.85}));
            const SharpFeatures of_master = sharp_features(master.surface, master.mesh.nodes),
                                of_slave = sharp_features(slave.surface, slave.mesh.nodes);
            const FixedShape fixed(master.surface, of_master, master.mesh.nodes);
            const SharpSurface own{slave.surface, of_slave, slave.mesh.nodes},
                other{master.surface, of_master, master.mesh.nodes};
            SharpSurface other_fixed = other;
            other_fixed.fixed = &fixed;
            const SurfaceContacts expected = sharp_contacts(own, other, 0.3),
                                  found = sharp_contacts(own, other_fixed, 0.3);
            if (tilt > 0.2) REQUIRE(!expected.contact.empty());
            REQUIRE(found.contact.size() == expected.contact.size());
            for (std::size_t i = 0; i < found.contact.size(); ++i) {
                CHECK(found.contact[i].id == expected.contact[i].id);
                CHECK(found.contact[i].gap == expected.contact[i].gap);
                CHECK(found.contact[i].normal == expected.contact[i].normal);
                CHECK(found.contact[i].point == expected.contact[i].point);
            }
        }
}

TEST_CASE(
    "the normal at a place does not jump across smooth edges, and there is none on sharp ones")
{
    for (const bool round : {true, false}) {
        CAPTURE(round);
        const TouchingBody body = body_of_triangles(round, round ? 12 : 2);
        const std::vector<Vec3>& x = body.mesh.nodes;
        const SharpFeatures sharp = sharp_features(body.surface, x);
        const FixedShape shape(body.surface, sharp, x);
        const FacetedSurface flat(body.surface);
        const auto place_at = [&](const FacetedSurface::Triangle& t, const Vec3& p) {
            return closest_on_triangle(p, x[std::size_t(t.nodes[0])], x[std::size_t(t.nodes[1])],
                                       x[std::size_t(t.nodes[2])]);
        };
        int smooth_edges = 0, sharp_edges = 0;
        for (const FacetedSurface::Triangle& t : flat.triangles()) {
            const Vec3 &a = x[std::size_t(t.nodes[0])], &b = x[std::size_t(t.nodes[1])],
                       &c = x[std::size_t(t.nodes[2])];
            const Vec3 own = (b - a).cross(c - a).normalized();
            const auto inside = smooth_normal_at(shape, flat, t.face, place_at(t, (a + b + c) / 3));
            REQUIRE(inside);
            CHECK(inside->dot(own) > (round ? 0.98 : 1 - 1e-12));
            for (std::size_t k = 0; k < 3; ++k) {
                const FacetedSurface::Triangle& other = flat.triangles()[std::size_t(t.beside[k])];
                const Vec3 &p = x[std::size_t(t.nodes[k])],
                           &q = x[std::size_t(t.nodes[(k + 1) % 3])];
                const Vec3 on = 0.7 * p + 0.3 * q;
                TrianglePoint here = place_at(t, on), there = place_at(other, on);
                here.feature = TriangleFeature(int(TriangleFeature::edge0) + int(k));
                const auto back = std::ranges::find(other.beside, t.face) - other.beside.begin();
                there.feature = TriangleFeature(int(TriangleFeature::edge0) + int(back));
                const auto n = smooth_normal_at(shape, flat, t.face, here),
                           m = smooth_normal_at(shape, flat, other.face, there);
                CHECK(n.has_value() == m.has_value());
                if (n && m) {
                    ++smooth_edges;
                    CHECK((*n - *m).norm() < 1e-12);
                } else {
                    ++sharp_edges;
                    const Vec3 d = x[std::size_t(other.nodes[1])] - x[std::size_t(other.nodes[0])],
                               e = x[std::size_t(other.nodes[2])] - x[std::size_t(other.nodes[0])];
                    CHECK(d.cross(e).normalized().dot(own) < 0.5);
                }
            }
        }
        CHECK(smooth_edges > 0);
        CHECK((sharp_edges == 0) == round);
    }
}
