#pragma once

#include <string>
#include <vector>

// Heavy packages stand behind modules, libamontons-NAME.so, that are opened only when a scene
// asks for them. A module's functions are plain C; its header says which there are.

namespace amontons {

/// Where libamontons-NAME.so is, or "" if it is not installed. Looks in $AMONTONS_MODULES, then
/// beside the program, in its ../lib/amontons, and in ../lib/<machine>/amontons.
std::string find_module(const std::string& name);

/// An open module. It stays mapped until the program ends: libraries that start threads or
/// register factories do not survive being closed.
class Module {
public:
    /// @throws std::runtime_error  that says what is missing and what to install
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
