#include "contact/surface/sharp_contacts.hpp"

#include "contact/tests/contact_surfaces.hpp"

#include <algorithm>
#include <doctest/doctest.h>
#include <map>
#include <numbers>
#include <set>
#include <string>

using namespace amontons;
using namespace amontons::test;

namespace {

struct Sharp {
    TouchingBody body;
    SharpFeatures sharp;

    SharpSurface now() const { return {body.surface, sharp, body.mesh.nodes}; }
};

Sharp sharp_body(TouchingBody body)
{
    SharpFeatures sharp = sharp_features(body.surface, body.mesh.nodes);
    return {std::move(body), std::move(sharp)};
}

constexpr double kHalf = 0.01; // of a bar's thickness [m]
const double kRidge = kHalf * std::numbers::sqrt2;

/// Bars along x and y, each on its edge, the upper's lower edge `gap` above the lower's upper one.
Sharp lower_bar(ElementKind kind, std::int32_t cells)
{
    TouchingBody b = box_body(kind, {-0.05, -kHalf, -kHalf}, {0.05, kHalf, kHalf}, {cells, 2, 2});
    b.move(turn(std::numbers::pi / 4, Vec3::UnitX()));
    return sharp_body(std::move(b));
}

Sharp upper_bar(ElementKind kind, std::int32_t cells, double gap, const Vec3& shift = Vec3::Zero())
{
    TouchingBody b = box_body(kind, {-kHalf, -0.05, -kHalf}, {kHalf, 0.05, kHalf}, {2, cells, 2});
    b.move(turn(std::numbers::pi / 4, Vec3::UnitY(), shift + Vec3(0, 0, 2 * kRidge + gap)));
    return sharp_body(std::move(b));
}

} // namespace

TEST_CASE("two crossed bars touch where their edges cross wherever nodes are")
{
    for (const ElementKind kind : kKinds)
        for (const std::int32_t cells : {1, 2, 5, 6})
            for (const double gap : {2e-4, 0.0, -3e-4}) {
                CAPTURE(std::string(shape_of(kind).name));
                CAPTURE(cells);
                CAPTURE(gap);
                const Vec3 shift(0.003, -0.002, 0);
                Sharp lower = lower_bar(kind, cells), upper = upper_bar(kind, cells, gap, shift);
                lower.body.move(anywhere());
                upper.body.move(anywhere());
                const SurfaceContacts found = sharp_contacts(upper.now(), lower.now(), 1e-3);
                REQUIRE(found.contact.size() == 1);
                const SurfaceContact& c = found.contact[0];
                // The upper's edge is at x = 0.003, the lower's at y = 0.
                const Vec3 up = anywhere().linear() * Vec3::UnitZ();
                CHECK((c.normal - up).norm() < 1e-13);
                CHECK(std::abs(c.gap - gap) < 1e-14);
                CHECK((c.point - anywhere() * Vec3(0.003, 0, kRidge + gap)).norm() < 1e-14);
                const Vec3 apart = weighted(found.slave(c), upper.body.mesh.nodes) -
                                   weighted(found.master(c), lower.body.mesh.nodes);
                CHECK((apart - gap * up).norm() < 1e-14);
                CHECK(sharp_contacts(upper.now(), lower.now(), 1e-4).contact.size() ==
                      (gap == 0 ? 1 : 0));
                // Seen from the other body.
                const SurfaceContacts back = sharp_contacts(lower.now(), upper.now(), 1e-3);
                REQUIRE(back.contact.size() == 1);
                CHECK((back.contact[0].normal + up).norm() < 1e-13);
                CHECK(std::abs(back.contact[0].gap - gap) < 1e-14);
            }
}

