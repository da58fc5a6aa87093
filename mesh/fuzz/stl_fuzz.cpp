#include "mesh/format/stl.hpp"
#include "mesh/fuzz/laws.hpp"

using namespace amontons;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    try {
        obey_laws(parse_stl(as_text(data, size), "fuzz"),
                  [](const SurfaceMesh& m) { return parse_stl(stl_text(m), "fuzz"); });
    } catch (const InputError&) {
    }
    return 0;
}
