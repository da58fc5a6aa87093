#include "mesh/extract_surface.hpp"

#include "mesh/neighbours.hpp"
#include "mesh/orient_surface.hpp"
#include "mesh/quality.hpp"
#include "mesh/surface_check.hpp"
#include "mesh/tests/sample_volumes.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <doctest/doctest.h>
#include <numbers>
#include <set>

using namespace amontons;

TEST_CASE("divergence theorem: the surface encloses the sum of the elements' volumes")
{
    for (const SampleVolume& sample : sample_volumes()) {
        CAPTURE(sample.name);
        const SurfaceIntegrals whole = integrate(extract_surface(sample.mesh), sample.mesh);
        const double volume = report_of(measure_quality(sample.mesh)).volume;
        CHECK(whole.volume == doctest::Approx(volume).epsilon(1e-12));
        CHECK(whole.area_vector.norm() <= 1e-13 * whole.area); // closed
        CHECK(volume == doctest::Approx(sample.volume).epsilon(0.15));
    }
}

TEST_CASE("the same for bodies with nodes moved about whose faces are curved")
{
    for (SampleVolume sample : sample_volumes()) {
        CAPTURE(sample.name);
        const Vec3 corner = sample.mesh.nodes[0];
        for (std::size_t i = 0; i < sample.mesh.nodes.size(); ++i) {
            const double size = 1e-2 * (sample.mesh.nodes[i] - corner).norm(),
                         k = static_cast<double>(i);
            sample.mesh.nodes[i] +=
                size * Vec3(std::sin(7 * k), std::sin(11 * k), std::sin(13 * k));
        }
        const SurfaceIntegrals whole = integrate(extract_surface(sample.mesh), sample.mesh);
        CHECK(whole.volume ==
              doctest::Approx(report_of(measure_quality(sample.mesh)).volume).epsilon(1e-12));
        CHECK(whole.area_vector.norm() <= 1e-13 * whole.area);
    }
}

TEST_CASE("faces of the surface point outwards and belong to their element")
{
    for (const SampleVolume& sample : sample_volumes()) {
        CAPTURE(sample.name);
        const ExternalSurface surface = extract_surface(sample.mesh);
        const auto at = [&](std::int32_t n) {
            return sample.mesh.nodes[static_cast<std::size_t>(n)];
        };
        for (std::size_t f = 0; f < surface.faces.size(); ++f) {
            const auto nodes = surface.face(f);
            const ElementView element = element_of(sample.mesh, surface.faces[f].element);
            Vec3 inside = Vec3::Zero();
            for (int i = 0; i < shape_of(element.kind).corners; ++i)
                inside +=
                    at(element.nodes[static_cast<std::size_t>(i)]) / shape_of(element.kind).corners;
            const Vec3 normal = (at(nodes[1]) - at(nodes[0])).cross(at(nodes[2]) - at(nodes[0]));
            CHECK(normal.dot(at(nodes[0]) - inside) > 0);
            CHECK(nodes.size() == (element.kind == ElementKind::T10 ? 6 : surface.corners[f]));
            for (const std::int32_t n : nodes)
                CHECK(surface.used_nodes[static_cast<std::size_t>(
                          surface.surface_nodes[static_cast<std::size_t>(n)])] == n);
        }
    }
}

TEST_CASE("edges of a box: 90 degrees at its 12 edges and 180 elsewhere")
{
    const double pi = std::numbers::pi;
    for (const ElementKind kind : kAllKinds) {
        CAPTURE(shape_of(kind).name);
        const VolumeMesh box = sample_box(kind);
        const SurfaceEdges edges = find_edges(extract_surface(box), box.nodes);
        double sharp = 0;
        for (const SurfaceEdge& e : edges.edges) {
            const Vec3 a = box.nodes[static_cast<std::size_t>(e.nodes[0])],
                       b = box.nodes[static_cast<std::size_t>(e.nodes[1])];
            if (std::abs(e.angle - pi / 2) < 1e-12)
                sharp += (b - a).norm();
            else
                CHECK(e.angle == doctest::Approx(pi).epsilon(1e-12));
            CHECK((e.middle >= 0) == (kind == ElementKind::T10));
            if (e.middle >= 0)
                CHECK((box.nodes[static_cast<std::size_t>(e.middle)] - 0.5 * (a + b)).norm() <
                      1e-14);
        }
        CHECK(sharp == doctest::Approx(4 * (2 + 1 + 1.5)));
    }
}

