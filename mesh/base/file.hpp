#pragma once

#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>

namespace amontons {

/// An output that could not be written: full disk, no permission, missing folder. Not the
/// input's fault; what() names the file and the system's reason.
class WriteError : public std::runtime_error {
public:
    WriteError(std::string file, const std::string& reason)
        : std::runtime_error(file + ": cannot be written: " + reason)
        , file_(std::move(file))
    {
    }
    const std::string& file() const { return file_; }

private:
    std::string file_;
};

/// All bytes of a file (or of a pipe).
/// @throws InputError  if it is missing (with the nearest name in its folder), is a folder or a
///                     device, or may not be read
std::string read_file(const std::string& path);

/// How far a written file must have come before write_file returns.
enum class Flush {
    to_disk,   ///< survives a power failure; waits for the disk (milliseconds)
    to_system, ///< survives the end of this process, however it ends
};

/// What happens to a link where a file is to be written.
enum class Links {
    follow,  ///< it stays, and the file that it names is written
    replace, ///< the file takes its place: what it names is left alone
};

/// Writes a file so that every reader gets all of the old one or all of the new one.
///
/// A temporary file in the same folder, then a rename. An existing file keeps its permissions. What
/// is no ordinary file (/dev/stdout, a pipe) is written directly.
/// @throws WriteError  and leaves the old file as it was, without a temporary file beside it
void write_file(const std::string& path, std::string_view bytes, Flush flush = Flush::to_disk,
                Links links = Links::follow);
/// The same from parts, one after the other: large arrays need not be copied together first.
void write_file(const std::string& path, std::span<const std::string_view> parts,
                Flush flush = Flush::to_disk, Links links = Links::follow);

/// Takes a link away, whatever it names; anything else stays.
void drop_link(const std::string& path);

/// Makes a folder and its parents, if they are not there.
/// @throws WriteError  if one is there but no folder, or cannot be made
void make_folder(const std::string& path);

/// 64-bit fingerprint (XXH3): the same on every machine. Not for keeping secrets.
std::uint64_t hash_bytes(std::string_view bytes);

/// 128-bit fingerprint (XXH3), for names of things that must not be mistaken for each other.
struct Hash128 {
    /// The two halves.
    std::uint64_t high = 0, low = 0;
    bool operator==(const Hash128&) const = default;
};
/// Hash of bytes; the same on every machine.
Hash128 hash128_bytes(std::string_view bytes);

} // namespace amontons
