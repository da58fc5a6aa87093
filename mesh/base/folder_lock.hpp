#pragma once

#include <string>

namespace amontons {

/// Holds a folder for this process alone, as long as it lives. The system ends the hold with the
/// process, however that ends: a lock that a killed one left behind is taken over.
class FolderLock {
public:
    /// @param folder  is there
    /// @param who     what works in it, for the message of the next one: "amontons run a.json"
    /// @throws InputError  if another process holds it, with what that states of itself
    /// @throws WriteError  if the folder cannot be written to
    FolderLock(const std::string& folder, const std::string& who);
    FolderLock(const FolderLock&) = delete;
    FolderLock& operator=(const FolderLock&) = delete;
    ~FolderLock();

private:
    std::string path_;
    int file_ = -1;
};

} // namespace amontons
