#include "contact/surface/mortar.hpp"

#include "contact/tests/contact_surfaces.hpp"
#include "mesh/face_shape.hpp"

#include <doctest/doctest.h>
#include <functional>
#include <map>
#include <string>

using namespace amontons;
using namespace amontons::test;

namespace {

constexpr double kTurn = 0.5235987755982988; // 30 degrees

/// Calls visit(slave, master) for all nine pairs of kinds: a slave above z = 0 with its lower face
/// [0, 1] x [0, 1], and a master below whose upper face is lowest..highest, turned by an angle
/// about the vertical through (0.5, 0.5).
void for_pairs(const Vec3& lowest, const Vec3& highest, double angle,
               const std::function<void(TouchingBody&, TouchingBody&)>& visit)
{
    const Eigen::Isometry3d there(Eigen::Translation3d(0.5, 0.5, 0));
    for (const ElementKind a : kKinds)
        for (const ElementKind b : kKinds) {
            CAPTURE(std::string(shape_of(a).name));
            CAPTURE(std::string(shape_of(b).name));
            TouchingBody slave = box_body(a, {0, 0, 0}, {1, 1, 0.6}, {3, 4, 2});
            TouchingBody master = box_body(b, lowest, highest, {5, 3, 2});
            master.move(there * turn(angle, Vec3::UnitZ()) * there.inverse());
            visit(slave, master);
        }
}

void check_rows(const SurfaceContacts& contacts)
{
    for (const SurfaceContact& c : contacts.contact) {
        double slave = 0, master = 0;
        for (const StencilEntry& e : contacts.slave(c))
            slave += e.weight;
        for (const StencilEntry& e : contacts.master(c))
            master += e.weight;
        CHECK(std::abs(slave - 1) < 1e-13);
        CHECK(std::abs(master - 1) < 1e-13);
        CHECK(c.area > 0);
        Mat3 frame;
        frame << c.normal, c.t1, c.t2;
        CHECK((frame.transpose() * frame - Mat3::Identity()).norm() < 1e-14);
        CHECK(frame.determinant() > 0);
    }
}

using NodeLoads = std::map<std::int32_t, double>;

/// int N over the faces in the plane at z, from the shape functions alone.
NodeLoads loads(const TouchingBody& body, double z)
{
    NodeLoads sum;
    for (std::size_t f = 0; f < body.surface.faces.size(); ++f) {
        const auto nodes = body.surface.face(f);
        const auto at = [&](std::size_t i) {
            return body.mesh.nodes[static_cast<std::size_t>(nodes[i])];
        };
        bool flat = true;
        for (std::size_t i = 0; i < nodes.size(); ++i)
            flat = flat && std::abs(at(i).z() - z) < 1e-9;
        if (!flat) continue;
        const int n = static_cast<int>(nodes.size());
        for (const QuadraturePoint& p : face_points(n)) {
            const FaceValues N = face_shape_values(n, p.xi);
            const FaceGradients dN = face_shape_gradients(n, p.xi);
            Vec3 along = Vec3::Zero(), across = Vec3::Zero();
            for (int i = 0; i < n; ++i) {
                along += dN(0, i) * at(static_cast<std::size_t>(i));
                across += dN(1, i) * at(static_cast<std::size_t>(i));
            }
            for (int i = 0; i < n; ++i)
                sum[nodes[static_cast<std::size_t>(i)]] +=
                    p.weight * N[i] * along.cross(across).norm();
        }
    }
    return sum;
}

/// What a pressure of 1 in the contacts does to the nodes of a side.
NodeLoads forces(const SurfaceContacts& contacts, bool of_slave)
{
    NodeLoads sum;
    for (const SurfaceContact& c : contacts.contact)
        for (const StencilEntry& e : of_slave ? contacts.slave(c) : contacts.master(c))
            sum[e.node] += c.area * e.weight;
    return sum;
}

double difference(const NodeLoads& expected, NodeLoads found)
{
    REQUIRE(!expected.empty());
    double worst = 0;
    for (const auto& [node, load] : expected)
        worst = std::max(worst, std::abs(found[node] - load));
    for (const auto& [node, load] : found)
        if (!expected.count(node)) worst = std::max(worst, std::abs(load));
    return worst;
}

} // namespace

