#include "bindings/python/stepper.hpp"

#include "bindings/python/aside.hpp"

#include <algorithm>
#include <chrono>

namespace amontons::python {
namespace {

constexpr double kPollPeriod = 0.05; // s between searches for signals
constexpr double kShort = 0.02;      // s; what is done sooner is not worth a thread

double seconds_now()
{
    using Clock = std::chrono::steady_clock;
    return std::chrono::duration<double>(Clock::now().time_since_epoch()).count();
}

} // namespace

Stepper::Stepper(SharedScene scene, const SimulationOptions& options)
    : SteppedScene(std::move(scene), options)
{
}

Stepper::Use::Use(Stepper& owner, Purpose purpose) : owner_(owner)
{
    if (owner.busy_.exchange(true)) throw_runtime("this simulation is in use by another thread");
    const char* wrong =
        owner.closed() ? "this simulation is closed"
        : purpose == Purpose::change && owner.running_
            ? "this simulation is in run(): its callback can read and save, not step"
            : nullptr;
    if (!wrong) return;
    owner.busy_ = false;
    throw_runtime(wrong);
}

void Stepper::check_signals()
{
    const double now = seconds_now();
    if (now - polled_ < kPollPeriod) return;
    polled_ = now;
    const py::gil_scoped_acquire hold;
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
}

/// By what the last step took.
bool Stepper::takes_long(long count, double not_beyond) const
{
    if (!record() || record()->step.step == 0) return true;
    const StepRecord& last = record()->step;
    const double left = std::min(not_beyond, end()) - time(),
                 most = std::min(double(count), 1 + left / last.step_length);
    return !(most * last.seconds < kShort);
}

StepResult Stepper::steps(long count, double not_beyond, const std::function<bool()>& after)
{
    StepResult last;
    const auto all = [&] {
        for (long k = 0; k < count; ++k) {
            last = step(stop_, not_beyond);
            if (last.outcome != StepResult::Outcome::accepted || (after && !after())) return;
        }
    };
    if (takes_long(count, not_beyond)) {
        const std::exception_ptr raised = run_aside(all, stop_);
        if (raised) std::rethrow_exception(raised);
    } else {
        all();
        check_signals();
    }
    return last;
}

std::shared_ptr<Stepper> Stepper::fork()
{
    auto other = std::make_shared<Stepper>(scene(), options());
    other->follow(*this);
    return other;
}

} // namespace amontons::python
