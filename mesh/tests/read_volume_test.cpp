#include "mesh/format/read_volume.hpp"

#include "mesh/base/file.hpp"
#include "mesh/tests/sample_surfaces.hpp"
#include "mesh/tests/temporary_folder.hpp"
#include "mesh/tests/volume_laws.hpp"

#include <doctest/doctest.h>

using namespace amontons;

TEST_CASE("solids: the suffix specifies the format, and sets and scale survive every conversion")
{
    const TemporaryFolder folder;
    const VolumeMesh mesh = mesh_with_sets();
    VolumeMesh last = mesh;
    for (const char* name : {"a.msh", "b.nodes", "c.MSH", "d.nodes"}) {
        CAPTURE(name);
        write_volume(folder / name, last, {std::string(name) == "c.MSH", true});
        last = read_volume(folder / name, 1).mesh;
        check_same(last, mesh);
    }
    write_volume(folder / "e.inp", mesh);
    const VolumeMesh small = read_volume(folder / "e.inp", 1e-3).mesh;
    CHECK(small.nodes[7] == 1e-3 * mesh.nodes[7]);
    CHECK(find_set(small.face_sets, "skin")->members == mesh.face_sets[0].members);
}

TEST_CASE("solids: other suffixes and scales are refused and missing files named")
{
    const TemporaryFolder folder;
    CHECK(refusal([&] { read_volume("a.stl", 1); }) ==
          "a.stl: found suffix \".stl\", allowed: .msh, .vtu, .inp or .nodes (with .elements "
          "beside it); a closed surface is filled with tetrahedra by: amontons mesh tetrahedralise "
          "\"a.stl\" part.msh");
    CHECK(refusal([&] { read_volume("a.STEP", 1); }).find("-3 -order 2 -o part.msh") !=
          std::string::npos);
    CHECK(refusal([&] { read_volume("a", 1); }).find("a name without suffix") != std::string::npos);
    CHECK(refusal([&] { read_volume("a.msh", -1); }).find("scale -1") != std::string::npos);
    CHECK(refusal([&] { read_volume(folder / "none.msh", 1); }).find("no such file") !=
          std::string::npos);
    write_file(folder / "a.nodes", "0 0 0\n");
    CHECK(refusal([&] { read_volume(folder / "a.nodes", 1); }).find("a.elements") !=
          std::string::npos);
    CHECK(refusal([&] {
              write_volume(folder / "a.stl", sample_box(ElementKind::T4));
          }).find(".stl") != std::string::npos);
}
