#include "contact/surface/smooth_normals.hpp"

#include "contact/tests/contact_surfaces.hpp"

#include <doctest/doctest.h>
#include <map>
#include <string>

using namespace amontons;
using namespace amontons::test;

namespace {

constexpr ElementKind kFlatKinds[] = {ElementKind::T4, ElementKind::H8};

TouchingBody round_ball(ElementKind kind, std::int32_t cells)
{
    SolidBallOptions options;
    options.radius = 1;
    options.cells = cells;
    options.kind = kind;
    return with_surface(make_solid_ball(options));
}

/// A node over the side of an upright cylinder, at an angle around it, and the normal of its
/// contact: by the nearest point of the cylinder's facets.
Vec3 normal_at(const TouchingBody& cylinder, double angle, bool smooth)
{
    TouchingBody tip = box_body(ElementKind::H8, {-0.01, -0.01, 0}, {0, 0, 0.01}, {1, 1, 1});
    tip.move(turn(angle, Vec3::UnitZ(), {1.03 * std::cos(angle), 1.03 * std::sin(angle), 0.5}) *
             turn(3.141592653589793, Vec3::UnitZ()));
    const SurfaceContacts contacts = mortar_contacts(tip.surface, tip.mesh.nodes, cylinder.surface,
                                                     cylinder.mesh.nodes, {0.2, true, smooth});
    REQUIRE(!contacts.contact.empty());
    return contacts.contact[0].normal;
}

} // namespace

TEST_CASE("normals of a faceted ball are nearer to those of the sphere than the facets' own" *
          doctest::test_suite("slow"))
{
    for (const ElementKind kind : kFlatKinds) {
        CAPTURE(std::string(shape_of(kind).name));
        double last = 0;
        for (const std::int32_t cells : {16, 32, 64}) {
            const TouchingBody body = round_ball(kind, cells);
            const SmoothNormals normals(body.surface, body.mesh.nodes);
            double worst = 0, flat = 0;
            for (std::size_t f = 0; f < body.surface.faces.size(); ++f) {
                const auto nodes = body.surface.face(f);
                const int n = static_cast<int>(nodes.size());
                const FaceInPlane face(nodes, body.mesh.nodes);
                const auto number = static_cast<std::int32_t>(f);
                CHECK(normals.has(number));
                for (const QuadraturePoint& p : n == 4 ? square_points(3) : triangle_points(5)) {
                    const FaceSpot at = spot(face, p.xi.head<2>());
                    const Vec3 normal = normals.normal(number, at.values);
                    CHECK(std::abs(normal.norm() - 1) < 1e-14);
                    worst = std::max(worst, (normal - at.place.normalized()).norm());
                    const Vec3 own = at.along[0].cross(at.along[1]).normalized();
                    flat = std::max(flat, (own - at.place.normalized()).norm());
                }
            }
            MESSAGE(cells << ": " << worst << ", facets " << flat);
            CHECK(worst < 0.5 * flat);                // [regression] of these meshes
            if (last > 0) CHECK(worst < 0.75 * last); // [regression] of these meshes
            last = worst;
        }
        CHECK(last < 0.01); // [regression] of the finest mesh
    }
}

TEST_CASE("sharp edges stay sharp: a box has the normals of its faces")
{
    for (const ElementKind kind : kFlatKinds) {
        TouchingBody body = box_body(kind, {0, 0, 0}, {1, 1, 1}, {3, 2, 4});
        body.move(anywhere());
        const SmoothNormals normals(body.surface, body.mesh.nodes);
        const std::vector<Facet> facets = facets_of(body.surface, body.mesh.nodes);
        REQUIRE(facets.size() >= 52); // of 2 (3 2 + 2 4 + 4 3) cells' sides
        for (const Facet& facet : facets) {
            const Vec2 corner = facet.xi[0];
            const PerNode N = shape_values(facet.corners, corner);
            CHECK((normals.normal(facet.face, N) - facet.normal).norm() < 1e-14);
        }
    }
}

TEST_CASE(
    "what is sharp can be chosen and a corner's normal does not depend on how its faces are split")
{
    for (const ElementKind kind : kFlatKinds) {
        CAPTURE(std::string(shape_of(kind).name));
        const TouchingBody body = box_body(kind, {0, 0, 0}, {1, 1, 1}, {1, 1, 1});
        const SmoothNormals round(body.surface, body.mesh.nodes, 2);
        const std::vector<Facet> facets = facets_of(body.surface, body.mesh.nodes);
        REQUIRE(facets.size() >= 6);
        for (const Facet& facet : facets)
            for (int i = 0; i < facet.corners; ++i) {
                const PerNode N =
                    shape_values(facet.corners, facet.xi[static_cast<std::size_t>(i)]);
                const Vec3 normal = round.normal(facet.face, N);
                CHECK((normal.cwiseAbs() - Vec3::Constant(std::sqrt(1.0 / 3))).norm() < 1e-14);
            }
    }
}