TEST_CASE("areas sum to the overlap of flat faces for all pairs of kinds")
{
    const struct {
        const char* name;
        Vec3 lowest, highest;
        double turn, area;
    } cases[] = {{"slave covered", {-0.5, -0.4, -1}, {1.6, 1.5, 0}, kTurn, 1},
                 {"master covered", {0.3, 0.25, -1}, {0.7, 0.75, 0}, kTurn, 0.2},
                 {"overhanging", {0.37, -0.2, -1}, {1.4, 1.1, 0}, 0, 0.63},
                 {"a corner", {0.81, 0.63, -1}, {1.4, 1.1, 0}, 0, 0.19 * 0.37}};
    for (const auto& c : cases) {
        CAPTURE(c.name);
        for_pairs(c.lowest, c.highest, c.turn, [&](TouchingBody& slave, TouchingBody& master) {
            slave.move(anywhere());
            master.move(anywhere());
            const SurfaceContacts contacts = contacts_of(slave, master, 1e-3);
            CHECK(std::abs(total_area(contacts) - c.area) < 1e-12);
            check_rows(contacts);
            const Vec3 up = anywhere().linear() * Vec3::UnitZ();
            for (const SurfaceContact& contact : contacts.contact) {
                CHECK((contact.normal - up).norm() < 1e-12);
                CHECK(std::abs(contact.gap) < 1e-14);
            }
        });
    }
}

TEST_CASE("on flat faces both sides of a contact are at the same place so any affine motion of "
          "both bodies gives their exact relative motion")
{
    const double gap = 0.0123;
    for (const bool part : {false, true})
        for_pairs({part ? 0.43 : -0.5, -0.4, -1}, {1.6, 1.5, -gap}, kTurn,
                  [&](TouchingBody& slave, TouchingBody& master) {
                      slave.move(anywhere());
                      master.move(anywhere());
                      const SurfaceContacts contacts = contacts_of(slave, master, 0.1);
                      CHECK(contacts.contact.size() > 10);
                      Mat3 F, G;
                      F << 0.3, -0.1, 0.7, 0.2, 0.9, -0.4, 0.5, 0.1, -0.8;
                      G << -0.6, 0.4, 0.1, 0.3, -0.2, 0.5, 0.9, -0.7, 0.2;
                      std::vector<Vec3> x, y;
                      for (const Vec3& p : slave.mesh.nodes)
                          x.push_back(F * p + Vec3(1, 2, 3));
                      for (const Vec3& p : master.mesh.nodes)
                          y.push_back(G * p - Vec3(2, 1, 4));
                      for (const SurfaceContact& c : contacts.contact) {
                          const Vec3 below = c.point - gap * c.normal;
                          CHECK(std::abs(c.gap - gap) < 1e-14);
                          const Vec3 u =
                              weighted(contacts.slave(c), x) - weighted(contacts.master(c), y);
                          const Vec3 exact =
                              F * c.point + Vec3(1, 2, 3) - G * below + Vec3(2, 1, 4);
                          CHECK((u - exact).norm() < 1e-12);
                      }
                  });
}

TEST_CASE("middle nodes anywhere on a flat surface: whole areas and linear motions stay exact")
{
    // Sides bend within the plane; faces share them as before.
    const auto bend = [](TouchingBody& body) {
        std::mt19937 rng{11};
        std::uniform_real_distribution<double> uniform(-0.02, 0.02);
        std::vector<bool> done(body.mesh.nodes.size());
        for (std::size_t f = 0; f < body.surface.faces.size(); ++f)
            for (std::size_t k = 3; k < 6; ++k) {
                const auto node = static_cast<std::size_t>(body.surface.face(f)[k]);
                Vec3& x = body.mesh.nodes[node];
                const bool border =
                    std::min(x.x(), x.y()) < 1e-9 || std::max(x.x(), x.y()) > 1 - 1e-9;
                if (done[node] || std::abs(x.z()) > 1e-9 || border) continue;
                x += Vec3(uniform(rng), uniform(rng), 0);
                done[node] = true;
            }
    };
    for (const ElementKind kind : kKinds) {
        CAPTURE(std::string(shape_of(kind).name));
        TouchingBody slave = box_body(ElementKind::T10, {0, 0, 0}, {1, 1, 1}, {3, 4, 1});
        TouchingBody master = box_body(kind, {-0.2, -0.3, -1}, {1.3, 1.4, 0}, {4, 3, 1});
        bend(slave);
        if (kind == ElementKind::T10) bend(master);
        const SurfaceContacts contacts = contacts_of(slave, master, 0.1);
        CHECK(std::abs(total_area(contacts) - 1) < 1e-12);
        check_rows(contacts);
        for (const SurfaceContact& c : contacts.contact) {
            CHECK(std::abs(c.gap) < 1e-14);
            CHECK((c.point - weighted(contacts.master(c), master.mesh.nodes)).norm() < 1e-12);
            CHECK((c.normal - Vec3::UnitZ()).norm() < 1e-13);
        }
    }
}