TEST_CASE("a crossing keeps its number while it slides over nodes and ends with the edge")
{
    const Sharp lower = lower_bar(ElementKind::T4, 7);
    std::set<std::int64_t> ids;
    for (int k = -60; k <= 60; ++k) {
        const double x = 1e-3 * k;
        const Sharp upper = upper_bar(ElementKind::T4, 5, 1e-5, {x, 0, 0});
        const SurfaceContacts found = sharp_contacts(upper.now(), lower.now(), 1e-4);
        CAPTURE(x);
        if (std::abs(x) > 0.0501) CHECK(found.contact.empty());
        if (std::abs(x) > 0.0499) continue;
        REQUIRE(found.contact.size() == 1);
        CHECK(std::abs(found.contact[0].point.x() - x) < 1e-15);
        ids.insert(found.contact[0].id);
    }
    CHECK(ids.size() == 1);
}

TEST_CASE("a corner on a face from either body but none where faces touch")
{
    for (const ElementKind kind : kKinds) {
        CAPTURE(std::string(shape_of(kind).name));
        Sharp floor = sharp_body(box_body(kind, {-0.05, -0.05, -0.02}, {0.05, 0.05, 0}, {3, 4, 1}));
        TouchingBody cube = box_body(kind, {0, 0, 0}, {0.02, 0.02, 0.02}, {1, 2, 1});
        // Standing on its corner, then laid down.
        const Vec3 foot(0.007, -0.004, -2e-4);
        cube.move(turn(0.5, Vec3(1, -0.7, 0), foot));
        Sharp tilted = sharp_body(std::move(cube));
        floor.body.move(anywhere());
        tilted.body.move(anywhere());
        const Vec3 up = anywhere().linear() * Vec3::UnitZ();
        const SurfaceContacts found = sharp_contacts(tilted.now(), floor.now(), 1e-3);
        REQUIRE(!found.contact.empty()); // edges beside it may be within reach, too
        CHECK((found.contact[0].normal - up).norm() < 1e-13);
        CHECK(std::abs(found.contact[0].gap + 2e-4) < 1e-14);
        const SurfaceContacts back = sharp_contacts(floor.now(), tilted.now(), 1e-3);
        REQUIRE(back.contact.size() == found.contact.size());
        CHECK((back.contact[0].normal + up).norm() < 1e-13);
        CHECK(std::abs(back.contact[0].gap + 2e-4) < 1e-14);
        // Weights reproduce places: no force without its moment.
        const Vec3 on_floor = weighted(back.slave(back.contact[0]), floor.body.mesh.nodes);
        CHECK((on_floor - anywhere() * Vec3(foot.x(), foot.y(), 0)).norm() < 1e-14);
        CHECK((weighted(back.master(back.contact[0]), tilted.body.mesh.nodes) - anywhere() * foot)
                  .norm() < 1e-14);
    }
}

TEST_CASE("corners that are flush with the sides of the other body touch it on both")
{
    for (int k = 0; k < 12; ++k) { // round-off puts them outside or inside of the sides
        CAPTURE(k);
        Sharp lower =
            sharp_body(box_body(ElementKind::H8, {-0.05, 0, -0.02}, {0.05, 0.0635, 0}, {5, 1, 1}));
        TouchingBody b = box_body(ElementKind::H8, {0, 0, 0}, {0.02, 0.0635, 0.02}, {1, 1, 1});
        b.move(turn(-0.5, Vec3::UnitY(), {0.003, 0, -1e-4}));
        const auto way = turn(0.3 * k, Vec3(1, 0.4 * k, -2));
        b.move(way);
        lower.body.move(way);
        const Sharp upper = sharp_body(std::move(b));
        int corners = 0;
        for (const SurfaceContact& c : sharp_contacts(upper.now(), lower.now(), 1e-3).contact)
            corners += c.slave_end == c.slave_begin + 1 && std::abs(c.gap + 1e-4) < 1e-12;
        CHECK(corners == 2);
    }
}

