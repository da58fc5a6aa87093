#include "mesh/format/abaqus.hpp"

#include "mesh/base/file.hpp"
#include "mesh/tests/sample_surfaces.hpp"
#include "mesh/tests/volume_laws.hpp"

#include <doctest/doctest.h>
#include <set>

using namespace amontons;

namespace {

std::string abaqus_seed(const char* name)
{
    return read_file(
        (std::filesystem::path(AMONTONS_SOURCE_DIR) / "mesh/fuzz/seeds/abaqus" / name).string());
}

std::string abaqus_refusal(const std::string& text)
{
    return refusal([&] { parse_abaqus(text, "f"); });
}

const std::string kAbaqusNodes = "*NODE\n1,0,0,0\n2,1,0,0\n3,0,1,0\n4,0,0,1\n5,1,1,1\n";
const std::string kElements = "*ELEMENT,TYPE=C3D4\n1,1,2,3,4\n";

} // namespace

TEST_CASE("inp: what is written reads back bit by bit")
{
    VolumeMesh mesh = mesh_with_sets();
    std::vector<std::string> notes;
    const VolumeFile file = parse_abaqus(abaqus_text(mesh, &notes), "f");
    CHECK(notes == std::vector<std::string>{"node set \"8\" is written as \"set_8\"",
                                            "element set \"soft part\" is written as \"soft_part\"",
                                            "element set \"7\" is written as \"set_7\""});
    mesh.node_sets[1].name = "set_8";
    mesh.element_sets[1].name = "soft_part";
    mesh.element_sets[2].name = "set_7";
    check_same(file.mesh, mesh);
    CHECK(file.notes.empty());
    for (const SampleVolume& sample : sample_volumes())
        check_same(parse_abaqus(abaqus_text(sample.mesh), "f").mesh, sample.mesh);
}

TEST_CASE("inp: names that are alike but for their case stay apart")
{
    VolumeMesh mesh = sample_box(ElementKind::T4);
    mesh.node_sets = {{"Top", {1}}, {"top", {2}}, {"to p", {3}}, {"to-p", {4}}};
    const VolumeMesh again = parse_abaqus(abaqus_text(mesh), "f").mesh;
    CHECK(again.node_sets.size() == 4);
    CHECK(find_set(again.node_sets, "top_2")->members == std::vector<std::int32_t>{2});
}

TEST_CASE("inp: a file as CalculiX users write it")
{
    const VolumeFile file = parse_abaqus(abaqus_seed("ccx.inp"), "f");
    const VolumeMesh& mesh = file.mesh;
    CHECK(mesh.nodes.size() == 9);
    CHECK(mesh.nodes[8] == Vec3(0.5, 0.5, 2));
    REQUIRE(mesh.blocks.size() == 2);
    CHECK(mesh.blocks[0].size() == 2); // T4
    CHECK(mesh.blocks[1].size() == 1); // H8
    CHECK(element_place(mesh, 0) == "element 20");
    CHECK(element_place(mesh, 2) == "element 10");
    CHECK(find_set(mesh.node_sets, "Nall")->members.size() == 9);
    CHECK(find_set(mesh.node_sets, "base")->members == std::vector<std::int32_t>{0, 1, 2, 3});
    CHECK(find_set(mesh.node_sets, "some")->members == std::vector<std::int32_t>{0, 1, 2, 3, 8});
    CHECK(find_set(mesh.element_sets, "Eall")->members == std::vector<std::int32_t>{0, 1, 2});
    CHECK(find_set(mesh.element_sets, "tets")->members == std::vector<std::int32_t>{0, 1});
    CHECK(find_set(mesh.face_sets, "bottom")->members == std::vector<FaceRef>{{2, 4}});
    CHECK(find_set(mesh.face_sets, "sides")->members == std::vector<FaceRef>{{0, 1}, {1, 1}});
    CHECK(find_set(mesh.face_sets, "roof")->members.size() == 1);
    REQUIRE(file.notes.size() == 2);
    CHECK(file.notes[0] == "passed over: *MATERIAL (line 32), *ELASTIC (line 33), *STATIC (line "
                           "36), *BOUNDARY (line 37)");
    CHECK(file.notes[1] == "set \"tets\": 9 numbers of a range belong to nothing");
    const VolumeReport report = check_volume(mesh);
    CHECK(report.inverted.empty());
    CHECK(report.crowded_edges.size() == 4); // two triangles do not fit to a square
    // The bottom of the cube, and the tetrahedra's sides 2-4-3.
    CHECK(integrate(surface_of(mesh, find_set(mesh.face_sets, "bottom")->members), mesh)
              .area_vector == Vec3(0, 0, -1));
}

