#pragma once

#include "solver/scene/scene.hpp"

#include <cstdint>
#include <map>
#include <string>

namespace amontons {

/// Hashes of files, by their paths.
using FileHashes = std::map<std::string, std::uint64_t>;

/// Fingerprint of a scene: of its text with all defaults, and of the bytes of every file that it
/// names. Where the scene lies, and how it was written, do not count.
/// @param scene  without what is not to count: the caller clears it
/// @param known  files that are not read again; those that are read are added
std::uint64_t fingerprint(const Scene& scene, FileHashes& known);

} // namespace amontons
