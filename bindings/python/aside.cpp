#include "bindings/python/aside.hpp"

#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>

namespace amontons::python {

std::exception_ptr run_aside(const std::function<void()>& work, std::atomic<bool>& stop)
{
    constexpr std::chrono::milliseconds kPollPeriod{50};
    std::mutex mutex;
    std::condition_variable ended;
    bool over = false;
    std::exception_ptr failure, raised;
    std::thread worker([&] {
        try {
            work();
        } catch (...) {
            failure = std::current_exception();
        }
        const std::lock_guard lock(mutex);
        over = true;
        ended.notify_one();
    });
    while (true) {
        {
            std::unique_lock lock(mutex);
            if (ended.wait_for(lock, kPollPeriod, [&] { return over; })) break;
        }
        if (raised) continue;
        const py::gil_scoped_acquire hold;
        if (PyErr_CheckSignals() != 0) {
            raised = std::make_exception_ptr(py::error_already_set());
            stop = true;
        }
    }
    worker.join();
    stop = false;
    if (failure) std::rethrow_exception(failure);
    return raised;
}

} // namespace amontons::python
