#include "mesh/base/folder_lock.hpp"

#include "mesh/base/error.hpp"
#include "mesh/base/file.hpp"

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

namespace amontons {
namespace {

constexpr std::size_t kMostWords = 300;

std::string words_in(int file)
{
    char text[kMostWords + 1] = "";
    const ssize_t n = ::pread(file, text, kMostWords, 0);
    std::string words(text, n > 0 ? std::size_t(n) : 0);
    while (!words.empty() && words.back() == '\n')
        words.pop_back();
    return words;
}

/// For file systems without locks: true if the process that the file names still exists.
bool lives(const std::string& words)
{
    const long process =
        std::strtol(words.c_str() + std::min(words.find(' '), words.size()), nullptr, 10);
    return process > 0 && process != ::getpid() &&
           (::kill(pid_t(process), 0) == 0 || errno == EPERM);
}

} // namespace

FolderLock::FolderLock(const std::string& folder, const std::string& who) : path_(folder + "/.lock")
{
    const auto fail = [&](int error) {
        if (file_ >= 0) ::close(file_);
        throw WriteError(path_, std::strerror(error));
    };
    while (true) {
        drop_link(path_);
        file_ = ::open(path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0666);
        if (file_ < 0) fail(errno);
        const bool held = ::flock(file_, LOCK_EX | LOCK_NB) != 0;
        const int error = errno;
        const std::string words = words_in(file_);
        if (held ? error == EWOULDBLOCK || lives(words) : false) {
            ::close(file_);
            file_ = -1;
            throw InputError({{folder, "",
                               words.empty() ? "another process at work in this folder"
                                             : words + " at work in this folder",
                               "its end, or another --output"}});
        }
        struct stat mine {
        }, there{};
        if (::fstat(file_, &mine) != 0) fail(errno);
        // The one before may have taken the file away between open and lock.
        if (::stat(path_.c_str(), &there) == 0 && mine.st_ino == there.st_ino &&
            mine.st_dev == there.st_dev)
            break;
        ::close(file_);
    }
    std::string words = "process " + std::to_string(::getpid()) + " (";
    for (const char c : who.substr(0, kMostWords / 2))
        words += static_cast<unsigned char>(c) < 0x20 || c == 0x7f ? '?' : c;
    words += ")\n";
    if (::ftruncate(file_, 0) != 0 || ::pwrite(file_, words.data(), words.size(), 0) < 0) {
        // A full disk: the lock holds without its words.
    }
}

FolderLock::~FolderLock()
{
    ::unlink(path_.c_str());
    ::close(file_);
}

} // namespace amontons