TEST_CASE("a contact of a whole face is at its node and no other node of the slave takes part")
{
    for_pairs({-0.5, -0.4, -1}, {1.6, 1.5, 0}, kTurn,
              [&](TouchingBody& slave, TouchingBody& master) {
                  const SurfaceContacts contacts = contacts_of(slave, master, 1e-3);
                  REQUIRE(!contacts.contact.empty());
                  for (const SurfaceContact& c : contacts.contact) {
                      const Vec3& node = slave.mesh.nodes[static_cast<std::size_t>(c.id)];
                      CHECK((c.point - node).norm() < 1e-13);
                      for (const StencilEntry& e : contacts.slave(c))
                          CHECK(std::abs(e.weight - (e.node == c.id ? 1 : 0)) < 1e-12);
                  }
              });
}

TEST_CASE("the integral of the gap is the volume between two planes and that of an overlap too")
{
    // Seen along the slave's normal; the contact's normal halves the angle between the planes.
    const double tilt = 0.1;
    for (const double gap : {0.07, -0.07})
        for_pairs({-0.5, -0.4, -1}, {1.6, 1.5, 0}, kTurn,
                  [&](TouchingBody& slave, TouchingBody& master) {
                      slave.move(turn(tilt, {1, 2, 0}, {0, 0, gap}));
                      const SurfaceContacts contacts = contacts_of(slave, master, 1);
                      double volume = 0;
                      for (const SurfaceContact& c : contacts.contact) {
                          CHECK(std::abs(std::acos(c.normal.z()) - tilt / 2) < 1e-10);
                          volume += c.area * c.gap / std::cos(tilt / 2);
                      }
                      // Area 1 of the slave; the height of its middle over z = 0, along its normal.
                      const Vec3 middle = turn(tilt, {1, 2, 0}, {0, 0, gap}) * Vec3(0.5, 0.5, 0);
                      CHECK(std::abs(volume - middle.z() / std::cos(tilt)) < 1e-12);
                      CHECK(std::abs(total_area(contacts) - 1) < 1e-12);
                  });
}

TEST_CASE("contacts turn and move with the bodies and do not depend on the order of faces")
{
    for_pairs({0.3, -0.4, -1}, {1.6, 1.5, 0}, kTurn,
              [&](TouchingBody& slave, TouchingBody& master) {
                  slave.move(turn(0.05, {1, 2, 0}, {0.01, 0.02, 0.01}));
                  const SurfaceContacts before = contacts_of(slave, master, 0.1);
                  slave.move(anywhere());
                  master.move(anywhere());
                  std::mt19937 rng{7};
                  for (TouchingBody* body : {&slave, &master}) {
                      std::vector<FaceRef> faces = body->surface.faces;
                      std::shuffle(faces.begin(), faces.end(), rng);
                      ExternalSurface& s = body->surface;
                      const ExternalSurface old = s;
                      s.nodes.clear();
                      std::vector<std::size_t> order(faces.size());
                      for (std::size_t i = 0; i < order.size(); ++i)
                          order[i] = i;
                      std::shuffle(order.begin(), order.end(), rng);
                      s.starts = {0};
                      for (std::size_t i = 0; i < order.size(); ++i) {
                          s.faces[i] = old.faces[order[i]];
                          s.corners[i] = old.corners[order[i]];
                          for (const std::int32_t n : old.face(order[i]))
                              s.nodes.push_back(n);
                          s.starts.push_back(static_cast<std::int64_t>(s.nodes.size()));
                      }
                  }
                  const SurfaceContacts after = contacts_of(slave, master, 0.1);
                  REQUIRE(!before.contact.empty());
                  REQUIRE(after.contact.size() == before.contact.size());
                  for (std::size_t i = 0; i < before.contact.size(); ++i) {
                      const SurfaceContact &a = before.contact[i], &b = after.contact[i];
                      CHECK(a.id == b.id);
                      CHECK((anywhere() * a.point - b.point).norm() < 1e-12);
                      CHECK((anywhere().linear() * a.normal - b.normal).norm() < 1e-12);
                      CHECK(std::abs(a.gap - b.gap) < 1e-13);
                      CHECK(std::abs(a.area - b.area) < 1e-13);
                  }
              });
}

