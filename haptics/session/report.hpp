#pragma once

#include "haptics/time/summary.hpp"

#include <optional>
#include <string>
#include <vector>

namespace amontons {

class HandleLink;      // haptics/link/handle_link.hpp
struct HapticSettings; // haptics/link/settings.hpp

/// What a window showed of a run.
struct ShownFrames {
    long frames = 0;    ///< pictures drawn
    double seconds = 0; ///< from the first to the last [s]
};

/// Result of a haptic run.
struct HapticOutcome {
    HapticSummary summary;
    std::vector<TickRecord> records; ///< of all ticks
    std::string status = "done", scheduling = "virtual time", output;
    std::string message; ///< why it failed
    bool real_time = false;
    long page_faults = 0, pages_moved = 0, preempted = 0, bare_missed = 0;
    Percentiles bare_wake;
    std::optional<ShownFrames> shown; ///< with --view
    double step_rate = 0; ///< of the simulation in real time, over its last whole second [1/s]
    int contacts_at_first = 0,
        contacts_left = 0; ///< most that are handed over: at first, at the end
};

/// The keys of `amontons haptic --json`.
std::string haptic_json(const HapticOutcome& o, const HapticSettings& set, const HandleLink& link);
/// The same for readers.
std::string haptic_table(const HapticOutcome& o, const HapticSettings& set, const HandleLink& link);

} // namespace amontons
