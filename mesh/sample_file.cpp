#include "mesh/sample_file.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <vector>

// magic | fingerprint (2 x 8 bytes) | number of bricks (8) | their keys, 3 x 4 each | their
// samples, 64 x 8 each | hash of all before (8); in the byte order of the machine.

namespace amontons {

namespace {

constexpr std::string_view kSampleMagic = "amontons samples 1";
constexpr std::int32_t kMostBrickNumber = (1 << 20) + 2;

template <class T> void append(std::string& bytes, const T& value)
{
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

template <class T> T taken(std::string_view& bytes)
{
    T value;
    std::memcpy(&value, bytes.data(), sizeof value);
    bytes.remove_prefix(sizeof value);
    return value;
}

bool is_key(const BrickKey& k)
{
    const auto small = [](std::int32_t v) {
        return v >= -kMostBrickNumber && v < kMostBrickNumber;
    };
    return small(k.x) && small(k.y) && small(k.z);
}

} // namespace

std::string sample_bytes(const Hash128& of, const Bricks& bricks)
{
    std::vector<std::pair<BrickKey, const Brick*>> sorted;
    sorted.reserve(bricks.size());
    for (const auto& [key, brick] : bricks)
        sorted.emplace_back(key, brick.get());
    std::sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) {
        const auto of_key = [](const BrickKey& k) { return std::array{k.x, k.y, k.z}; };
        return of_key(a.first) < of_key(b.first);
    });
    std::string bytes(kSampleMagic);
    bytes.reserve(bytes.size() + 32 + sorted.size() * (sizeof(BrickKey) + sizeof(Brick)));
    append(bytes, of.high);
    append(bytes, of.low);
    append(bytes, static_cast<std::uint64_t>(sorted.size()));
    for (const auto& [key, brick] : sorted)
        append(bytes, key);
    for (const auto& [key, brick] : sorted)
        append(bytes, *brick);
    append(bytes, hash_bytes(bytes));
    return bytes;
}

std::string read_samples(std::string_view bytes, const Hash128& of, Bricks& bricks)
{
    constexpr std::size_t head = kSampleMagic.size() + 3 * sizeof(std::uint64_t);
    constexpr std::size_t each = sizeof(BrickKey) + sizeof(Brick);
    if (bytes.size() < head + sizeof(std::uint64_t) || !bytes.starts_with(kSampleMagic))
        return "damaged";
    std::string_view end = bytes.substr(bytes.size() - sizeof(std::uint64_t));
    bytes.remove_suffix(sizeof(std::uint64_t));
    if (taken<std::uint64_t>(end) != hash_bytes(bytes)) return "damaged";
    bytes.remove_prefix(kSampleMagic.size());
    const Hash128 found{taken<std::uint64_t>(bytes), taken<std::uint64_t>(bytes)};
    if (found != of) return "of something else";
    const auto count = taken<std::uint64_t>(bytes);
    if (bytes.size() % each != 0 || bytes.size() / each != count) return "damaged";
    std::string_view keys = bytes.substr(0, count * sizeof(BrickKey));
    bytes.remove_prefix(keys.size());
    std::vector<BrickKey> places;
    places.reserve(count);
    while (!keys.empty()) {
        places.push_back(taken<BrickKey>(keys));
        if (!is_key(places.back())) return "damaged";
    }
    for (const BrickKey& key : places)
        if (auto& slot = bricks[key]; !slot)
            slot = std::make_unique<Brick>(taken<Brick>(bytes));
        else
            bytes.remove_prefix(sizeof(Brick));
    return "";
}

} // namespace amontons
