#include "mesh/format/gmsh.hpp"

#include "mesh/base/file.hpp"
#include "mesh/format/byte_order.hpp"
#include "mesh/tests/sample_surfaces.hpp"
#include "mesh/tests/test_program.hpp"
#include "mesh/tests/volume_laws.hpp"

#include <algorithm>
#include <cmath>
#include <doctest/doctest.h>
#include <sstream>

using namespace amontons;

namespace {

constexpr GmshOptions kEncodings[] = {{false, false}, {false, true}, {true, false}, {true, true}};

std::string gmsh_refusal(const std::string& bytes)
{
    return refusal([&] { parse_gmsh(bytes, "f"); });
}

std::string replaced(std::string text, const std::string& what, const std::string& by)
{
    const std::size_t at = text.find(what);
    REQUIRE(at != std::string::npos);
    return text.replace(at, what.size(), by);
}

// Two tetrahedra with a face in common, by hand; groups with and without a name.
const std::string kNodes2 =
    "$Nodes\n5\n10 0 0 0\n20 1 0 0\n30 0 1 0\n40 0 0 1\n50 1 1 1\n$EndNodes\n";
const std::string kText2 = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n"
                           "$PhysicalNames\n3\n2 4 \"bottom\"\n3 9 \"all of it\"\n1 77 \"edge\"\n"
                           "$EndPhysicalNames\n" +
                           kNodes2 +
                           "$Elements\n8\n"
                           "1 15 2 3 1 50\n"
                           "2 1 2 77 1 10 20\n"
                           "3 2 2 4 1 10 20 30\n"
                           "4 2 2 5 2 20 30 40\n"
                           "5 2 2 6 2 20 40 30\n"
                           "6 2 2 0 2 10 20 40\n"
                           "7 4 2 9 1 10 20 30 40\n"
                           "8 4 3 9 1 0 20 30 40 50\n"
                           "$EndElements\n";

} // namespace

TEST_CASE(
    "msh 2.2: groups become sets and inner faces belong to the side from which they are oriented")
{
    const VolumeFile file = parse_gmsh(kText2, "f");
    const VolumeMesh& mesh = file.mesh;
    CHECK(file.notes.empty());
    CHECK(mesh.nodes.size() == 5);
    CHECK(mesh.node_labels == std::vector<std::int64_t>{10, 20, 30, 40, 50});
    CHECK(mesh.element_labels == std::vector<std::int64_t>{7, 8});
    CHECK(node_place(mesh, 4) == "node 50");
    CHECK(element_place(mesh, 1) == "element 8");
    CHECK(find_set(mesh.element_sets, "all of it")->members == std::vector<std::int32_t>{0, 1});
    CHECK(find_set(mesh.node_sets, "3")->members == std::vector<std::int32_t>{4});
    CHECK(find_set(mesh.node_sets, "edge")->members == std::vector<std::int32_t>{0, 1});
    // 10 20 30 is face 0 2 1 of the first, turned round: a border has no choice of side
    CHECK(find_set(mesh.face_sets, "bottom")->members == std::vector<FaceRef>{{0, 3}});
    // 20 30 40 points out of the first element (1 2 3 there), 20 40 30 out of the second
    CHECK(find_set(mesh.face_sets, "5")->members == std::vector<FaceRef>{{0, 1}});
    CHECK(find_set(mesh.face_sets, "6")->members == std::vector<FaceRef>{{1, 3}});
    CHECK(errors_of(check_volume(mesh), mesh, "f").empty());
}

TEST_CASE("msh: what is written reads back bit by bit in every version and encoding")
{
    const VolumeMesh mesh = mesh_with_sets();
    for (const GmshOptions& options : kEncodings) {
        CAPTURE(options.version_2);
        CAPTURE(options.binary);
        const std::string bytes = gmsh_bytes(mesh, options);
        const VolumeFile file = parse_gmsh(bytes, "f");
        check_same(file.mesh, mesh);
        CHECK(file.notes.size() == (options.version_2 ? 1 : 0)); // elements of several groups
        for (const SampleVolume& sample : sample_volumes())
            check_same(parse_gmsh(gmsh_bytes(sample.mesh, options), "f").mesh, sample.mesh);
    }
}

