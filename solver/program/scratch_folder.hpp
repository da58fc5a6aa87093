#pragma once

#include <string>

namespace amontons {

/// A folder of this process alone, removed with it.
class ScratchFolder {
public:
    /// @throws WriteError  if none can be made, in TMPDIR or /tmp
    ScratchFolder();
    ScratchFolder(const ScratchFolder&) = delete;
    ScratchFolder& operator=(const ScratchFolder&) = delete;
    ~ScratchFolder();
    const std::string& path() const { return path_; }
    /// It stays where it is.
    void keep() { kept_ = true; }

private:
    std::string path_;
    bool kept_ = false;
};

} // namespace amontons
