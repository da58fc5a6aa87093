#pragma once

#include <atomic>

namespace amontons {

/// From now on the first SIGINT or SIGTERM sets the flag; a second one ends the program at
/// once with exit code 130. Files are whole at any time, so nothing is lost by that.
/// @return  the flag; the same one at each call
std::atomic<bool>& stop_on_interrupt();

/// True once a signal has come (the flag may have been set for another reason).
bool was_interrupted();

} // namespace amontons
