#include "mesh/format/slicer_markups.hpp"
#include "mesh/fuzz/laws.hpp"

using namespace amontons;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    try {
        obey_laws(parse_slicer_markups(as_text(data, size), "fuzz"));
    } catch (const InputError&) {
    }
    return 0;
}
