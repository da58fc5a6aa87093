#include "mesh/self_intersection.hpp"

#include "mesh/predicates.hpp"
#include "mesh/tests/sample_surfaces.hpp"

#include <Eigen/Geometry>
#include <doctest/doctest.h>
#include <random>

using namespace amontons;

namespace {

using Pair = std::array<std::int32_t, 2>;

std::int64_t count(const SurfaceMesh& mesh)
{
    return find_self_intersections(mesh, 10).count;
}

/// Two triangles; those corners of the second that are at a place of the first are shared.
bool touch(const std::array<Vec3, 3>& a, const std::array<Vec3, 3>& b)
{
    SurfaceMesh mesh;
    mesh.points.assign(a.begin(), a.end());
    std::array<std::int32_t, 3> second{};
    for (std::size_t i = 0; i < 3; ++i) {
        const auto known = std::find(a.begin(), a.end(), b[i]) - a.begin();
        second[i] =
            static_cast<std::int32_t>(known < 3 ? known : std::ptrdiff_t(mesh.points.size()));
        if (known == 3) mesh.points.push_back(b[i]);
    }
    mesh.triangles = {{0, 1, 2}, second};
    const bool found = count(mesh) == 1;
    std::swap(mesh.triangles[0], mesh.triangles[1]); // the answer has no order
    std::swap(mesh.triangles[0][0], mesh.triangles[0][2]);
    CHECK((count(mesh) == 1) == found);
    return found;
}

const std::array<Vec3, 3> kBase = {Vec3(0, 0, 0), Vec3(4, 0, 0), Vec3(0, 4, 0)};

} // namespace

TEST_CASE("the side of a plane is exact where double precision is not")
{
    std::mt19937 rng{3};
    std::uniform_int_distribution<int> whole(-1000000, 1000000);
    const auto point = [&] { return Vec3(whole(rng), whole(rng), whole(rng)); };
    for (int i = 0; i < 2000; ++i) {
        const Vec3 a = point(), u = point(), v = point();
        // In the plane, then the smallest step away from it; whole numbers are exact.
        const Vec3 d = a + 3 * u - 5 * v;
        CHECK(orientation(a, a + u, a + v, d) == 0);
        const Vec3 n = u.cross(v);
        const Vec3 step(n[0] > 0 ? 1 : -1, 0, 0);
        if (n[0] == 0) continue;
        CHECK(orientation(a, a + u, a + v, d + step) == -1);
        CHECK(orientation(a, a + u, a + v, d - step) == 1);
        CHECK(orientation(a + u, a, a + v, d + step) == 1);
    }
    // 3 * 0.1 is not 0.3: these four points are not in one plane, by half a rounding.
    const double step = 0.1 + 0.2 - 0.3;
    CHECK(step != 0);
    CHECK(orientation({0, 0, 0.3}, {1, 0, 0.3}, {0, 1, 0.3}, {5, 5, 0.1 + 0.2}) == -1);
    CHECK(orientation_along(2, {0, 0.1, 0}, {1, 0.1, 0}, {7, 0.1, 0}) == 0);
    CHECK(orientation_along(2, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}) == 1);
    CHECK(orientation_along(0, {0, 0, 0}, {0, 1, 0}, {0, 0, 1}) == 1);
}

