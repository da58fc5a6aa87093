#include "solver/child.hpp"

#include "mesh/base/phase_timer.hpp"
#include "solver/module.hpp"

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <fcntl.h>
#include <list>
#include <poll.h>
#include <stdexcept>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

namespace amontons {
namespace {

constexpr int kPollPeriod = 100; // ms between reads of the clock and the stop flag

/// A process and the pipes it talks through. Killed if it is left alone.
class Child {
public:
    Child(std::size_t index, const ChildJob& job) : index_(index), most_seconds_(job.most_seconds)
    {
        std::vector<std::string> words{job.program.empty() ? "amontons" : job.program};
        words.insert(words.end(), job.arguments.begin(), job.arguments.end());
        std::vector<char*> arguments;
        for (std::string& w : words)
            arguments.push_back(w.data());
        arguments.push_back(nullptr);
        const std::string chosen = job.program.empty() ? program_path() : job.program;
        const char* const program = chosen.c_str();
        int out[2] = {-1, -1}, err[2] = {-1, -1};
        const int nothing = ::open("/dev/null", O_RDONLY | O_CLOEXEC);
        const bool pipes =
            nothing >= 0 && ::pipe2(out, O_CLOEXEC) == 0 && ::pipe2(err, O_CLOEXEC) == 0;
        const pid_t parent = ::getpid();
        pid_ = pipes ? ::fork() : -1;
        if (pid_ == 0) { // only calls that are safe here, until exec
            ::prctl(PR_SET_PDEATHSIG, SIGKILL);
            ::setpgid(0, 0); // Ctrl-C arrives from the parent process alone
            if (::getppid() != parent) ::_exit(127);
            ::dup2(nothing, 0);
            ::dup2(out[1], 1);
            ::dup2(err[1], 2);
            if (job.most_cpu_seconds > 0) {
                const auto most = static_cast<rlim_t>(job.most_cpu_seconds);
                const rlimit limit{most, most + 1}; // SIGXCPU, then SIGKILL
                ::setrlimit(RLIMIT_CPU, &limit);
            }
            ::execv(program, arguments.data());
            ::_exit(127);
        }
        const int error = errno;
        for (const int fd : {nothing, out[1], err[1]})
            if (fd >= 0) ::close(fd);
        pipe_[0] = out[0];
        pipe_[1] = err[0];
        if (pid_ < 0) {
            close_pipes();
            throw std::runtime_error(std::string("no process can be started: ") +
                                     std::strerror(error));
        }
        for (const int fd : pipe_)
            ::fcntl(fd, F_SETFL, O_NONBLOCK);
    }
    Child(const Child&) = delete;
    Child& operator=(const Child&) = delete;
    ~Child()
    {
        if (pid_ > 0) {
            end();
            ::waitpid(pid_, nullptr, 0);
        }
        close_pipes();
    }

    std::size_t index() const { return index_; }
    const int* pipes() const { return pipe_; }
    void signal(int number) const { ::kill(pid_, number); }

    void read()
    {
        std::string* texts[2] = {&result_.output, &result_.errors};
        char buffer[65536];
        for (int k = 0; k < 2; ++k)
            while (pipe_[k] >= 0) {
                const ssize_t n = ::read(pipe_[k], buffer, sizeof buffer);
                if (n > 0) {
                    texts[k]->append(buffer, std::size_t(n));
                } else if (n < 0 && errno == EINTR) {
                    continue;
                } else {
                    if (n == 0 || (errno != EAGAIN && errno != EWOULDBLOCK)) {
                        ::close(pipe_[k]);
                        pipe_[k] = -1;
                    }
                    break;
                }
            }
    }

    /// True once it has ended.
    bool ended()
    {
        if (most_seconds_ > 0 && watch_.seconds() > most_seconds_ && !result_.out_of_time) {
            result_.out_of_time = true;
            end();
        }
        int status = 0;
        rusage usage{};
        if (::wait4(pid_, &status, WNOHANG, &usage) != pid_) return false;
        pid_ = -1;
        read();
        result_.seconds = watch_.seconds();
        const auto seconds = [](const timeval& t) {
            return double(t.tv_sec) + 1e-6 * double(t.tv_usec);
        };
        result_.cpu_seconds = seconds(usage.ru_utime) + seconds(usage.ru_stime);
        if (WIFEXITED(status)) result_.exit_code = WEXITSTATUS(status);
        if (WIFSIGNALED(status)) result_.signal = WTERMSIG(status);
        result_.out_of_time |= result_.signal == SIGXCPU;
        return true;
    }
    const ChildResult& result() const { return result_; }

private:
    /// With whatever it has started: it is the first of its process group.
    void end() const
    {
        ::kill(-pid_, SIGKILL);
        ::kill(pid_, SIGKILL); // its group may not be made yet
    }
    void close_pipes()
    {
        for (int& fd : pipe_)
            if (fd >= 0) {
                ::close(fd);
                fd = -1;
            }
    }

    std::size_t index_;
    double most_seconds_;
    pid_t pid_ = -1;
    int pipe_[2] = {-1, -1};
    Stopwatch watch_;
    ChildResult result_;
};

} // namespace

void run_children(const std::vector<ChildJob>& jobs, int at_once, const std::atomic<bool>& stop,
                  const std::function<void(std::size_t, const ChildResult&)>& done)
{
    std::list<Child> running;
    std::size_t next = 0;
    bool stopped = false;
    while (true) {
        while (!stop && next < jobs.size() && int(running.size()) < at_once) {
            running.emplace_back(next, jobs[next]);
            ++next;
        }
        if (stop && !stopped) {
            stopped = true;
            for (const Child& c : running)
                c.signal(SIGINT);
        }
        if (running.empty()) return;
        std::vector<pollfd> ends;
        for (const Child& c : running)
            for (int k = 0; k < 2; ++k)
                if (c.pipes()[k] >= 0) ends.push_back({c.pipes()[k], POLLIN, 0});
        // A child whose pipes are closed is about to end: poll again soon.
        ::poll(ends.data(), ends.size(), ends.empty() ? 1 : kPollPeriod);
        for (auto c = running.begin(); c != running.end();) {
            c->read();
            if (!c->ended()) {
                ++c;
                continue;
            }
            const std::size_t index = c->index();
            const ChildResult result = c->result();
            c = running.erase(c);
            const bool interrupted = stopped && (result.exit_code == 130 || result.signal != 0);
            if (!interrupted) done(index, result);
        }
    }
}

std::string last_line(const std::string& errors)
{
    std::size_t end = errors.find_last_not_of(" \n");
    if (end == std::string::npos) return "";
    const std::size_t start = errors.rfind('\n', end) + 1; // npos + 1 is 0
    std::string line = errors.substr(start, end - start + 1);
    const std::string head = "error: ";
    if (line.rfind(head, 0) == 0) line.erase(0, head.size());
    return line;
}

} // namespace amontons