TEST_CASE("a surface that was flat at rest has one normal at a node however far it is dented")
{
    // A floor of squares, pressed down along a line of nodes until its faces enclose 0.7 rad.
    for (const ElementKind kind : kKinds) {
        CAPTURE(std::string(shape_of(kind).name));
        const Sharp floor =
            sharp_body(box_body(kind, {-0.06, -0.04, -0.02}, {0.06, 0.04, 0}, {6, 4, 1}));
        const std::vector<Vec3>& rest = floor.body.mesh.nodes;
        double line = 1; // y of the corners that are next to the middle [m]
        for (std::size_t f = 0; f < floor.body.surface.faces.size(); ++f)
            for (const std::int32_t n : floor.body.surface.face(f).first(3)) // corners
                if (std::abs(rest[std::size_t(n)].y()) < std::abs(line))
                    line = rest[std::size_t(n)].y();
        std::vector<Vec3> places = rest;
        for (Vec3& x : places)
            x.z() += std::tan(0.35) * std::abs(x.y() - line);
        // The largest angle between normals of the floor's upper faces at one of their nodes.
        const auto jump = [&](const SharpFeatures& features) {
            SmoothNormalsOnDemand normals(floor.body.surface, places, features.smooth);
            std::map<std::int32_t, Vec3> known;
            double most = 0;
            for (std::size_t f = 0; f < floor.body.surface.faces.size(); ++f) {
                const std::span<const std::int32_t> nodes = floor.body.surface.face(f);
                if (!std::ranges::all_of(
                        nodes, [&](std::int32_t n) { return rest[std::size_t(n)].z() > -1e-9; }))
                    continue;
                for (std::size_t k = 0; k < nodes.size(); ++k) {
                    PerNode values = PerNode::Zero();
                    values[Eigen::Index(k)] = 1;
                    const Vec3 n = normals.normal(std::int32_t(f), values).value();
                    most = std::max(most, (n - known.emplace(nodes[k], n).first->second).norm());
                }
            }
            return most;
        };
        CHECK(jump(floor.sharp) < 1e-12);
        CHECK(jump(sharp_features(floor.body.surface, places)) > 0.6); // by the present shape
    }
}

TEST_CASE("an edge on a face crosses each edge of the mesh below it once")
{
    // A mesh of squares: the edge of a rigid bar along x crosses the lines x = const.
    const Sharp floor =
        sharp_body(box_body(ElementKind::H8, {-0.05, -0.05, -0.02}, {0.05, 0.05, 0}, {6, 3, 1}));
    TouchingBody b = box_body(ElementKind::H8, {-0.2, 0, 0}, {0.2, 0.02, 0.02}, {1, 1, 1});
    b.move(turn(0.5, Vec3::UnitX(), {0, 0.004, 1e-4}));
    const Sharp bar = sharp_body(std::move(b));
    const SurfaceContacts found = sharp_contacts(bar.now(), floor.now(), 1e-3);
    CHECK(found.contact.size() == 7);
    for (const SurfaceContact& c : found.contact) {
        CHECK((c.normal - Vec3::UnitZ()).norm() < 1e-13);
        CHECK(std::abs(c.gap - 1e-4) < 1e-14);
        CHECK(std::abs(c.point.y() - 0.004) < 1e-14);
    }
}

TEST_CASE("faces on faces are left to integrals and what a contact has flattened stays")
{
    const std::vector<std::int64_t> none;
    for (const double tilt : {0.0, 0.03, 0.4}) { // flat, nearly so, on its edge
        const Sharp lower = sharp_body(
            box_body(ElementKind::T4, {-0.05, -0.02, -0.02}, {0.05, 0.02, 0}, {5, 3, 2}));
        TouchingBody b = box_body(ElementKind::T4, {0, -0.05, 0}, {0.02, 0.05, 0.02}, {2, 5, 2});
        b.move(turn(-tilt, Vec3::UnitY(), {0, 0, -1e-5}));
        const Sharp upper = sharp_body(std::move(b));
        CAPTURE(tilt);
        const SurfaceContacts found = sharp_contacts(upper.now(), lower.now(), 1e-3, &none);
        CHECK(found.contact.empty() == (tilt < 0.1));
        const SurfaceContacts means = contacts_of(upper.body, lower.body, 1e-3);
        double least = 1;
        for (const SurfaceContact& c : means.contact)
            least = std::min(least, c.gap);
        CHECK((least > 1e-4) == (tilt > 0.1)); // on its edge they are far from closed
        if (tilt < 0.1) continue;
        std::vector<std::int64_t> known;
        for (const SurfaceContact& c : found.contact)
            known.push_back(c.id);
        std::sort(known.begin(), known.end());
        TouchingBody flat = upper.body;
        flat.move(turn(tilt - 0.03, Vec3::UnitY()));
        const SharpSurface now{flat.surface, upper.sharp, flat.mesh.nodes};
        CHECK(sharp_contacts(now, lower.now(), 1e-3, &none).contact.empty());
        CHECK(sharp_contacts(now, lower.now(), 1e-3, &known).contact.size() >= known.size());
    }
}