TEST_CASE("a uniform pressure acts on whole faces of either side as its consistent nodal loads")
{
    for_pairs({-0.5, -0.4, -1}, {1.6, 1.5, 0}, kTurn,
              [&](TouchingBody& slave, TouchingBody& master) {
                  CHECK(difference(loads(slave, 0),
                                   forces(contacts_of(slave, master, 1e-3), true)) < 1e-13);
              });
    for_pairs({0.3, 0.25, -1}, {0.7, 0.75, 0}, kTurn,
              [&](TouchingBody& slave, TouchingBody& master) {
                  CHECK(difference(loads(master, 0),
                                   forces(contacts_of(slave, master, 1e-3), false)) < 1e-13);
              });
}

TEST_CASE("quadrilaterals that are no parallelograms take a uniform pressure as exactly")
{
    // Nodes inside of the flat surfaces are moved by up to a third of a cell.
    const auto distort = [](TouchingBody& body, const Vec3& low, const Vec3& high, double most) {
        std::mt19937 rng{5};
        std::uniform_real_distribution<double> uniform(-most, most);
        for (Vec3& x : body.mesh.nodes) {
            const Eigen::Vector2d inside = (x - low).head<2>().cwiseMin((high - x).head<2>());
            if (std::abs(x.z()) < 1e-9 && inside.minCoeff() > 1e-9)
                x += Vec3(uniform(rng), uniform(rng), 0);
        }
    };
    for (const double most : {0.0, 0.01, 0.03, 0.08})
        for (const ElementKind kind : {ElementKind::T4, ElementKind::H8}) {
            CAPTURE(most);
            CAPTURE(std::string(shape_of(kind).name));
            const Vec3 low{0.3, 0.25, -1}, high{0.7, 0.75, 0};
            TouchingBody slave = box_body(ElementKind::H8, {0, 0, 0}, {1, 1, 0.6}, {3, 4, 2});
            TouchingBody master = box_body(kind, low, high, {2, 3, 2});
            distort(slave, {0, 0, 0}, {1, 1, 1}, most);
            distort(master, low, high, most / 2);
            CHECK(difference(loads(master, 0), forces(contacts_of(slave, master, 1e-3), false)) <
                  1e-11);
        }
}

TEST_CASE(
    "a multiplier that keeps little of its area joins a neighbour while areas and places stay")
{
    // The slave overhangs: of its row of cells next to the edge 1e-6 of the width remains.
    for (const ElementKind kind : kKinds) {
        CAPTURE(std::string(shape_of(kind).name));
        SolidBoxOptions box;
        box.cells = {4, 4, 1};
        box.kind = kind;
        const TouchingBody slave = with_surface(make_solid_box(box));
        const double edge = 0.5 + 1e-6; // just beyond the second cell of four
        const TouchingBody master = box_body(kind, {-0.3, -0.3, -1}, {edge, 1.3, 0}, {3, 3, 1});
        const SurfaceContacts contacts = contacts_of(slave, master, 1e-3);
        CHECK(std::abs(total_area(contacts) - edge) < 1e-12);
        Vec3 moment = Vec3::Zero();
        for (const SurfaceContact& c : contacts.contact) {
            CHECK(c.area > 0.01 / 16);
            moment += c.area * c.point;
        }
        CHECK(std::abs(moment.x() - edge * edge / 2) < 1e-12);
        CHECK(std::abs(moment.y() - edge / 2) < 1e-12);
        check_rows(contacts);
    }
}

