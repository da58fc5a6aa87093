// How deep parts of one solid stand in each other.

#include "contact/surface/self_overlap.hpp"

#include "mesh/generate/solid_box.hpp"
#include "solver/solid/place_in.hpp"

#include <Eigen/Geometry>
#include <doctest/doctest.h>

using namespace amontons;

namespace {

/// Two boxes in one mesh that share no node.
VolumeMesh two_boxes(ElementKind kind, std::array<std::int32_t, 3> cells)
{
    SolidBoxOptions options;
    options.cells = cells;
    options.kind = kind;
    VolumeMesh both = make_solid_box(options);
    const VolumeMesh other = both;
    const auto first = std::int32_t(both.nodes.size());
    both.nodes.insert(both.nodes.end(), other.nodes.begin(), other.nodes.end());
    for (std::size_t b = 0; b < both.blocks.size(); ++b)
        for (const std::int32_t n : other.blocks[b].nodes)
            both.blocks[b].nodes.push_back(n + first);
    both.face_sets.clear();
    both.element_sets.clear();
    return both;
}

/// The deepest place of a solid in itself [m], 0 if there is none.
OverlapSpot deepest(const VolumeMesh& mesh, std::span<const Vec3> places)
{
    const ExternalSurface surface = extract_surface(mesh);
    const FacetedSurface facets(surface);
    const PlacedSurface placed{facets, places, 0, mesh.nodes};
    const PlacedElements elements(mesh, places);
    std::vector<OverlapSpot> spots;
    self_overlap_spots(
        placed, placed,
        [&](const Vec3& x, const SurfacePlace& place) {
            std::vector<std::int32_t> nodes;
            for (const StencilEntry& e : place.nodes())
                nodes.push_back(e.node);
            return elements.hold_without(x, nodes);
        },
        spots);
    OverlapSpot most;
    for (const OverlapSpot& s : spots) {
        if (s.depth > most.depth) most = s;
        CHECK(s.own.count > 0);
        CHECK(s.other.count > 0);
    }
    return most;
}

constexpr ElementKind kKinds[] = {ElementKind::T4, ElementKind::T10, ElementKind::H8};

} // namespace

TEST_CASE("the depth of one part of a solid in another is measured, whatever its elements and "
          "wherever it stands")
{
    const Mat3 turn = Eigen::AngleAxisd(0.7, Vec3(1, -2, 0.5).normalized()).toRotationMatrix();
    for (const ElementKind kind : kKinds)
        for (const double depth : {-0.1, -1e-6, 1e-5, 0.004, 0.03, 0.2})
            for (const bool turned : {false, true}) {
                const VolumeMesh mesh = two_boxes(kind, {2, 3, 2});
                std::vector<Vec3> places = mesh.nodes;
                // Aside: nodes of one part do not lie on nodes of the other.
                for (std::size_t n = places.size() / 2; n < places.size(); ++n)
                    places[n] += Vec3(0.13, 0.21, 1 - depth);
                if (turned)
                    for (Vec3& x : places)
                        x = turn * x + Vec3(5, -3, 2);
                CAPTURE(int(kind));
                CAPTURE(depth);
                const OverlapSpot s = deepest(mesh, places);
                CHECK(s.depth == doctest::Approx(depth > 1e-3 ? depth : 0).epsilon(1e-9));
                if (depth > 0) CHECK(s.face <= std::sqrt(2.0 / 4 + 1e-9) * 1.001);
            }
}

TEST_CASE("edges of a solid that cross are found between its nodes")
{
    for (const ElementKind kind : kKinds) {
        const VolumeMesh mesh = two_boxes(kind, {1, 1, 1});
        std::vector<Vec3> places = mesh.nodes;
        // Bars, the upper one crosswise and on its edge: all its nodes are clear of the lower one.
        const double depth = 0.05;
        const Mat3 on_edge = Eigen::AngleAxisd(std::numbers::pi / 4, Vec3::UnitX()).matrix();
        const Mat3 crosswise = Eigen::AngleAxisd(std::numbers::pi / 2, Vec3::UnitZ()).matrix();
        const Vec3 middle = Vec3::Constant(0.5), size(4, 0.5, 0.5);
        for (std::size_t n = 0; n < places.size(); ++n) {
            const Vec3 own = on_edge * (places[n] - middle).cwiseProduct(size);
            const bool upper = n >= places.size() / 2;
            const double half = std::sqrt(2.0) / 4;
            places[n] = upper ? Vec3(crosswise * own + Vec3(0, 0, 2 * half - depth)) : own;
        }
        CAPTURE(int(kind));
        const OverlapSpot s = deepest(mesh, places);
        CHECK(s.depth > 0.5 * depth); // below a side that is inclined by 45 degrees
        CHECK(s.depth <= depth);
    }
}

TEST_CASE("thin, bent and flattened solids do not stand in themselves")
{
    for (const ElementKind kind : kKinds)
        for (const double flat : {1.0, 0.02}) {
            SolidBoxOptions options;
            options.cells = {12, 2, 1};
            options.kind = kind;
            const VolumeMesh mesh = make_solid_box(options);
            std::vector<Vec3> places = mesh.nodes;
            for (Vec3& x : places) { // an arc of 300 degrees whose ends face each other
                const double r = 1 + 0.1 * flat * x.z(), a = 5.2 * x.x();
                x = Vec3(r * std::cos(a), x.y(), r * std::sin(a));
            }
            CAPTURE(int(kind));
            CHECK(deepest(mesh, places).depth == 0);
            for (std::size_t n = 0; n < places.size(); ++n) { // closed beyond its other end
                const Vec3& x = mesh.nodes[n];
                const double r = 1 + 0.1 * flat * x.z(), a = 6.5 * x.x();
                places[n] = Vec3(r * std::cos(a), x.y(), r * std::sin(a));
            }
            CHECK(deepest(mesh, places).depth > 0.001 * flat);
        }
}
