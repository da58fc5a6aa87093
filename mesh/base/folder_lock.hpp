#pragma once

#include <string>

namespace amontons {

/// Holds a folder for this process alone, as long as it lives. The system ends the hold with the
/// process, however that ends: a lock that a killed one left behind is taken over.
class FolderLock {
public:
    /// @param folder  exists
    /// @param who     what works in it, for messages of other processes: "amontons run a.json"
    /// @throws InputError  if another process holds it, with the `who` of that one
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