TEST_CASE("triangles without a common vertex: through or touching or apart")
{
    CHECK(touch(kBase, {Vec3(1, 1, -1), Vec3(1, 1, 1), Vec3(9, 9, 0.5)})); // through the inside
    CHECK(touch(kBase, {Vec3(1, 1, 0), Vec3(1, 1, 5), Vec3(2, 1, 5)}));    // vertex on the face
    CHECK(touch(kBase, {Vec3(2, 2, 0), Vec3(5, 5, 5), Vec3(6, 5, 5)}));    // vertex on an edge
    CHECK(touch(kBase, {Vec3(2, -1, 0), Vec3(2, 5, 0), Vec3(2, 2, 5)}));   // edge in the face
    CHECK(touch(kBase, {Vec3(1, 1, 0), Vec3(2, 1, 0), Vec3(1, 2, 0)}));    // inside, in one plane
    CHECK(
        touch(kBase, {Vec3(-9, -9, 0), Vec3(30, -9, 0), Vec3(-9, 30, 0)})); // around, in one plane
    CHECK(touch(kBase, {Vec3(1, -1, 0), Vec3(1, 9, 0), Vec3(9, 9, 0)}));    // across, in one plane
    CHECK(!touch(kBase, {Vec3(1, 1, 1e-300), Vec3(2, 1, 1), Vec3(1, 2, 1)}));
    CHECK(!touch(kBase, {Vec3(3, 3, -1), Vec3(3, 3, 1), Vec3(9, 9, 0)})); // beside
    CHECK(!touch(kBase, {Vec3(5, 0, 0), Vec3(9, 0, 0), Vec3(5, 4, 0)}));  // beside, in one plane
    CHECK(!touch(kBase, {Vec3(2, 2.1, 0), Vec3(4, 4, 0), Vec3(2, 4, 0)}));
}

TEST_CASE("triangles with one common vertex touch there only or not only there")
{
    const Vec3 o = kBase[0];
    CHECK(!touch(kBase, {o, Vec3(-1, 0, 0), Vec3(0, -1, 0)})); // in one plane
    CHECK(!touch(kBase, {o, Vec3(1, 1, 1), Vec3(2, 1, 1)}));
    CHECK(!touch(kBase, {o, Vec3(0, 0, 1), Vec3(-1, -1, -1)}));
    CHECK(touch(kBase, {o, Vec3(9, 9, 1), Vec3(9, 9, -1)})); // through, out at the far edge
    CHECK(touch(kBase, {o, Vec3(1, 1, 1), Vec3(1, 1, -1)})); // through, ends inside
    CHECK(touch(kBase, {o, Vec3(1, 1, 0), Vec3(1, 1, 5)}));  // an edge lies in the face
    CHECK(touch(kBase, {o, Vec3(1, 1, 0), Vec3(1, 2, 0)}));  // in one plane, inside
    CHECK(touch(kBase, {o, Vec3(9, 1, 0), Vec3(1, 9, 0)}));  // in one plane, wider
    CHECK(touch(kBase, {o, Vec3(1, -1, 0), Vec3(1, 9, 0)})); // in one plane, across
    CHECK(touch(kBase, {o, Vec3(2, 0, 0), Vec3(1, -1, 0)})); // along half an edge
}

TEST_CASE("triangles with a common edge touch elsewhere only when folded flat")
{
    CHECK(!touch(kBase, {kBase[0], kBase[1], Vec3(1, -1, 0)})); // flat
    CHECK(!touch(kBase, {kBase[1], kBase[0], Vec3(1, 1, 1)}));
    CHECK(!touch(kBase, {kBase[1], kBase[0], Vec3(1, 1, 1e-300)})); // almost folded
    CHECK(touch(kBase, {kBase[1], kBase[0], Vec3(1, 1, 0)}));
    CHECK(touch(kBase, {kBase[1], kBase[0], Vec3(9, 9, 0)}));
    CHECK(touch(kBase, {kBase[1], kBase[2], kBase[0]})); // the same triangle twice
}

TEST_CASE("good surfaces have no self-intersection at any scale and in any position")
{
    const Eigen::AngleAxisd turn(0.7, Vec3(1, 2, 3).normalized());
    for (const double size : {1e-6, 1.0, 1e6}) {
        for (SurfaceMesh mesh : {unit_cube(), open_tube(40, 30, 8)}) {
            CHECK(count(moved(mesh, size, Vec3::Zero())) == 0);
            for (Vec3& x : mesh.points)
                x = size * (turn * x + Vec3(3, -2, 1));
            CHECK(count(mesh) == 0);
        }
    }
}

