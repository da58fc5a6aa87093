#pragma once

#include "haptics/link/handle_link.hpp"
#include "haptics/loop/haptic_loop.hpp"
#include "mesh/base/phase_timer.hpp"
#include "solver/program/line_reader.hpp"
#include "solver/program/live_frames.hpp"
#include "solver/program/session.hpp"

#include <span>
#include <string>
#include <vector>

namespace amontons {

/// State of a haptic loop: times over its last second, counts so far, and the force now.
struct LoopHealth {
    double time = 0;         ///< of the last tick [s]
    double rate = 0;         ///< ticks a second
    long ticks = 0;          ///< done so far
    long missed = 0;         ///< left out so far
    long missed_by_work = 0; ///< ticks so far whose own processor time was longer than a period
    double p99 = 0;          ///< of the time that a tick takes [s]
    double late_p99 = 0;     ///< of how late a tick begins [s]
    TickRecord last;
};

/// Takes ticks as they are made and keeps what is counted over all of them.
class LoopWatch {
public:
    explicit LoopWatch(double period) : period_(period) {}
    /// @param ticks  all so far, those of before among them
    /// @param by_clock  false: in virtual time no tick is left out or late
    LoopHealth update(std::span<const TickRecord> ticks, bool by_clock);

private:
    double period_;
    std::size_t seen_ = 0;
    long by_work_ = 0;
};

/// A haptic run as the engine of `amontons studio`: requests are read from stdin, answers and
/// events written to stdout, one JSON document a line, frames to a descriptor (docs/studio.md). All
/// in the thread of the simulation: the loop's own never waits for it.
class HapticStudio {
public:
    /// @param frames     where frames are written
    /// @param period     of the loop [s]
    /// @param step_rate  that the simulation aims at [1/s]
    HapticStudio(int frames, Session& session, std::atomic<bool>& stop, double period,
                 double step_rate);

    /// A requested change of the scene.
    struct Change {
        std::string path, value; ///< value: JSON
    };
    /// Answers what has come since.
    /// @param scene  with every default, as JSON
    std::vector<Change> take(const std::string& scene);
    /// A change is made, or is not: "" or why not.
    void report_change(const std::string& line, double time, const std::string& refusal);

    /// A step was taken: the frame that is waited for is sent.
    bool frame_requested();
    bool whole_requested() const { return frames_.next_is_whole(); }
    void send(ViewFrame frame, bool whole, const HandleLink& link);

    /// Ten times a second: how the loop fares, and the place of the simulation's handle.
    void report_health(std::span<const TickRecord> ticks, const HandleLink& link, double stiffness,
                       bool by_clock);
    /// At the end: what the run came to.
    void write_report_event(const std::string& text);

private:
    void answer(const std::string& line, const std::string& scene, std::vector<Change>& changes);

    int stream_;
    Session& session_;
    std::atomic<bool>& stop_;
    LineReader lines_;
    LiveFrames frames_;
    LoopWatch watch_;
    double period_, step_rate_;
    Stopwatch since_health_;
    bool reported_ = false;
    int steps_ = 0, steps_before_ = 0;
};

} // namespace amontons
