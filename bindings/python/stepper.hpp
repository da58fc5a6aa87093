#pragma once

#include "bindings/python/aside.hpp"
#include "bindings/python/records.hpp"
#include "solver/step/stepped_scene.hpp"

#include <atomic>
#include <functional>
#include <limits>

namespace amontons::python {

/// A simulation as a caller in Python steps it: one thread at a time, interrupted by Ctrl-C.
class Stepper : public SteppedScene, public std::enable_shared_from_this<Stepper> {
public:
    /// Without the GIL. @throws InputError
    Stepper(SharedScene scene, const SimulationOptions& options);

    /// Held while a call is in this object, after what an interrupted one has still to do.
    /// @throws RuntimeError of Python  where another thread, or a callback, is in it already, or it
    ///         is closed; what a signal's handler raises meanwhile. With the GIL.
    enum class Purpose { look, change, run };
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
    /// @param after  called after each accepted one, on the thread that steps; false ends them. It
    ///               keeps what it uses alive
    /// @throws KeyboardInterrupt of Python, and whatever else a signal's handler raises; the state
    ///         is that of the last accepted step, at the latest when the next call is in here
    StepResult steps(long count, double not_beyond = std::numeric_limits<double>::infinity(),
                     const std::function<bool()>& after = {});

    /// From its beginning to its end only run() itself may step.
    void set_running(bool running) { running_ = running; }
    /// The same scene and state with a future of its own.
    std::shared_ptr<Stepper> fork() const;
    /// As SteppedScene::change. Without the GIL.
    /// @throws  as steps(), and InputError; nothing is changed
    void change(const std::vector<std::string>& overrides);

    /// As SteppedScene, but an interrupted call that continues is not waited for.
    /// @throws RuntimeError of Python  where a thread, or a callback, is in it
    void close();
    bool closed() const { return closing_ || SteppedScene::closed(); }

    /// What asks it to stop.
    const Aside::Stop& stop() const { return stop_; }
    /// Work in this object that has been left to itself: the next call waits for it.
    void leave(std::shared_ptr<Aside> call);
    /// The same, or null where no call continues.
    std::shared_ptr<Aside> left() const;

private:
    bool takes_long(long count, double not_beyond) const;
    void check_signals();
    void settle();

    Aside::Stop stop_ = std::make_shared<std::atomic<bool>>(false);
    std::atomic<bool> busy_{false}, running_{false}, closing_{false};
    mutable std::mutex leaving_; // of left_
    std::shared_ptr<Aside> left_;
    double looked_ = 0; ///< for signals [s]
};

/// Waits for work in steppers that are in use; what Ctrl-C leaves is waited for by their next call.
/// @throws  as Aside::wait
void wait_for(const std::shared_ptr<Aside>& call, std::span<const std::shared_ptr<Stepper>> users);

} // namespace amontons::python