TEST_CASE("an edge inside a corner of a room has 270 degrees")
{
    VolumeMesh l = sample_box(ElementKind::H8); // 3 x 2 x 4 cells; take away those of one corner
    ElementBlock kept{ElementKind::H8, {}};
    for (std::size_t e = 0; e < l.blocks[0].size(); ++e)
        if (e % 6 != 5) { // i = 2, j = 1
            const auto nodes = l.blocks[0].element(e);
            kept.nodes.insert(kept.nodes.end(), nodes.begin(), nodes.end());
        }
    l.blocks[0] = kept;
    double inner = 0;
    for (const SurfaceEdge& e : find_edges(extract_surface(l), l.nodes).edges)
        if (std::abs(e.angle - 1.5 * std::numbers::pi) < 1e-9)
            inner += (l.nodes[static_cast<std::size_t>(e.nodes[0])] -
                      l.nodes[static_cast<std::size_t>(e.nodes[1])])
                         .norm();
    CHECK(inner == doctest::Approx(1.5));
}

TEST_CASE("triangles of the surface are closed and enclose nearly the volume")
{
    for (const SampleVolume& sample : sample_volumes()) {
        CAPTURE(sample.name);
        const ExternalSurface surface = extract_surface(sample.mesh);
        const TriangulatedSurface flat = triangulate(surface, sample.mesh);
        const SurfaceReport report = check_surface(flat.mesh);
        CHECK(report.closed());
        CHECK(report.inconsistent.empty());
        CHECK(report.enclosed_volume == doctest::Approx(sample.volume).epsilon(0.15));
        CHECK(flat.faces.size() == flat.mesh.triangles.size());
        CHECK(flat.mesh.points.size() == surface.used_nodes.size());
    }
}

TEST_CASE("neighbours are mutual and agree with a search through everything")
{
    for (const SampleVolume& sample : sample_volumes()) {
        CAPTURE(sample.name);
        const VolumeMesh& mesh = sample.mesh;
        const Lists at_nodes = elements_at_nodes(mesh), nodes = nodes_at_nodes(mesh),
                    beyond = elements_at_faces(mesh);
        std::vector<std::set<std::int32_t>> slow_elements(mesh.nodes.size()),
            slow_nodes(mesh.nodes.size());
        for_each_element(mesh, [&](std::int32_t e, ElementKind, auto of) {
            for (const std::int32_t a : of) {
                slow_elements[static_cast<std::size_t>(a)].insert(e);
                for (const std::int32_t b : of)
                    if (a != b) slow_nodes[static_cast<std::size_t>(a)].insert(b);
            }
        });
        for (std::size_t i = 0; i < mesh.nodes.size(); ++i) {
            const auto a = at_nodes.of(static_cast<std::int32_t>(i)),
                       b = nodes.of(static_cast<std::int32_t>(i));
            CHECK(std::equal(a.begin(), a.end(), slow_elements[i].begin(), slow_elements[i].end()));
            CHECK(std::equal(b.begin(), b.end(), slow_nodes[i].begin(), slow_nodes[i].end()));
        }
        std::size_t outside = 0;
        for (std::int32_t e = 0; e < static_cast<std::int32_t>(beyond.size()); ++e)
            for (const std::int32_t other : beyond.of(e)) {
                outside += other < 0 ? 1 : 0;
                if (other < 0) continue;
                const auto back = beyond.of(other);
                CHECK(std::find(back.begin(), back.end(), e) != back.end());
            }
        CHECK(outside == extract_surface(mesh).faces.size());
    }
}