TEST_CASE("the far sides of thin bodies do not touch and of several layers the nearest counts")
{
    for (const ElementKind kind : kKinds) {
        CAPTURE(std::string(shape_of(kind).name));
        const TouchingBody slave = box_body(kind, {0, 0, 0}, {1, 1, 0.01}, {4, 4, 1});
        const TouchingBody thin =
            box_body(kind, {-0.1, -0.1, -0.012}, {1.1, 1.1, -0.002}, {5, 3, 1});
        const SurfaceContacts one = contacts_of(slave, thin, 0.1);
        CHECK(std::abs(total_area(one) - 1) < 1e-12);
        for (const SurfaceContact& c : one.contact)
            CHECK(std::abs(c.gap - 0.002) < 1e-14);

        // A second plate below, which the first covers up to x = 0.37.
        TouchingBody two = box_body(kind, {-0.1, -0.1, -0.012}, {0.37, 1.1, -0.002}, {5, 3, 1});
        const TouchingBody lower =
            box_body(kind, {-0.1, -0.1, -0.04}, {1.1, 1.1, -0.03}, {5, 3, 1});
        const auto count = static_cast<std::int32_t>(two.mesh.nodes.size());
        for (const Vec3& x : lower.mesh.nodes)
            two.mesh.nodes.push_back(x);
        for (const std::int32_t n : lower.mesh.blocks[0].nodes)
            two.mesh.blocks[0].nodes.push_back(n + count);
        two = with_surface(two.mesh);
        const SurfaceContacts layers = contacts_of(slave, two, 0.1);
        CHECK(std::abs(total_area(layers) - 1) < 1e-12);
        double volume = 0;
        for (const SurfaceContact& c : layers.contact)
            volume += c.area * c.gap;
        CHECK(std::abs(volume - (0.37 * 0.002 + 0.63 * 0.03)) < 1e-12);
    }
}

TEST_CASE("contacts are made for gaps and overlaps up to the requested distances")
{
    for (const ElementKind kind : kKinds)
        for (const double gap : {0.0999, 0.1001, -0.0999, -0.1001}) {
            const TouchingBody slave = box_body(kind, {0, 0, gap}, {1, 1, 1 + gap}, {3, 3, 3});
            const TouchingBody master = box_body(kind, {-1, -1, -2}, {2, 2, 0}, {4, 4, 4});
            const SurfaceContacts contacts = contacts_of(slave, master, 0.1);
            CHECK(std::abs(total_area(contacts) - (std::abs(gap) < 0.1 ? 1 : 0)) < 1e-12);
        }
}

