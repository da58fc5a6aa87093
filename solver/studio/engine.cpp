#include "solver/studio/engine.hpp"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <linux/close_range.h>
#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>
#include <sys/wait.h>
#include <unistd.h>

namespace amontons::studio {
namespace {

constexpr double kBetweenSaves = 5;                     // of a run [s]
constexpr double kLastWords = 1.5;                      // of an engine that is ended [s]
constexpr double kPatience = 60;                        // for an answer [s]
constexpr std::uint64_t kMostFrame = 1ULL << 30;        // [bytes]
constexpr std::size_t kMostLine = std::size_t(1) << 29; // a state in it

double now()
{
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch())
        .count();
}

Json refusal(const std::string& status, const std::string& found, const std::string& allowed)
{
    return {{"ok", false},
            {"status", status},
            {"issues",
             Json::array({{{"file", ""}, {"place", ""}, {"found", found}, {"allowed", allowed}}})}};
}

/// Of a scene's results: its file's name, or its folder's where that name is generic.
std::string name_of(const std::string& scene)
{
    const std::filesystem::path path(scene);
    const std::string name = path.stem().string();
    return name == "scene" ? path.parent_path().filename().string() : name;
}

/// All bytes, or false.
bool read_whole(int stream, void* to, std::size_t size)
{
    auto* at = static_cast<char*>(to);
    while (size > 0) {
        const ssize_t n = ::read(stream, at, size);
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) return false;
        at += n;
        size -= static_cast<std::size_t>(n);
    }
    return true;
}

template <class Take> void read_lines(int stream, Take take)
{
    std::string bytes;
    char block[65536];
    while (true) {
        const ssize_t n = ::read(stream, block, sizeof block);
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) return;
        const std::size_t before = bytes.size();
        bytes.append(block, static_cast<std::size_t>(n));
        if (bytes.size() > kMostLine) return;
        std::size_t begin = 0, end = bytes.find('\n', before);
        for (; end != std::string::npos; end = bytes.find('\n', begin)) {
            take(bytes.substr(begin, end - begin));
            begin = end + 1;
        }
        bytes.erase(0, begin);
    }
}

} // namespace

std::int64_t post(EngineRequests& requests, Json request)
{
    const std::int64_t id = ++requests.last_id;
    request["id"] = id;
    requests.to_send.push_back(request.dump() + "\n");
    requests.open[id] = std::move(request);
    return id;
}

void answer_all(EngineRequests& requests, const Json& answer)
{
    for (auto& [id, known] : requests.waited_for)
        if (known.is_null()) known = answer;
}

bool save_is_due(const SavedState& saved, double now)
{
    return !saved.saving && now - saved.at > kBetweenSaves;
}

bool is_newer(const NewestFrame& frame, std::uint64_t after, bool whole)
{
    return frame.bytes && frame.seq > after && (!whole || frame.whole);
}

bool is_requested(const NewestFrame& frame, std::uint64_t after, bool whole)
{
    return frame.requested && frame.requested_after <= after && (!whole || frame.requested_whole);
}

Engine::Engine(std::string program, std::string results, std::function<void(std::string)> publish)
    : program_(std::move(program))
    , results_(std::move(results))
    , publish_(std::move(publish))
{
}

Engine::~Engine()
{
    stop();
}

void Engine::start(EngineStart how)
{
    const std::lock_guard one(control_);
    std::unique_lock lock(mutex_);
    end(lock);
    how_ = std::move(how);
    folder_.clear();
    led_.clear();
    saved_.state.clear();
    saved_.to_restore.clear();
    launch();
}

void Engine::resume()
{
    const std::lock_guard one(control_);
    std::unique_lock lock(mutex_);
    if (state_ != "failed" && state_ != "stopped")
        throw std::runtime_error("the simulation has not ended");
    if (how_.scene.empty()) throw std::runtime_error("no scene was started");
    end(lock);
    saved_.to_restore = saved_.state;
    how_.resume.clear();
    launch();
}

void Engine::stop()
{
    const std::lock_guard one(control_);
    std::unique_lock lock(mutex_);
    const bool alive = process_.pid > 0;
    end(lock);
    if (alive) {
        state_ = "stopped";
        reason_.clear();
        report_state();
    }
}

