#include "mesh/format/vtu.hpp"

#include "mesh/base/file.hpp"
#include "mesh/tests/sample_surfaces.hpp"
#include "mesh/tests/volume_laws.hpp"

#include <algorithm>
#include <doctest/doctest.h>

using namespace amontons;

namespace {

std::filesystem::path seeds()
{
    return std::filesystem::path(AMONTONS_SOURCE_DIR) / "mesh/fuzz/seeds/vtu";
}

std::string vtu_seed(const std::string& name)
{
    return read_file((seeds() / name).string());
}

std::string vtu_refusal(const std::string& bytes)
{
    return refusal([&] { parse_vtu(bytes, "f"); });
}

std::string with_words(std::string text, const std::string& what, const std::string& by)
{
    const std::size_t at = text.find(what);
    REQUIRE(at != std::string::npos);
    return text.replace(at, what.size(), by);
}

} // namespace

TEST_CASE("files that VTK itself wrote: all encodings hold the same mesh")
{
    std::size_t count = 0;
    for (const std::string tag : {"linear", "quadratic"}) {
        const VolumeMesh expected = parse_vtu(vtu_seed(tag + "_ascii.vtu"), "f").mesh;
        for (const auto& entry : std::filesystem::directory_iterator(seeds())) {
            const std::string name = entry.path().filename().string();
            if (!name.starts_with(tag)) continue;
            CAPTURE(name);
            check_same(parse_vtu(read_file(entry.path().string()), "f").mesh, expected);
            ++count;
        }
    }
    CHECK(count == 28);
}

TEST_CASE("vtu: a hexahedron and two tetrahedra and faces and regions")
{
    const VolumeFile file = parse_vtu(vtu_seed("linear_ascii.vtu"), "f");
    const VolumeMesh& mesh = file.mesh;
    CHECK(file.notes.empty());
    REQUIRE(mesh.blocks.size() == 2);
    CHECK(mesh.blocks[0].nodes == std::vector<std::int32_t>{4, 5, 6, 8, 4, 6, 7, 8});
    CHECK(mesh.blocks[1].nodes == std::vector<std::int32_t>{0, 1, 2, 3, 4, 5, 6, 7});
    CHECK(element_place(mesh, 2) == "element 0"); // cells count from 0
    CHECK(find_set(mesh.element_sets, "1")->members == std::vector<std::int32_t>{2});
    CHECK(find_set(mesh.element_sets, "2")->members == std::vector<std::int32_t>{0, 1});
    CHECK(find_set(mesh.face_sets, "5")->members == std::vector<FaceRef>{{0, 0}});
    CHECK(find_set(mesh.face_sets, "6")->members == std::vector<FaceRef>{{2, 4}});
    CHECK(find_set(mesh.node_sets, "base")->members == std::vector<std::int32_t>{0, 1, 2, 3});
    const VolumeMesh quadratic = parse_vtu(vtu_seed("quadratic_ascii.vtu"), "f").mesh;
    CHECK(quadratic.blocks[0].kind == ElementKind::T10);
    CHECK(errors_of(check_volume(quadratic), quadratic, "f").empty());
    const VolumeMesh voxels = parse_vtu(vtu_seed("voxels_ascii.vtu"), "f").mesh;
    CHECK(voxels.blocks[0].kind == ElementKind::H8);
    CHECK(errors_of(check_volume(voxels), voxels, "f").empty());
    CHECK(check_volume(voxels).quality.volume == doctest::Approx(2));
}

TEST_CASE("vtu cut off at any byte is refused or whole")
{
    for (const char* name : {"linear_ascii.vtu", "linear_inline64_zlib.vtu", "quadratic_raw32.vtu",
                             "quadratic_base64_64_zlib.vtu"}) {
        CAPTURE(name);
        const std::string bytes = vtu_seed(name);
        const VolumeMesh whole = parse_vtu(bytes, "f").mesh;
        std::size_t accepted = 0;
        for (std::size_t n = 0; n < bytes.size(); ++n)
            if (vtu_refusal(bytes.substr(0, n)).empty()) {
                ++accepted;
                check_same(parse_vtu(bytes.substr(0, n), "f").mesh, whole);
            }
        CHECK(accepted <= 1); // only the last line end is lost
    }
}

TEST_CASE("a damaged vtu states where and what")
{
    const std::string good = vtu_seed("linear_ascii.vtu");
    CHECK(vtu_refusal("") == "f: line 1: found the end of the file, allowed: </VTKFile>");
    CHECK(vtu_refusal("<html>").find("allowed: VTKFile") != std::string::npos);
    CHECK(vtu_refusal(with_words(good, "UnstructuredGrid\" version", "PolyData\" version")) ==
          "f: line 1: found a file of type \"PolyData\", allowed: \"UnstructuredGrid\"");
    CHECK(vtu_refusal(with_words(good, "NumberOfPoints=\"9\"", "NumberOfPoints=\"10\""))
              .find("with 27 numbers, allowed: 30 numbers") != std::string::npos);
    CHECK(vtu_refusal(with_words(good, "NumberOfPoints=\"9\"", "NumberOfPoints=\"1000000000\""))
              .size() > 0);
    CHECK(vtu_refusal(with_words(good, "NumberOfPoints=\"9\"", "NumberOfPoints=\"-9\""))
              .find("\"-9\"") != std::string::npos);
    CHECK(vtu_refusal(with_words(good, "0.5 0.5 2", "0.5 x 2"))
              .find("with \"x\", allowed: numbers") != std::string::npos);
    CHECK(vtu_refusal(with_words(good, "0.5 0.5 2", "0.5 nan 2")) ==
          "f: node 8: found coordinates 0.5 nan 2, allowed: finite numbers");
    CHECK(vtu_refusal(with_words(good, "connectivity", "connections"))
              .find("without the array connectivity") != std::string::npos);
    CHECK(vtu_refusal(with_words(good, "12 10 10 5 9", "13 10 10 5 9")) ==
          "f: cell 0: found 1 cells of type 13 (wedge), allowed: tetra (10, 24), hexahedron (12) "
          "or voxel (11)");
    CHECK(vtu_refusal(with_words(good, "12 10 10 5 9", "12 12 10 5 9")) ==
          "f: cell 1: found 4 nodes of a hexahedron, allowed: 8 nodes");
    CHECK(vtu_refusal(with_words(good, "</Piece>", "</Piec>")).find("allowed: </Piece>") !=
          std::string::npos);
    const std::string packed = vtu_seed("linear_raw64_zlib.vtu");
    CHECK(vtu_refusal(with_words(packed, "vtkZLibDataCompressor", "vtkLZ4DataCompressor"))
              .find("compressor \"vtkLZ4DataCompressor\"") != std::string::npos);
    CHECK(vtu_refusal(with_words(packed, "UInt64", "UInt32")).size() > 0);
    // The header of the points, announcing two blocks of no bytes: 2, 0, 0 for 2, 200, 16.
    CHECK(vtu_refusal(with_words(vtu_seed("linear_inline64_zlib.vtu"),
                                 "AgAAAAAAAADIAAAAAAAAABAAAAAAAAAAHAAAAAAAAAARAAAAAAAAAA==",
                                 "AgAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAHAAAAAAAAAARAAAAAAAAAA=="))
              .size() > 0);
}
