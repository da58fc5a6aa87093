#include "mesh/small_features.hpp"

#include "mesh/tests/sample_surfaces.hpp"

#include <algorithm>
#include <cmath>
#include <doctest/doctest.h>
#include <numbers>

using namespace amontons;

namespace {

SurfaceMesh box(const Vec3& size)
{
    SurfaceMesh mesh = unit_cube();
    for (Vec3& x : mesh.points)
        x = x.cwiseProduct(size);
    return mesh;
}

std::vector<SmallFeature> find(const SurfaceMesh& mesh, double size)
{
    return find_small_features(mesh, SizeField(size, {}, 0.3), std::numbers::pi / 4);
}

double least(const std::vector<SmallFeature>& all, const std::string& what)
{
    double extent = 1e300;
    for (const SmallFeature& f : all)
        if (f.what == what) extent = std::min(extent, f.extent);
    return extent;
}

} // namespace

TEST_CASE("a plate is a wall of its thickness to elements that are larger")
{
    const SurfaceMesh plate = box({1, 1, 0.05});
    CHECK(find(plate, 0.05).empty());
    const auto found = find(plate, 0.0501);
    CHECK(least(found, "a wall") == doctest::Approx(0.05));
    CHECK(least(found, "a sharp edge") == doctest::Approx(0.05));
    for (const SmallFeature& f : found)
        if (f.what == std::string("a wall")) CHECK(f.at[2] == doctest::Approx(0.025));
}

TEST_CASE("two blocks are a gap apart")
{
    const SurfaceMesh blocks = together(box({1, 1, 1}), moved(box({1, 1, 1}), 1, {0, 0, 1.02}));
    const auto found = find(blocks, 0.1);
    CHECK(least(found, "a gap") == doctest::Approx(0.02));
    CHECK(least(found, "a wall") > 1e299);
}

TEST_CASE("a wedge is no thin wall and a small tooth is a short sharp edge")
{
    SurfaceMesh wedge; // its edge along y; first with sides that all but face each other
    for (const double height : {std::tan(10 * std::numbers::pi / 180), 1.0}) {
        wedge.points = {{0, 0, 0}, {1, 0, 0}, {1, 0, height}, {0, 1, 0}, {1, 1, 0}, {1, 1, height}};
        wedge.triangles = {{0, 1, 2}, {3, 5, 4}, {0, 3, 4}, {0, 4, 1},
                           {1, 4, 5}, {1, 5, 2}, {0, 2, 5}, {0, 5, 3}};
        CHECK(find(wedge, 0.15).empty());
    }
    const auto found = find(together(wedge, moved(wedge, 0.01, {5, 0, 0})), 0.2);
    CHECK(least(found, "a sharp edge") == doctest::Approx(0.01));
}

TEST_CASE("sources of small features are as small as they are and few and near all of them")
{
    const auto found = find(box({1, 1, 0.05}), 0.2);
    const auto sources = sources_of(found);
    // In cubes of 1/32, the largest power of 2 below the thickness: a layer of 32 x 32, and edges.
    CHECK(sources.size() <= 33 * 33 + 4);
    CHECK(found.size() > sources.size());
    const SizeField field(0.2, sources, 0.3);
    for (const SmallFeature& f : found)
        CHECK(field.at(f.at) <= 2 * f.extent);
    for (const SizeSource& s : sources)
        CHECK(s.size == doctest::Approx(0.05));
}

TEST_CASE("slender triangles are examined along their length only")
{
    const SurfaceMesh rod = box({1e-3, 1e-3, 1});
    CHECK(find(rod, 9e-4).empty());
    const auto found = find(rod, 1.1e-3);
    CHECK(least(found, "a wall") == doctest::Approx(1e-3));
    // Eight triangles in pieces of one to two thicknesses, what they are pieces of, eight edges.
    CHECK(found.size() < 8 * 2 * 1000 + 8);
    CHECK(found.size() > 8 * 500);
}
