#pragma once

#include "solver/output/vtk/view_frame.hpp"

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <string>
#include <sys/types.h>
#include <thread>

namespace CLI {
class App;
}

namespace amontons {

struct Session;

/// A window in a process of its own, so that drawing costs a run nothing but the making of a
/// frame: the newest one waits for the window, never the run.
class Viewer {
public:
    /// @param stay  the window stays when the run has ended, until the user closes it
    /// @throws InputError  if no window can be opened; gives the reason
    Viewer(const std::string& title, bool stay);
    /// Shows the last frame; then the window may be closed.
    ~Viewer();
    Viewer(const Viewer&) = delete;
    Viewer& operator=(const Viewer&) = delete;

    /// Is it time for a frame? Not while one waits, or when the user has closed the window.
    bool frame_due();
    void offer(const ViewFrame& frame);

    struct Counts {
        long frames = 0;    ///< drawn
        double seconds = 0; ///< from the first to the last
    };
    /// Ends the stream and waits for the window.
    Counts close();

private:
    void send();

    int stream_ = -1;
    pid_t child_ = -1;
    std::chrono::steady_clock::time_point next_{};
    std::mutex mutex_;
    std::condition_variable changed_;
    std::string waiting_; ///< bytes of the newest frame
    bool ended_ = false, closed_ = false;
    std::thread sender_;
};

/// The hidden command that is the window's process.
void add_view(CLI::App& program, Session& session);

} // namespace amontons
