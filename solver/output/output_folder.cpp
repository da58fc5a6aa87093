#include "solver/output/output_folder.hpp"

#include "mesh/base/error.hpp"
#include "solver/scene/read.hpp"

#include <filesystem>

namespace fs = std::filesystem;

namespace amontons {

void check_output_folder(const std::string& folder, const Scene& scene)
{
    std::vector<NamedFile> inputs = named_files(scene);
    inputs.insert(inputs.begin(), {scene.file, scene.file});
    std::error_code ignored; // folders that are not there hold nothing
    for (const NamedFile& input : inputs)
        for (const char* part : {"", "frames", "record", "points"}) {
            const fs::path parent = fs::absolute(input.path, ignored).parent_path();
            if (fs::equivalent(fs::path(folder) / part, parent, ignored))
                throw InputError(
                    {{"(--output)", "", quoted_text(folder, 200) + ", where " + input.path + " is",
                      "a folder that holds neither the scene nor what it names"}});
        }
}

} // namespace amontons
