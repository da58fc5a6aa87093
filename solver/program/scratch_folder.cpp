#include "solver/program/scratch_folder.hpp"

#include "mesh/base/file.hpp"

#include <cstdlib>
#include <filesystem>
#include <unistd.h>

namespace fs = std::filesystem;

namespace amontons {

ScratchFolder::ScratchFolder()
{
    const char* parent = std::getenv("TMPDIR");
    path_ = std::string(parent && *parent ? parent : "/tmp") + "/amontons_XXXXXX";
    if (!::mkdtemp(path_.data())) throw WriteError(path_, "no folder can be made");
}

ScratchFolder::~ScratchFolder()
{
    std::error_code ignored;
    if (!kept_) fs::remove_all(path_, ignored);
}

} // namespace amontons
