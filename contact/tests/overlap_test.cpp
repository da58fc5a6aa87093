#include "contact/rigid/overlap.hpp"
#include "contact/rigid/shape_distance.hpp"
#include "contact/surface/passage.hpp"

#include "contact/tests/contact_surfaces.hpp"

#include <cmath>
#include <doctest/doctest.h>
#include <limits>
#include <numbers>
#include <random>

using namespace amontons;
using namespace amontons::test;

namespace {

double deepest_spot(const std::vector<OverlapSpot>& spots)
{
    double depth = 0;
    for (const OverlapSpot& s : spots)
        depth = std::max(depth, s.depth);
    return depth;
}

/// Both ways, as the bodies are.
double mesh_overlap(const TouchingBody& a, const TouchingBody& b)
{
    const FacetedSurface of_a(a.surface), of_b(b.surface);
    std::vector<OverlapSpot> spots;
    overlap_spots({of_a, a.mesh.nodes}, {of_b, b.mesh.nodes}, spots);
    overlap_spots({of_b, b.mesh.nodes}, {of_a, a.mesh.nodes}, spots);
    for (const OverlapSpot& s : spots) {
        double sum = 0;
        for (const StencilEntry& e : s.own.nodes())
            sum += e.weight;
        CHECK(sum == doctest::Approx(1).epsilon(1e-12));
    }
    return deepest_spot(spots);
}

BoundingBox all_space()
{
    constexpr double kFar = std::numeric_limits<double>::infinity();
    return {Eigen::Array3d::Constant(-kFar), Eigen::Array3d::Constant(kFar)};
}

} // namespace

TEST_CASE("two blocks overlap by what one was pushed into the other however they stand and are cut")
{
    for (const ElementKind kind : kKinds)
        for (const double depth : {1e-6, 0.003, 0.02}) {
            CAPTURE(depth);
            TouchingBody lower = box_body(kind, {-0.5, -0.5, -0.4}, {0.5, 0.5, 0}, {3, 4, 2});
            TouchingBody upper =
                box_body(kind, {-0.21, -0.17, -depth}, {0.23, 0.19, 0.3}, {2, 1, 1});
            const Eigen::Isometry3d there = anywhere();
            lower.move(there);
            upper.move(there);
            CHECK(mesh_overlap(lower, upper) == doctest::Approx(depth).epsilon(1e-9));
        }
}

TEST_CASE("bars that cross overlap though no node of one is inside the other")
{
    for (const ElementKind kind : kKinds)
        for (const double depth : {-1e-4, 1e-4, 0.01}) {
            TouchingBody lower = box_body(kind, {-0.03, -0.5, -0.05}, {0.02, 0.5, 0}, {1, 1, 1});
            TouchingBody upper =
                box_body(kind, {-0.5, -0.02, -depth}, {0.5, 0.03, 0.05 - depth}, {1, 1, 1});
            const Eigen::Isometry3d there = anywhere();
            lower.move(there);
            upper.move(there);
            CHECK(mesh_overlap(lower, upper) ==
                  doctest::Approx(std::max(depth, 0.0)).epsilon(1e-6));
        }
}

TEST_CASE("a set of faces has no sides beyond its border")
{
    const TouchingBody block = box_body(ElementKind::H8, {-1, -1, -1}, {1, 1, 0}, {2, 2, 2});
    std::vector<FaceRef> top;
    for (std::size_t f = 0; f < block.surface.faces.size(); ++f) {
        bool up = true;
        for (const std::int32_t n : block.surface.face(f))
            up = up && block.mesh.nodes[std::size_t(n)].z() == 0;
        if (up) top.push_back(block.surface.faces[f]);
    }
    REQUIRE(top.size() == 4);
    const ExternalSurface set = surface_of(block.mesh, top);
    const FacetedSurface faces(set);
    const FaceDistance distance({faces, block.mesh.nodes}, all_space());
    std::int32_t hint = -1;
    const auto below = distance.at({0.3, 0.2, -0.1}, hint);
    REQUIRE(below);
    CHECK(below->distance == doctest::Approx(-0.1));
    CHECK((below->normal - Vec3::UnitZ()).norm() < 1e-12);
    CHECK(!distance.at({1.2, 0.2, -0.1}, hint));

    // A part that is flat has no room of its own: the body below it has.
    const auto depth_of = [&](const Vec3& low, const Vec3& high, double thickness) {
        const TouchingBody tool = box_body(ElementKind::H8, low, high, {1, 1, 1});
        const FacetedSurface outside(tool.surface);
        std::vector<OverlapSpot> spots;
        overlap_spots({outside, tool.mesh.nodes}, {faces, block.mesh.nodes, thickness}, spots);
        return deepest_spot(spots);
    };
    CHECK(depth_of({-0.3, -0.2, -0.1}, {0.3, 0.2, 0.2}, 1) == doctest::Approx(0.1));
    CHECK(depth_of({0.7, -0.2, -0.1}, {1.3, 0.2, 0.2}, 1) == doctest::Approx(0.1));
    CHECK(depth_of({-0.3, -0.2, -1.4}, {0.3, 0.2, -1.1}, 1) == 0); // below the body
    CHECK(depth_of({-0.3, -0.2, 1e-9}, {0.3, 0.2, 0.2}, 1) == 0);
}

