#include "mesh/format/abaqus.hpp"

#include "mesh/fuzz/volume_fuzz_laws.hpp"

using namespace amontons;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    try {
        obey_volume_laws(parse_abaqus(as_text(data, size), "fuzz").mesh, [](const VolumeMesh& m) {
            return parse_abaqus(abaqus_text(m), "fuzz").mesh;
        });
    } catch (const InputError&) {
    }
    return 0;
}