TEST_CASE("msh: binary files of the other byte order and with sizes of four bytes")
{
    // A file as a foreign machine writes it, by hand: 4.1, one tetrahedron.
    const VolumeMesh expected =
        parse_gmsh(
            "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 4 1 4\n3 1 0 4\n1\n2\n3\n4\n0 0 0\n1 "
            "0 0\n"
            "0 1 0\n0 0 1\n$EndNodes\n$Elements\n1 1 1 1\n3 1 4 1\n1 1 2 3 4\n$EndElements\n",
            "f")
            .mesh;
    for (const bool big : {false, true})
        for (const int size : {4, 8}) {
            CAPTURE(big);
            CAPTURE(size);
            std::string b = "$MeshFormat\n4.1 1 " + std::to_string(size) + "\n";
            const auto put = [&](int value) {
                append_bytes(b, static_cast<std::int32_t>(value), big);
            };
            const auto put_size = [&](std::uint64_t value) {
                if (size == 4)
                    append_bytes(b, static_cast<std::uint32_t>(value), big);
                else
                    append_bytes(b, value, big);
            };
            put(1);
            b += "\n$EndMeshFormat\n$Nodes\n";
            for (const std::uint64_t v : {1U, 4U, 1U, 4U})
                put_size(v);
            for (const int v : {3, 1, 0})
                put(v);
            for (const std::uint64_t v : {4U, 1U, 2U, 3U, 4U})
                put_size(v);
            for (const double x : {0., 0., 0., 1., 0., 0., 0., 1., 0., 0., 0., 1.})
                append_bytes(b, x, big);
            b += "\n$EndNodes\n$Elements\n";
            for (const std::uint64_t v : {1U, 1U, 1U, 1U})
                put_size(v);
            for (const int v : {3, 1, 4})
                put(v);
            for (const std::uint64_t v : {1U, 1U, 1U, 2U, 3U, 4U})
                put_size(v);
            b += "\n$EndElements\n";
            check_same(parse_gmsh(b, "f").mesh, expected);
        }
}

TEST_CASE("msh: a scale multiplies coordinates and numbers of nodes may be large and sparse")
{
    std::string text = kText2;
    for (std::size_t at = 0; (at = text.find("50", at)) != std::string::npos;)
        text.replace(at, 2, "9000000000000");
    const VolumeMesh mesh = parse_gmsh(text, "f", 1e-3).mesh;
    CHECK(mesh.nodes[4] == Vec3(1e-3, 1e-3, 1e-3));
    CHECK(mesh.node_labels[4] == 9000000000000);
}

TEST_CASE("msh cut off at any byte is refused or whole")
{
    const VolumeMesh mesh = parse_gmsh(kText2, "f").mesh;
    for (const GmshOptions& options : kEncodings) {
        CAPTURE(options.version_2);
        CAPTURE(options.binary);
        const std::string bytes = gmsh_bytes(mesh, options);
        std::size_t accepted = 0;
        for (std::size_t n = 0; n < bytes.size(); ++n)
            if (gmsh_refusal(bytes.substr(0, n)).empty()) {
                ++accepted;
                check_same(parse_gmsh(bytes.substr(0, n), "f").mesh, parse_gmsh(bytes, "f").mesh);
            }
        CHECK(accepted == 1); // only the last line end is lost
    }
}

