#include "contact/curve/curve_on_faces.hpp"
#include "contact/curve/edge_curves.hpp"
#include "contact/surface/feet_on_faces.hpp"
#include "contact/tests/contact_surfaces.hpp"

#include <doctest/doctest.h>

using namespace amontons;
using namespace amontons::test;

namespace {

Curve straight_rod(const Vec3& from, const Vec3& to, double radius, int pieces)
{
    Curve c;
    c.start.push_back(0);
    const Vec3 step = (to - from) / pieces;
    for (int i = 0; i < pieces; ++i) {
        c.pieces.push_back({from + i * step, from + (i + 1) * step, step, step, radius});
        c.start.push_back(c.start.back() + step.norm());
    }
    return c;
}

BoundingBox everywhere()
{
    BoundingBox box;
    box.add(Vec3::Constant(-100));
    box.add(Vec3::Constant(100));
    return box;
}

std::vector<CurveOnFaces> touched(const Curve& c, const TouchingBody& body,
                                  std::span<const Vec3> places, double reach)
{
    const SharpFeatures sharp = sharp_features(body.surface, body.mesh.nodes);
    std::vector<CurveOnFaces> out;
    touch_faces(c, face_stations(stations(c, 0)), {body.surface, sharp, places}, body.mesh.nodes,
                reach, {}, out);
    return out;
}

} // namespace

TEST_CASE("feet of points are right at faces and edges and corners of a box and inside too")
{
    for (const ElementKind kind : kKinds) {
        const TouchingBody box = box_body(kind, {-1, -1, -1}, {1, 1, 1}, {3, 4, 2});
        const FeetOnFaces feet(box.surface, box.mesh.nodes, box.mesh.nodes, everywhere());
        std::mt19937 random(7);
        std::uniform_real_distribution<double> any(-1.5, 1.5);
        for (int i = 0; i < 300; ++i) {
            const Vec3 x(any(random), any(random), any(random));
            const Vec3 on = x.cwiseMax(-1).cwiseMin(1);
            const bool in = x.cwiseAbs().maxCoeff() < 1;
            const double distance = in ? x.cwiseAbs().maxCoeff() - 1 : (x - on).norm();
            const auto foot = feet.find(x, 3);
            REQUIRE(foot.has_value());
            CHECK(foot->distance == doctest::Approx(distance).epsilon(1e-9));
            CHECK((foot->place + foot->distance * foot->normal - x).norm() < 1e-9);
            Vec3 mean = Vec3::Zero();
            double sum = 0;
            for (int k = 0; k < foot->nodes; ++k) {
                const StencilEntry& e = foot->node[std::size_t(k)];
                mean += e.weight * box.mesh.nodes[std::size_t(e.node)];
                sum += e.weight;
                CHECK(e.weight > -1e-6);
            }
            CHECK(sum == doctest::Approx(1));
            CHECK((mean - foot->place).norm() < 1e-9);
        }
    }
}

TEST_CASE("over a dent and a bulge neither feet nor normals nor distances jump" *
          doctest::test_suite("slow"))
{
    // z = a (x^2 + y^2) of either sign, in faces of 0.25 that turn from one to the next by up to 30
    // degrees: a point that passes 1e-4 at a time.
    for (const ElementKind kind : kKinds)
        for (const double a : {1.0, 0.3, -0.3, -1.0}) {
            TouchingBody box = box_body(kind, {-1, -1, -1}, {1, 1, 0}, {8, 8, 2});
            const std::vector<Vec3> at_rest = box.mesh.nodes;
            for (Vec3& x : box.mesh.nodes)
                x.z() += a * (x.x() * x.x() + x.y() * x.y());
            const FeetOnFaces feet(box.surface, box.mesh.nodes, at_rest, everywhere());
            const double step = 1e-4;
            std::optional<FaceFoot> before;
            for (double s = -0.6; s < 0.6; s += step) {
                const Vec3 x(s, 0.37 * s + 0.011, 0.2);
                const auto foot = feet.find(x, 1);
                REQUIRE(foot.has_value());
                CHECK(!foot->beyond);
                if (before) {
                    CHECK((foot->normal - before->normal).norm() < 30 * step);
                    CHECK((foot->place - before->place).norm() < 10 * step);
                    CHECK(std::abs(foot->distance - before->distance) < 2 * step);
                }
                before = foot;
            }
        }
}

TEST_CASE("beside a set of faces nothing is touched")
{
    const TouchingBody box = box_body(ElementKind::H8, {-1, -1, -1}, {1, 1, 1}, {3, 4, 2});
    const FaceSet* top = nullptr;
    for (const FaceSet& f : box.mesh.face_sets)
        if (f.name == "z_max") top = &f;
    REQUIRE(top);
    const ExternalSurface surface = surface_of(box.mesh, top->members);
    const FeetOnFaces feet(surface, box.mesh.nodes, box.mesh.nodes, everywhere());
    CHECK(feet.find({0.9, 0, 1.2}, 2));
    CHECK(!feet.find({1.1, 0, 1.2}, 2));
    CHECK(!feet.find({1.1, 1.1, 1.2}, 2));
}