TEST_CASE("what a face leaves of a curved surface follows its width across the bend alone")
{
    constexpr double kRadius = 1;
    for (const ElementKind kind : {ElementKind::H8, ElementKind::T4})
        for (const double length : {0.1, 1.0, 10.0}) {
            CAPTURE(length);
            TouchingBody roof = box_body(kind, {0, 0, -0.1}, {1, length, 0}, {8, 2, 1});
            for (Vec3& x : roof.mesh.nodes)
                x = {(kRadius + x.z()) * std::sin(x.x()), x.y(),
                     (kRadius + x.z()) * std::cos(x.x())};
            const FacetedSurface faces(roof.surface);
            const PlacedSurface placed{faces, roof.mesh.nodes};
            int tops = 0;
            for (std::size_t f = 0; f < roof.surface.faces.size(); ++f) {
                bool top = true;
                double low = 10, high = -10; // of the angle [rad]
                for (const std::int32_t n : roof.surface.face(f)) {
                    const Vec3& x = roof.mesh.nodes[std::size_t(n)];
                    top = top && std::hypot(x.x(), x.z()) > 0.99 * kRadius;
                    low = std::min(low, std::atan2(x.x(), x.z()));
                    high = std::max(high, std::atan2(x.x(), x.z()));
                }
                if (!top || low < 1e-9 || high > 1 - 1e-9) continue; // none beside some of those
                ++tops;
                const double arc = kRadius * (1 - std::cos((high - low) / 2));
                const double bulge = bulge_of_face(placed, f, 100);
                CHECK(bulge > 0.85 * arc);
                // Those beside may be wider or less wide; between triangles the way is two thirds.
                CHECK(bulge < (kind == ElementKind::H8 ? 1.15 : 1.75) * arc);
                CHECK(bulge_of_face(placed, f, kRadius * (high - low) / 2) ==
                      doctest::Approx(bulge / 4).epsilon(1e-2));
            }
            CHECK(tops >= 12);
        }
}

TEST_CASE("a ball between the nodes of a wide face is as deep as it stands in it")
{
    const double radius = 0.1;
    for (const ElementKind kind : kKinds)
        for (const double depth : {0.001, 0.02, 0.05}) {
            CAPTURE(depth);
            const TouchingBody block = box_body(kind, {-1, -1, -1}, {1, 1, 0}, {1, 1, 1});
            const FacetedSurface faces(block.surface);
            const Vec3 centre(0.31, 0.17, radius - depth);
            const auto ball = [&](const Vec3& x) {
                std::int32_t near = -1;
                return shape_distance(Ball{radius}, x - centre, near);
            };
            std::vector<OverlapSpot> spots;
            overlap_spots({faces, block.mesh.nodes}, ball, all_space(), spots);
            REQUIRE(!spots.empty());
            CHECK(std::abs(deepest_spot(spots) - depth) <= std::max(0.05 * depth, 2e-3));
            CHECK(spots[0].bulge > 0);
        }
}