TEST_CASE("a damaged msh states where and what")
{
    const auto with = [&](const char* what, const char* by) {
        return gmsh_refusal(replaced(kText2, what, by));
    };
    CHECK(gmsh_refusal("") == "f: line 1: found \"\", allowed: $MeshFormat");
    CHECK(with("2.2 0", "4 0") == "f: line 2: found version 4, allowed: version 2.2 or 4.1 (gmsh "
                                  "-save -format msh41 FILE converts)");
    CHECK(with("2.2 0", "2.2 3").find("file type 3") != std::string::npos);
    CHECK(with("20 1 0 0", "20 1 x 0") == "f: line 13: found \"x\", allowed: a number");
    CHECK(with("20 1 0 0", "20 1 nan 0") ==
          "f: node 20: found coordinates 1 nan 0, allowed: finite numbers");
    CHECK(with("50 1 1 1", "40 1 1 1").find("two nodes with this number") != std::string::npos);
    CHECK(with("20 30 40 50", "20 30 40 51") ==
          "f: element 8: found node 51, allowed: a node of the file");
    CHECK(with("10 20 30\n", "10 20 31\n") ==
          "f: group \"bottom\": found node 31, allowed: a node of the file");
    CHECK(with("$Nodes\n5", "$Nodes\n6").find("line 17: found \"$EndNodes\"") != std::string::npos);
    CHECK(with("$Nodes\n5", "$Nodes\n500000000").find("which the file can hold") !=
          std::string::npos);
    CHECK(with("7 4 2 9 1 10 20 30 40", "7 6 2 9 1 10 20 30 40 10 20") ==
          "f: line 26: found 1 elements of type 6 (prism), allowed: tetrahedra of 4 or 10 nodes "
          "(types 4, 11), hexahedra of 8 (type 5)");
    CHECK(with("7 4 2", "7 99 2").find("an element of type 99") != std::string::npos);
    CHECK(with("\"bottom\"", "bottom").find("a name in quotes") != std::string::npos);
    CHECK(gmsh_refusal("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n" + kNodes2 +
                       "$Elements\n1\n1 2 2 1 1 10 20 30\n$EndElements\n")
              .find("no solid element (5 nodes, 1 faces)") != std::string::npos);
    CHECK(gmsh_refusal("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n" + kNodes2)
              .find("no section $Elements") != std::string::npos);
}

TEST_CASE("msh: faces of no element and other sections are passed over with a note")
{
    const VolumeFile file =
        parse_gmsh(replaced(kText2, "4 2 2 5 2 20 30 40", "4 2 2 5 2 20 30 50") +
                       "$Comments\nsome $Nodes words\n$EndComments\n",
                   "f");
    CHECK(file.notes.size() == 1); // 20 30 50 is a face of the second element
    CHECK(file.notes[0] == "section $Comments is passed over");
    const VolumeFile lost =
        parse_gmsh(replaced(kText2, "4 2 2 5 2 20 30 40", "4 2 2 5 2 10 30 50"), "f");
    REQUIRE(lost.notes.size() == 1);
    CHECK(lost.notes[0] == "face set \"5\": 1 faces belong to no element and are left out");
    CHECK(find_set(lost.mesh.face_sets, "5")->members.empty());
}

