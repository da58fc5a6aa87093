#include "bindings/python/stepper.hpp"

#include <algorithm>
#include <chrono>

namespace amontons::python {
namespace {

constexpr double kLookAfter = 0.05;  // s between searches for signals
constexpr double kShort = 0.02; // s; what is done sooner is not worth a thread

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
    try {
        owner.settle();
    } catch (...) {
        owner.busy_ = false;
        throw;
    }
    const char* wrong =
        owner.closed() ? "this simulation is closed"
        : purpose == Purpose::change && owner.running_
            ? "this simulation is in run(): its callback can look and save, not step"
            : nullptr;
    if (!wrong) return;
    owner.busy_ = false;
    throw_runtime(wrong);
}

void Stepper::leave(std::shared_ptr<Aside> call)
{
    const std::lock_guard lock(leaving_);
    left_ = std::move(call);
}

std::shared_ptr<Aside> Stepper::left() const
{
    const std::lock_guard lock(leaving_);
    return left_;
}

/// Until an interrupted call has come to its end.
void Stepper::settle()
{
    const std::shared_ptr<Aside> call = left();
    if (!call || closed()) return;
    const py::gil_scoped_release free;
    try {
        call->wait();
    } catch (...) {
        if (call->is_over()) leave(nullptr);
        throw;
    }
    leave(nullptr);
}

void Stepper::close()
{
    if (busy_.exchange(true)) throw_runtime("this simulation is in use by another thread");
    if (running_) {
        busy_ = false;
        throw_runtime("this simulation is in run(): its callback can look and save, not close it");
    }
    closing_ = true;
    const std::shared_ptr<Aside> call = left();
    const auto end = [self = shared_from_this()] { self->SteppedScene::close(); };
    if (!call || !call->then(end)) end();
    busy_ = false;
}

void wait_for(const std::shared_ptr<Aside>& call, std::span<const std::shared_ptr<Stepper>> users)
{
    try {
        call->wait();
    } catch (...) {
        if (!call->is_over())
            for (const std::shared_ptr<Stepper>& s : users)
                s->leave(call);
        throw;
    }
}

void Stepper::check_signals()
{
    const double now = seconds_now();
    if (now - looked_ < kLookAfter) return;
    looked_ = now;
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
    const auto last = std::make_shared<StepResult>();
    const auto all = [last, count, not_beyond, after](Stepper& s) {
        for (long k = 0; k < count; ++k) {
            *last = s.step(*s.stop_, not_beyond);
            if (last->outcome != StepResult::Outcome::accepted || (after && !after())) return;
        }
    };
    if (takes_long(count, not_beyond)) {
        const std::shared_ptr<Stepper> self = shared_from_this();
        wait_for(Aside::start([self, all] { all(*self); }, stop_), {&self, 1});
    } else {
        all(*this);
        check_signals();
    }
    return *last;
}

std::shared_ptr<Stepper> Stepper::fork() const
{
    auto other = std::make_shared<Stepper>(scene(), options());
    other->follow(*this);
    return other;
}

void Stepper::change(const std::vector<std::string>& overrides)
{
    const std::shared_ptr<Stepper> self = shared_from_this();
    const auto next = std::make_shared<std::optional<SteppedScene>>();
    wait_for(Aside::start([self, next, overrides] { next->emplace(self->changed(overrides)); }, stop_),
             {&self, 1});
    SteppedScene::operator=(std::move(**next));
}

} // namespace amontons::python