TEST_CASE("inp: a part in an assembly and ten nodes and a surface by its internal set")
{
    const VolumeFile file = parse_abaqus(abaqus_seed("part.inp"), "f");
    CHECK(file.mesh.nodes.size() == 10);
    CHECK(file.mesh.blocks[0].kind == ElementKind::T10);
    CHECK(find_set(file.mesh.face_sets, "Surf-1")->members == std::vector<FaceRef>{{0, 0}});
    CHECK(find_set(file.mesh.node_sets, "Set-1")->members.size() == 10);
    CHECK(find_set(file.mesh.element_sets, "Set-1")->members.size() == 1);
    REQUIRE(file.notes.size() == 1);
    CHECK(file.notes[0].find("nodes of the assembly") != std::string::npos);
    CHECK(errors_of(check_volume(file.mesh), file.mesh, "f").empty());
}

TEST_CASE("inp: members named with their instance as sets of an assembly may be")
{
    const VolumeMesh mesh =
        parse_abaqus("*PART,NAME=P\n" + kAbaqusNodes + kElements +
                         "*END PART\n*ASSEMBLY,NAME=A\n*INSTANCE,NAME=P-1.b,"
                         "PART=P\n*END INSTANCE\n*NSET,NSET=some\nP-1.b.2, "
                         "P-1.b.4, 1\n*ELSET,ELSET=one\nP-1.b.1\n*END ASSEMBLY\n",
                     "f")
            .mesh;
    CHECK(find_set(mesh.node_sets, "some")->members == std::vector<std::int32_t>{0, 1, 3});
    CHECK(find_set(mesh.element_sets, "one")->members == std::vector<std::int32_t>{0});
}

TEST_CASE("inp: each face S1 and S2 and so on has the nodes of the manual's table")
{
    // Nodes from 1, as the manual of CalculiX lists them.
    const std::vector<std::vector<int>> tetra{{1, 2, 3}, {1, 4, 2}, {2, 4, 3}, {3, 4, 1}},
        hexa{{1, 2, 3, 4}, {5, 8, 7, 6}, {1, 5, 6, 2}, {2, 6, 7, 3}, {3, 7, 8, 4}, {4, 8, 5, 1}};
    for (const ElementKind kind : kAllKinds) {
        VolumeMesh box = sample_box(kind);
        const auto& table = kind == ElementKind::H8 ? hexa : tetra;
        for (std::size_t f = 0; f < table.size(); ++f) {
            std::string text = abaqus_text(box);
            text += "*SURFACE, NAME=here\n1, S" + std::to_string(f + 1) + "\n";
            const VolumeMesh mesh = parse_abaqus(text, "f").mesh;
            const FaceNodes face =
                face_nodes(mesh, find_set(mesh.face_sets, "here")->members.at(0));
            std::set<std::int32_t> found(face.node.begin(), face.node.begin() + face.corners),
                expected;
            for (const int n : table[f])
                expected.insert(mesh.blocks[0].nodes[static_cast<std::size_t>(n - 1)]);
            CHECK(found == expected);
        }
    }
}

