#pragma once

#include "contact/linear/lanes.hpp"

#include <cstddef>

// What the analysis of BlockLu and its kernels must agree on.

namespace amontons::block_lu {

/// Rows of a tile: three for each lane.
constexpr int kTileRows = 3 * kLanes;
constexpr int kTileBlocks = kLanes; ///< block rows of a tile
/// Kernels read whole tiles: so far beyond the last number.
constexpr std::size_t kSlack = 2 * kTileRows;
constexpr int kNarrow = 8; ///< blocks: up to here a diagonal block is inverted in registers

/// A count as an unsigned number.
inline std::size_t size(int i)
{
    return static_cast<std::size_t>(i);
}

} // namespace amontons::block_lu
