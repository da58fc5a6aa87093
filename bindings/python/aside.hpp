#pragma once

#include "bindings/python/common.hpp"

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

namespace amontons::python {

/// Work on a thread of its own, while the caller's waits for signals, which Python hands to its
/// first thread alone. Ctrl-C asks the work to stop, and is raised at once: work that cannot stop
/// at once (a factor, a mesh) continues by itself until it can.
class Aside : public std::enable_shared_from_this<Aside> {
public:
    /// Set where the work is to end.
    using Stop = std::shared_ptr<std::atomic<bool>>;

    /// @param work  keeps what it uses alive: nothing of the caller's stack
    static std::shared_ptr<Aside> start(std::function<void()> work, Stop stop);
    ~Aside();
    Aside(const Aside&) = delete;
    Aside& operator=(const Aside&) = delete;

    /// Until it is over. Without the GIL.
    /// @throws  what a signal's handler raises: then is_over() states whether the work has ended;
    ///          and what the work throws
    void wait();
    /// True if the work has ended.
    bool is_over() const;
    /// Work to be done after it, on its thread. @return  false: it is over already
    bool then(std::function<void()> more);

private:
    explicit Aside(Stop stop) : stop_(std::move(stop)) {}
    void do_all(std::function<void()> work);
    bool ends_within(std::chrono::milliseconds time);

    Stop stop_;
    mutable std::mutex mutex_; // of what follows
    std::condition_variable ended_;
    bool over_ = false, left_ = false;
    std::vector<std::function<void()>> more_;
    std::exception_ptr failure_;
    std::thread thread_;
};

/// What work gives that Ctrl-C may leave for good. Without the GIL.
/// @throws  as Aside::wait
template <class Work> auto done_aside(Work work, Aside::Stop stop)
{
    using Result = decltype(work());
    const auto result = std::make_shared<std::optional<Result>>();
    Aside::start([result, work = std::move(work)] { result->emplace(work()); }, std::move(stop))
        ->wait();
    return std::move(**result);
}
template <class Work> auto done_aside(Work work)
{
    return done_aside(std::move(work), std::make_shared<std::atomic<bool>>(false));
}

/// Held by threads of C++ while they call functions of Python.
class InPython {
public:
    /// @throws std::runtime_error  Python is about to end
    InPython();
    ~InPython();
    InPython(const InPython&) = delete;
    InPython& operator=(const InPython&) = delete;

private:
    struct Entry {
        Entry();
        ~Entry();
    } entry_;
    py::gil_scoped_acquire gil_;
};

/// An object of Python that a thread of C++ may be the last to give up.
using SharedObject = std::shared_ptr<py::object>;
SharedObject shared_object(py::object object);

/// What threads that continue by themselves need when Python ends.
void add_aside(py::module_& module);

} // namespace amontons::python