TEST_CASE("a ball over a plane: heights and normals and areas converge with the mesh" *
          doctest::test_suite("slow"))
{
    // Of a node at an angle t from the pole: height 1 - cos t, the normal halves the angle, and the
    // gap is seen along the ball's normal. The
    // area by a smooth function of t with the integral 2 pi int (1 - 4 t^2)^2 sin t dt.
    const auto bump = [](double t) { return t < 0.5 ? std::pow(1 - 4 * t * t, 2) : 0; };
    double exact = 0;
    for (int i = 0; i < 1000; ++i)
        exact += bump((i + 0.5) / 2000) * std::sin((i + 0.5) / 2000) * 2 * 3.14159265358979 / 2000;
    // The last height's error, and how much smaller than that of the mesh before errors may be.
    const struct {
        ElementKind kind;
        double height, less_height, less_tilt;
    } expected[] = {
        {ElementKind::T4, 1e-14, 10, 0.6},   // [regression] nodes lie on the sphere
        {ElementKind::T10, 2e-6, 0.1, 0.12}, // [regression] of this mesh
        {ElementKind::H8, 1e-9, 0.1, 0.6},
    };
    for (const auto& e : expected) {
        CAPTURE(std::string(shape_of(e.kind).name));
        double last[3] = {1, 1, 1};
        std::vector<double> gaps;
        for (const std::int32_t cells : {8, 16, 32}) {
            CAPTURE(cells);
            SolidBallOptions ball;
            ball.radius = 1;
            ball.cells = cells;
            ball.kind = e.kind;
            const TouchingBody slave = with_surface(make_solid_ball(ball));
            const TouchingBody master = box_body(e.kind, {-2, -2, -2}, {2, 2, -1}, {7, 6, 1});
            const SurfaceContacts contacts = contacts_of(slave, master, 0.3);
            double height = 0, gap = 0, tilt = 0, area = 0;
            for (const SurfaceContact& c : contacts.contact) {
                const Vec3& node = slave.mesh.nodes[static_cast<std::size_t>(c.id)];
                const double t = std::acos(-node.z());
                if (t > 0.5) continue;
                height = std::max(height, std::abs(c.point.z() + std::cos(t)));
                tilt = std::max(tilt, std::abs(std::acos(c.normal.z()) - t / 2));
                area += c.area * bump(t);
                gap = std::max(gap,
                               std::abs(c.gap - (1 - std::cos(t)) * std::cos(t / 2) / std::cos(t)));
            }
            area = std::abs(area / exact - 1);
            MESSAGE(std::string(shape_of(e.kind).name)
                    << " " << cells << ": height " << height << ", gap " << gap << ", tilt " << tilt
                    << ", area " << area);
            CHECK(height <=
                  std::max(e.kind == ElementKind::H8 ? 1e-9 : 1e-14, e.less_height * last[0]));
            CHECK(tilt < e.less_tilt * last[1]);
            gaps.push_back(gap);
            CHECK(area < 0.35 * last[2]);
            last[0] = height;
            last[1] = tilt;
            last[2] = area;
        }
        CHECK(last[0] < e.height);
        CHECK(gaps.back() < 0.35 * gaps.front());
    }
}

TEST_CASE("normals of the master alone are its own however the slave is bent")
{
    for_pairs({-1, -1, -0.5}, {2, 2, -0.1}, 0.4, [](TouchingBody& slave, TouchingBody& master) {
        for (Vec3& x : slave.mesh.nodes)
            x.z() += 0.3 * x.x() * x.x() + 0.1 * x.y();
        for (const bool smooth : {false, true}) {
            MortarOptions options;
            options.reach = 1;
            options.smooth_normals = smooth;
            double most[2] = {0, 0};
            for (const bool own : {false, true}) {
                options.master_normals = own;
                const SurfaceContacts all = mortar_contacts(
                    slave.surface, slave.mesh.nodes, master.surface, master.mesh.nodes, options);
                CHECK(!all.contact.empty());
                for (const SurfaceContact& c : all.contact)
                    most[own] = std::max(most[own], (c.normal - Vec3::UnitZ()).norm());
            }
            CHECK(most[0] > 0.05);
            CHECK(most[1] < 1e-12);
        }
    });
}

TEST_CASE("a body that is folded touches itself and not through its own thickness")
{
    constexpr double kThick = 0.4, kHalf = 0.05; // the fold's inner radius
    for (const ElementKind kind : kKinds)
        for (const double slant : {0.0, 0.07}) { // legs overlap by 0.04 at their ends
            CAPTURE(std::string(shape_of(kind).name));
            SolidBoxOptions box;
            box.highest = {8, 1, kThick};
            box.cells = {32, 3, 1};
            box.kind = kind;
            TouchingBody body = with_surface(make_solid_box(box));
            const std::vector<Vec3> flat = body.mesh.nodes;
            for (Vec3& x : body.mesh.nodes) {
                const double r = kHalf + kThick - x.z(), leg = std::min(x.x(), 8 - x.x());
                const double sign = x.x() < 4 ? -1 : 1;
                const double angle = (x.x() - 4) * std::acos(0.0);
                x = leg < 3 ? Vec3(leg, x.y(), sign * (r - slant * (1 - leg / 3)))
                            : Vec3(3 + r * std::cos(angle), x.y(), r * std::sin(angle));
            }
            MortarOptions options;
            options.reach = 0.5;
            const SurfaceContacts blind = mortar_contacts(body.surface, body.mesh.nodes,
                                                          body.surface, body.mesh.nodes, options);
            CHECK(std::any_of(blind.contact.begin(), blind.contact.end(),
                              [](const SurfaceContact& c) { return c.gap < -0.3; }));
            options.at_rest = flat;
            const SurfaceContacts all = mortar_contacts(body.surface, body.mesh.nodes, body.surface,
                                                        body.mesh.nodes, options);
            check_rows(all);
            double area = 0, least = 1;
            for (const SurfaceContact& c : all.contact) {
                CHECK(std::abs(c.normal.y()) < 1e-12);
                least = std::min(least, c.gap);
                if (c.point.x() > 2.5) continue;
                area += c.area;
                CHECK(std::abs(c.normal.z()) > 0.99);
                const double leg = c.point.x();
                CHECK(std::abs(c.gap - 2 * (kHalf - slant * (1 - leg / 3))) < 1e-3);
            }
            CHECK(area > 2 * 2.3); // both legs carry multipliers
            CHECK(area < 2 * 2.7);
            CHECK(least > 2 * (kHalf - slant) - 1e-3);
        }
}

