#include "mesh/base/file.hpp"

#include "mesh/base/error.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>
#include <vector>
#include <xxhash.h>

namespace fs = std::filesystem;

namespace amontons {
namespace {

std::string reason(int error)
{
    return std::strerror(error);
}

/// A file descriptor that closes itself.
class Descriptor {
public:
    explicit Descriptor(int fd) : fd_(fd) {}
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;
    ~Descriptor()
    {
        if (fd_ >= 0) ::close(fd_);
    }
    int get() const { return fd_; }
    bool valid() const { return fd_ >= 0; }
    /// Closes now: on a network disk this is where "full" may be reported. @return 0 or errno
    int close()
    {
        const int fd = std::exchange(fd_, -1);
        return ::close(fd) == 0 || errno == EINTR ? 0 : errno;
    }

private:
    int fd_;
};

[[noreturn]] void refuse(const std::string& path, std::string found, std::string allowed)
{
    throw InputError({{path, "", std::move(found), std::move(allowed)}});
}

std::string nearest_file(const std::string& path)
{
    constexpr int kMostNames = 10000; // a hint is not worth a walk through a huge folder
    const fs::path requested(path);
    const fs::path folder = requested.has_parent_path() ? requested.parent_path() : fs::path(".");
    std::vector<std::string> names;
    std::error_code error;
    int count = 0;
    for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
         entry.increment(error)) {
        if (++count > kMostNames) break;
        names.push_back(entry->path().filename().string());
    }
    std::sort(names.begin(), names.end()); // the system's order is not the same everywhere
    return nearest_name(requested.filename().string(), names);
}

/// Writes all bytes. @return 0 or errno
int write_all(int fd, std::span<const std::string_view> parts)
{
    for (std::string_view bytes : parts)
        while (!bytes.empty()) {
            const ssize_t n = ::write(fd, bytes.data(), bytes.size());
            if (n < 0) {
                if (errno == EINTR) continue;
                return errno;
            }
            bytes.remove_prefix(static_cast<std::size_t>(n));
        }
    return 0;
}

/// A new file beside the target, under a name that no one else has.
struct Temporary {
    std::string path;
    int fd = -1; ///< -1: errno gives the reason
};

Temporary temporary_beside(const fs::path& target)
{
    constexpr int kTries = 1000; // names left by killed processes, or taken by other threads
    Temporary file;
    for (int i = 0; i < kTries; ++i) {
        std::string name = ".";
        name.append(target.filename().string()).append(".").append(std::to_string(::getpid()));
        name.append(".").append(std::to_string(i)).append(".tmp");
        file.path = (target.parent_path() / name).string();
        file.fd = ::open(file.path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        if (file.fd >= 0 || errno != EEXIST) break;
    }
    return file;
}

} // namespace

std::string read_file(const std::string& path)
{
    struct stat info {};
    if (::stat(path.c_str(), &info) != 0) {
        if (errno != ENOENT) refuse(path, reason(errno), "a file that can be read");
        const std::string near = nearest_file(path);
        refuse(path, "no such file",
               near.empty() ? "an existing file"
                            : "an existing file (nearest name: " + quoted_text(near) + ")");
    }
    if (S_ISDIR(info.st_mode)) refuse(path, "a folder", "a file");
    if (!S_ISREG(info.st_mode) && !S_ISFIFO(info.st_mode)) refuse(path, "a device", "a file");
    const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
    if (!file.valid()) refuse(path, reason(errno), "a file that can be read");

    // One byte more than the size, so that the end is seen without growing.
    std::string bytes(static_cast<std::size_t>(info.st_size) + 1, '\0');
    std::size_t length = 0;
    for (;;) {
        if (length == bytes.size()) bytes.resize(2 * bytes.size() + 4096);
        const ssize_t n = ::read(file.get(), bytes.data() + length, bytes.size() - length);
        if (n == 0) break;
        if (n < 0) {
            if (errno == EINTR) continue;
            refuse(path, reason(errno), "a file that can be read");
        }
        length += static_cast<std::size_t>(n);
    }
    bytes.resize(length);
    return bytes;
}

void drop_link(const std::string& path)
{
    struct stat info {};
    if (::lstat(path.c_str(), &info) == 0 && S_ISLNK(info.st_mode)) ::unlink(path.c_str());
}

void write_file(const std::string& path, std::string_view bytes, Flush flush, Links links)
{
    write_file(path, std::span(&bytes, 1), flush, links);
}

void write_file(const std::string& path, std::span<const std::string_view> parts, Flush flush,
                Links links)
{
    struct stat info {};
    const auto stat_file = links == Links::follow ? ::stat : ::lstat;
    bool exists = stat_file(path.c_str(), &info) == 0;
    if (exists && S_ISLNK(info.st_mode)) exists = false; // the rename takes its place
    if (exists && S_ISDIR(info.st_mode)) throw WriteError(path, "it is a folder");
    if (exists && !S_ISREG(info.st_mode)) { // a rename would replace the device itself
        Descriptor file(::open(path.c_str(), O_WRONLY | O_CLOEXEC));
        int error = file.valid() ? write_all(file.get(), parts) : errno;
        if (error == 0) error = file.close();
        if (error != 0) throw WriteError(path, reason(error));
        return;
    }

    std::error_code ignored; // a dangling or foreign link then fails below, with its reason
    fs::path target(path);
    if (links == Links::follow && fs::is_symlink(target, ignored))
        target = fs::weakly_canonical(target, ignored);
    const Temporary temporary = temporary_beside(target);
    Descriptor file(temporary.fd);
    if (!file.valid()) throw WriteError(path, reason(errno));

    int error = write_all(file.get(), parts);
    if (error == 0 && exists && ::fchmod(file.get(), info.st_mode & 07777) != 0) error = errno;
    if (error == 0 && flush == Flush::to_disk && ::fsync(file.get()) != 0) error = errno;
    const int close_error = file.close();
    if (error == 0) error = close_error;
    if (error == 0 && ::rename(temporary.path.c_str(), target.c_str()) != 0) error = errno;
    if (error != 0) {
        ::unlink(temporary.path.c_str());
        throw WriteError(path, reason(error));
    }
    if (flush == Flush::to_disk) { // the rename itself; a folder that cannot sync is no failure
        const fs::path folder = target.has_parent_path() ? target.parent_path() : fs::path(".");
        const Descriptor open_folder(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
        if (open_folder.valid()) ::fsync(open_folder.get());
    }
}

void make_folder(const std::string& path)
{
    std::error_code error;
    fs::create_directories(path, error);
    if (error) throw WriteError(path, error.message());
    if (!fs::is_directory(path, error)) throw WriteError(path, "it is a file, not a folder");
}

std::uint64_t hash_bytes(std::string_view bytes)
{
    return XXH3_64bits(bytes.data(), bytes.size());
}

Hash128 hash128_bytes(std::string_view bytes)
{
    const XXH128_hash_t hash = XXH3_128bits(bytes.data(), bytes.size());
    return {hash.high64, hash.low64};
}

} // namespace amontons
