#pragma once

#include <string>
#include <vector>

// Heavy packages stand behind modules, libamontons-NAME.so, that are opened only when a scene
// needs them. A module's functions are plain C; its header specifies which there are.

namespace amontons {

/// The host: another program that this library is part of (such as Python), and its paths.
struct Host {
    std::string program; ///< amontons
    std::string modules; ///< folder of libamontons-NAME.so
};
/// Sets the host, once and before any other call; for the whole process.
void set_host(Host host);

/// What to start for a task in a process of its own (a picture, a window, a case): the host's
/// amontons, else this program, which stays the same when its file is replaced.
std::string program_path();

/// Where modules are searched for, in this order: $AMONTONS_MODULES; the host's folder; beside this
/// library or program, in its ../lib/amontons and ../lib/<machine>/amontons; where amontons was
/// configured to be installed.
std::vector<std::string> module_folders();

/// Where libamontons-NAME.so is, or "" if it is in none of the folders.
std::string find_module(const std::string& name);

/// Names of the modules that are mapped into this process, sorted.
std::vector<std::string> mapped_modules();

/// An open module. It stays mapped until the program ends: libraries that start threads or
/// register factories do not survive being closed.
class Module {
public:
    /// @throws std::runtime_error  that states what is missing and what to install
    explicit Module(const std::string& name);

    /// A function of the module, by its name.
    /// @throws std::runtime_error  if the module has none of this name (another version)
    template <class Function> Function* function(const char* name) const
    {
        return reinterpret_cast<Function*>(symbol_(name));
    }
    const std::string& path() const { return path_; }

private:
    void* symbol_(const char* name) const;

    std::string path_;
    void* handle_ = nullptr;
};

} // namespace amontons
