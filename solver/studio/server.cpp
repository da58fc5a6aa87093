// The server of amontons studio: HTTP on the loopback interface, for a page that has the token.
// docs/studio.md lists requests and answers.

#include "solver/studio/engine.hpp"
#include "solver/studio/guard.hpp"
#include "solver/studio/studio_module.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <fstream>
#include <httplib.h>
#include <iterator>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <unistd.h>

namespace fs = std::filesystem;

namespace amontons::studio {
namespace {

constexpr std::size_t kMostBody = std::size_t(16) << 20; // of a request [bytes]
constexpr std::size_t kMostConnections = 16;
constexpr std::size_t kMostEvents = 4096; // kept for a page that is slow
constexpr std::size_t kMostListed = 500;  // scenes and results
constexpr int kDeepest = 5;               // folders below the root that are examined
constexpr double kFramePatience = 2;      // [s]

/// How many connections are served now, by all addresses together.
struct Connections {
    std::mutex mutex;
    std::condition_variable changed;
    std::size_t working = 0;
};

/// Serves so many connections at a time; more wait where the system keeps them.
class FewThreads : public httplib::TaskQueue {
public:
    explicit FewThreads(Connections& all) : all_(all) {}
    void enqueue(std::function<void()> work) override
    {
        std::unique_lock lock(all_.mutex);
        all_.changed.wait(lock, [this] { return all_.working < kMostConnections; });
        ++all_.working;
        std::thread([&all = all_, work = std::move(work)] {
            work();
            const std::lock_guard done(all.mutex);
            --all.working;
            all.changed.notify_all();
        }).detach();
    }
    void shutdown() override
    {
        std::unique_lock lock(all_.mutex);
        all_.changed.wait(lock, [this] { return all_.working == 0; });
    }

private:
    Connections& all_;
};

/// What is reported to the pages, in order; each reads at its own pace.
class Events {
public:
    void add(std::string line)
    {
        const std::lock_guard lock(mutex_);
        lines_.push_back(std::move(line));
        if (lines_.size() > kMostEvents) {
            lines_.pop_front();
            ++first_;
        }
        changed_.notify_all();
    }
    void close()
    {
        const std::lock_guard lock(mutex_);
        closed_ = true;
        changed_.notify_all();
    }
    std::uint64_t end() const
    {
        const std::lock_guard lock(mutex_);
        return first_ + lines_.size();
    }
    /// The lines from `next` on, waited for up to a second. @return  false at the end of all
    bool take(std::uint64_t& next, std::string& text)
    {
        std::unique_lock lock(mutex_);
        changed_.wait_for(lock, std::chrono::seconds(1),
                          [&] { return closed_ || next < first_ + lines_.size(); });
        if (closed_) return false;
        text.clear();
        if (next < first_) {
            text = Json{{"event", "lost"}, {"lines", first_ - next}}.dump() + "\n";
            next = first_;
        }
        for (; next < first_ + lines_.size(); ++next)
            text += lines_[next - first_] + "\n";
        if (text.empty())
            text = "{\"event\":\"alive\"}\n"; // a page that no longer exists is noticed
        return true;
    }

private:
    mutable std::mutex mutex_;
    std::condition_variable changed_;
    std::deque<std::string> lines_;
    std::uint64_t first_ = 0;
    bool closed_ = false;
};

std::string read_file(const fs::path& path)
{
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

Json issue(const std::string& place, const std::string& found, const std::string& allowed)
{
    return {
        {"ok", false},
        {"status", "bad_input"},
        {"issues",
         Json::array({{{"file", ""}, {"place", place}, {"found", found}, {"allowed", allowed}}})}};
}

class Studio {
public:
    explicit Studio(const AmontonsStudio& how)
        : how_(how)
        , root_(fs::canonical(how.root))
        , token_(random_token())
        , engine_(how.program, how.results,
                  [this](std::string line) { events_.add(std::move(line)); })
    {
        set_up(server_);
        set_up(server6_);
    }

private:
    void set_up(httplib::Server& server)
    {
        server.new_task_queue = [this] { return new FewThreads(connections_); };
        server.set_tcp_nodelay(true); // 11 ms a round trip instead of 46
        server.set_payload_max_length(kMostBody);
        server.set_read_timeout(10);
        server.set_write_timeout(10);
        server.set_keep_alive_timeout(5);
        server.set_keep_alive_max_count(100000);
        server.set_default_headers(
            {{"Content-Security-Policy",
              "default-src 'self'; img-src 'self' data: blob:; object-src 'none'; base-uri 'none'; "
              "form-action 'none'; frame-ancestors 'none'"},
             {"X-Content-Type-Options", "nosniff"},
             {"Cross-Origin-Resource-Policy", "same-origin"},
             {"Cross-Origin-Opener-Policy", "same-origin"},
             {"Referrer-Policy", "no-referrer"},
             {"Cache-Control", "no-store"}});
        server.set_socket_options([](socket_t) {}); // a port in use is refused
        server.set_pre_routing_handler(
            [this](const httplib::Request& q, httplib::Response& r) { return admit(q, r); });
        server.set_exception_handler(
            [](const httplib::Request&, httplib::Response& r, std::exception_ptr error) {
                std::string found = "an unknown error";
                try {
                    std::rethrow_exception(error);
                } catch (const std::exception& e) {
                    found = e.what();
                } catch (...) { // nothing else is thrown
                }
                r.status = 500;
                r.set_content(issue("", found, "this is a mistake in amontons, please report it")
                                  .dump(-1, ' ', false, Json::error_handler_t::replace),
                              "application/json");
            });
        serve_pages(server);
        serve_interface(server);
    }

public:
    void listen()
    {
        const std::string host = "127.0.0.1"; // no option opens it to others
        port_ = how_.port;
        if (port_ == 0)
            port_ = server_.bind_to_any_port(host);
        else if (!server_.bind_to_port(host, port_))
            port_ = -1;
        if (port_ < 0)
            throw std::runtime_error("127.0.0.1: the port " + std::to_string(how_.port) +
                                     " cannot be had");
        // The same port by the newer protocol, where the machine has it and the port is free.
        const bool both = server6_.bind_to_port("::1", port_);
        how_.ready(("http://127.0.0.1:" + std::to_string(port_) + "/#" + token_).c_str(), port_);
        last_request_ = seconds();
        std::thread second;
        if (both) second = std::thread([this] { server6_.listen_after_bind(); });
        std::thread watch([this, both] {
            while (!ended_) {
                std::this_thread::sleep_for(std::chrono::milliseconds(100));
                const bool idle = how_.idle_seconds > 0 && open_pages_ == 0 &&
                                  seconds() - last_request_ > how_.idle_seconds;
                if (how_.stop() == 0 && !idle) continue;
                events_.close();
                engine_.stop();
                server_.stop();
                if (both) server6_.stop();
                return;
            }
        });
        const bool served = server_.listen_after_bind();
        ended_ = true;
        watch.join();
        if (both) server6_.stop();
        if (second.joinable()) second.join();
        if (!served && how_.stop() == 0 && how_.idle_seconds == 0)
            throw std::runtime_error("the server ended");
    }

private:
    static double seconds()
    {
        return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch())
            .count();
    }

    /// Host, origin and token, before anything else is examined.
    httplib::Server::HandlerResponse admit(const httplib::Request& q, httplib::Response& r)
    {
        using Done = httplib::Server::HandlerResponse;
        const auto refuse = [&](int status, const char* text) {
            r.status = status;
            r.set_content(text, "text/plain");
            r.set_header("Connection", "close");
            return Done::Handled;
        };
        if (q.get_header_value_count("Host") != 1 ||
            !is_own_host(q.get_header_value("Host"), port_))
            return refuse(403, "Host");
        if (q.get_header_value_count("Origin") > 1 ||
            !is_own_origin(q.get_header_value("Origin"), port_))
            return refuse(403, "Origin");
        if (q.method != "GET" && q.method != "POST") return refuse(405, "GET or POST");
        if (q.path.rfind("/api/", 0) == 0) {
            if (!is_authorised(q.get_header_value("Authorization"), token_))
                return refuse(401, "token");
            last_request_ = seconds();
        }
        return Done::Unhandled;
    }

    void serve_pages(httplib::Server& server)
    {
        struct Page {
            const char *path, *file, *type;
        };
        static constexpr Page kPages[] = {
            {"/", "index.html", "text/html; charset=utf-8"},
            {"/studio.js", "studio.js", "text/javascript; charset=utf-8"},
            {"/studio.css", "studio.css", "text/css; charset=utf-8"},
            {"/licences.txt", "licences.txt", "text/plain; charset=utf-8"},
        };
        for (const Page& p : kPages) {
            const std::string text = read_file(fs::path(how_.pages) / p.file);
            if (text.empty())
                throw std::runtime_error(std::string(how_.pages) + "/" + p.file +
                                         ": the page is not whole, build it again");
            server.Get(p.path,
                       [text, type = p.type](const httplib::Request&, httplib::Response& r) {
                           r.set_content(text, type);
                       });
        }
    }

    void answer(httplib::Response& r, const Json& json)
    {
        r.set_content(json.dump(-1, ' ', false, Json::error_handler_t::replace),
                      "application/json");
    }

    void serve_interface(httplib::Server& server)
    {
        server.Get("/api/state", [this](const httplib::Request&, httplib::Response& r) {
            answer(r, {{"version", how_.version},
                       {"root", root_.string()},
                       {"open", how_.open},
                       {"engine", engine_.state()},
                       {"events", events_.end()}});
        });
        server.Get("/api/schema", [this](const httplib::Request&, httplib::Response& r) {
            r.set_content(how_.schema, "application/json");
        });
        server.Get("/api/list",
                   [this](const httplib::Request&, httplib::Response& r) { answer(r, listing()); });
        server.Get("/api/file", [this](const httplib::Request& q, httplib::Response& r) {
            send_file(q.get_param_value("path"), r);
        });
        server.Get("/api/frame", [this](const httplib::Request& q, httplib::Response& r) {
            send_frame(q.get_param_value("after"), r);
        });
        server.Get("/api/events", [this](const httplib::Request& q, httplib::Response& r) {
            send_events(q.get_param_value("from"), r);
        });
        server.Post("/api/command", [this](const httplib::Request& q, httplib::Response& r) {
            answer(r, command(q.body));
        });
    }

    /// Scenes and folders of results below the root; the one whose manifest was written last.
    Json listing() const
    {
        Json scenes = Json::array(), results = Json::array();
        std::error_code error;
        fs::recursive_directory_iterator at(root_, fs::directory_options::skip_permission_denied,
                                            error);
        std::size_t examined = 0;
        std::optional<fs::file_time_type> last;
        std::string newest;
        for (; !error && at != fs::end(at); at.increment(error)) {
            if (++examined > 100 * kMostListed) break;
            const fs::path& path = at->path();
            const std::string name = path.filename().string();
            std::error_code none;
            if (at->is_directory(none)) {
                if (name.front() == '.' || name == "node_modules" || name == "build" ||
                    at.depth() >= kDeepest)
                    at.disable_recursion_pending();
                continue;
            }
            const std::string from_root = path.lexically_relative(root_).generic_string();
            if (at->is_symlink(none) && !inside(root_, from_root)) continue;
            if (name == "manifest.json" && results.size() < kMostListed) {
                results.push_back(fs::path(from_root).parent_path().generic_string());
                const fs::file_time_type written = fs::last_write_time(path, none);
                if (!none && (!last || written > *last)) {
                    last = written;
                    newest = results.back();
                }
            } else if (path.extension() == ".json" && scenes.size() < kMostListed &&
                       at->file_size(none) < kMostBody) {
                const std::string text = read_file(path);
                if (text.find("\"schema\"") != std::string::npos &&
                    text.find("\"bodies\"") != std::string::npos)
                    scenes.push_back(from_root);
            }
        }
        std::sort(scenes.begin(), scenes.end());
        std::sort(results.begin(), results.end());
        Json list = {{"scenes", scenes}, {"results", results}};
        if (last) list["newest"] = newest;
        return list;
    }

    void send_file(const std::string& relative, httplib::Response& r) const
    {
        static const std::set<std::string> kKinds{".json", ".csv", ".pvd", ".vtu", ".vtp"};
        const auto path = inside(root_, relative);
        std::error_code error;
        if (!path || !kKinds.contains(path->extension().string())) {
            r.status = 403;
            r.set_content("a file of a scene or of results below " + root_.string(), "text/plain");
        } else if (!fs::is_regular_file(*path, error)) {
            r.status = 404;
            r.set_content("no such file", "text/plain");
        } else {
            r.set_content(read_file(*path), "application/octet-stream");
        }
    }

    /// A whole number that a page sends; nothing else.
    static bool read_number(const std::string& text, std::uint64_t& number)
    {
        if (text.empty() || text.size() > 18 ||
            text.find_first_not_of("0123456789") != std::string::npos)
            return false;
        number = std::stoull(text);
        return true;
    }

    void send_frame(const std::string& after, httplib::Response& r)
    {
        std::uint64_t number = 0;
        if (!read_number(after, number)) {
            r.status = 400;
            r.set_content("after", "text/plain");
            return;
        }
        const std::shared_ptr<const std::string> frame = engine_.frame(number, kFramePatience);
        if (!frame) {
            r.status = 204;
            return;
        }
        r.set_content_provider(
            frame->size(), "application/octet-stream",
            [frame](std::size_t at, std::size_t length, httplib::DataSink& sink) {
                return sink.write(frame->data() + at, length);
            });
    }

    void send_events(const std::string& from, httplib::Response& r)
    {
        std::uint64_t next = 0;
        if (!read_number(from, next)) next = events_.end();
        next = std::min(next, events_.end());
        ++open_pages_;
        r.set_chunked_content_provider(
            "application/x-ndjson",
            [this, next](std::size_t, httplib::DataSink& sink) mutable {
                std::string text;
                if (!events_.take(next, text)) {
                    sink.done();
                    return true;
                }
                last_request_ = seconds();
                return sink.write(text.data(), text.size());
            },
            [this](bool) { --open_pages_; });
    }

    Json command(const std::string& body)
    {
        // Deep brackets would be recursion: a request has three levels.
        const Json request = Json::parse(body, nullptr, false);
        if (!request.is_object()) return issue("", "no JSON object", "{\"id\": 1, \"do\": ...}");
        const Json id = request.contains("id") ? request["id"] : Json();
        const auto reply = [&](Json json) {
            Json all{{"id", id}};
            all.update(json);
            return all;
        };
        if (!id.is_number_integer() && !id.is_string())
            return issue("id", id.dump(), "a whole number or a text");
        const Json what = request.contains("do") ? request["do"] : Json();
        if (!what.is_string()) return reply(issue("do", what.dump(), "the name of a command"));
        const auto name = what.get<std::string>();
        static const std::set<std::string> kOfEngine{
            "run",     "pause", "step",   "advance", "set",   "reset",    "save",
            "restore", "state", "inputs", "scene",   "check", "contacts", "sets"};
        if (kOfEngine.contains(name)) return engine_.handle(request);
        try {
            if (name == "start") return reply(start(request));
            if (name == "stop") {
                engine_.stop();
                return reply({{"ok", true}});
            }
            if (name == "resume") {
                engine_.resume();
                return reply({{"ok", true}});
            }
            if (name == "save_scene") return reply(save_scene(request));
        } catch (const std::exception& error) {
            return reply(issue("", error.what(), "another state"));
        }
        return reply(issue("do", "\"" + name + "\"",
                           "run, pause, step, advance, set, reset, save, restore, state, inputs, "
                           "scene, check, contacts, sets, start, stop, resume, save_scene"));
    }

    /// A scene from its beginning, in the hand or not; or one from where a folder of results ends.
    Json start(const Json& request)
    {
        EngineStart how;
        Json from = request;
        if (request.contains("folder")) {
            Json refused;
            from = start_of_folder(request["folder"], how, refused);
            if (!refused.is_null()) return refused;
        }
        if (!from.contains("scene") || !from["scene"].is_string())
            return issue("scene", "nothing", "the path of a scene below " + root_.string());
        const auto scene = from["scene"].get<std::string>();
        const auto path = inside(root_, scene);
        std::error_code error;
        if (!path || path->extension() != ".json" || !fs::is_regular_file(*path, error))
            return issue("scene", "\"" + scene + "\"", "a scene (.json) below " + root_.string());
        how.scene = path->string();
        for (const Json& s : from.value("set", Json::array())) {
            if (!s.is_string() || s.get_ref<const std::string&>().find('=') == std::string::npos)
                return issue("set", s.dump(), "\"PATH=VALUE\"");
            how.set.push_back(s.get<std::string>());
        }
        if (from.contains("device")) {
            if (!is_device(from["device"]))
                return issue("device", from["device"].dump(),
                             "simulated, spacemouse, udp:PORT or recorded:FILE below " +
                                 root_.string());
            how.device = from["device"].get<std::string>();
            if (how.device.starts_with("recorded:"))
                how.device = "recorded:" + inside(root_, how.device.substr(9))->string();
            how.virtual_time = from.value("virtual_time", Json()) == true;
        }
        engine_.start(std::move(how));
        return {{"ok", true}};
    }

    bool is_device(const Json& device) const
    {
        if (!device.is_string()) return false;
        const auto name = device.get<std::string>();
        if (name == "simulated" || name == "spacemouse") return true;
        std::uint64_t port = 0;
        if (name.starts_with("udp:")) return read_number(name.substr(4), port) && port < 65536;
        std::error_code error;
        if (!name.starts_with("recorded:")) return false;
        const auto path = inside(root_, name.substr(9));
        return path && fs::is_regular_file(*path, error);
    }

    /// What the manifest of a folder states that it was made from.
    Json start_of_folder(const Json& folder, EngineStart& how, Json& refused) const
    {
        const std::string name = folder.is_string() ? folder.get<std::string>() : "";
        const auto path = inside(root_, name);
        std::error_code error;
        if (!path || !fs::is_regular_file(*path / "checkpoint", error) ||
            !fs::is_regular_file(*path / "manifest.json", error)) {
            refused = issue("folder", folder.dump(),
                            "a folder of results with a checkpoint below " + root_.string());
            return {};
        }
        const Json manifest = Json::parse(read_file(*path / "manifest.json"), nullptr, false);
        const Json command = manifest.is_object() ? manifest.value("command", Json()) : Json();
        Json from{{"set", Json::array()}};
        for (std::size_t i = 2; command.is_array() && i < command.size(); ++i) {
            const std::string word = command[i].is_string() ? command[i].get<std::string>() : "";
            const auto value = [&] { // "--set X" or "--set=X"
                return i + 1 < command.size() && command[i + 1].is_string()
                           ? command[++i].get<std::string>()
                           : "";
            };
            if (word.starts_with("--set="))
                from["set"].push_back(word.substr(6));
            else if (word == "--set" || word == "-s")
                from["set"].push_back(value());
            else if (word == "--output" || word == "-o" || word == "--threads" || word == "--cache")
                value();
            else if (!word.starts_with("-") && !from.contains("scene")) {
                const fs::path scene = fs::weakly_canonical(root_ / word, error);
                from["scene"] = scene.lexically_relative(root_).generic_string();
            }
        }
        how.resume = path->string();
        return from;
    }

    /// A scene that is not there yet, or was saved by this server.
    Json save_scene(const Json& request)
    {
        if (!request.contains("path") || !request["path"].is_string() ||
            !request.contains("scene") || !request["scene"].is_object())
            return issue("", "no path and scene", "both");
        const auto name = request["path"].get<std::string>();
        const auto path = inside(root_, name);
        std::error_code error;
        if (!path || path->extension() != ".json" || !fs::is_directory(path->parent_path(), error))
            return issue("path", "\"" + name + "\"",
                         "a name that ends in .json, in a folder below " + root_.string());
        const std::lock_guard lock(saving_);
        if (fs::exists(*path, error) && !own_scenes_.contains(path->string()))
            return issue("path", "\"" + name + "\", which is there", "a new name");
        const fs::path draft = path->string() + ".part";
        {
            std::ofstream out(draft, std::ios::binary);
            out << request["scene"].dump(2) << "\n";
            if (!out.flush()) return issue("path", "\"" + name + "\"", "a place to write to");
        }
        fs::rename(draft, *path);
        own_scenes_.insert(path->string());
        return {{"ok", true}, {"path", path->lexically_relative(root_).generic_string()}};
    }

    const AmontonsStudio how_;
    const fs::path root_;
    const std::string token_;
    int port_ = 0;
    Events events_;
    Engine engine_;
    Connections connections_;
    httplib::Server server_, server6_; // 127.0.0.1 and ::1
    std::atomic<double> last_request_ = 0;
    std::atomic<int> open_pages_ = 0;
    std::atomic<bool> ended_ = false;
    std::mutex saving_;
    std::set<std::string> own_scenes_;
};

} // namespace
} // namespace amontons::studio

const char* amontons_studio_serve(const AmontonsStudio* how)
{
    static std::string problem;
    try {
        amontons::studio::Studio(*how).listen();
        problem.clear();
    } catch (const std::exception& error) {
        problem = error.what();
    }
    return problem.c_str();
}