TEST_CASE("a contact begins gradually as faces part")
{
    // A block laid across another, lifted off it about its lower edge, and 10 um into it there.
    double left = 1;
    for (const double tilt : {0.0, 0.03, 0.06, 0.09, 0.095, 0.0999, 0.1005, 0.4}) {
        const Sharp lower = sharp_body(
            box_body(ElementKind::T4, {-0.05, -0.02, -0.02}, {0.05, 0.02, 0}, {5, 3, 2}));
        TouchingBody b = box_body(ElementKind::T4, {0, -0.05, 0}, {0.02, 0.05, 0.02}, {2, 5, 2});
        b.move(turn(-tilt, Vec3::UnitY(), {0, 0, -1e-5}));
        const Sharp upper = sharp_body(std::move(b));
        CAPTURE(tilt);
        const SurfaceContacts found = sharp_contacts(upper.now(), lower.now(), 1e-3);
        REQUIRE(!found.contact.empty());
        // What is left of the overlap of 10 um: nothing beyond a rise of 0.1 (sine).
        double least = 1;
        for (const SurfaceContact& c : found.contact)
            least = std::min(least, c.gap + 1e-5);
        if (tilt > 0.1002)
            CHECK(std::abs(least) < 1e-15);
        else {
            CHECK(least > 0);
            CHECK(least < left);
            CHECK(least < 0.01 * 0.04); // of a face
        }
        left = least;
        const SurfaceContacts means = contacts_of(upper.body, lower.body, 1e-3);
        double mean = 1;
        for (const SurfaceContact& c : means.contact)
            mean = std::min(mean, c.gap);
        if (tilt < 0.05 || tilt > 0.3)
            CHECK((mean > 1e-4) == (tilt > 0.1)); // on its edge they are far from closed
    }
    CHECK(left < 1e-15);
}

TEST_CASE("a rim below a flat face does not touch the face's other sides")
{
    // Flush along y = 0.02, and overlapping a little as mean gaps allow.
    for (const ElementKind kind : kKinds) {
        const Sharp bed =
            sharp_body(box_body(kind, {-0.05, -0.02, -0.02}, {0.05, 0.02, 0}, {12, 5, 3}));
        TouchingBody b = box_body(kind, {-0.02, -0.02, 0}, {0.02, 0.02, 0.04}, {5, 5, 5});
        b.move(turn(0.002, Vec3(1, 1, 1), {1e-5, 2e-5, -2e-5}));
        const Sharp tool = sharp_body(std::move(b));
        const auto vertical = [](const SurfaceContacts& found) {
            for (const SurfaceContact& c : found.contact)
                CHECK(std::abs(c.normal.z()) > 0.99);
        };
        vertical(sharp_contacts(tool.now(), bed.now(), 0.01));
        vertical(sharp_contacts(bed.now(), tool.now(), 0.01));
    }
}

TEST_CASE("the corner of a quadratic block on an obstacle which no multiplier of a face has")
{
    const auto floor = [](const Vec3& x) {
        WallSample s;
        s.distance = x.z();
        s.normal = Vec3::UnitZ();
        return s;
    };
    for (const ElementKind kind : kKinds)
        for (const double tilt : {0.0, 0.5}) {
            TouchingBody b = box_body(kind, {0, 0, 0}, {0.02, 0.02, 0.02}, {1, 2, 1});
            b.move(turn(tilt, Vec3(1, -0.7, 0), {0, 0, -1e-4}));
            const Sharp block = sharp_body(std::move(b));
            const SurfaceContacts found = sharp_wall_contacts(block.now(), floor, 1e-3);
            // Flat on it, all nodes of its lower edges but the middles.
            REQUIRE(found.contact.size() == (kind != ElementKind::T10 ? 0 : tilt > 0 ? 1 : 6));
            for (const SurfaceContact& c : found.contact)
                CHECK(std::abs(c.gap + 1e-4) < 1e-15);
        }
}

