#include "contact/fclib/child_process.hpp"

#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <fcntl.h>
#include <new>
#include <stdexcept>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

namespace amontons::fclib_module {
namespace {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kSanitized = true;
#elif defined(__has_feature)
constexpr bool kSanitized = __has_feature(address_sanitizer) || __has_feature(thread_sanitizer);
#else
constexpr bool kSanitized = false;
#endif

class Descriptor {
public:
    explicit Descriptor(int number) : number_(number) {}
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;
    ~Descriptor()
    {
        if (number_ >= 0) ::close(number_);
    }
    int get() const { return number_; }

private:
    int number_;
};

bool write_all(int to, const char* data, std::size_t size)
{
    while (size > 0) {
        const ssize_t n = ::write(to, data, size);
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) return false;
        data += n;
        size -= static_cast<std::size_t>(n);
    }
    return true;
}

/// First byte: 'y' and what the work returned, or 'n' and why it did not.
[[noreturn]] void be_child(int to, const std::function<std::string()>& work, double memory,
                           double time)
{
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    for (const int s : {SIGINT, SIGTERM, SIGSEGV, SIGBUS, SIGABRT, SIGFPE, SIGILL, SIGXCPU})
        std::signal(s, SIG_DFL); // a handler of the parent's must not run twice
    if (const int null = ::open("/dev/null", O_RDWR | O_CLOEXEC); null >= 0)
        for (const int stream : {0, 1, 2})
            ::dup2(null, stream); // what a crash prints is no message for a user
    const rlimit no_core{0, 0};
    ::setrlimit(RLIMIT_CORE, &no_core);
    const auto seconds = static_cast<rlim_t>(std::ceil(time));
    const rlimit processor{seconds, seconds + 1};
    ::setrlimit(RLIMIT_CPU, &processor);
    if (!kSanitized) { // a sanitizer's shadow takes terabytes
        long pages = 0;
        if (FILE* f = std::fopen("/proc/self/statm", "r")) {
            if (std::fscanf(f, "%ld", &pages) != 1) pages = 0;
            std::fclose(f);
        }
        const double now = static_cast<double>(pages) * static_cast<double>(::getpagesize());
        const auto bytes = static_cast<rlim_t>(now + memory);
        const rlimit space{bytes, bytes};
        ::setrlimit(RLIMIT_AS, &space);
    }
    char kind = 'y';
    std::string result;
    try {
        result = work();
    } catch (const std::bad_alloc&) {
        kind = 'n';
        result = "it needs more memory than there is for it";
    } catch (const std::exception& error) {
        kind = 'n';
        result = error.what();
    }
    const bool written = write_all(to, &kind, 1) && write_all(to, result.data(), result.size());
    ::_exit(written ? 0 : 1);
}

} // namespace

Bytes in_child_process(const std::function<std::string()>& work, double memory, double time)
{
    const Descriptor file(::memfd_create("amontons", MFD_CLOEXEC));
    if (file.get() < 0) throw std::runtime_error("no memory for the result of the reading");
    const pid_t child = ::fork();
    if (child < 0)
        throw std::runtime_error(std::string("no process could be started: ") +
                                 std::strerror(errno));
    if (child == 0) be_child(file.get(), work, memory, time);
    int status = 0;
    while (::waitpid(child, &status, 0) < 0)
        if (errno != EINTR) throw std::runtime_error("the process of the reading was lost");
    if (WIFSIGNALED(status)) {
        const int s = WTERMSIG(status);
        if (s == SIGXCPU || s == SIGKILL)
            throw std::runtime_error("the HDF5 library comes to no end with it");
        throw std::runtime_error(std::string("the HDF5 library crashes on it (") + ::strsignal(s) +
                                 ")");
    }
    struct stat state = {};
    if (::fstat(file.get(), &state) != 0 || state.st_size < 1 || !WIFEXITED(status) ||
        WEXITSTATUS(status) != 0)
        throw std::runtime_error("the HDF5 library crashes on it");
    Bytes bytes;
    bytes.size = state.st_size - 1;
    bytes.data = static_cast<char*>(std::malloc(static_cast<std::size_t>(bytes.size) + 1));
    if (!bytes.data) throw std::bad_alloc();
    char kind = 'n';
    bool whole = ::pread(file.get(), &kind, 1, 0) == 1;
    for (long done = 0; whole && done < bytes.size;) {
        const ssize_t n = ::pread(file.get(), bytes.data + done,
                                  static_cast<std::size_t>(bytes.size - done), done + 1);
        if (n < 0 && errno == EINTR) continue;
        whole = n > 0;
        done += n;
    }
    bytes.data[bytes.size] = '\0';
    if (whole && kind == 'y') return bytes;
    const std::string message(bytes.data, whole ? static_cast<std::size_t>(bytes.size) : 0);
    std::free(bytes.data);
    throw std::runtime_error(whole ? message : "the result of the reading was lost");
}

} // namespace amontons::fclib_module
