#include "mesh/generate/solid_box.hpp"

#include "mesh/split_elements.hpp"
#include "mesh/tests/sample_surfaces.hpp"
#include "mesh/tests/sample_volumes.hpp"
#include "mesh/volume_check.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <doctest/doctest.h>
#include <numbers>

using namespace amontons;

namespace {

double volume_of(const VolumeMesh& mesh)
{
    return report_of(measure_quality(mesh)).volume;
}

double area_of(const VolumeMesh& mesh, const char* set)
{
    const FaceSet* faces = find_set(mesh.face_sets, set);
    REQUIRE(faces != nullptr);
    return integrate(surface_of(mesh, faces->members), mesh).area;
}

/// How the error falls when the element size is halved: its power.
template <class Make> double order(Make make, double exact)
{
    const double coarse = std::abs(volume_of(make(1)) - exact),
                 fine = std::abs(volume_of(make(2)) - exact);
    return std::log2(coarse / fine);
}

} // namespace

TEST_CASE("generated solids have no fault and no warning and one closed part")
{
    for (const SampleVolume& sample : sample_volumes()) {
        CAPTURE(sample.name);
        const VolumeReport report = check_volume(sample.mesh);
        CHECK(errors_of(report, sample.mesh, "f").empty());
        const auto warnings = warnings_of(report, sample.mesh, "f");
        CHECK_MESSAGE(warnings.empty(), (warnings.empty() ? "" : InputError(warnings).what()));
        CHECK(report.surface_borders == 0);
        CHECK(report.surface_parts == 1);
        const bool tube = sample.name.find("tube") != std::string::npos;
        CHECK(report.euler_characteristic == (tube ? 0 : 2)); // a torus, a sphere
        CHECK(report.quality.shape.least >
              0.1); // [regression] cells are up to five times longer than wide
    }
}

TEST_CASE("each generator covers its surface with its face sets once")
{
    for (const SampleVolume& sample : sample_volumes()) {
        CAPTURE(sample.name);
        std::vector<FaceRef> all;
        for (const FaceSet& set : sample.mesh.face_sets) {
            CHECK(std::is_sorted(set.members.begin(), set.members.end()));
            all.insert(all.end(), set.members.begin(), set.members.end());
        }
        std::sort(all.begin(), all.end());
        CHECK(all == extract_surface(sample.mesh).faces);
        CHECK(find_set(sample.mesh.element_sets, "volume")->members.size() ==
              element_count(sample.mesh));
    }
}

TEST_CASE("a box is exact: volume and sides and graded cells")
{
    for (const ElementKind kind : kAllKinds) {
        CAPTURE(shape_of(kind).name);
        const VolumeMesh box = sample_box(kind);
        CHECK(volume_of(box) == doctest::Approx(3).epsilon(1e-14));
        CHECK(area_of(box, "x_min") == doctest::Approx(1.5).epsilon(1e-14));
        CHECK(area_of(box, "y_max") == doctest::Approx(3).epsilon(1e-14));
        CHECK(area_of(box, "z_min") == doctest::Approx(2).epsilon(1e-14));
        for (const std::int32_t n : nodes_of(box, *find_set(box.face_sets, "y_max")))
            CHECK(box.nodes[static_cast<std::size_t>(n)][1] == 3);
        CHECK(element_count(box) == (kind == ElementKind::H8 ? 24 : 144));
    }
    const VolumeMesh box = sample_box(ElementKind::H8);
    CHECK(box.nodes.size() == 4 * 3 * 5);
    const double first = box.nodes[12][2] - box.nodes[0][2], // z: four cells, the last a quarter
        last = box.nodes[59][2] - box.nodes[47][2];
    CHECK(last / first == doctest::Approx(0.25));
}

TEST_CASE("round solids converge to the true volume with order 2 and with T10 order 4")
{
    const double pi = std::numbers::pi;
    for (const ElementKind kind : kAllKinds) {
        CAPTURE(shape_of(kind).name);
        const double expected = kind == ElementKind::T10 ? 4 : 2;
        CHECK(order(
                  [&](int fine) {
                      return make_solid_ball({{1, 2, 3}, 0.5, 8 * fine, kind});
                  },
                  pi / 6) == doctest::Approx(expected).epsilon(0.1));
        CHECK(
            order(
                [&](int fine) {
                    return make_solid_cylinder({{1, 0, 0}, {1, 2, 2}, 0.25, 2, 8 * fine, 2, kind});
                },
                pi / 8) == doctest::Approx(expected).epsilon(0.1));
        CHECK(order([&](int fine) { return sample_tube(kind, 2 * fine); },
                    pi * (0.025 * 0.025 - 0.02 * 0.02) * 0.15) ==
              doctest::Approx(expected).epsilon(0.1));
    }
}

