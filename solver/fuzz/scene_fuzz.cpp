#include "mesh/base/error.hpp"
#include "solver/scene/read.hpp"

#include <cstdint>

using namespace amontons;

// A scene, and after a byte 1 an override of it. Whatever is read must read back the same.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    const std::string_view all(reinterpret_cast<const char*>(data), size);
    const std::size_t cut = all.find('\1');
    std::vector<std::string> overrides;
    if (cut != std::string_view::npos) overrides.emplace_back(all.substr(cut + 1));
    try {
        const Scene scene = parse_scene(all.substr(0, cut), "fuzz", overrides);
        const std::string resolved = resolved_scene(scene);
        AMONTONS_ASSERT(resolved_scene(parse_scene(resolved, "again")) == resolved);
    } catch (const InputError& error) {
        for (const Issue& issue : error.issues())
            AMONTONS_ASSERT(!issue.file.empty() && !issue.found.empty() && !issue.allowed.empty());
    }
    return 0;
}
