#include "mesh/format/plain.hpp"

#include "mesh/tests/sample_surfaces.hpp"
#include "mesh/tests/volume_laws.hpp"

#include <doctest/doctest.h>

using namespace amontons;

namespace {

const std::string kPlainNodes = "# four corners\n0 0 0\n1 0 0 # the second\n\n0, 1, 0\n0\t0\t1\r\n";

VolumeMesh read(const std::string& elements)
{
    return parse_plain(kPlainNodes, elements, "n", "e").mesh;
}

std::string plain_refusal(const std::string& nodes, const std::string& elements)
{
    return refusal([&] { parse_plain(nodes, elements, "n", "e"); });
}

} // namespace

TEST_CASE("plain text: what is written reads back bit by bit")
{
    const auto again = [](const VolumeMesh& mesh) {
        const PlainText text = plain_text(mesh);
        return parse_plain(text.nodes, text.elements, "n", "e").mesh;
    };
    check_same(again(mesh_with_sets()), mesh_with_sets());
    for (const SampleVolume& sample : sample_volumes())
        check_same(again(sample.mesh), sample.mesh);
}

TEST_CASE("plain text: counted from 0 or from 1, and what cannot be determined must be specified")
{
    CHECK(read("0 1 2 3").blocks[0].nodes == std::vector<std::int32_t>{0, 1, 2, 3});
    CHECK(read("1 2 3 4").blocks[0].nodes == std::vector<std::int32_t>{0, 1, 2, 3});
    CHECK(read("index_from 1\n1,2,3,4\n").blocks[0].nodes == std::vector<std::int32_t>{0, 1, 2, 3});
    CHECK(node_place(read("0 1 2 3"), 0) == "node 0");
    CHECK(node_place(read("1 2 3 4"), 0) == "node 1");
    CHECK(plain_refusal(kPlainNodes + "5 5 5\n6 6 6\n", "1 2 3 4") ==
          "e: found nodes 1 to 4 of 6 in use, allowed: node 0, or node 6, or a line index_from 0 "
          "or 1");
    CHECK(plain_refusal(kPlainNodes, "0 1 2 4") ==
          "e: element 0: found node 4, allowed: a node of the file");
}

TEST_CASE("plain text: middle nodes in Gmsh's order on demand")
{
    const VolumeMesh box = sample_box(ElementKind::T10);
    PlainText text = plain_text(box);
    const std::string vtk = text.elements, gmsh = "t10_order gmsh\n" + vtk;
    CHECK(errors_of(check_volume(parse_plain(text.nodes, vtk, "n", "e").mesh), box, "f").empty());
    CHECK(!errors_of(check_volume(parse_plain(text.nodes, gmsh, "n", "e").mesh), box, "f").empty());
}

TEST_CASE(
    "plain text cut off at any byte is refused or is the mesh so far with its last line noted" *
    doctest::test_suite("slow"))
{
    const PlainText text = plain_text(mesh_with_sets());
    const VolumeMesh whole = mesh_with_sets();
    const auto check = [&](const std::string& nodes, const std::string& elements, char last) {
        try {
            const VolumeFile part = parse_plain(nodes, elements, "n", "e");
            CHECK(element_count(part.mesh) <= element_count(whole));
            CHECK(part.mesh.nodes.size() <= whole.nodes.size());
            CHECK((!part.cut.empty() || static_cast<unsigned char>(last) <= ' '));
            CHECK(part.cut.empty() == part.notes.empty());
        } catch (const InputError&) {
        }
    };
    for (std::size_t n = 1; n < text.nodes.size(); ++n)
        check(text.nodes.substr(0, n), text.elements, text.nodes[n - 1]);
    for (std::size_t n = 1; n < text.elements.size(); ++n)
        check(text.nodes, text.elements.substr(0, n), text.elements[n - 1]);
    CHECK(parse_plain(text.nodes, text.elements, "n", "e").cut.empty());
    CHECK(parse_plain(kPlainNodes, "0 1 2 3", "n", "e").cut == "e");
}

TEST_CASE("damaged plain text is reported with its place")
{
    CHECK(plain_refusal("", "0 1 2 3") == "n: found no node, allowed: lines of x y z");
    CHECK(plain_refusal("0 0 0\n1 x 0\n1 0\n1 2 3 4\n", "") ==
          "n: line 2: found \"x\", allowed: three coordinates\n"
          "n: line 3: found the end of the line, allowed: three coordinates\n"
          "n: line 4: found \"4\" after three coordinates, allowed: one node a line");
    CHECK(plain_refusal(kPlainNodes, "0 1 2\n0 1 2 3 0\n0 1 2 x\nface_set\nsets 1\n") ==
          "e: line 1: found 3 numbers, allowed: 4, 8 or 10 nodes (T4, H8, T10)\n"
          "e: line 2: found 5 numbers, allowed: 4, 8 or 10 nodes (T4, H8, T10)\n"
          "e: line 3: found \"x\", allowed: a whole number\n"
          "e: line 4: found a set without a name, allowed: a name\n"
          "e: line 5: found \"sets\", allowed: numbers, index_from, t10_order, node_set, "
          "element_set or face_set");
    CHECK(plain_refusal(kPlainNodes,
                        "0 1 x\n0 1 2 3 0 1 2 3\n") == // the rest of a bad line stays out
          "e: line 1: found \"x\", allowed: a whole number");
    CHECK(plain_refusal(kPlainNodes, "0 1 2 3\nface_set a\n0 4\n") ==
          "e: face set \"a\": found a face that element 0 has not, allowed: 4 faces");
    CHECK(plain_refusal(kPlainNodes, "0 1 2 3\nface_set a\n0\n").find("pairs") !=
          std::string::npos);
    CHECK(plain_refusal("0 0 0\n0 nan 1\n", "0 0 0 0") ==
          "n: line 2: found coordinates 0 nan 1, allowed: finite numbers");
    CHECK(plain_refusal("0 0 inf\n", "0 0 0 0").find("finite numbers") != std::string::npos);
    CHECK(plain_refusal(kPlainNodes, "").find("no solid element") != std::string::npos);
}
