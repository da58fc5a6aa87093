#include "mesh/format/vtu.hpp"

#include "mesh/fuzz/volume_fuzz_laws.hpp"

using namespace amontons;

// This room writes no .vtu: the mesh must survive another format.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    try {
        obey_volume_laws(parse_vtu(as_text(data, size), "fuzz").mesh, [](const VolumeMesh& m) {
            return parse_gmsh(gmsh_bytes(m, {false, true}), "fuzz").mesh;
        });
    } catch (const InputError&) {
    }
    return 0;
}
