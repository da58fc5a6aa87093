#include "solver/output/volume_vtu.hpp"

#include "mesh/base/file.hpp"
#include "mesh/format/vtu.hpp"
#include "mesh/tests/temporary_folder.hpp"
#include "mesh/tests/volume_laws.hpp"

#include <cstdlib>
#include <doctest/doctest.h>

using namespace amontons;

TEST_CASE("vtu of solids: what is written reads back bit by bit with its sets")
{
    VolumeMesh mesh = mesh_with_sets();
    mesh.node_sets[0].name = "<fixed> & \"so\"";
    check_same(parse_vtu(volume_vtu_bytes(mesh), "f").mesh, mesh);
    for (const SampleVolume& sample : sample_volumes())
        check_same(parse_vtu(volume_vtu_bytes(sample.mesh), "f").mesh, sample.mesh);
}

TEST_CASE("vtu of solids cut off at any byte is refused or whole")
{
    const std::string bytes = volume_vtu_bytes(sample_box(ElementKind::H8));
    std::size_t accepted = 0;
    for (std::size_t n = 0; n < bytes.size(); ++n)
        try {
            parse_vtu(bytes.substr(0, n), "f");
            ++accepted;
        } catch (const InputError&) {
        }
    CHECK(accepted <= 1);
}
