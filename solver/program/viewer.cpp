#include "solver/program/viewer.hpp"

#include "solver/module.hpp"
#include "solver/output/vtk/vtk_module.hpp"
#include "solver/program/session.hpp"

#include <CLI/CLI.hpp>
#include <cerrno>
#include <cstdio>
#include <memory>
#include <stdexcept>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>
#include <vector>

// Frames are sent down a socket; up come "R" when the window is there, or "E" and why not, and at
// its end "F frames seconds".

namespace amontons {
namespace {

constexpr auto kPause = std::chrono::milliseconds(25); // between two frames: up to 40 a second

/// Text of the other side, up to the end of a line; "" at its end.
std::string read_line(int stream)
{
    std::string text;
    for (char c = 0; ::read(stream, &c, 1) == 1 && c != '\n';)
        text += c;
    return text;
}

InputError no_window(const std::string& why)
{
    return InputError({{"(--view)", "", why, "a display ($DISPLAY) and the VTK module"}});
}

struct ViewArguments {
    std::string title;
    bool stay = false;
};

} // namespace

Viewer::Viewer(const std::string& title, bool stay)
{
    if (find_module("vtk").empty()) throw no_window("no VTK module");
    int ends[2] = {-1, -1};
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0)
        throw no_window("no socket");
    std::vector<std::string> words{"amontons", "view", "--title", title, "--quiet"};
    if (stay) words.push_back("--stay");
    std::vector<char*> arguments;
    for (std::string& w : words)
        arguments.push_back(w.data());
    arguments.push_back(nullptr);
    const std::string program = program_path();
    child_ = ::fork();
    if (child_ == 0) {   // only calls that are safe here, until exec
        ::setpgid(0, 0); // Ctrl-C is for the run
        ::dup2(ends[1], 0);
        ::execv(program.c_str(), arguments.data());
        ::_exit(127);
    }
    ::close(ends[1]);
    stream_ = ends[0];
    const std::string answer = child_ > 0 ? read_line(stream_) : "";
    if (answer != "R") {
        ::close(stream_);
        if (child_ > 0) ::waitpid(child_, nullptr, 0);
        throw no_window(answer.size() > 1 ? answer.substr(1) : "its process has failed");
    }
    sender_ = std::thread([this] { send(); });
}

Viewer::~Viewer()
{
    close();
}

bool Viewer::frame_due()
{
    const auto now = std::chrono::steady_clock::now();
    if (now < next_) return false;
    const std::lock_guard lock(mutex_);
    return !closed_ && waiting_.empty();
}

void Viewer::offer(const ViewFrame& frame)
{
    next_ = std::chrono::steady_clock::now() + kPause;
    std::string bytes = view_bytes(frame);
    {
        const std::lock_guard lock(mutex_);
        waiting_ = std::move(bytes);
    }
    changed_.notify_one();
}

void Viewer::send()
{
    std::unique_lock lock(mutex_);
    while (true) {
        changed_.wait(lock, [this] { return ended_ || !waiting_.empty(); });
        if (waiting_.empty()) return;
        std::string bytes;
        bytes.swap(waiting_);
        lock.unlock();
        bool closed = false;
        for (std::size_t sent = 0; sent < bytes.size() && !closed;) {
            const ssize_t n =
                ::send(stream_, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
            if (n > 0) sent += static_cast<std::size_t>(n);
            closed = n < 0 && errno != EINTR;
        }
        lock.lock();
        closed_ = closed_ || closed;
        if (closed_) return;
    }
}

Viewer::Counts Viewer::close()
{
    Counts counts;
    if (stream_ < 0) return counts;
    {
        const std::lock_guard lock(mutex_);
        ended_ = true;
    }
    changed_.notify_one();
    sender_.join();
    ::shutdown(stream_, SHUT_WR);
    const std::string last = read_line(stream_);
    std::sscanf(last.c_str(), "F %ld %lf", &counts.frames, &counts.seconds);
    ::close(stream_);
    stream_ = -1;
    ::waitpid(child_, nullptr, 0);
    return counts;
}

void add_view(CLI::App& program, Session& session)
{
    const auto a = std::make_shared<ViewArguments>();
    CLI::App* command = program.add_subcommand("view", "The window of --view");
    command->group(""); // not for users: it reads frames from a socket
    command->add_option("--title", a->title);
    command->add_flag("--stay", a->stay);
    command->callback([a, &session] {
        char message[1000] = "";
        try {
            const Module vtk("vtk");
            const auto view = vtk.function<decltype(amontons_vtk_view)>("amontons_vtk_view");
            if (view(0, a->title.c_str(), a->stay, message, sizeof message) == 0) return;
        } catch (const std::runtime_error& error) {
            std::snprintf(message, sizeof message, "%s", error.what());
        }
        std::string line = std::string("E") + message + "\n";
        if (::write(0, line.data(), line.size()) < 0) session.error(message);
        session.exit_code = kSolveFailed;
    });
}

} // namespace amontons
