#include "solver/scene/fingerprint.hpp"

#include "mesh/base/file.hpp"
#include "solver/scene/read.hpp"

#include <fmt/format.h>

namespace amontons {

std::uint64_t fingerprint(const Scene& scene, FileHashes& known)
{
    std::string all = resolved_scene(scene);
    for (const NamedFile& f : named_files(scene)) {
        const auto [at, fresh] = known.emplace(f.path, 0);
        if (fresh) at->second = hash_bytes(read_file(f.path));
        all += fmt::format("\n{} {:016x}", f.name, at->second);
    }
    return hash_bytes(all);
}

} // namespace amontons