TEST_CASE(
    "a folded sheet: outer sides that stand out beyond the inner ones do not overlap through it")
{
    // In millimetres: 60 long, 20 wide, 2 thick, bent back on itself with 4 between its limbs.
    TouchingBody sheet = box_body(ElementKind::H8, {0, -10, -1}, {60, 10, 1}, {24, 2, 1});
    const std::vector<Vec3> flat = sheet.mesh.nodes;
    const double pi = 3.14159265358979323846, radius = 3, straight = (60 - pi * radius) / 2;
    for (Vec3& x : sheet.mesh.nodes) {
        const double s = x.x(), y = x.y() * (1 - 0.01 * x.z()), z = x.z(); // inside: z = 1
        const double angle = std::clamp((s - straight) / radius, 0.0, pi);
        const double along = s - straight - angle * radius; // before and behind the bend
        x = Vec3(straight + (radius - z) * std::sin(angle) + along * std::cos(angle), y,
                 radius - (radius - z) * std::cos(angle));
    }
    MortarOptions options;
    options.reach = 12;
    options.at_rest = flat;
    const SurfaceContacts found =
        mortar_contacts(sheet.surface, sheet.mesh.nodes, sheet.surface, sheet.mesh.nodes, options);
    int across = 0;
    for (const SurfaceContact& c : found.contact) {
        CHECK(c.gap > -1e-9);
        across += std::abs(c.gap - 4) < 1e-6;
    }
    CHECK(across > 10);
}

TEST_CASE("small multipliers of a quadrilateral join along its edges wherever its numbers begin")
{
    // A narrow bar across the middle of one long face: the two corners on its shorter side carry
    // less than a twentieth, and each joins the corner at the other end of its own long edge. The
    // two contacts mirror each other.
    for (int begin = 0; begin < 4; ++begin) {
        CAPTURE(begin);
        const Vec3 corner[4] = {
            {-0.05, -1, 0}, {0.05, -1, 0}, {0.05, 1, 0}, {-0.05, 1, 0}}; // around the face
        VolumeMesh mesh;
        for (const double z : {0.0, 0.1})
            for (int k = 0; k < 4; ++k)
                mesh.nodes.push_back(corner[(begin + k) % 4] + Vec3(0, 0, z));
        mesh.blocks.push_back({ElementKind::H8, {0, 1, 2, 3, 4, 5, 6, 7}});
        const TouchingBody slave = with_surface(mesh);
        const TouchingBody bar =
            box_body(ElementKind::H8, {-1, -0.052, -0.1}, {1, 0.045, 0}, {1, 1, 1});
        const SurfaceContacts found = contacts_of(slave, bar, 0.01);
        REQUIRE(found.contact.size() == 2);
        const SurfaceContact &a = found.contact[0], &b = found.contact[1];
        CHECK(a.area == doctest::Approx(b.area).epsilon(1e-9));
        CHECK(a.area == doctest::Approx(0.05 * 0.097).epsilon(1e-9));
        CHECK(a.point.x() == doctest::Approx(-b.point.x()).epsilon(1e-9));
        CHECK(a.point.y() == doctest::Approx(b.point.y()).epsilon(1e-9));
    }
}

