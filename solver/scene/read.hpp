#pragma once

#include "solver/scene/scene.hpp"

#include <string>
#include <string_view>
#include <vector>

namespace amontons {

/// Reads and checks a scene file (JSON, comments allowed).
///
/// @param file       as the user wrote it; it stands in every message
/// @param overrides  "PATH=VALUE" each: PATH is a JSON pointer without the leading slash, with
///                   dots or slashes; VALUE is JSON, or else taken as a text
/// @throws InputError  with everything that is wrong with the file and the overrides
Scene read_scene(const std::string& file, const std::vector<std::string>& overrides = {});

/// As read_scene, of a text in memory. @throws InputError  likewise
Scene parse_scene(std::string_view text, const std::string& file,
                  const std::vector<std::string>& overrides = {});

/// The scene with every default filled in, as JSON that parse_scene reads to the same scene.
std::string resolved_scene(const Scene& scene);

/// A file that a scene names.
struct NamedFile {
    std::string name; ///< as the scene has it
    std::string path; ///< beside the scene unless it is absolute
};
/// Those that are there, each once.
std::vector<NamedFile> named_files(const Scene& scene);

/// Path of a file that the scene names: beside the scene unless it is absolute.
std::string beside(const Scene& scene, const std::string& file);

} // namespace amontons