TEST_CASE("meshes of other people's benchmarks: counts and boxes and volumes" *
          doctest::test_suite("slow"))
{
    const auto files = peer_meshes();
    if (files.empty()) {
        skip_test("no meshes in ../shared/data/fe/meshes");
        return;
    }
    for (const auto& path : files) {
        CAPTURE(path.filename().string());
        const std::string text = read_file(path.string());
        // Counts by a second, plain way: the lines of the sections.
        std::istringstream lines(text);
        std::string word;
        std::size_t nodes = 0, solids = 0;
        while (lines >> word && word != "$Nodes") {
        }
        std::size_t blocks = 0, n = 0;
        lines >> blocks >> nodes;
        while (lines >> word && word != "$Elements") {
        }
        lines >> blocks >> n >> word >> word;
        for (std::size_t b = 0; b < blocks; ++b) {
            std::size_t dimension = 0, tag = 0, type = 0, count = 0;
            lines >> dimension >> tag >> type >> count;
            if (dimension == 3) solids += count;
            std::getline(lines, word);
            for (std::size_t i = 0; i < count; ++i)
                std::getline(lines, word);
        }
        const VolumeFile file = parse_gmsh(text, path.string());
        CHECK(file.notes.empty());
        CHECK(file.mesh.nodes.size() == nodes);
        CHECK(element_count(file.mesh) == solids);
        const bool quadratic = path.filename().string().find("_o2_") != std::string::npos;
        CHECK(file.mesh.blocks[0].kind == (quadratic ? ElementKind::T10 : ElementKind::T4));
        const VolumeReport report = check_volume(file.mesh);
        CHECK(errors_of(report, file.mesh, "f").empty());
        CHECK(report.unreferenced.empty());
        CHECK(report.surface_borders == 0);
        CHECK(report.euler_characteristic == 2);
        CHECK(report.integrals.volume == doctest::Approx(report.quality.volume).epsilon(1e-12));
        // The groups of surfaces cover the surface once.
        std::vector<FaceRef> faces;
        for (const FaceSet& set : file.mesh.face_sets)
            faces.insert(faces.end(), set.members.begin(), set.members.end());
        std::sort(faces.begin(), faces.end());
        CHECK(faces == report.surface.faces);
        CHECK(find_set(file.mesh.element_sets, "vol")->members.size() == solids);
        // Prisms and blocks have the volume of their box.
        const std::string name = path.filename().string();
        if (name.starts_with("patch") || name.starts_with("elastica") ||
            name.starts_with("raous")) {
            const Vec3 size = report.highest - report.lowest;
            CHECK(report.quality.volume == doctest::Approx(size.prod()).epsilon(1e-12));
        }
        // A half or quarter of a ball has a flat far side of a known area.
        if (name.starts_with("hertz") && quadratic)
            CHECK(report.quality.volume ==
                  doctest::Approx(3.14159265358979 * 2 / 3 * 1000 / 4).epsilon(2e-3));
    }
}

TEST_CASE("files that Gmsh itself wrote: one tetrahedron's geometry in all encodings")
{
    const auto folder = std::filesystem::path(AMONTONS_SOURCE_DIR) / "mesh/fuzz/seeds/gmsh";
    for (const char* version : {"v22", "v41"})
        for (const char* encoding : {"ascii", "binary"})
            for (const int order : {1, 2}) {
                const std::string name = std::string(version) + "_" + encoding + "_order" +
                                         std::to_string(order) + ".msh";
                CAPTURE(name);
                const VolumeFile file = parse_gmsh(read_file((folder / name).string()), name);
                const VolumeMesh& mesh = file.mesh;
                REQUIRE(mesh.blocks.size() == 1);
                CHECK(mesh.blocks[0].kind == (order == 1 ? ElementKind::T4 : ElementKind::T10));
                const VolumeReport report = check_volume(mesh);
                CHECK(errors_of(report, mesh, name).empty()); // also the order of middle nodes
                CHECK(report.quality.volume == doctest::Approx(1. / 6).epsilon(1e-12));
                CHECK(find_set(mesh.element_sets, "body")->members.size() == element_count(mesh));
                const auto area = [&](const char* set) {
                    return integrate(surface_of(mesh, find_set(mesh.face_sets, set)->members), mesh)
                        .area;
                };
                CHECK(area("base") == doctest::Approx(0.5));
                CHECK(area("42") == doctest::Approx(0.5 + std::sqrt(3.0) / 2)); // two of its sides
                for (const std::int32_t n : find_set(mesh.node_sets, "edge")->members)
                    CHECK(mesh.nodes[static_cast<std::size_t>(n)].tail<2>().norm() < 1e-12);
                REQUIRE(find_set(mesh.node_sets, "7")->members.size() == 1);
                CHECK(mesh.nodes[static_cast<std::size_t>(
                          find_set(mesh.node_sets, "7")->members[0])] == Vec3(0, 0, 1));
            }
}
