#include "solver/output/vtk_writer.hpp"

#include "mesh/base/file.hpp"
#include "mesh/tests/temporary_folder.hpp"
#include "mesh/tests/test_program.hpp"
#include "solver/output/beam_tube.hpp"
#include "solver/output/frame_bytes.hpp"
#include "solver/output/meanings.hpp"

#include <Eigen/Geometry>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <doctest/doctest.h>

using namespace amontons;

namespace {

/// The values of an appended array, from the bytes alone.
template <class Number>
std::vector<Number> appended(const std::string& bytes, const std::string& name)
{
    const std::size_t array = bytes.find("Name=\"" + name + "\"");
    REQUIRE(array != std::string::npos);
    const std::size_t offset_at = bytes.find("offset=\"", array) + 8;
    const std::size_t offset = std::stoul(bytes.substr(offset_at, 20));
    const std::size_t raw = bytes.find("<AppendedData encoding=\"raw\">\n_") + 31;
    std::uint64_t size = 0;
    std::memcpy(&size, bytes.data() + raw + offset, sizeof size);
    std::vector<Number> values(size / sizeof(Number));
    std::memcpy(values.data(), bytes.data() + raw + offset + sizeof size, size);
    return values;
}

const std::vector<Vec3> kPoints{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0.1}};

PolyData example_polydata(const std::vector<double>& scalars, const std::vector<double>& vectors)
{
    PolyData data;
    data.points = kPoints;
    data.lines = {{0, 1, 2}};
    static const std::vector<std::array<std::int32_t, 3>> triangles{{0, 1, 2}, {0, 2, 3}};
    data.triangles = triangles;
    data.vertices = true;
    data.point_arrays = {{"gap", "m", 1, scalars},
                         {"force", "N", 3, vectors, Stored::float32},
                         {"status", "", 1, scalars, Stored::int32}};
    return data;
}

} // namespace

TEST_CASE("what is written to a VTP stands in its bytes")
{
    const std::vector<double> scalars{1, 2, 3, 4.75},
        vectors{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 0.1};
    const std::string bytes = vtp_bytes(example_polydata(scalars, vectors), 2.5);
    CHECK(appended<double>(bytes, "gap") == scalars);
    CHECK(appended<float>(bytes, "force").back() == 0.1f);
    CHECK(appended<std::int32_t>(bytes, "status") == std::vector<std::int32_t>{1, 2, 3, 4});
    CHECK(appended<double>(bytes, "points").size() == 12);
    CHECK(bytes.find("Name=\"TimeValue\" NumberOfTuples=\"1\" format=\"ascii\">2.5<") !=
          std::string::npos);
    CHECK(bytes.find("location=\"vtkDataArray\">N</InformationKey>") != std::string::npos);
}

TEST_CASE("VTK reads every file without a warning")
{
    if (!std::filesystem::exists(VTK_READS)) {
        skip_test("the module vtk is not built (libvtk9-dev)");
        return;
    }
    const TemporaryFolder folder;
    const std::vector<double> scalars{1, 2, 3, 4.75}, vectors(12, 0.5);
    const auto write = [&](const char* name, const std::string& bytes) {
        write_file(folder / name, bytes, Flush::to_system);
    };
    write("full.vtp", vtp_bytes(example_polydata(scalars, vectors), 1.5));
    PolyData empty;
    empty.vertices = true;
    empty.point_arrays = {{"gap", "m", 1, {}}, {"force", "N", 3, {}}};
    write("empty.vtp", vtp_bytes(empty, 0));
    UnstructuredGrid grid;
    grid.points = kPoints;
    const std::vector<std::int32_t> connectivity{0, 1, 2, 3}, offsets{4};
    const std::vector<std::uint8_t> types{10};
    const std::vector<double> pressure{7}, stress(6, 1.0);
    grid.connectivity = connectivity;
    grid.offsets = offsets;
    grid.types = types;
    grid.point_arrays = {{"displacement", "m", 3, vectors}};
    grid.cell_arrays = {{"pressure", "Pa", 1, pressure}, {"stress", "Pa", 6, stress}};
    write("tet.vtu", vtu_bytes(grid, 3));
    Collection collection;
    collection.add({0, 0, "a", "full.vtp"});
    collection.add({0.5, 0, "a", "empty.vtp"});
    write("all.pvd", collection.bytes());
    const auto reads = [&](const char* name) {
        const std::string command =
            std::string(VTK_READS) + " " + folder / name + " >/dev/null 2>&1";
        return std::system(command.c_str()) == 0;
    };
    CHECK(reads("all.pvd"));
    CHECK(reads("tet.vtu"));
    std::string broken =
        vtp_bytes(example_polydata(scalars, vectors), 1.5); // the check itself can fail
    write("broken.vtp", broken.substr(0, broken.size() - 200));
    CHECK_FALSE(reads("broken.vtp"));
}

