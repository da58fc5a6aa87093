#include "mesh/format/ply.hpp"
#include "mesh/fuzz/laws.hpp"

using namespace amontons;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    try {
        obey_laws(parse_ply(as_text(data, size), "fuzz"), [](const SurfaceMesh& m) {
            return parse_ply(ply_bytes(m, PlyEncoding::big_endian), "fuzz");
        });
    } catch (const InputError&) {
    }
    return 0;
}