TEST_CASE("a normal of the gap is the gradient of the gap where surfaces are shifted")
{
    const auto bend = [](TouchingBody& body, double size, double phase) {
        for (Vec3& x : body.mesh.nodes)
            x.z() += size * std::sin(3 * x.x() + phase) * std::cos(2.5 * x.y() - phase);
    };
    constexpr double kStep = 1e-5;
    for_pairs(
        {-0.5, -0.4, -1}, {1.6, 1.5, 0}, kTurn, [&](TouchingBody& slave, TouchingBody& master) {
            bend(slave, 0.03, 0.2);
            bend(master, -0.04, 0.9);
            const auto found = [&](const Vec3& shift, bool of_gap) {
                TouchingBody moved = slave;
                moved.move(Eigen::Isometry3d(Eigen::Translation3d(shift)));
                MortarOptions options;
                options.reach = 0.3;
                options.normals_of_gap = of_gap;
                return mortar_contacts(moved.surface, moved.mesh.nodes, master.surface,
                                       master.mesh.nodes, options);
            };
            const SurfaceContacts mean = found(Vec3::Zero(), false),
                                  own = found(Vec3::Zero(), true);
            REQUIRE(mean.contact.size() == own.contact.size());
            REQUIRE(mean.contact.size() > 10);
            std::vector<Vec3> gradient(mean.contact.size(), Vec3::Zero());
            for (int axis = 0; axis < 3; ++axis)
                for (const double sign : {-1.0, 1.0}) {
                    const SurfaceContacts there = found(sign * kStep * Vec3::Unit(axis), false);
                    REQUIRE(there.contact.size() == mean.contact.size());
                    for (std::size_t i = 0; i < gradient.size(); ++i) {
                        const SurfaceContact& c = there.contact[i];
                        const Vec3 opposite = weighted(there.master(c), master.mesh.nodes);
                        gradient[i][axis] +=
                            sign * mean.contact[i].normal.dot(c.point - opposite) / (2 * kStep);
                    }
                }
            double worst = 0, of_mean = 0;
            for (std::size_t i = 0; i < gradient.size(); ++i) {
                const Vec3 along = gradient[i].normalized();
                worst = std::max(worst, (own.contact[i].normal - along).norm());
                of_mean = std::max(of_mean, (mean.contact[i].normal - along).norm());
                CHECK(own.contact[i].gap * gradient[i].norm() ==
                      doctest::Approx(mean.contact[i].gap).epsilon(1e-3));
            }
            CHECK(worst < 2e-3);
            CHECK(of_mean > 20 * worst);
        });
}

TEST_CASE("what turns towards a face covers it gradually")
{
    // A block of H8 above the ridge of a roof that turns about it, until one side of the roof has a
    // cosine of 0.2 to the block's faces and covers them: no integral jumps. (Of triangles, halves
    // of faces leave the range of the search at once.)
    constexpr double kCell = 0.1, kReach = 3 * kCell;
    SolidBoxOptions block;
    block.lowest = {-3 * kCell, -3 * kCell, 0};
    block.highest = {3 * kCell, 3 * kCell, 0.5};
    block.cells = {6, 6, 2};
    const TouchingBody slave = with_surface(make_solid_box(block));
    std::map<std::int32_t, SurfaceContact> before;
    double most = 0;
    int followed = 0;
    for (double angle = 1.33; angle < 1.41; angle += 5e-4) { // the cosine is 0.2 at 1.369
        TouchingBody roof = box_body(ElementKind::H8, {0, -2, -2}, {2, 2, 0}, {1, 1, 1});
        roof.move(turn(1.5707963267948966 - angle, Vec3::UnitY(), {0.013, 0.007, -0.001}));
        std::map<std::int32_t, SurfaceContact> now;
        for (const SurfaceContact& c : contacts_of(slave, roof, kReach).contact)
            now[std::int32_t(c.id)] = c;
        for (const auto& [id, c] : now)
            if (const auto known = before.find(id); known != before.end()) {
                ++followed;
                const SurfaceContact& k = known->second;
                const double area = std::abs(c.area - k.area),
                             volume = std::abs(c.area * c.gap - k.area * k.gap);
                most = std::max({most, area / (kCell * kCell), volume / (kCell * kCell * kCell)});
            }
        before = std::move(now);
    }
    CHECK(followed > 400);
    CHECK(most < 0.01); // 0.1 where what is covered counts wholly
}
