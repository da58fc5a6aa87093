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

/// Requests to the simulation.
struct EngineRequests {
    std::deque<std::string> to_send; ///< by a thread: the engine may be in a long step
    std::int64_t last_id = 0;
    std::map<std::int64_t, Json> waited_for; ///< answers, null until they come
    std::map<std::int64_t, Json> open;       ///< requests that are not answered yet
};
/// Queues a request. @param request  its id is set. @return  that id
std::int64_t post(EngineRequests& requests, Json request);
/// Gives all that are waited for this answer.
void answer_all(EngineRequests& requests, const Json& answer);

/// The state that the simulation is continued from after its end.
struct SavedState {
    std::string state;      ///< "": none
    std::string to_restore; ///< by a process that has just started
    double time = 0;        ///< of the state [s]
    double last_time = 0;   ///< that the simulation has reported [s]
    double at = 0;          ///< when it was saved, in real time [s]
    bool saving = false;
};

/// Whether a running simulation should save its state again. @param now  in real time [s]
bool save_is_due(const SavedState& saved, double now);

/// The newest frame, and whether one is on its way.
struct NewestFrame {
    std::shared_ptr<const std::string> bytes; ///< null: none yet
    std::uint64_t seq = 0, requested_after = 0;
    bool whole = false, requested = false, requested_whole = false;
};
/// Whether it is one after `after`. @param whole  a whole one
bool is_newer(const NewestFrame& frame, std::uint64_t after, bool whole);
/// Whether such a frame is on its way.
bool is_requested(const NewestFrame& frame, std::uint64_t after, bool whole);

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
    void send(const std::string& what);
    void send(const std::string& what, Json request);
    void report_state();
    void keep_state();

    const std::string program_, results_;
    const std::function<void(std::string)> publish_;

    std::mutex control_; ///< one start or end at a time
    mutable std::mutex mutex_;
    std::condition_variable changed_;
    Process process_;
    int number_ = 0; ///< of the process: what an older one states is passed over
    std::string state_ = "none", reason_, last_error_;
    EngineStart how_;                 ///< its `set` as the scene was started or changed since
    std::string folder_;              ///< of results, that the engine writes or wrote
    std::map<std::string, Json> led_; ///< inputs, as they were last set
    std::vector<std::string> inputs_; ///< names of those that can be led
    EngineRequests requests_;
    SavedState saved_;
    NewestFrame frame_;
};

} // namespace amontons::studio