TEST_CASE("normals of T6 are those of a ball to the order of its faces and do not jump at sides")
{
    // Own normals of a quadratic face are off by O(h^2) across its sides; nodes lie on the ball.
    double before = 0;
    for (const int cells : {8, 16}) {
        const TouchingBody body = round_ball(ElementKind::T10, cells);
        const SmoothNormals normals(body.surface, body.mesh.nodes);
        std::map<std::int32_t, Vec3> of_node;
        double worst = 0;
        for (std::size_t f = 0; f < body.surface.faces.size(); ++f) {
            const auto nodes = body.surface.face(f);
            REQUIRE(nodes.size() == 6);
            REQUIRE(normals.has(static_cast<std::int32_t>(f)));
            for (int k = 0; k < 6; ++k) {
                const Vec3& n = normals.corner(static_cast<std::int32_t>(f), k);
                const std::int32_t node = nodes[static_cast<std::size_t>(k)];
                const auto [at, is_new] = of_node.try_emplace(node, n);
                CHECK((at->second - n).norm() < 1e-14);
                const Vec3 radial = body.mesh.nodes[static_cast<std::size_t>(node)].normalized();
                worst = std::max(worst, (n - radial).norm());
            }
        }
        MESSAGE(worst);
        if (before > 0) CHECK(worst < 0.35 * before);
        before = worst;
    }
}

TEST_CASE("a box of T6 keeps its edges sharp and its sides flat")
{
    const TouchingBody body = box_body(ElementKind::T10, {0, 0, 0}, {1, 2, 3}, {2, 3, 2});
    const SmoothNormals normals(body.surface, body.mesh.nodes);
    for (const Facet& facet : facets_of(body.surface, body.mesh.nodes))
        for (int k = 0; k < 6; ++k)
            CHECK((normals.corner(facet.face, k) - facet.normal).norm() < 1e-14);
}

TEST_CASE("the normal does not jump where a contact slides over facets")
{
    for (const ElementKind kind : kFlatKinds) {
        CAPTURE(std::string(shape_of(kind).name));
        SolidCylinderOptions options;
        options.radius = 1;
        options.length = 1;
        options.cells = 8;
        options.along = 3;
        options.kind = kind;
        const TouchingBody cylinder = with_surface(make_solid_cylinder(options));
        double jump[2] = {0, 0};
        for (const bool smooth : {false, true}) {
            Vec3 last = normal_at(cylinder, 0.3, smooth);
            for (int i = 1; i <= 300; ++i) {
                const Vec3 next = normal_at(cylinder, 0.3 + 1e-3 * i, smooth);
                jump[smooth] = std::max(jump[smooth], (next - last).norm());
                last = next;
            }
        }
        CHECK(jump[0] > 0.05);  // half the angle between two facets
        CHECK(jump[1] < 0.005); // a step turns the tip by 0.001
    }
}

TEST_CASE("smooth normals of a ball over a plane: tilts are nearer to those of the sphere")
{
    for (const ElementKind kind : kFlatKinds) {
        const TouchingBody slave = round_ball(kind, 16);
        const TouchingBody master = box_body(kind, {-2, -2, -2}, {2, 2, -1}, {7, 6, 1});
        double tilt[2] = {0, 0};
        for (const bool smooth : {false, true}) {
            const SurfaceContacts contacts =
                mortar_contacts(slave.surface, slave.mesh.nodes, master.surface, master.mesh.nodes,
                                {0.3, false, smooth});
            CHECK(contacts.contact.size() > 20);
            for (const SurfaceContact& c : contacts.contact) {
                const double t = std::acos(-slave.mesh.nodes[static_cast<std::size_t>(c.id)].z());
                if (t < 0.5)
                    tilt[smooth] =
                        std::max(tilt[smooth], std::abs(std::acos(c.normal.z()) - t / 2));
            }
        }
        MESSAGE(std::string(shape_of(kind).name) << " " << tilt[0] << " " << tilt[1]);
        CHECK(tilt[1] < tilt[0]);
    }
}

TEST_CASE("normals on demand are those of the whole surface, sharp where it is at rest")
{
    for (const ElementKind kind : kKinds) {
        CAPTURE(std::string(shape_of(kind).name));
        for (TouchingBody body :
             {round_ball(kind, 8), box_body(kind, {0, 0, 0}, {1, 1, 1}, {3, 2, 4})}) {
            const std::vector<Vec3> rest = body.mesh.nodes;
            for (Vec3& x : body.mesh.nodes)
                x.z() += 0.8 * std::abs(x.x() - 0.3);
            const SmoothNormals whole(body.surface, body.mesh.nodes, SmoothNormals::kSharp, rest);
            const SmoothGroups groups(body.surface, rest);
            SmoothNormalsOnDemand some(body.surface, body.mesh.nodes, groups);
            for (std::size_t f = 0; f < body.surface.faces.size(); f += 3) {
                PerNode values = PerNode::Zero();
                for (std::size_t k = 0; k < body.surface.face(f).size(); ++k)
                    values[Eigen::Index(k)] = 0.1 + 0.2 * double(k);
                const auto face = static_cast<std::int32_t>(f);
                const std::optional<Vec3> normal = some.normal(face, values);
                REQUIRE(normal.has_value());
                CHECK((*normal - whole.normal(face, values)).norm() < 1e-14);
            }
        }
    }
}
