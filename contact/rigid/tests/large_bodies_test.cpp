#include "contact/rigid/extent.hpp"
#include "contact/rigid/polyhedron_pair.hpp"
#include "contact/rigid/tests/contacts_for_tests.hpp"
#include "mesh/base/index.hpp"

using namespace amontons;

// Of bodies with many features only those near each other are compared.

namespace {

/// An ellipsoid of meridians and parallels: 2 n (m - 1) triangles.
/// @param turned  each parallel against the one before, in parts of the triangles' width: not
/// convex
///                unless 0
SurfaceMesh round_mesh(const Vec3& radii, int n, int m, double turned)
{
    SurfaceMesh mesh;
    mesh.points.push_back(-radii.z() * Vec3::UnitZ());
    for (int j = 1; j < m; ++j)
        for (int i = 0; i < n; ++i) {
            const double a = M_PI * j / m, b = 2 * M_PI * (i + turned * j) / n;
            mesh.points.push_back(radii.cwiseProduct(
                Vec3{std::sin(a) * std::cos(b), std::sin(a) * std::sin(b), -std::cos(a)}));
        }
    mesh.points.push_back(radii.z() * Vec3::UnitZ());
    const int last = int(mesh.points.size()) - 1;
    for (int i = 0; i < n; ++i) {
        const int next = (i + 1) % n;
        mesh.triangles.push_back({0, 1 + next, 1 + i});
        for (int j = 0; j + 2 < m; ++j) {
            const int a = 1 + j * n + i, b = 1 + j * n + next;
            mesh.triangles.push_back({a, b, b + n});
            mesh.triangles.push_back({a, b + n, a + n});
        }
        mesh.triangles.push_back({last, last - n + i, last - n + next});
    }
    return mesh;
}

TriangleShape round_body(const Vec3& radii, int n, int m)
{
    return make_triangle_shape(round_mesh(radii, n, m, 0.25));
}

/// Every feature of one body with every feature of the other, of bodies that are apart.
Contacts contacts_of_all_triangles(const TriangleShape& a, const Pose& pa, const TriangleShape& b,
                                   const Pose& pb, double reach)
{
    const Mat3 turn_b = pb.turn.toRotationMatrix(),
               turn = turn_b.transpose() * pa.turn.toRotationMatrix();
    const Vec3 shift = turn_b.transpose() * (pa.place - pb.place);
    const PolyhedronTopology of_a = a.polyhedron.topology(), of_b = b.polyhedron.topology();
    const PolyhedronView own = a.polyhedron.view(of_a), view_b = b.polyhedron.view(of_b);
    TurnedPolyhedron turned(own, turn, shift);
    Contacts out;
    PolyhedronPair pair{{turned.view(), &a, nullptr, turn, shift},
                        {view_b, &b, nullptr, Mat3::Identity(), Vec3::Zero()},
                        reach,
                        std::min(farthest_vertex(a), farthest_vertex(b)),
                        &out};
    pair.deepest = reach;
    for (const bool on_a : {true, false}) {
        const PolyhedronView &x = on_a ? pair.a.view : pair.b.view,
                             &y = on_a ? pair.b.view : pair.a.view;
        for (std::size_t v = 0; v < x.vertices.size(); ++v)
            for (std::size_t e = 0; e < y.edges.size(); ++e)
                add_vertex_edge(pair, on_a, number(v), number(e));
        for (std::size_t v = 0; v < x.vertices.size(); ++v)
            for (std::size_t f = 0; f < y.normals.size(); ++f)
                if (const auto h = height_over_face(pair, on_a, number(v), number(f)); h && *h >= 0)
                    add_vertex_face(pair, on_a, number(v), number(f), *h);
    }
    for (std::size_t v = 0; v < own.vertices.size(); ++v)
        for (std::size_t w = 0; w < view_b.vertices.size(); ++w)
            add_vertex_vertex(pair, number(v), number(w));
    for (std::size_t e = 0; e < own.edges.size(); ++e)
        for (std::size_t f = 0; f < view_b.edges.size(); ++f)
            add_edge_edge(pair, number(e), number(f));
    drop_repeated(out, 0, pair.size);
    return out;
}

std::vector<std::uint64_t> ids(const Contacts& all)
{
    std::vector<std::uint64_t> found;
    for (const RigidContact& c : all)
        found.push_back(c.id);
    std::sort(found.begin(), found.end());
    return found;
}

} // namespace