TEST_CASE("two cubes: one in the other or apart or through each other")
{
    const SurfaceMesh cube = unit_cube();
    CHECK(count(together(cube, moved(cube, 0.5, Vec3(0.25, 0.25, 0.25)))) == 0);
    CHECK(count(together(cube, moved(cube, 1, Vec3(1.5, 0, 0)))) == 0);
    const SurfaceMesh crossed = together(cube, moved(cube, 1, Vec3(0.3, 0.4, 0.6)));
    const SelfIntersections found = find_self_intersections(crossed, 3);
    CHECK(found.count > 3);
    REQUIRE(found.pairs.size() == 3);
    CHECK(std::is_sorted(found.pairs.begin(), found.pairs.end()));
    for (const Pair& p : found.pairs) {
        CHECK(p[0] < 12); // a triangle of the one cube with one of the other
        CHECK(p[1] >= 12);
    }
    CHECK(find_self_intersections(crossed, 1000).count == found.count);
    CHECK(std::int64_t(find_self_intersections(crossed, 1000).pairs.size()) == found.count);
}

TEST_CASE("the tree finds all pairs that a search of all pairs finds")
{
    std::mt19937 rng{5};
    std::normal_distribution<double> normal;
    SurfaceMesh mesh;
    for (int i = 0; i < 400; ++i) {
        const Vec3 at = 3 * Vec3(normal(rng), normal(rng), normal(rng));
        for (int k = 0; k < 3; ++k)
            mesh.points.push_back(at + Vec3(normal(rng), normal(rng), normal(rng)));
        mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    }
    std::vector<Pair> brute;
    SurfaceMesh two = mesh;
    for (std::size_t i = 0; i < 400; ++i)
        for (std::size_t j = i + 1; j < 400; ++j) {
            two.triangles = {mesh.triangles[i], mesh.triangles[j]};
            if (count(two) == 1)
                brute.push_back({static_cast<std::int32_t>(i), static_cast<std::int32_t>(j)});
        }
    CHECK(brute.size() > 100);
    CHECK(find_self_intersections(mesh, 100000).pairs == brute);
}

namespace {

/// Of a tube, or of what it is unrolled into a skew plane, where exact signs are needed all over.
std::int64_t compared_of_tube(int along, bool unrolled)
{
    SurfaceMesh mesh = open_tube(100, along, 10);
    if (unrolled) {
        for (Vec3& x : mesh.points) {
            const double angle = std::atan2(x[1], x[0]);
            x = Vec3(angle, x[2], 0.3 * angle + 0.7 * x[2]);
        }
        std::erase_if(mesh.triangles, [&](const auto& t) { // those across the seam
            const auto angle = [&](int i) {
                return mesh.points[static_cast<std::size_t>(t[static_cast<std::size_t>(i)])][0];
            };
            return std::abs(angle(0) - angle(1)) > 1 || std::abs(angle(1) - angle(2)) > 1;
        });
    }
    const SelfIntersections found = find_self_intersections(mesh, 10);
    CHECK(found.count == 0);
    return found.compared;
}

} // namespace

TEST_CASE("comparisons grow with the number of triangles even if all are in one plane" *
          doctest::test_suite("slow"))
{
    for (const bool unrolled : {false, true}) {
        CAPTURE(unrolled);
        const double few = double(compared_of_tube(125, unrolled)), // of 25 000 triangles
            many = double(compared_of_tube(500, unrolled));         // of 100 000
        MESSAGE(few << " pairs of boxes, then " << many);
        CHECK(many < 4.6 * few);    // n log n: 4 log 100 000 / log 25 000 = 4.55; all pairs: 16
        CHECK(many < 52 * 100'000); // [regression] 26 and 25 a triangle, twice that
    }
}

TEST_CASE("a pile of equal triangles is not searched to its end")
{
    SurfaceMesh pile;
    for (int i = 0; i < 5000; ++i) {
        pile.points.insert(pile.points.end(), kBase.begin(), kBase.end());
        pile.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    }
    CHECK(count(pile) == 1'000'000);
}