TEST_CASE("rigid shapes: closed forms of how deep one stands in the other wherever they are")
{
    const auto depth = [](const RigidShape& a, const Pose& at, const RigidShape& b,
                          const Pose& to) {
        const auto distance = [&](const Vec3& x) {
            std::int32_t near = -1;
            WallSample s = shape_distance(b, to.turn.conjugate() * (x - to.place), near);
            s.normal = to.turn * s.normal;
            return s;
        };
        return deepest_in(a, at, nullptr, distance, {all_space()}).depth;
    };
    const Eigen::Quaterniond turned(Eigen::AngleAxisd(0.7, Vec3(1, 2, -1).normalized()));
    const auto pose = [&](const Vec3& x) { return Pose{turned * x + Vec3(3, -2, 1), turned}; };
    const Box box{{0.1, 0.2, 0.3}, 0};
    CHECK(depth(Ball{0.1}, pose({0.15, 0, 0}), box, pose({0, 0, 0})) ==
          doctest::Approx(0.05).epsilon(1e-9));
    CHECK(depth(box, pose({0.19, 0, 0}), box, pose({0, 0, 0})) ==
          doctest::Approx(0.01).epsilon(1e-9));
    CHECK(depth(box, pose({0.21, 0, 0}), box, pose({0, 0, 0})) == 0);
    // Two cylinders whose axes cross at right angles.
    const Cylinder bar{0.05, 1, 0};
    Pose across = pose({0, 0.09, 0});
    across.turn = across.turn * Eigen::AngleAxisd(std::acos(0.0), Vec3::UnitY());
    CHECK(depth(bar, across, bar, pose({0, 0, 0})) == doctest::Approx(0.01).epsilon(1e-6));
    across.place = pose({0, 0.101, 0}).place;
    CHECK(depth(bar, across, bar, pose({0, 0, 0})) == 0);
    // An upright one by its rim in a half-space, tilted.
    const double tilt = 0.2, height = 1 * std::cos(tilt) + 0.05 * std::sin(tilt) - 0.004;
    const Pose tilted{{0, 0, height}, Eigen::Quaterniond(Eigen::AngleAxisd(tilt, Vec3::UnitX()))};
    const auto plane = [](const Vec3& x) {
        WallSample s;
        s.distance = x.z();
        s.normal = Vec3::UnitZ();
        return s;
    };
    CHECK(deepest_in(bar, tilted, nullptr, plane, {all_space()}).depth ==
          doctest::Approx(0.004).epsilon(1e-6));
}

TEST_CASE("what is known to be convex is measured at fewer places, and as deep")
{
    std::mt19937 random(7);
    std::uniform_real_distribution<double> any(-1, 1);
    const auto pose = [&](double far) {
        Eigen::Quaterniond q(any(random), any(random), any(random), any(random));
        return Pose{far * Vec3(any(random), any(random), any(random)), q.normalized()};
    };
    const RigidShape others[] = {Box{{0.3, 0.2, 0.1}, 0}, Ball{0.2}, Cylinder{0.15, 0.2, 0},
                                 Capsule{0.1, 0.2}, Ellipsoid{{0.3, 0.2, 0.1}}};
    const Box box{{0.1, 0.2, 0.3}, 0};
    int inside = 0, known = 0;
    for (int k = 0; k < 400; ++k) {
        const RigidShape& other = others[k % 5];
        const bool flat = k % 3 == 0; // as one box rests on another
        const Pose to = flat ? Pose{} : pose(0.3);
        const Pose at = flat
                            ? Pose{{0.1 * any(random), 0.1 * any(random), 0.4 + 1e-3 * any(random)},
                                   Eigen::Quaterniond::Identity()}
                            : pose(0.3);
        int samples = 0;
        const auto distance = [&](const Vec3& x) {
            ++samples;
            std::int32_t near = -1;
            WallSample s = shape_distance(other, to.turn.conjugate() * (x - to.place), near);
            s.normal = to.turn * s.normal;
            return s;
        };
        CAPTURE(k);
        const double whole = deepest_in(box, at, nullptr, distance, {all_space()}).depth;
        const int all = std::exchange(samples, 0);
        const double depth =
            deepest_in(box, at, nullptr, distance, {all_space()}, Inside::convex).depth;
        CHECK(std::abs(depth - whole) <= 1e-12);
        inside += whole > 0;
        known += samples < all;
    }
    CHECK(inside > 100);
    CHECK(known > 100);
}