TEST_CASE("a damaged inp states where and what")
{
    CHECK(abaqus_refusal("") ==
          "f: found no solid element (0 nodes, 0 faces), allowed: elements C3D4, "
          "C3D10 or C3D8");
    CHECK(abaqus_refusal(kAbaqusNodes + "*ELEMENT,TYPE=C3D20R\n1,1,2,3,4\n") ==
          "f: line 7: found elements of type \"C3D20R\", allowed: C3D4, C3D10, C3D8 and their "
          "variants");
    CHECK(abaqus_refusal(kAbaqusNodes + "*ELEMENT,TYPE=C3D6\n1,1,2,3,4,5,5\n").find("C3D6") !=
          std::string::npos);
    CHECK(abaqus_refusal(kAbaqusNodes + "*ELEMENT,TYPE=C3D4\n7,1,2,3\n") ==
          "f: line 8: found an element of type C3D4 with 3 nodes, allowed: 4 nodes");
    CHECK(abaqus_refusal(kAbaqusNodes + "*ELEMENT,TYPE=C3D4\n7,1,2,3,4,5\n").find("5 nodes") !=
          std::string::npos);
    CHECK(abaqus_refusal(kAbaqusNodes + "*ELEMENT,TYPE=C3D4\n7,1,2,3,\n*NSET,NSET=a\n1\n")
              .find("line 8") != std::string::npos);
    CHECK(abaqus_refusal(kAbaqusNodes + "*ELEMENT,TYPE=C3D4\n7,1,2,3,6\n") ==
          "f: element 7: found node 6, allowed: a node of the file");
    CHECK(
        abaqus_refusal(kAbaqusNodes + kElements + "*INCLUDE,INPUT=more.inp\n") ==
        "f: line 9: found *INCLUDE from the file \"more.inp\", allowed: a file that is whole: put "
        "the content of the other in its place");
    CHECK(abaqus_refusal("*NODE,INPUT=nodes.txt\n" + kElements) ==
          "f: line 1: found *NODE from the file \"nodes.txt\", allowed: a file that is whole: put "
          "the "
          "content of the other in its place");
    CHECK(abaqus_refusal(kAbaqusNodes + kElements + "*NSET,NSET=a,INPUT=a.txt\n")
              .find("line 9: found *NSET") != std::string::npos);
    CHECK(abaqus_refusal(kAbaqusNodes + "*NGEN\n1,5\n" + kElements).find("*NGEN") !=
          std::string::npos);
    CHECK(abaqus_refusal("*NODE,SYSTEM=C\n" + kAbaqusNodes + kElements).find("SYSTEM=C") !=
          std::string::npos);
    CHECK(abaqus_refusal(kAbaqusNodes + "6,0,x,0\n" + kElements) ==
          "f: line 7: found \"x\", allowed: a coordinate");
    CHECK(abaqus_refusal(kAbaqusNodes + "6,0,nan,0\n" + kElements).find("finite") !=
          std::string::npos);
    CHECK(abaqus_refusal(kAbaqusNodes + kElements + "*NSET,NSET=a\n1,b\n") ==
          "f: line 10: found set \"b\", allowed: a set that was defined before");
    CHECK(abaqus_refusal(kAbaqusNodes + kElements + "*NSET,NSET=a\n99\n") ==
          "f: node set \"a\": found node 99, allowed: a node of the file");
    CHECK(abaqus_refusal(kAbaqusNodes + kElements + "*ELSET,ELSET=a\n99\n") ==
          "f: element set \"a\": found element 99, allowed: an element of the file");
    CHECK(abaqus_refusal(kAbaqusNodes + kElements + "*SURFACE,NAME=a\n1,S5\n") ==
          "f: line 10: found face \"S5\" of element 1, allowed: S1 to S4 of a tetrahedron, S1 to "
          "S6 of a hexahedron");
    CHECK(abaqus_refusal(kAbaqusNodes + kElements + "*NSET,NSET=a,GENERATE\n1,2000000000000\n")
              .find("a range of 2000000000000 numbers") != std::string::npos);
    CHECK(abaqus_refusal(kAbaqusNodes + kElements + "*NSET,NSET=a,GENERATE\n5,1\n")
              .find("does not increase") != std::string::npos);
    CHECK(abaqus_refusal("*PART,NAME=a\n*END PART\n*PART,NAME=b\n" + kAbaqusNodes + kElements)
              .find("*PART, allowed: one part") != std::string::npos);
}

TEST_CASE("inp cut off at any byte is refused or is the mesh so far with its last line noted")
{
    const std::string text = abaqus_seed("ccx.inp");
    const VolumeMesh whole = parse_abaqus(text, "f").mesh;
    for (std::size_t n = 0; n < text.size(); ++n) {
        try {
            const VolumeFile part = parse_abaqus(text.substr(0, n), "f");
            // Elements are whole or missing, never others.
            CHECK(element_count(part.mesh) <= element_count(whole));
            const bool noted = std::any_of(part.notes.begin(), part.notes.end(), [](auto& note) {
                return note.find("the last line has no end") != std::string::npos;
            });
            const char last = text[n - 1];
            CHECK((noted || last == '\n' || last == ' '));
        } catch (const InputError&) {
        }
    }
}
