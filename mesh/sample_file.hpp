#pragma once

#include "mesh/base/file.hpp"

#include <array>
#include <memory>
#include <string>
#include <string_view>
#include <unordered_map>

namespace amontons {

/// The place of a brick in its grid, counted in bricks, each within 2^20.
struct BrickKey {
    /// Numbers of the brick in the lattice.
    std::int32_t x, y, z;
    bool operator==(const BrickKey&) const = default;
};

/// Hash of a brick's numbers.
struct BrickHash {
    std::size_t operator()(const BrickKey& k) const
    {
        const auto part = [](std::int32_t v) { return static_cast<std::uint64_t>(v + (1 << 20)); };
        std::uint64_t h = part(k.x) << 42 | part(k.y) << 21 | part(k.z);
        h = (h ^ (h >> 31)) * 0x9e3779b97f4a7c15ULL;
        return static_cast<std::size_t>(h ^ (h >> 29));
    }
};

inline constexpr int kBrick = 4; ///< samples along an edge of a brick
using Brick = std::array<double, kBrick * kBrick * kBrick>;
using Bricks = std::unordered_map<BrickKey, std::unique_ptr<Brick>, BrickHash>;

/// Samples of a field as a file's bytes, in an order that does not depend on that of the map.
/// @param of  fingerprint of the sampled field and its grid
std::string sample_bytes(const Hash128& of, const Bricks& bricks);

/// Adds the samples in a file's bytes to `bricks`.
/// @return  "" if they were added, else the reason, and `bricks` is unchanged
std::string read_samples(std::string_view bytes, const Hash128& of, Bricks& bricks);

} // namespace amontons
