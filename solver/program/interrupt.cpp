#include "solver/program/interrupt.hpp"

#include "solver/program/session.hpp"

#include <csignal>
#include <unistd.h>

namespace amontons {
namespace {

// A signal handler can reach nothing but globals.
std::atomic<bool> stop_flag{false};
std::atomic<bool> signal_arrived{false};
static_assert(std::atomic<bool>::is_always_lock_free);

void on_signal(int)
{
    if (signal_arrived.exchange(true)) ::_exit(kInterrupted);
    stop_flag = true;
}

} // namespace

std::atomic<bool>& stop_on_interrupt()
{
    struct sigaction action {};
    action.sa_handler = on_signal;
    action.sa_flags = SA_RESTART;
    ::sigemptyset(&action.sa_mask);
    ::sigaction(SIGINT, &action, nullptr);
    ::sigaction(SIGTERM, &action, nullptr);
    struct sigaction before {};
    if (::sigaction(SIGHUP, nullptr, &before) == 0 && before.sa_handler != SIG_IGN) // nohup's stays
        ::sigaction(SIGHUP, &action, nullptr);
    return stop_flag;
}

bool was_interrupted()
{
    return signal_arrived;
}

} // namespace amontons
