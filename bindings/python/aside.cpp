#include "bindings/python/aside.hpp"

#include <cstdio>
#include <cstdlib>
#include <unistd.h>

namespace amontons::python {
namespace {

constexpr std::chrono::milliseconds kPollPeriod{10}; ///< between two searches for signals
/// For work to stop after Ctrl-C, before it is left to itself.
constexpr std::chrono::milliseconds kGrace{30};

std::atomic<int> left_to_themselves{0};

/// Who is in Python, or on the way there, from threads of C++.
struct Visitors {
    std::mutex mutex;
    std::condition_variable none_left;
    int count = 0;
    bool closed = false;
};
Visitors& visitors()
{
    static auto* all = new Visitors; // never ends: threads may outlive static objects
    return *all;
}

/// With the GIL, before Python's objects end: a thread that entered it afterwards would be ended in
/// the midst of the engine's work.
void before_python_ends()
{
    Visitors& v = visitors();
    {
        const py::gil_scoped_release free;
        std::unique_lock lock(v.mutex);
        v.closed = true;
        v.none_left.wait(lock, [&] { return v.count == 0; });
    }
    // Registered last, it is called first: libraries that are still at work keep what they use.
    if (left_to_themselves > 0)
        ::on_exit(
            [](int status, void*) {
                if (left_to_themselves == 0) return;
                std::fflush(nullptr);
                ::_exit(status);
            },
            nullptr);
}

} // namespace

InPython::Entry::Entry()
{
    Visitors& v = visitors();
    const std::lock_guard lock(v.mutex);
    if (v.closed) throw std::runtime_error("Python is about to end");
    ++v.count;
}
InPython::Entry::~Entry()
{
    Visitors& v = visitors();
    const std::lock_guard lock(v.mutex);
    if (--v.count == 0) v.none_left.notify_all();
}
InPython::InPython() = default;
InPython::~InPython() = default;

SharedObject shared_object(py::object object)
{
    return {new py::object(std::move(object)), [](py::object* o) {
                try {
                    const InPython in;
                    delete o;
                } catch (const std::runtime_error&) { // with Python all objects end
                }
            }};
}

std::shared_ptr<Aside> Aside::start(std::function<void()> work, Stop stop)
{
    const std::shared_ptr<Aside> one(new Aside(std::move(stop)));
    one->thread_ = std::thread(
        [one, work = std::move(work)]() mutable { one->do_all(std::move(work)); });
    return one;
}

Aside::~Aside()
{
    if (thread_.joinable()) thread_.detach(); // it may be this thread itself
}

void Aside::do_all(std::function<void()> work)
{
    std::exception_ptr failure;
    std::vector<std::function<void()>> all;
    all.push_back(std::move(work));
    while (!all.empty()) {
        for (const std::function<void()>& one : all)
            try {
                one();
            } catch (...) {
                if (!failure) failure = std::current_exception();
            }
        all.clear(); // what they kept ends here, before it is over
        const std::lock_guard lock(mutex_);
        all.swap(more_);
        if (!all.empty()) continue;
        failure_ = failure;
        over_ = true;
        if (left_) --left_to_themselves;
        ended_.notify_all();
    }
}

bool Aside::ends_within(std::chrono::milliseconds time)
{
    std::unique_lock lock(mutex_);
    return ended_.wait_for(lock, time, [this] { return over_; });
}

bool Aside::is_over() const
{
    const std::lock_guard lock(mutex_);
    return over_;
}

bool Aside::then(std::function<void()> more)
{
    const std::lock_guard lock(mutex_);
    if (over_) return false;
    more_.push_back(std::move(more));
    return true;
}

void Aside::wait()
{
    std::exception_ptr raised;
    while (!raised && !ends_within(kPollPeriod)) {
        const py::gil_scoped_acquire hold;
        if (PyErr_CheckSignals() != 0)
            raised = std::make_exception_ptr(py::error_already_set());
    }
    if (raised) {
        *stop_ = true;
        if (!ends_within(left_ ? std::chrono::milliseconds(0) : kGrace)) {
            const std::lock_guard lock(mutex_);
            if (!over_ && !std::exchange(left_, true)) ++left_to_themselves;
        }
        if (!is_over()) std::rethrow_exception(raised);
    }
    std::thread ended; // of several that wait one joins
    {
        const std::lock_guard lock(mutex_);
        ended.swap(thread_);
    }
    if (ended.joinable()) ended.join();
    *stop_ = false;
    if (raised) std::rethrow_exception(raised);
    if (failure_) std::rethrow_exception(failure_);
}

void add_aside(py::module_&)
{
    py::module_::import("atexit").attr("register")(py::cpp_function(before_python_ends));
}

} // namespace amontons::python
