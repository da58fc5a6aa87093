#include "mesh/base/error.hpp"
#include "mesh/base/file.hpp"
#include "solver/output/checkpoint.hpp"

#include <cstdint>
#include <cstring>

using namespace amontons;

namespace {

void read(std::string_view bytes)
{
    try {
        AMONTONS_ASSERT(checkpoint_bytes(read_checkpoint(bytes, "fuzz")) == bytes);
    } catch (const InputError&) {
    }
}

} // namespace

// As it is, and with its last 8 bytes replaced by the right hash: mutations then come further.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    std::string bytes(reinterpret_cast<const char*>(data), size);
    read(bytes);
    if (size >= sizeof(std::uint64_t)) {
        bytes.resize(size - sizeof(std::uint64_t));
        const std::uint64_t hash = hash_bytes(bytes);
        bytes.append(reinterpret_cast<const char*>(&hash), sizeof hash);
        read(bytes);
    }
    return 0;
}
