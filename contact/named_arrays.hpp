#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

// The contents of a file of arrays, as plain memory: what crosses the border to the module that
// that uses HDF5, and the process in which it reads.

namespace amontons {

/// Something is there, but it cannot be read as numbers or text.
struct Unreadable {
    /// What is unreadable, and what is allowed.
    std::string reason;
};

/// One dataset. Arrays of any rank are flat here, row by row.
struct NamedArray {
    std::string name; ///< the path in the file, "fclib_local/W/p"
    std::variant<std::vector<std::int32_t>, std::vector<double>, std::string, Unreadable> value;
};

/// All arrays in one piece of memory, of this machine's byte order.
std::string pack_arrays(const std::vector<NamedArray>& arrays);

/// The way back. @throws std::runtime_error  if the bytes are not those of pack_arrays
std::vector<NamedArray> unpack_arrays(std::string_view bytes);

} // namespace amontons
