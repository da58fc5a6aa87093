#pragma once

#include <cstddef>
#include <cstdint>

// Meshes count in 32 bits, containers in 64; for .cpp files alone.

namespace amontons {

inline std::size_t at(std::int32_t i)
{
    return static_cast<std::size_t>(i);
}

inline std::int32_t number(std::size_t i)
{
    return static_cast<std::int32_t>(i);
}

} // namespace amontons
