#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <thread>
#include <vector>

namespace amontons::studio {

/// JSON with its members in the order of the file.
using Json = nlohmann::ordered_json;

/// What the engine simulates, and from which state.
struct EngineStart {
    std::string scene;            ///< its path
    std::vector<std::string> set; ///< "PATH=VALUE"
    std::string device;           ///< of a haptic run, as --device; "": none
    bool virtual_time = false;    ///< of a haptic run
    std::string resume; ///< folder of results that no longer exists on with; "": from the beginning
};

/// The simulation, in a process of its own: `amontons serve SCENE --frames FD`, or `amontons
/// haptic`. When it ends for any reason, the server continues and reports why. For many threads.
class Engine {
public:
    /// @param program  amontons
    /// @param results  folder that those of runs are written to; "": none are written
    /// @param report     called with each line for the page, without its end; by any
    ///                 thread
    Engine(std::string program, std::string results, std::function<void(std::string)> publish);
    Engine(const Engine&) = delete;
    Engine& operator=(const Engine&) = delete;
    ~Engine();

    /// Starts the simulation of a scene; one that runs is ended.
    /// @throws std::runtime_error  no process can be started
    void start(EngineStart how);
    /// Ends it, now.
    void stop();
    /// Starts it again after its end, in the scene as it was changed, from the last state that it
    /// has reported of: saved where it stood still and every few seconds of a run.
    /// @throws std::runtime_error  there is nothing to continue from
    void resume();

    /// Sends a request and waits for its answer.
    /// @param request  an object with `do`; its id is replaced
    /// @return  the answer, with the id of the request
    Json handle(Json request);

    /// The newest frame after one, waited for.
    /// @param after  its sequence; 0: a whole frame
    /// @return  null if there is none within the patience [s]
    std::shared_ptr<const std::string> frame(std::uint64_t after, double patience);

    /// {"state": "none" | "starting" | "paused" | "running" | "failed" | "stopped", ...}
    Json state() const;
    /// Its process, or 0.
    int pid() const;

private:
    struct Process {
        int pid = 0, out = -1, err = -1, frames = -1;
        std::vector<std::thread> threads;
    };
    void launch();
    void end(std::unique_lock<std::mutex>& lock);
    void read_answers(int stream, int number);
    void read_errors(int stream, int number);
    void read_frames(int stream, int number);
    void take_line(const std::string& line, int number);
    void ended(int number);
    void write_requests(int stream, int number);
    void send(const Json& request);
    void report_state();
    void keep_state();

    const std::string program_, results_;
    const std::function<void(std::string)> publish_;

    std::mutex control_; ///< one start or end at a time
    mutable std::mutex mutex_;
    std::deque<std::string> to_send_; ///< by a thread: the engine may be in a long step
    std::condition_variable changed_;
    Process process_;
    int number_ = 0; ///< of the process: what an older one states is passed over
    std::string state_ = "none", reason_, last_error_;
    EngineStart how_;                 ///< its `set` as the scene was started or changed since
    std::string folder_;              ///< of results, that the engine writes or wrote
    std::map<std::string, Json> led_; ///< inputs, as they were last set
    std::vector<std::string> inputs_; ///< names of those that can be led
    std::string saved_, to_restore_;
    double saved_time_ = 0, last_time_ = 0;
    bool saving_ = false;
    double saved_at_ = 0; ///< in real time [s]
    std::int64_t last_id_ = 0;
    std::map<std::int64_t, Json> waited_for_;    ///< answers, null until they come
    std::map<std::int64_t, Json> open_requests_; ///< requests that are not answered yet
    std::shared_ptr<const std::string> frame_;
    std::uint64_t frame_seq_ = 0;
    bool frame_whole_ = false;
    std::uint64_t requested_after_ = 0;
    bool frame_requested_ = false, requested_whole_ = false;
};

} // namespace amontons::studio