TEST_CASE("a curve that crosses a box touches it at stations and at both edges anywhere in space")
{
    const TouchingBody at_rest = box_body(ElementKind::T10, {-1, -1, -1}, {1, 1, 1}, {3, 4, 2});
    const Eigen::Isometry3d motion = anywhere();
    for (const bool moved : {false, true}) {
        TouchingBody box = at_rest;
        const Eigen::Isometry3d to = moved ? motion : Eigen::Isometry3d::Identity();
        box.move(to);
        const double r = 0.05, gap = 0.01;
        const Curve c = straight_rod(to * Vec3(-1.7, 0.2, 1 + r + gap),
                                     to * Vec3(1.7, 0.3, 1 + r + gap), r, 17);
        int crossings = 0, on_top = 0;
        for (const CurveOnFaces& t : touched(c, box, box.mesh.nodes, 0.1)) {
            CHECK(t.curve.gap == doctest::Approx(gap).epsilon(1e-9));
            CHECK((t.curve.normal - to.linear() * Vec3::UnitZ()).norm() < 1e-9);
            const Vec3 x = to.inverse() * t.curve.point;
            CHECK(x.z() == doctest::Approx(1 + gap / 2).epsilon(1e-9));
            if (is_crossing(t.curve.id)) {
                ++crossings;
                CHECK(std::abs(x.x()) == doctest::Approx(1).epsilon(1e-9));
            } else {
                ++on_top;
            }
        }
        CHECK(crossings == 2);
        CHECK(on_top == 10); // nothing of those that are beyond the edges
    }
}

TEST_CASE("where faces are fine across a curve the solid's nodes touch it and nothing else does")
{
    const TouchingBody box = box_body(ElementKind::H8, {-1, -1, -1}, {1, 1, 1}, {24, 4, 2});
    const double r = 0.4;
    // Along y: faces of 0.05 to 0.13 across it, of 0.5 along it.
    const Curve c = straight_rod({0.1, -1.4, 1 + r}, {0.1, 1.4, 1 + r}, r, 7);
    const std::vector<CurveOnFaces> found = touched(c, box, box.mesh.nodes, 0.1);
    double area = 0;
    for (const CurveOnFaces& t : found) {
        CHECK(t.nodes == 1);
        const Vec3& x = box.mesh.nodes[std::size_t(t.node[0].node)];
        const double apart = std::hypot(x.x() - 0.1, 1 + r - x.z());
        CHECK(t.curve.gap == doctest::Approx(apart - r).epsilon(1e-9));
        area += t.area;
    }
    CHECK(found.size() > 20);
    CHECK(area > 0.5);
    // Along x they are too long: a line.
    const Curve other = straight_rod({-1.4, 0.1, 1 + r}, {1.4, 0.1, 1 + r}, r, 7);
    const std::vector<CurveOnFaces> line = touched(other, box, box.mesh.nodes, 0.1);
    REQUIRE(!line.empty());
    for (const CurveOnFaces& t : line) {
        CHECK(t.nodes == 4);
        CHECK(t.area == 0);
    }
}

TEST_CASE("a curve that passes through faces or over a sharp edge has passed")
{
    TouchingBody plate = box_body(ElementKind::T4, {-1, -1, -0.01}, {1, 1, 0.01}, {4, 4, 1});
    const SharpFeatures sharp = sharp_features(plate.surface, plate.mesh.nodes);
    const SharpSurface surface{plate.surface, sharp, plate.mesh.nodes};
    const auto passes = [&](const Vec3& a0, const Vec3& a1, const Vec3& way) {
        return pass_through_faces(straight_rod(a0, a1, 0.05, 4),
                                  straight_rod(a0 + way, a1 + way, 0.05, 4), plate.mesh.nodes,
                                  surface);
    };
    CHECK(passes({-0.5, 0.1, 0.1}, {0.5, 0.1, 0.1}, {0, 0, -0.2}));
    CHECK(!passes({-0.5, 0.1, 0.1}, {0.5, 0.1, 0.1}, {0.3, 0, -0.04}));
    CHECK(!passes({-0.5, 1.2, 0.1}, {0.5, 1.2, 0.1}, {0, 0, -0.2})); // beside it
    // Along z, sideways through the plate, which is thinner than the way between places.
    CHECK(passes({1.3, 0, -0.983}, {1.3, 0, 1}, {-0.6, 0, 0}));
    CHECK(!passes({1.3, 0, -0.983}, {1.3, 0, 1}, {-0.2, 0, 0}));
    // The plate comes.
    std::vector<Vec3> before = plate.mesh.nodes;
    for (Vec3& x : before)
        x.z() -= 1;
    const Curve still = straight_rod({-0.5, 0.1, -0.1}, {0.5, 0.1, -0.1}, 0.05, 4);
    CHECK(pass_through_faces(still, still, before, surface));
}

TEST_CASE("a line through sharp edges is the one that its nodes define")
{
    TouchingBody box = box_body(ElementKind::T10, {-1, -1, -1}, {1, 1, 1}, {3, 4, 2});
    for (Vec3& x : box.mesh.nodes)
        x.z() += 0.1 * std::sin(2 * x.x()) + 0.05 * x.y() * x.y();
    const SharpFeatures sharp = sharp_features(box.surface, box.mesh.nodes);
    const std::vector<EdgeCurve> edges = edge_curves({box.surface, sharp, box.mesh.nodes});
    CHECK(edges.size() == 12);
    for (const EdgeCurve& e : edges)
        for (std::size_t i = 0; i < e.nodes.size(); ++i)
            for (const double t : {0.0, 0.3, 0.9, 1.0}) {
                Vec3 x = Vec3::Zero();
                double sum = 0;
                for (const StencilEntry& n : e.at({int(i), t})) {
                    x += n.weight * box.mesh.nodes[std::size_t(n.node)];
                    sum += n.weight;
                }
                CHECK(sum == doctest::Approx(1));
                CHECK((x - e.curve.pieces[i].at(t)).norm() < 1e-12);
            }
}
