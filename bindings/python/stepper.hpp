#pragma once

#include "bindings/python/records.hpp"
#include "solver/step/stepped_scene.hpp"

#include <atomic>
#include <functional>
#include <limits>

namespace amontons::python {

/// A simulation as a caller in Python steps it: one thread at a time, interrupted by Ctrl-C.
class Stepper : public SteppedScene {
public:
    /// Without the GIL. @throws InputError
    Stepper(SharedScene scene, const SimulationOptions& options);

    /// Held while a call is in this object. @throws RuntimeError of Python  where another thread,
    /// or a callback, is in it already, or it is closed. With the GIL.
    enum class Purpose { read, change, run };
    class Use {
    public:
        Use(Stepper& owner, Purpose purpose);
        ~Use() { owner_.busy_ = false; }
        Use(const Use&) = delete;
        Use& operator=(const Use&) = delete;

    private:
        Stepper& owner_;
    };

    /// So many accepted steps, or up to what else comes. Where they may take long they are taken on
    /// a thread of their own, while this one searches for signals. Without the GIL.
    /// @param after  called after each accepted one, on the thread that steps; false ends them
    /// @throws KeyboardInterrupt of Python, and whatever else a signal's handler raises; the state
    ///         is that of the last accepted step
    StepResult steps(long count, double not_beyond = std::numeric_limits<double>::infinity(),
                     const std::function<bool()>& after = {});

    /// From its beginning to its end only run() itself may step.
    void set_running(bool running) { running_ = running; }
    /// The same scene and state with a future of its own.
    std::shared_ptr<Stepper> fork();

private:
    bool takes_long(long count, double not_beyond) const;
    void check_signals();

    std::atomic<bool> stop_{false}, busy_{false}, running_{false};
    double polled_ = 0; ///< for signals [s]
};

} // namespace amontons::python
