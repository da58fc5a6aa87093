#pragma once

#include <cstddef>
#include <cstdint>

// Meshes count in 32 bits, containers in 64; for .cpp files alone.

namespace amontons {

/// An index of this program (int32) as one of the standard library; >= 0.
inline std::size_t at(std::int32_t i)
{
    return static_cast<std::size_t>(i);
}

/// An index of the standard library as one of this program (int32).
inline std::int32_t number(std::size_t i)
{
    return static_cast<std::int32_t>(i);
}

} // namespace amontons
