#include "solver/module.hpp"

#include <cstdlib>
#include <dlfcn.h>
#include <filesystem>
#include <stdexcept>

namespace fs = std::filesystem;

namespace amontons {

std::string find_module(const std::string& name)
{
    const std::string file = "libamontons-" + name + ".so";
    std::error_code error;
    std::vector<fs::path> folders;
    if (const char* chosen = std::getenv("AMONTONS_MODULES")) folders.emplace_back(chosen);
    const fs::path program = fs::read_symlink("/proc/self/exe", error).parent_path();
    if (!error) {
        folders.push_back(program);
        folders.push_back(program / "../lib/amontons");
        folders.push_back(program / ".." / AMONTONS_LIBDIR / "amontons");
    }
    for (const fs::path& folder : folders)
        if (fs::exists(folder / file, error))
            return fs::weakly_canonical(folder / file, error).string();
    return "";
}

Module::Module(const std::string& name) : path_(find_module(name))
{
    const std::string file = "libamontons-" + name + ".so";
    if (path_.empty())
        throw std::runtime_error(
            "the module " + file +
            " is not installed; \"./setup.sh packages\" installs what it needs, "
            "then build again");
    handle_ = ::dlopen(path_.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (!handle_) {
        const char* reason = ::dlerror();
        throw std::runtime_error("the module " + path_ +
                                 " cannot be loaded: " + (reason ? reason : "unknown reason"));
    }
}

void* Module::symbol_(const char* name) const
{
    void* symbol = ::dlsym(handle_, name);
    if (!symbol)
        throw std::runtime_error("the module " + path_ + " has no \"" + name +
                                 "\": it is of another version");
    return symbol;
}

} // namespace amontons