/// Ends the process and the threads that read from it. The lock is held again afterwards.
void Engine::end(std::unique_lock<std::mutex>& lock)
{
    ++number_;
    Process old = std::exchange(process_, {});
    answer_all(requests_, refusal("failed", "the simulation was ended", "start it"));
    requests_.open.clear();
    requests_.to_send.clear();
    saved_.saving = frame_.requested = false;
    frame_.bytes.reset();
    changed_.notify_all();
    lock.unlock();
    if (old.pid > 0) {
        // A hand's force tends to zero, and files are finished, where there is time for it.
        ::kill(old.pid, SIGINT);
        const double until = now() + kLastWords;
        bool has_ended = false;
        while (!has_ended && now() < until) {
            has_ended = ::waitpid(old.pid, nullptr, WNOHANG) == old.pid;
            if (!has_ended) std::this_thread::sleep_for(std::chrono::milliseconds(5));
        }
        if (!has_ended) {
            ::kill(-old.pid, SIGKILL);
            ::kill(old.pid, SIGKILL);
            ::waitpid(old.pid, nullptr, 0);
        }
    }
    for (std::thread& t : old.threads)
        t.join();
    for (const int fd : {old.out, old.err, old.frames})
        if (fd >= 0) ::close(fd);
    lock.lock();
}

void Engine::launch()
{
    int in[2] = {-1, -1}, out[2] = {-1, -1}, err[2] = {-1, -1}, frames[2] = {-1, -1};
    const bool pipes = ::pipe2(in, O_CLOEXEC) == 0 && ::pipe2(out, O_CLOEXEC) == 0 &&
                       ::pipe2(err, O_CLOEXEC) == 0 && ::pipe2(frames, O_CLOEXEC) == 0;
    std::vector<std::string> words{"amontons", how_.device.empty() ? "serve" : "haptic", how_.scene,
                                   "--frames", std::to_string(frames[1])};
    if (!results_.empty()) words.push_back("--results=" + results_ + "/" + name_of(how_.scene));
    if (!how_.device.empty()) words.push_back("--device=" + how_.device);
    if (how_.virtual_time) words.emplace_back("--virtual-time");
    if (!how_.resume.empty()) words.push_back("--resume=" + how_.resume);
    for (const std::string& s : how_.set)
        words.push_back("--set=" + s);
    std::vector<char*> arguments;
    for (std::string& w : words)
        arguments.push_back(w.data());
    arguments.push_back(nullptr);
    const pid_t pid = pipes ? ::fork() : -1;
    if (pid == 0) {      // only calls that are safe here, until exec
        ::setpgid(0, 0); // Ctrl-C is for the server; the end of standard input ends the engine
        ::dup2(in[0], 0);
        ::dup2(out[1], 1);
        ::dup2(err[1], 2);
        // Connections of pages are not its own: cpp-httplib leaves those that it accepts open.
        ::close_range(3, ~0U, CLOSE_RANGE_CLOEXEC);
        ::fcntl(frames[1], F_SETFD, 0);
        ::execv(program_.c_str(), arguments.data());
        ::_exit(127);
    }
    const int error = errno;
    for (const int fd : {in[0], out[1], err[1], frames[1]})
        if (fd >= 0) ::close(fd);
    if (pid < 0) {
        for (const int fd : {in[1], out[0], err[0], frames[0]})
            if (fd >= 0) ::close(fd);
        throw std::runtime_error(std::string("no process can be started: ") + std::strerror(error));
    }
    const int n = ++number_;
    process_ = {pid, out[0], err[0], frames[0], {}};
    requests_.to_send.clear();
    process_.threads.emplace_back([this, fd = in[1], n] { write_requests(fd, n); });
    process_.threads.emplace_back([this, fd = out[0], n] { read_answers(fd, n); });
    process_.threads.emplace_back([this, fd = err[0], n] { read_errors(fd, n); });
    process_.threads.emplace_back([this, fd = frames[0], n] { read_frames(fd, n); });
    state_ = "starting";
    reason_.clear();
    last_error_.clear();
    inputs_.clear();
    saved_.at = now();
    report_state();
}

void Engine::send(const std::string& what)
{
    send(what, Json::object());
}

/// Sends a request that no page has made.
/// @param what  the request, by which its answer is known
void Engine::send(const std::string& what, Json request)
{
    request["do"] = request.value("do", what);
    const std::int64_t id = post(requests_, std::move(request));
    requests_.open[id] = {{"do", what}};
    changed_.notify_all();
}

void Engine::write_requests(int stream, int number)
{
    std::unique_lock lock(mutex_);
    while (true) {
        changed_.wait(lock, [&] { return number != number_ || !requests_.to_send.empty(); });
        if (number != number_) break;
        const std::string line = std::move(requests_.to_send.front());
        requests_.to_send.pop_front();
        lock.unlock();
        bool has_ended = false;
        for (std::size_t sent = 0; sent < line.size() && !has_ended;) {
            const ssize_t n = ::write(stream, line.data() + sent, line.size() - sent);
            if (n > 0) sent += static_cast<std::size_t>(n);
            has_ended = n == 0 || (n < 0 && errno != EINTR);
        }
        lock.lock();
        if (has_ended) break; // its end is reported by who reads
    }
    lock.unlock();
    ::close(stream);
}

