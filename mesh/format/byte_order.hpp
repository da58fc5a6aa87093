#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <string>

// Numbers in binary files, in the byte order of the file, not of this machine.

namespace amontons {

/// A number from the bytes of a file.
/// @param from  sizeof(T) bytes, of any alignment
template <class T> T read_bytes(const char* from, bool big_endian)
{
    std::array<char, sizeof(T)> bytes;
    std::memcpy(bytes.data(), from, sizeof(T));
    if (big_endian != (std::endian::native == std::endian::big))
        std::reverse(bytes.begin(), bytes.end());
    return std::bit_cast<T>(bytes);
}

/// Adds the bytes of a number to those of a file.
template <class T> void append_bytes(std::string& to, T value, bool big_endian)
{
    auto bytes = std::bit_cast<std::array<char, sizeof(T)>>(value);
    if (big_endian != (std::endian::native == std::endian::big))
        std::reverse(bytes.begin(), bytes.end());
    to.append(bytes.data(), bytes.size());
}

} // namespace amontons