TEST_CASE("shapes in a half-space by their support, as deep as their surface is")
{
    std::mt19937 random(11);
    std::uniform_real_distribution<double> any(-1, 1);
    const RigidShape shapes[] = {Box{{0.3, 0.2, 0.1}, 0}, Ball{0.2}, Cylinder{0.15, 0.2, 0},
                                 Capsule{0.1, 0.2}, Ellipsoid{{0.3, 0.2, 0.1}}};
    int inside = 0;
    for (int k = 0; k < 200; ++k) {
        const Vec3 normal = Vec3(any(random), any(random), any(random)).normalized(),
                   on = Vec3(any(random), any(random), any(random));
        Eigen::Quaterniond q(any(random), any(random), any(random), any(random));
        q.normalize();
        const Pose pose{on + 0.2 * any(random) * normal + Vec3(0.1, -0.2, 0.3).cross(normal), q};
        const auto plane = [&](const Vec3& x) {
            WallSample s;
            s.distance = normal.dot(x - on);
            s.normal = normal;
            return s;
        };
        CAPTURE(k);
        const ShapeOverlap found = deepest_below(shapes[k % 5], pose, on, normal);
        const ShapeOverlap searched =
            deepest_in(shapes[k % 5], pose, nullptr, plane, {all_space()});
        CHECK(std::abs(found.depth - searched.depth) <= 1e-5); // of the search on an ellipsoid
        CHECK(found.depth >= searched.depth - 1e-14);
        if (!(found.depth > 0)) continue;
        ++inside;
        CHECK(std::abs(normal.dot(found.place - on) + found.depth) <= 1e-14);
    }
    CHECK(inside > 50);
}

TEST_CASE("how thick a body is at its thinnest, also where its faces are wide")
{
    for (const ElementKind kind : kKinds) {
        const TouchingBody plate = box_body(kind, {-1, -1, -0.03}, {1, 1, 0}, {2, 2, 1});
        CHECK(least_thickness(plate.surface, plate.mesh.nodes, 10) == doctest::Approx(0.03));
        const TouchingBody cube = box_body(kind, {0, 0, 0}, {1, 1, 1}, {4, 4, 4});
        CHECK(least_thickness(cube.surface, cube.mesh.nodes, 10) == doctest::Approx(1));
        CHECK(least_thickness(cube.surface, cube.mesh.nodes, 0.4) == doctest::Approx(0.4));
    }
}

TEST_CASE("what is measured of bent quadrilaterals does not depend on where their meshes begin")
{
    // The same two plates with x, y, z as y, z, x: nodes, faces and diagonals come in another
    // order.
    const auto bent = [](const Vec3& x) {
        return Vec3(0, 0, 0.02 * x.x() * x.y() + 0.03 * x.x() * x.x() - 0.01 * x.y());
    };
    const auto turned = [](const Vec3& x) { return Vec3(x.z(), x.x(), x.y()); };
    const auto measured = [&](bool turn) {
        const auto body = [&](const Vec3& low, const Vec3& high,
                              const std::array<std::int32_t, 3>& n, bool bends) {
            SolidBoxOptions box;
            box.lowest = turn ? turned(low) : low;
            box.highest = turn ? turned(high) : high;
            box.cells = turn ? std::array<std::int32_t, 3>{n[2], n[0], n[1]} : n;
            box.kind = ElementKind::H8;
            TouchingBody b = with_surface(make_solid_box(box));
            for (Vec3& x : b.mesh.nodes) {
                const Vec3 vertical = turn ? Vec3(x.y(), x.z(), x.x()) : x;
                if (bends) x += turn ? turned(bent(vertical)) : bent(vertical);
            }
            return b;
        };
        const TouchingBody lower = body({-0.9, -0.9, -0.18}, {0.9, 0.9, 0}, {6, 6, 1}, true),
                           upper = body({-0.4, -0.33, -0.004}, {0.5, 0.39, 0.17}, {4, 4, 1}, false);
        const FacetedSurface of_a(lower.surface), of_b(upper.surface);
        std::vector<OverlapSpot> spots;
        overlap_spots({of_b, upper.mesh.nodes}, {of_a, lower.mesh.nodes}, spots);
        std::erase_if(spots, [](const OverlapSpot& s) { return s.own.count > 1; });
        for (OverlapSpot& s : spots)
            if (turn) s.point = Vec3(s.point.y(), s.point.z(), s.point.x());
        std::ranges::sort(spots, [](const OverlapSpot& p, const OverlapSpot& q) {
            return std::pair(std::lround(1e6 * p.point.x()), p.point.y()) <
                   std::pair(std::lround(1e6 * q.point.x()), q.point.y());
        });
        return spots;
    };
    const std::vector<OverlapSpot> one = measured(false), other = measured(true);
    REQUIRE(one.size() > 8);
    REQUIRE(one.size() == other.size());
    for (std::size_t i = 0; i < one.size(); ++i) {
        CHECK((one[i].point - other[i].point).norm() < 1e-12);
        CHECK(one[i].depth == doctest::Approx(other[i].depth).epsilon(1e-9));
        CHECK(one[i].face == doctest::Approx(other[i].face).epsilon(1e-9));
        CHECK(one[i].bulge == doctest::Approx(other[i].bulge).epsilon(1e-9));
        // At a corner the face beneath counts, not a side, whose edges are shorter.
        CHECK(one[i].face == doctest::Approx(0.225).epsilon(1e-3));
    }
}