Json Engine::handle(Json request)
{
    const Json id = request.contains("id") ? request["id"] : Json();
    const auto with_id = [&](const Json& answer) {
        Json all{{"id", id}};
        for (const auto& item : answer.items())
            if (item.key() != "id") all[item.key()] = item.value();
        return all;
    };
    std::unique_lock lock(mutex_);
    if (process_.pid == 0) return with_id(refusal("failed", "no simulation", "start a scene"));
    const std::int64_t own = post(requests_, std::move(request));
    requests_.open[own]["page"] = true;
    auto& waited_for = requests_.waited_for;
    waited_for[own] = nullptr;
    changed_.notify_all();
    const bool answered = changed_.wait_for(lock, std::chrono::duration<double>(kPatience),
                                            [&] { return !waited_for[own].is_null(); });
    const Json answer = waited_for[own];
    waited_for.erase(own);
    if (!answered)
        return with_id(
            refusal("waiting", "a step that takes long", "wait: the request is executed after it"));
    return with_id(answer);
}

std::shared_ptr<const std::string> Engine::frame(std::uint64_t after, double patience)
{
    std::unique_lock lock(mutex_);
    const bool whole = after == 0;
    const auto until = std::chrono::steady_clock::now() + std::chrono::duration<double>(patience);
    while (!is_newer(frame_, after, whole)) {
        if (process_.pid > 0 && state_ != "starting" && !is_requested(frame_, after, whole)) {
            frame_.requested = true;
            frame_.requested_after = after;
            frame_.requested_whole = whole;
            send("frame", {{"after", after}, {"whole", whole}});
        }
        if (changed_.wait_until(lock, until) == std::cv_status::timeout)
            return is_newer(frame_, after, whole) ? frame_.bytes : nullptr;
    }
    return frame_.bytes;
}

Json Engine::state() const
{
    const std::lock_guard lock(mutex_);
    Json set = Json::array();
    for (const std::string& s : how_.set)
        set.push_back(s);
    return {{"state", state_},
            {"reason", reason_},
            {"scene", how_.scene},
            {"set", set},
            {"device", how_.device},
            {"folder", folder_},
            {"saved_time", saved_.state.empty() ? Json() : Json(saved_.time)},
            {"pid", process_.pid}};
}

int Engine::pid() const
{
    const std::lock_guard lock(mutex_);
    return process_.pid;
}

void Engine::report_state()
{
    publish_(
        Json{{"event", "engine"},
             {"state", state_},
             {"reason", reason_},
             {"can_resume", (state_ == "failed" || state_ == "stopped") && !how_.scene.empty()},
             {"device", how_.device},
             {"folder", folder_},
             {"saved_time", saved_.state.empty() ? Json() : Json(saved_.time)}}
            .dump());
}

/// Requests the state that resume() continues from.
void Engine::keep_state()
{
    if (saved_.saving) return;
    saved_.saving = true;
    send("save");
}

void Engine::read_answers(int stream, int number)
{
    read_lines(stream, [&](const std::string& line) { take_line(line, number); });
    ended(number);
}