TEST_CASE("the lowest vertex of a body and the box around it are those of all its vertices")
{
    std::mt19937 rng{31};
    for (const TriangleShape& body :
         {round_body({0.5, 0.3, 0.4}, 30, 20), triangle_l(), triangle_box({0.5, 0.7, 0.3}, 4),
          make_triangle_shape(round_mesh({0.5, 0.3, 0.4}, 100, 60, 0))}) {
        const std::vector<Vec3>& all = body.polyhedron.vertices;
        const RigidShape shape = body;
        for (int k = 0; k < 200; ++k) {
            const Vec3 n = k < 6 ? signed_axis(k / 2, k % 2 == 0) : random_vector(rng).normalized();
            double least = 1e300;
            for (const Vec3& x : all)
                least = std::min(least, n.dot(x));
            CHECK(std::abs(lowest_along(body, n) - least) < 1e-15);
            CHECK(std::abs(n.dot(all[at(lowest_vertex(body, n))]) - least) < 1e-15);
            const Pose pose = random_pose(rng);
            double farthest = 0;
            for (const Vec3& x : all)
                farthest = std::max(farthest, x.norm());
            CHECK(std::abs(bounding_radius(shape) - farthest) < 1e-15);
            const AxisBox box = axis_box(shape, pose);
            Vec3 low = Vec3::Constant(1e300), high = -low;
            for (const Vec3& x : all) {
                low = low.cwiseMin(pose.place + pose.turn * x);
                high = high.cwiseMax(pose.place + pose.turn * x);
            }
            CHECK((box.low - low).norm() < 1e-14);
            CHECK((box.high - high).norm() < 1e-14);
        }
    }
}

TEST_CASE("a body of many faces is convex if it is so at each edge")
{
    std::mt19937 rng{33};
    const SurfaceMesh mesh = round_mesh({0.5, 0.3, 0.4}, 100, 60, 0);
    CHECK(make_triangle_shape(mesh).polyhedron.convex);
    for (const double in : {1e-3, 0.3}) { // of the way to the middle
        SurfaceMesh dented = mesh;
        const std::size_t v = dented.points.size() / 3;
        dented.points[v] *= 1 - in;
        const TriangleShape body = make_triangle_shape(dented);
        CHECK_FALSE(body.polyhedron.convex);
        // Its lowest vertex towards the dent is beside it.
        const Vec3 n = -mesh.points[v].normalized();
        double least = 1e300;
        for (const Vec3& x : dented.points)
            least = std::min(least, n.dot(x));
        CHECK(std::abs(lowest_along(body, n) - least) < 1e-15);
    }
    CHECK_FALSE(round_body({0.5, 0.3, 0.4}, 100, 60).polyhedron.convex);
}

TEST_CASE("large bodies that are apart have the contacts of all their features with all" *
          doctest::test_suite("slow"))
{
    std::mt19937 rng{32};
    std::uniform_real_distribution<double> uniform(0, 1);
    const TriangleShape round = round_body({0.5, 0.5, 0.5}, 22, 12),
                        other = round_body({0.5, 0.3, 0.4}, 18, 14), hollow = triangle_l();
    std::size_t compared = 0;
    for (int k = 0; k < 60; ++k) {
        const TriangleShape &a = k % 3 == 2 ? hollow : round, &b = k % 3 == 1 ? round : other;
        const Vec3 n = k < 6 ? signed_axis(k / 2, k % 2 == 0) : random_vector(rng).normalized();
        const Pose pb{random_vector(rng), random_turn(rng)};
        Pose pa{Vec3::Zero(), random_turn(rng)};
        const double reach = 0.1 * uniform(rng), apart = 0.5 * reach * uniform(rng);
        const double low = lowest_along(a, pa.turn.conjugate() * n),
                     high = -lowest_along(b, pb.turn.conjugate() * -n);
        const Vec3 beside = n.unitOrthogonal();
        pa.place = pb.place + (high - low + apart) * n + 0.1 * uniform(rng) * beside;
        CAPTURE(k);
        const Contacts all = contacts_of_all_triangles(a, pa, b, pb, reach);
        CHECK(ids(contacts(a, pa, b, pb, reach)) == ids(all));
        compared += all.size();
    }
    CHECK(compared > 300);
}