TEST_CASE("feet lie on one side where a face that both have is all that one of them has")
{
    const TouchingBody block =
        box_body(ElementKind::T4, {-0.5, -0.5, -0.5}, {0.5, 0.5, 0}, {4, 4, 2});
    const FacetedSurface facets(block.surface);
    const FaceDistance distance({facets, block.mesh.nodes}, all_space());
    std::int32_t hint = -1;
    const auto foot = [&](const Vec3& x) { return *distance.at(x, hint); };
    const auto above = foot({0.3, 0.1, 1e-4}), on_edge = foot({0.5, 0.15, 0}),
               outside = foot({0.5 + 1e-4, 0.15, 1e-4}),
               near_edge = foot({0.5 - 1e-6, 0.15, -1e-5}), beside = foot({0.5, 0.13, -0.1}),
               other = foot({-0.5, 0.13, 0});
    REQUIRE(near_edge.normal.x() > 0.99); // of the side, which is nearer
    CHECK(distance.on_one_side(above, on_edge, 2e-4));
    CHECK(distance.on_one_side(on_edge, above, 2e-4));
    CHECK(distance.on_one_side(above, outside, 2e-4));
    CHECK(distance.on_one_side(above, near_edge, 2e-4));
    CHECK(distance.on_one_side(beside, on_edge, 2e-4));
    CHECK(!distance.on_one_side(above, outside, 1e-5)); // farther off than that
    // Through the body, and from edge to edge, where what is between them may be anything.
    CHECK(!distance.on_one_side(above, beside, 2e-4));
    CHECK(!distance.on_one_side(beside, other, 2e-4));
    CHECK(!distance.on_one_side(on_edge, other, 2e-4));
    CHECK(!distance.on_one_side(above, foot({0.3, 0.1, -0.5}), 2e-4));
}

TEST_CASE("an edge whose ends lie on two sides of a body, of no depth, overlaps between them")
{
    for (const ElementKind kind : kKinds) {
        TouchingBody lower = box_body(kind, {-0.5, -0.5, -0.5}, {0.5, 0.5, 0}, {1, 1, 1});
        // A wedge whose only edge within reach leads from the top to a side.
        TouchingBody upper = box_body(kind, {0, 0, 0}, {1, 1, 1}, {1, 1, 1});
        Eigen::Isometry3d there = Eigen::Isometry3d::Identity();
        const double way = std::sqrt(0.02);
        for (Vec3& x : upper.mesh.nodes) // its lowest edge runs along x
            x = Vec3(x.x() * way, (x.y() - x.z()) / std::sqrt(2), (x.y() + x.z()) / std::sqrt(2));
        there.translate(Vec3(0.4, 0.05, 0))
            .rotate(Eigen::AngleAxisd(std::numbers::pi / 4, Vec3::UnitY()));
        upper.move(there);
        CHECK(mesh_overlap(lower, upper) > 0.04); // 0.05 in the middle of the edge
    }
}

