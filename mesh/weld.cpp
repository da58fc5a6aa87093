#include "mesh/weld.hpp"

#include <bit>
#include <cstddef>

namespace amontons {
namespace {

std::uint64_t mix(std::uint64_t x) // finaliser of MurmurHash3
{
    x ^= x >> 33;
    x *= 0xff51afd7ed558ccdULL;
    x ^= x >> 33;
    x *= 0xc4ceb9fe1a85ec53ULL;
    return x ^ (x >> 33);
}

std::uint64_t hash(const Vec3& p)
{
    std::uint64_t h = 0;
    for (int i = 0; i < 3; ++i) // adding 0 makes 0 of -0
        h = mix(h ^ std::bit_cast<std::uint64_t>(p[i] + 0.0)) + 0x9e3779b97f4a7c15ULL;
    return mix(h);
}

} // namespace

std::vector<std::int32_t> first_at_same_place(const std::vector<Vec3>& points)
{
    // Open addressing, at most half full.
    const std::size_t capacity = std::bit_ceil(2 * points.size() + 1);
    std::vector<std::int32_t> table(capacity, -1);
    std::vector<std::int32_t> first(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
        std::size_t slot = hash(points[i]) & (capacity - 1);
        while (table[slot] >= 0 && points[static_cast<std::size_t>(table[slot])] != points[i])
            slot = (slot + 1) & (capacity - 1);
        if (table[slot] < 0) table[slot] = static_cast<std::int32_t>(i);
        first[i] = table[slot];
    }
    return first;
}

void weld(SurfaceMesh& mesh)
{
    std::vector<std::int32_t> place = first_at_same_place(mesh.points);
    std::size_t kept = 0;
    for (std::size_t i = 0; i < place.size(); ++i) {
        const auto first = static_cast<std::size_t>(place[i]);
        if (first != i) {
            place[i] = place[first]; // already its new number, since first < i
            continue;
        }
        mesh.points[kept] = mesh.points[i];
        place[i] = static_cast<std::int32_t>(kept++);
    }
    mesh.points.resize(kept);
    for (auto& triangle : mesh.triangles)
        for (std::int32_t& corner : triangle)
            corner = place[static_cast<std::size_t>(corner)];
}

} // namespace amontons
