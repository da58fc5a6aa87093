#include "solver/output/vtk/virtual_display.hpp"

#include <X11/Xlib.h>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <poll.h>
#include <sstream>
#include <stdexcept>
#include <sys/wait.h>
#include <unistd.h>

#ifdef __linux__
#include <sys/prctl.h>
#endif

namespace amontons::vtk_module {
namespace {

constexpr int kStartSeconds = 20; // a loaded machine; Xvfb itself needs a tenth of one

std::string program_path(const char* name)
{
    const char* path = std::getenv("PATH");
    std::istringstream folders(path ? path : "/usr/bin:/bin");
    for (std::string folder; std::getline(folders, folder, ':');) {
        std::string candidate = folder + "/" + name;
        if (access(candidate.c_str(), X_OK) == 0) return candidate;
    }
    return "";
}

/// Xvfb picks a free display and writes its number to descriptor `out`. Between fork and exec
/// only async-signal-safe calls: the program may have other threads.
[[noreturn]] void become_xvfb(const char* program, int out, pid_t parent)
{
    setpgid(0, 0); // a Ctrl-C is for the run, not for the server
#ifdef __linux__
    prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (getppid() != parent) _exit(1);
#else
    (void)parent;
#endif
    const int null = open("/dev/null", O_RDWR);
    dup2(null, STDIN_FILENO);
    dup2(null, STDOUT_FILENO);
    dup2(null, STDERR_FILENO);
    if (out == 3)
        fcntl(out, F_SETFD, 0); // dup2 onto itself would leave it to be closed by exec
    else
        dup2(out, 3);
    execl(program, "Xvfb", "-displayfd", "3", "-screen", "0", "64x64x24", "-nolisten", "tcp",
          "-noreset", static_cast<char*>(nullptr));
    _exit(127);
}

/// The display's number, or "" if none came in time.
std::string read_number(int descriptor)
{
    std::string text;
    char byte = 0;
    pollfd wait{descriptor, POLLIN, 0};
    while (poll(&wait, 1, 1000 * kStartSeconds) > 0) {
        const ssize_t got = read(descriptor, &byte, 1);
        if (got < 0 && errno == EINTR) continue;
        if (got <= 0) return "";
        if (byte == '\n') return text;
        text += byte;
    }
    return "";
}

} // namespace

VirtualDisplay::VirtualDisplay()
{
    const std::string xvfb = program_path("Xvfb");
    std::string name;
    if (!xvfb.empty()) {
        int ends[2];
        if (pipe2(ends, O_CLOEXEC) != 0)
            throw std::runtime_error(std::string("no pipe for Xvfb: ") + std::strerror(errno));
        const pid_t parent = getpid();
        server_ = fork();
        if (server_ == 0) become_xvfb(xvfb.c_str(), ends[1], parent);
        close(ends[1]);
        const std::string number = server_ > 0 ? read_number(ends[0]) : "";
        close(ends[0]);
        if (!number.empty())
            name = ":" + number;
        else
            stop_server();
    }
    if (name.empty())
        if (const char* display = std::getenv("DISPLAY")) name = display;
    if (name.empty())
        throw std::runtime_error(
            xvfb.empty() ? "no X display to draw on: install the package xvfb, or set DISPLAY"
                         : "Xvfb is installed but does not start; run `Xvfb :99` to see why");
    connection_ = XOpenDisplay(name.c_str());
    if (!connection_) {
        stop_server();
        throw std::runtime_error("the X display " + name +
                                 " does not answer: install the package xvfb");
    }
}

VirtualDisplay::~VirtualDisplay()
{
    if (connection_) XCloseDisplay(static_cast<Display*>(connection_));
    stop_server();
}

void VirtualDisplay::stop_server()
{
    if (server_ <= 0) return;
    kill(server_, SIGTERM);
    while (waitpid(server_, nullptr, 0) < 0 && errno == EINTR) {
    }
    server_ = -1;
}

} // namespace amontons::vtk_module