TEST_CASE("surface nodes of round solids lie on the true surface")
{
    for (const ElementKind kind : kAllKinds) {
        const VolumeMesh ball = make_solid_ball({{1, 2, 3}, 0.5, 6, kind});
        for (const std::int32_t n : nodes_of(ball, ball.face_sets[0]))
            CHECK((ball.nodes[static_cast<std::size_t>(n)] - Vec3(1, 2, 3)).norm() ==
                  doctest::Approx(0.5).epsilon(1e-14));
        Centreline line{{0, 0, 0}, {0, 0, 1}, {1, 0, 0}, 0.01};
        line.append_line(0.1, 0.01);
        const VolumeMesh tube = make_solid_tube({line, 0.002, 7, 3, 4, kind});
        for (const auto& [name, radius] : {std::pair{"inner", 0.01}, {"outer", 0.012}})
            for (const std::int32_t n : nodes_of(tube, *find_set(tube.face_sets, name)))
                CHECK(tube.nodes[static_cast<std::size_t>(n)].head<2>().norm() ==
                      doctest::Approx(radius).epsilon(1e-13));
        for (const std::int32_t n : nodes_of(tube, *find_set(tube.face_sets, "end")))
            CHECK(tube.nodes[static_cast<std::size_t>(n)][2] == doctest::Approx(0.1));
    }
}

TEST_CASE("hexahedra of any numbering are cut into tetrahedra that fit")
{
    // Numbers decide the diagonals: shuffle them, and every cut must still fill the box.
    VolumeMesh box = sample_box(ElementKind::H8);
    const auto n = static_cast<std::int32_t>(box.nodes.size());
    for (const std::int32_t factor : {7, 13, 23, 37, 49}) { // coprime to 60
        CAPTURE(factor);
        VolumeMesh shuffled = box;
        for (std::int32_t i = 0; i < n; ++i)
            shuffled.nodes[static_cast<std::size_t>(i * factor % n)] =
                box.nodes[static_cast<std::size_t>(i)];
        for (std::int32_t& i : shuffled.blocks[0].nodes)
            i = i * factor % n;
        const VolumeMesh tetrahedra = tetrahedra_of(shuffled);
        const VolumeReport report = check_volume(tetrahedra);
        CHECK(errors_of(report, tetrahedra, "f").empty());
        CHECK(report.surface_borders == 0);
        CHECK(report.surface.faces.size() == 2 * extract_surface(box).faces.size());
        CHECK(report.quality.volume == doctest::Approx(3));
    }
}

TEST_CASE("generators report every number that is out of range")
{
    SolidBoxOptions box;
    box.highest = {1, -1, 1};
    box.cells = {0, 1, 1};
    box.grading = {1, 0, 1};
    CHECK(refusal([&] { make_solid_box(box); }) ==
          "/cells/0: found 0, allowed: >= 1\n"
          "/size/1: found -1, allowed: > 0 and finite [m]\n"
          "/grading/1: found 0, allowed: 1e-6 to 1e6");
    box = {};
    box.cells = {2000000000, 2000000000, 2000000000};
    CHECK(refusal([&] { make_solid_box(box); }).find("at most") != std::string::npos);
    CHECK(refusal([&] {
              make_solid_ball({{0, 0, 0}, -1, 1, ElementKind::H8});
          }) == "/radius: found -1, allowed: > 0 and finite [m]\n"
                "/cells: found 1, allowed: 2 to 2000");
    CHECK(refusal([&] {
              make_solid_cylinder({{0, 0, 0}, {0, 0, 0}, 1, 0, 4, 0, ElementKind::H8});
          }).find("/axis") != std::string::npos);
    Centreline line{{0, 0, 0}, {0, 0, 1}, {1, 0, 0}, 0.01};
    line.append_arc(0.012, 1, 0, 0.01);
    CHECK(refusal([&] {
              make_solid_tube({line, 0.003, 8, 1, 8, ElementKind::H8});
          }).find("a bend of radius 0.012") != std::string::npos);
}