void Engine::take_line(const std::string& line, int number)
{
    Json answer = Json::parse(line, nullptr, false);
    if (!answer.is_object()) return;
    std::unique_lock lock(mutex_);
    if (number != number_) return;

    // ---- Events
    if (answer.contains("event")) {
        const std::string event = answer["event"].get<std::string>();
        if (event == "ready") {
            state_ = how_.device.empty() ? "paused" : "running";
            send("inputs");
            if (!saved_.to_restore.empty()) {
                send("restore", {{"state", saved_.to_restore}});
                for (const auto& [path, value] : led_) // their refusal is one of the state's
                    send("restore", {{"do", "set"}, {"path", path}, {"value", value}});
                saved_.to_restore.clear();
            }
            changed_.notify_all();
            report_state();
            return;
        }
        if (answer.contains("time") && answer["time"].is_number())
            saved_.last_time = answer["time"];
        if (event == "results") folder_ = answer.value("folder", "");
        if (event == "set" && answer.value("ok", false))
            how_.set.push_back(answer.value("line", ""));
        if (event == "paused") {
            state_ = "paused";
            if (answer["status"] != "failed") keep_state();
        } else if (event == "step" && save_is_due(saved_, now())) {
            keep_state();
        }
        publish_(line);
        if (event == "paused") report_state();
        return;
    }

    // ---- Answers to requests
    if (!answer.contains("id") || !answer["id"].is_number_integer()) {
        if (answer.value("ok", true) == false && answer.contains("issues"))
            publish_(Json{{"event", "refused"}, {"issues", answer["issues"]}}.dump());
        return;
    }
    const auto id = answer["id"].get<std::int64_t>();
    const Json request = requests_.open.contains(id) ? requests_.open[id] : Json::object();
    requests_.open.erase(id);
    const std::string what = request.value("do", "");
    const bool ok = answer.value("ok", false);
    if (answer.contains("time") && answer["time"].is_number()) saved_.last_time = answer["time"];
    if (request.contains("page")) {
        if (ok && (what == "run" || what == "pause")) {
            state_ = what == "run" ? "running" : "paused";
            report_state();
        }
        bool led = false;
        if (what == "set" && request.contains("path") && request["path"].is_string()) {
            const auto path = request["path"].get<std::string>();
            led = std::ranges::find(inputs_, path) != inputs_.end();
            if (ok && led) led_[path] = request["value"];
            if (ok && !led && !answer.contains("pending"))
                how_.set.push_back(path + "=" + request["value"].dump());
        }
        if (ok && what == "reset") led_.clear();
        // Where it stands still a state is cheap to keep, and one of the scene before a change
        // would not fit after it.
        static const std::set<std::string> kMoves{"pause", "step",    "advance",
                                                  "reset", "restore", "set"};
        if (kMoves.contains(what) && !led && how_.device.empty()) {
            keep_state();
            if (ok && what != "pause") {
                Json event = answer;
                event.erase("id");
                event["event"] = "step";
                event["after"] = what;
                publish_(event.dump());
            }
        }
        if (requests_.waited_for.contains(id)) requests_.waited_for[id] = std::move(answer);
        changed_.notify_all();
    } else if (what == "save") {
        saved_.saving = false;
        saved_.at = now();
        if (ok) {
            saved_.state = answer["state"].get<std::string>();
            saved_.time = saved_.last_time;
        }
    } else if (what == "inputs") {
        for (const Json& i : answer.value("inputs", Json::array()))
            inputs_.push_back(i.value("name", ""));
    } else if (what == "restore") {
        if (ok) {
            Json event = answer;
            event.erase("id");
            event["event"] = "step";
            event["after"] = "restore";
            publish_(event.dump());
        } else {
            publish_(Json{{"event", "refused"}, {"issues", answer["issues"]}}.dump());
        }
    }
}

void Engine::read_errors(int stream, int number)
{
    read_lines(stream, [&](const std::string& line) {
        const std::lock_guard lock(mutex_);
        if (number != number_) return;
        last_error_ = line;
        publish_(Json{{"event", "log"}, {"text", line}}.dump(-1, ' ', false,
                                                             Json::error_handler_t::replace));
    });
}

void Engine::read_frames(int stream, int number)
{
    while (true) {
        std::uint64_t length = 0;
        if (!read_whole(stream, &length, sizeof length) || length < 8 || length > kMostFrame)
            return;
        auto bytes = std::make_shared<std::string>(length, '\0');
        if (!read_whole(stream, bytes->data(), length)) return;
        std::uint32_t header = 0;
        std::memcpy(&header, bytes->data() + 4, sizeof header);
        if (header > length - 8) return;
        const Json head = Json::parse(bytes->substr(8, header), nullptr, false);
        const std::lock_guard lock(mutex_);
        if (number != number_ || !head.is_object()) return;
        frame_.seq = head.value("seq", std::uint64_t(0));
        frame_.whole = head.value("before", std::uint64_t(1)) == 0;
        frame_.bytes = std::move(bytes);
        frame_.requested = false;
        changed_.notify_all();
    }
}

/// The process has closed its end: reports how it ended.
void Engine::ended(int number)
{
    std::unique_lock lock(mutex_);
    if (number != number_ || process_.pid == 0) return;
    const int pid = process_.pid;
    int status = 0;
    ::waitpid(pid, &status, 0);
    process_.pid = 0; // its threads are joined by end()
    if (WIFSIGNALED(status))
        reason_ = std::string("the process of the simulation was ended by signal ") +
                  std::to_string(WTERMSIG(status)) + " (" + ::strsignal(WTERMSIG(status)) + ")";
    else
        reason_ = "the process of the simulation ended with exit code " +
                  std::to_string(WEXITSTATUS(status));
    const bool over = WIFEXITED(status) && WEXITSTATUS(status) == 0; // a haptic run's time
    if (!last_error_.empty() && !over) reason_ += ": " + last_error_;
    state_ = over ? "stopped" : "failed";
    if (over) reason_ = "the run is over";
    answer_all(requests_, refusal("failed", reason_, "resume, or start it again"));
    changed_.notify_all();
    report_state();
}

} // namespace amontons::studio
