#include "mesh/format/obj.hpp"
#include "mesh/fuzz/laws.hpp"

using namespace amontons;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    try {
        obey_laws(parse_obj(as_text(data, size), "fuzz"),
                  [](const SurfaceMesh& m) { return parse_obj(obj_text(m), "fuzz"); });
    } catch (const InputError&) {
    }
    return 0;
}
