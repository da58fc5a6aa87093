#pragma once

#include <functional>
#include <string>

namespace amontons::fclib_module {

/// Does some work in a forked process, and returns the bytes that it returned there.
///
/// The child inherits nothing of the work back but the bytes: what the work damages, allocates or
/// leaves open is lost with it.
/// @param work    may throw std::exception, whose message is that of the exception thrown here
/// @param memory  address space that the child may add [bytes]
/// @param time    processor time that the child may take [s]
/// @return        bytes allocated by std::malloc, and their number
/// @throws std::runtime_error  what the work threw; or that it crashed, or took too long
struct Bytes {
    char* data = nullptr;
    long size = 0;
};
Bytes in_child_process(const std::function<std::string()>& work, double memory, double time);

} // namespace amontons::fclib_module
