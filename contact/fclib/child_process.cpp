#include "contact/fclib/child_process.hpp"

#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <fcntl.h>
#include <memory>
#include <new>
#include <optional>
#include <stdexcept>
#include <sys/prctl.h>
#include <sys/resource.h>
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
    for (const int s : {SIGHUP, SIGINT, SIGTERM, SIGSEGV, SIGBUS, SIGABRT, SIGFPE, SIGILL, SIGXCPU})
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
        result = "it needs more memory than is allowed for it";
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
    // A pipe: a limit on the size of files is none of it.
    int ends[2];
    if (::pipe2(ends, O_CLOEXEC) != 0)
        throw std::runtime_error(std::string("no process could be started: ") +
                                 std::strerror(errno));
    const Descriptor from(ends[0]);
    std::optional<Descriptor> to(ends[1]);
    const pid_t child = ::fork();
    if (child < 0)
        throw std::runtime_error(std::string("no process could be started: ") +
                                 std::strerror(errno));
    if (child == 0) be_child(to->get(), work, memory, time);
    to.reset();
    std::size_t room = std::size_t(1) << 16, size = 0;
    std::unique_ptr<char, decltype(&std::free)> data(static_cast<char*>(std::malloc(room)),
                                                     &std::free);
    while (data) {
        if (size + 1 >= room) { // one more for the end
            room *= 2;
            char* const more = static_cast<char*>(std::realloc(data.get(), room));
            if (!more) break;
            (void)data.release();
            data.reset(more);
        }
        const ssize_t n = ::read(from.get(), data.get() + size, room - size - 1);
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) break;
        size += static_cast<std::size_t>(n);
    }
    const bool full = !data || size + 1 >= room;
    if (full) ::kill(child, SIGKILL); // it waits for a reader
    int status = 0;
    while (::waitpid(child, &status, 0) < 0)
        if (errno != EINTR) throw std::runtime_error("the process that reads it was lost");
    if (full) throw std::bad_alloc();
    if (WIFSIGNALED(status)) {
        const int s = WTERMSIG(status);
        if (s == SIGXCPU || s == SIGKILL)
            throw std::runtime_error("the HDF5 library does not finish reading it");
        throw std::runtime_error(std::string("the HDF5 library crashes on it (") + ::strsignal(s) +
                                 ")");
    }
    if (size < 1 || !WIFEXITED(status) || WEXITSTATUS(status) != 0)
        throw std::runtime_error("the HDF5 library crashes on it");
    const char kind = *data;
    std::memmove(data.get(), data.get() + 1, size - 1);
    data.get()[size - 1] = '\0';
    if (kind != 'y') throw std::runtime_error(std::string(data.get(), size - 1));
    return {data.release(), static_cast<long>(size - 1)};
}

} // namespace amontons::fclib_module