TEST_CASE("the surface of a straight wire is a closed cylinder")
{
    BeamRecord beam;
    constexpr int kRings = 20, kCorners = 40;
    const double radius = 0.5, length = 3;
    beam.fields = {{"radius", "m", 1, {}}, {"moment", "N m", 3, {}}};
    for (int i = 0; i < kRings; ++i) {
        beam.points.push_back(Vec3{1, 2, 3} +
                              length * i / (kRings - 1) * Vec3{1, 1, 1}.normalized());
        beam.fields[0].values.push_back(radius);
        beam.fields[1].values.insert(beam.fields[1].values.end(), {0, 0, double(i)});
    }
    TubeSurface tube;
    for (int again = 0; again < 2; ++again) { // its memory is used again
        make_tube_surface(beam, kCorners, tube);
        REQUIRE(tube.points.size() == kRings * kCorners);
        CHECK(tube.fields[1].values.size() == 3 * tube.points.size());
        double volume = 0;
        for (const auto& t : tube.triangles) {
            const auto p = [&](int k) {
                return tube.points[static_cast<std::size_t>(t[static_cast<std::size_t>(k)])];
            };
            volume += p(0).dot(p(1).cross(p(2))) / 6;
        }
        // Prism of a regular polygon; positive: normals outwards.
        const double pi = 3.14159265358979;
        const double area = 0.5 * kCorners * radius * radius * std::sin(2 * pi / kCorners);
        CHECK(volume == doctest::Approx(area * length).epsilon(1e-9));
    }
    beam.points.resize(1);
    beam.fields[0].values.resize(1);
    make_tube_surface(beam, kCorners, tube);
    CHECK(tube.points.empty());
}

TEST_CASE(
    "contacts state on which body their force acts and the names of all bodies in its numbers")
{
    Scene scene;
    scene.obstacles.resize(1);
    scene.obstacles[0].name = "wall";
    scene.rigids.resize(1);
    scene.rigids[0].name = "ball";
    scene.solids.resize(1);
    scene.solids[0].name = "bed";
    scene.order = {"ball", "wall", "bed"};
    const ContactBodies bodies = contact_bodies(scene);
    CHECK(bodies.names == std::vector<std::string>{"wall", "ball", "bed"});
    CHECK(bodies.kinds == std::vector<std::string>{"obstacle", "rigid", "solid"});
    const std::string bytes = contacts_bytes({}, bodies);
    const auto in_numbers = [](const std::string& text) {
        std::string out;
        for (const char c : text)
            out += std::to_string(int(c)) + " ";
        return out + "0 ";
    };
    CHECK(bytes.find("Name=\"body_names\" NumberOfTuples=\"3\" format=\"ascii\">" +
                     in_numbers("wall") + in_numbers("ball") + in_numbers("bed") + "<") !=
          std::string::npos);
    CHECK(bytes.find("Name=\"force_acts_on\" NumberOfTuples=\"1\" format=\"ascii\">" +
                     in_numbers("body_a") + "<") != std::string::npos);
}

TEST_CASE("a quantity's meaning is that of the first form that fits all of its name")
{
    const auto unit = [](const char* name) {
        const Meaning* m = meaning_of(name);
        return m ? std::string(m->unit) : "?";
    };
    CHECK(unit("my_ball_on_left_wall_force_x") == "N");
    CHECK(unit("my_ball_on_left_wall_max_pressure") == "Pa");
    CHECK(unit("a_on_world_coupling_12_force_z") == "N");
    CHECK(unit("rod_start_moment_y") == "N m");
    CHECK(unit("ball_turn_x") == "rad");
    CHECK(unit("ball_x") == "m");
    CHECK(unit("depth") == "m");
    CHECK(unit("wire_max_torque") == "N m");
    CHECK(unit("catheter_over_wire_contacts") == "");
    CHECK(unit("catheter_over_wire_normal_force_sum") == "N");
    CHECK(unit("work") == "J");
    CHECK(unit("ball_on_floor_force") == "?");
    CHECK(unit("nothing") == "?");
}
