#include "bindings/python/stepper.hpp"

#include "bindings/python/aside.hpp"

#include <chrono>

namespace amontons::python {
namespace {

constexpr double kLook = 0.05;  // s between searches for signals
constexpr double kShort = 0.02; // s; of the last step: the next one is not waited for

} // namespace

double seconds_now()
{
    using Clock = std::chrono::steady_clock;
    return std::chrono::duration<double>(Clock::now().time_since_epoch()).count();
}

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
            ? "this simulation is in run(): its callback can look and save, not step"
            : nullptr;
    if (!wrong) return;
    owner.busy_ = false;
    throw_runtime(wrong);
}

void Stepper::check_signals()
{
    const double now = seconds_now();
    if (now - looked_ < kLook) return;
    looked_ = now;
    const py::gil_scoped_acquire hold;
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
}

StepResult Stepper::step_aside(double not_beyond)
{
    const bool quick = record() && record()->step.seconds < kShort && record()->step.step > 0;
    if (quick) return step(stop_, not_beyond);
    StepResult result;
    const std::exception_ptr raised = run_aside([&] { result = step(stop_, not_beyond); }, stop_);
    if (raised) std::rethrow_exception(raised); // a step that ended all the same counts
    return result;
}

std::shared_ptr<Stepper> Stepper::fork()
{
    auto other = std::make_shared<Stepper>(scene(), options());
    other->follow(*this);
    return other;
}

} // namespace amontons::python
