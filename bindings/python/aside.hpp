#pragma once

#include "bindings/python/common.hpp"

#include <atomic>
#include <functional>

namespace amontons::python {

/// Does what takes long on a thread of its own, while this one waits for signals, which Python
/// hands to its first thread alone: Ctrl-C sets `stop`. Without the GIL.
/// @return  what a signal's handler raised, to be thrown on by the caller; or null
/// @throws  what the work throws
std::exception_ptr run_aside(const std::function<void()>& work, std::atomic<bool>& stop);

} // namespace amontons::python
