#pragma once

#include "haptics/session/report.hpp"

#include <atomic>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

// A haptic run of a scene: the common part of `amontons haptic` and Python's haptic.Session.

namespace amontons {

struct Obstacle; // solver/step/simulation.hpp
struct Scene;    // solver/scene/scene.hpp

/// Options of a haptic run.
struct HandRunOptions {
    std::string device = "simulated"; ///< or recorded:FILE, udp:PORT, spacemouse
    double duration = 0;              ///< [s]; 0: the trajectory's, or the scene's end
    bool virtual_time = false;        ///< without a clock: the same ticks in every run
    double late = 0;                  ///< virtual time: share of ticks that come 3 ticks late
    int latency = 1;                  ///< virtual time: periods that a step takes
    bool control = true;              ///< passivity; else the energy is counted only
    int threads = 1;
    std::string cache;    ///< folder of factors; "": none
    bool watched = false; ///< virtual time follows the clock, for a viewer
    /// True if the process does nothing else: its allocator then never returns freed memory to the
    /// system.
    bool own_process = true;
};

/// Callbacks of a run, in the simulation's thread. Any may be empty.
struct HandRunHooks {
    std::function<void(const std::string&)> print_line; ///< a line for the user
    std::function<std::vector<std::string>()> changes;  ///< "PATH=VALUE" that the user requests
    /// Called for each change, with "" if it was made, else with the reason. Empty: `print_line` is
    /// called.
    std::function<void(const std::string& line, const std::string& refusal, const HandleLink&)>
        changed;
    /// All ticks that are done, about once a step of the simulation.
    std::function<void(std::span<const TickRecord>, const HandleLink&)> ticks;
    /// After each step of the simulation.
    /// @param remade  the obstacles are others than those of the step before
    std::function<void(const HandleLink&, const std::vector<Obstacle>&, bool remade)> after_step;
};

/// A haptic run of a scene. For one thread at a time.
class HandRun {
public:
    /// Reads the settings of device and loop; refuses scenes without a handle that can be held.
    /// Makes no bodies.
    /// @param read  reads the scene with values that are changed during the run
    /// @throws InputError
    HandRun(Scene scene, const HandRunOptions& options,
            std::function<Scene(const std::vector<std::string>& overrides)> read);
    ~HandRun();

    /// With introducers placed at their centrelines.
    const Scene& scene() const;
    /// As it is now, after changes.
    const Scene& scene_now() const;
    /// After prepare().
    const HapticSettings& settings() const;
    /// Makes the bodies and opens the device. @throws InputError
    void prepare(std::function<std::vector<Obstacle>(const Scene&)> make);

    /// From the beginning to the end, or until `stop`. Once, after prepare().
    HapticOutcome run(const HandRunHooks& hooks, const std::atomic<bool>& stop);

    /// Warnings about the scene: values that are valid but probably not intended; after prepare().
    std::vector<std::string> warnings() const;
    /// The keys of `amontons haptic --json`; after run().
    std::string json(const HapticOutcome& o) const;
    /// A table for readers; after run().
    std::string table(const HapticOutcome& o) const;

private:
    struct State;
    std::unique_ptr<State> state_;
};

} // namespace amontons