TEST_CASE("places below the requested depth have no bulge, deeper ones the same")
{
    // A ball in a block: places of all depths down to the ball's.
    SolidBallOptions options;
    options.radius = 0.3;
    options.cells = 8;
    TouchingBody ball = with_surface(make_solid_ball(options));
    ball.move(Eigen::Isometry3d(Eigen::Translation3d(0.013, 0.021, 0.27)));
    const TouchingBody block =
        box_body(ElementKind::T4, {-0.5, -0.5, -0.4}, {0.5, 0.5, 0}, {7, 6, 3});
    const FacetedSurface of_ball(ball.surface), of_block(block.surface);
    const PlacedSurface a{of_ball, ball.mesh.nodes}, b{of_block, block.mesh.nodes};
    std::vector<OverlapSpot> all;
    overlap_spots(a, b, all);
    REQUIRE(all.size() > 3);
    const double middle = 0.5 * deepest_spot(all);
    for (const Shallow& shallow : {Shallow{1e6, middle}, Shallow{middle / all[0].face}}) {
        std::vector<OverlapSpot> spots;
        overlap_spots(a, b, spots, shallow);
        REQUIRE(spots.size() == all.size());
        int deep = 0, left = 0;
        for (std::size_t i = 0; i < all.size(); ++i) {
            CHECK(all[i].bulge > 0);
            CHECK(spots[i].depth == all[i].depth);
            CHECK(spots[i].face == all[i].face);
            const bool counts =
                all[i].depth > std::min(shallow.of_face * all[i].face, shallow.depth);
            CHECK(spots[i].bulge == (counts ? all[i].bulge : 0));
            (counts ? deep : left) += 1;
        }
        CHECK(deep > 0);
        CHECK(left > 0);
    }
}

TEST_CASE("of places that are as deep under a cylinder's side round-off chooses none")
{
    const RigidShape cylinder = Cylinder{0.1, 0.06}; // along z
    const TouchingBody block =
        box_body(ElementKind::T10, {-0.5, -0.5, -0.4}, {0.5, 0.5, 0}, {4, 4, 2});
    const FacetedSurface facets(block.surface);
    const Mat3 lying = Eigen::AngleAxisd(std::numbers::pi / 2, Vec3::UnitY()).toRotationMatrix();
    const Vec3 centre{0.011, 0.009, 0.09};
    std::vector<OverlapSpot> first;
    for (int i = 0; i < 12; ++i) {
        CAPTURE(i);
        const Eigen::Isometry3d there = i ? turn(0.41 * i, {0.2, 1, -0.1 * i}, {0.3 * i, -1, 2})
                                          : Eigen::Isometry3d::Identity();
        TouchingBody moved = block;
        moved.move(there);
        std::int32_t near = -1;
        const auto distance = [&](const Vec3& x) {
            WallSample s =
                shape_distance(cylinder, lying.transpose() * (there.inverse() * x - centre), near);
            s.normal = there.linear() * (lying * s.normal);
            return s;
        };
        std::vector<OverlapSpot> spots;
        overlap_spots({facets, moved.mesh.nodes}, distance, all_space(), spots);
        if (i == 0) first = spots;
        REQUIRE(spots.size() == first.size());
        REQUIRE(!spots.empty());
        for (std::size_t k = 0; k < spots.size(); ++k) {
            CHECK(spots[k].depth == doctest::Approx(first[k].depth).epsilon(1e-9));
            CHECK((spots[k].point - there * first[k].point).norm() < 1e-9);
        }
    }
}

TEST_CASE("a block that is bent around an edge has no curvature that its faces stand for")
{
    for (const ElementKind kind : kKinds) {
        CAPTURE(std::string(shape_of(kind).name));
        const TouchingBody straight = box_body(kind, {-0.5, -0.1, -0.2}, {0.5, 0.1, 0}, {8, 1, 2});
        TouchingBody bent = straight;
        for (Vec3& x : bent.mesh.nodes)
            x.z() += 0.8 * std::max(x.x(), 0.0) * x.x();
        const TouchingBody die =
            box_body(ElementKind::H8, {-0.2, -0.05, -0.01}, {0.1, 0.05, 0.2}, {1, 1, 1});
        const FacetedSurface of_block(bent.surface), of_die(die.surface);
        std::vector<OverlapSpot> known, unknown;
        overlap_spots({of_block, bent.mesh.nodes, 0, straight.mesh.nodes},
                      {of_die, die.mesh.nodes, 0, die.mesh.nodes}, known);
        overlap_spots({of_block, bent.mesh.nodes}, {of_die, die.mesh.nodes}, unknown);
        REQUIRE(!known.empty());
        REQUIRE(known.size() == unknown.size());
        double bulge = 0;
        for (std::size_t k = 0; k < known.size(); ++k) {
            CHECK(known[k].bulge_at_rest < 1e-12);
            CHECK(unknown[k].bulge_at_rest == unknown[k].bulge);
            CHECK(known[k].bulge == unknown[k].bulge);
            bulge = std::max(bulge, known[k].bulge);
        }
        CHECK(bulge > 1e-4);
    }
}
