#include "solver/module.hpp"

#include <cstdlib>
#include <dlfcn.h>
#include <filesystem>
#include <fstream>
#include <set>
#include <stdexcept>
#include <string_view>

namespace fs = std::filesystem;

namespace amontons {

namespace {

Host& the_host()
{
    static Host host;
    return host;
}

/// The file that this function is in: of a library, or of the program.
fs::path own_file()
{
    Dl_info info{};
    std::error_code error;
    const fs::path program = fs::read_symlink("/proc/self/exe", error);
    if (::dladdr(reinterpret_cast<const void*>(&find_module), &info) == 0 || !info.dli_fname)
        return program;
    const fs::path file = fs::weakly_canonical(info.dli_fname, error);
    return fs::exists(file, error) ? file : program; // a program is named as it was called
}

} // namespace

void set_host(Host host)
{
    the_host() = std::move(host);
}

std::string program_path()
{
    return the_host().program.empty() ? "/proc/self/exe" : the_host().program;
}

std::vector<std::string> module_folders()
{
    std::vector<std::string> folders;
    if (const char* chosen = std::getenv("AMONTONS_MODULES")) folders.emplace_back(chosen);
    if (!the_host().modules.empty()) folders.push_back(the_host().modules);
    const fs::path own = own_file().parent_path();
    if (!own.empty())
        for (const fs::path& folder :
             {own, own / "../lib/amontons", own / ".." / AMONTONS_LIBDIR / "amontons"})
            folders.push_back(folder.string());
    folders.emplace_back(AMONTONS_PREFIX "/" AMONTONS_LIBDIR "/amontons");
    return folders;
}

std::string find_module(const std::string& name)
{
    const std::string file = "libamontons-" + name + ".so";
    std::error_code error;
    for (const fs::path folder : module_folders())
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

std::vector<std::string> mapped_modules()
{
    constexpr std::string_view kHead = "/libamontons-", kTail = ".so";
    std::set<std::string> names;
    std::ifstream maps("/proc/self/maps");
    for (std::string line; std::getline(maps, line);) {
        const std::size_t at = line.rfind(kHead);
        if (at == std::string::npos) continue;
        const std::size_t name = at + kHead.size(), end = line.find(kTail, name);
        if (end != std::string::npos) names.insert(line.substr(name, end - name));
    }
    return {names.begin(), names.end()};
}

} // namespace amontons
