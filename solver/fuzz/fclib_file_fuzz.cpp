#include "solver/fclib_file.hpp"

#include <cstdint>

using namespace amontons;

// Bytes of an HDF5 file: nothing in them may end this process or keep it waiting.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    try {
        const FclibProblem p = parse_fclib({reinterpret_cast<const char*>(data), size}, "fuzz");
        AMONTONS_ASSERT(p.local ? issues(*p.local).empty() : issues(*p.global).empty());
    } catch (const InputError&) {
    }
    return 0;
}