TEST_CASE("chains: 12 of a box and the rims of a cylinder and none of a ball")
{
    for (const ElementKind kind : kKinds) {
        const Sharp box = sharp_body(box_body(kind, {0, 0, 0}, {1, 2, 3}, {3, 4, 2}));
        CHECK(box.sharp.chains == 12);
        CHECK(box.sharp.sharp == (kind == ElementKind::T10 ? 8 : 4) * (3 + 4 + 2));
        int ends = 0;
        for (std::size_t i = 0; i < box.sharp.sharp; ++i)
            ends += box.sharp.pieces[i].ends[0] + box.sharp.pieces[i].ends[1];
        CHECK(ends == 24);
    }
    SolidCylinderOptions cylinder;
    cylinder.radius = 1;
    cylinder.length = 2;
    cylinder.cells = 8;
    const Sharp round = sharp_body(with_surface(make_solid_cylinder(cylinder)));
    CHECK(round.sharp.chains == 2);
    for (std::size_t i = 0; i < round.sharp.sharp; ++i)
        CHECK(!(round.sharp.pieces[i].ends[0] || round.sharp.pieces[i].ends[1]));
    SolidBallOptions ball;
    ball.radius = 1;
    ball.cells = 8;
    CHECK(sharp_body(with_surface(make_solid_ball(ball))).sharp.sharp == 0);
}

TEST_CASE("the force of edges that cross ends gradually as they become parallel")
{
    // The lower edge of a box, tilted about it, 10 um in a flat block whose mesh has lines nearly
    // along it.
    constexpr double kDeep = 1e-5;
    for (const ElementKind kind : {ElementKind::T4, ElementKind::H8}) {
        CAPTURE(std::string(shape_of(kind).name));
        SolidBoxOptions options;
        options.lowest = {-0.05, -0.05, -0.02};
        options.highest = {0.05, 0.05, 0};
        options.cells = {10, 4, 2};
        options.kind = kind;
        const Sharp block = sharp_body(with_surface(make_solid_box(options)));
        const auto left_at = [&](double angle) {
            TouchingBody b =
                box_body(ElementKind::H8, {-0.04, 0, 0}, {0.04, 0.02, 0.02}, {1, 1, 1});
            b.move(turn(angle, Vec3::UnitZ(), {0.005, 0, -kDeep}) * turn(0.5, Vec3::UnitX()));
            const Sharp box = sharp_body(std::move(b));
            const SurfaceContacts found = sharp_contacts(block.now(), box.now(), 1e-3);
            double least = 1;
            for (const SurfaceContact& c : found.contact) {
                const auto nodes = found.slave(c);
                if (nodes.size() != 2 || std::abs(nodes[0].weight - 0.5) > 0.4) continue;
                const Vec3 along = block.body.mesh.nodes[std::size_t(nodes[1].node)] -
                                   block.body.mesh.nodes[std::size_t(nodes[0].node)];
                if (std::abs(along.normalized().x()) > 1 - 1e-9)
                    least = std::min(least, c.gap + kDeep);
            }
            return least;
        };
        CHECK(std::abs(left_at(0.21)) < 1e-12);
        CHECK(std::abs(left_at(0.3)) < 1e-12);
        double before = 0;
        for (double angle = 0.2; angle > 0.0505; angle -= 0.002) {
            CAPTURE(angle);
            const double left = left_at(angle);
            CHECK(left >= before - 1e-12);
            CHECK(left - before < 1e-3 * 0.03); // of a face
            before = left;
        }
        CHECK(before > 0.04 * 0.01); // of a face: more than a force there leaves
        CHECK(left_at(0.049) == 1);
    }
}
