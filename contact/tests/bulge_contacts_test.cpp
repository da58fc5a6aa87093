#include "contact/surface/bulge_contacts.hpp"
#include "contact/tests/contact_surfaces.hpp"

#include <cmath>
#include <doctest/doctest.h>

using namespace amontons;
using namespace amontons::test;

namespace {

WallSample ball_at(const Vec3& centre, double radius, const Vec3& x)
{
    WallSample s;
    const Vec3 d = x - centre;
    s.distance = d.norm() - radius;
    s.normal = d.normalized();
    s.hessian = (Mat3::Identity() - s.normal * s.normal.transpose()) / d.norm();
    return s;
}

} // namespace

TEST_CASE("a ball between the nodes of a face: one contact where the face is nearest to it")
{
    const double radius = 0.006, gap = 1e-4;
    for (const ElementKind kind : kKinds)
        for (const Eigen::Vector2d& over :
             {Eigen::Vector2d(0.013, 0.017), Eigen::Vector2d(0.02, 0.011),
              Eigen::Vector2d(0.0201, 0.0299)}) {
            CAPTURE(int(kind));
            CAPTURE(over.transpose());
            SolidBoxOptions box;
            box.highest = Vec3(0.08, 0.08, 0.04);
            box.cells = {2, 2, 1}; // faces of 40 mm, T6 between multipliers of 20
            box.kind = kind;
            const TouchingBody b = with_surface(make_solid_box(box));
            const Vec3 centre(over.x(), over.y(), 0.04 + radius + gap);
            const SurfaceContacts found = bulge_contacts(
                b.surface, b.mesh.nodes, b.mesh.nodes,
                [&](const Vec3& x) { return ball_at(centre, radius, x); }, 0.002);
            REQUIRE(found.contact.size() == 1);
            const SurfaceContact& c = found.contact.front();
            CHECK(std::abs(c.gap - gap) < 1e-15);
            CHECK((c.point - Vec3(over.x(), over.y(), 0.04)).norm() < 1e-15);
            CHECK((c.normal + Vec3::UnitZ()).norm() < 1e-12);
            CHECK((weighted(found.slave(c), b.mesh.nodes) - c.point).norm() < 1e-15);
            double sum = 0;
            for (const StencilEntry& e : found.slave(c))
                sum += e.weight;
            CHECK(std::abs(sum - 1) < 1e-14);
        }
}

TEST_CASE("no contact between nodes where the nodes themselves are in contact with a wall")
{
    SolidBoxOptions box;
    box.highest = Vec3(0.08, 0.08, 0.04);
    box.cells = {2, 2, 1};
    box.kind = ElementKind::H8;
    const TouchingBody b = with_surface(make_solid_box(box));
    const auto found = [&](double radius, const Eigen::Vector2d& over) {
        return bulge_contacts(
                   b.surface, b.mesh.nodes, b.mesh.nodes,
                   [&](const Vec3& x) {
                       return ball_at({over.x(), over.y(), 0.04 + radius}, radius, x);
                   },
                   0.002)
            .contact.size();
    };
    CHECK(found(0.03, {0.02, 0.02}) == 1);
    CHECK(found(0.05, {0.02, 0.02}) == 0);   // rounder than the faces are long
    CHECK(found(0.006, {0.04, 0.04}) == 0);  // on a node
    const auto hollow = [&](const Vec3& x) { // from inside
        WallSample s = ball_at({0.02, 0.02, 0.02}, 0.035, x);
        s.distance = -s.distance;
        s.normal = -s.normal;
        s.hessian = -s.hessian;
        return s;
    };
    CHECK(bulge_contacts(b.surface, b.mesh.nodes, b.mesh.nodes, hollow, 0.1).contact.empty());
}

TEST_CASE("a ball as large as the faces keeps its contact when what it presses shrinks")
{
    SolidBoxOptions box;
    box.highest = Vec3(0.08, 0.08, 0.04);
    box.cells = {2, 2, 1};
    box.kind = ElementKind::H8;
    const TouchingBody b = with_surface(make_solid_box(box));
    for (const double stretch : {0.999, 1.0, 1.001}) {
        std::vector<Vec3> x = b.mesh.nodes;
        for (Vec3& place : x)
            place.head<2>() *= stretch;
        const auto ball = [&](const Vec3& at) { return ball_at({0.013, 0.011, 0.08}, 0.04, at); };
        CHECK(bulge_contacts(b.surface, x, b.mesh.nodes, ball, 0.002).contact.size() == 1);
    }
}
