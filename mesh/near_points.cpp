#include "mesh/near_points.hpp"

#include "mesh/weld.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace amontons {

// Points enter cubes four times `distance` wide. What is near to a point is then in its cube or
// beyond the walls that are near to it.
std::vector<std::array<std::int32_t, 2>> near_points(const std::vector<Vec3>& points,
                                                     double distance)
{
    std::vector<std::array<std::int32_t, 2>> pairs;
    const std::vector<std::int32_t> first = first_at_same_place(points);
    const double width = distance > 0 ? 4 * distance : 1;
    const auto hash = [](const std::array<double, 3>& cube) {
        std::uint64_t h = 0;
        for (const double c : cube) // a collision costs time only: distances are measured
            h = std::rotl(h ^ std::bit_cast<std::uint64_t>(c + 0.0), 29) * 0x9e3779b97f4a7c15ULL;
        return h ^ (h >> 32);
    };
    using Entry = std::pair<std::uint64_t, std::int32_t>; // hash of the cube, vertex
    std::vector<Entry> cubes;
    cubes.reserve(first.size());
    for (std::size_t i = 0; i < first.size(); ++i) {
        const Vec3& x = points[i];
        if (first[i] == static_cast<std::int32_t>(i))
            cubes.emplace_back(hash({std::floor(x[0] / width), std::floor(x[1] / width),
                                     std::floor(x[2] / width)}),
                               first[i]);
    }
    std::sort(cubes.begin(), cubes.end());

    const auto nearest_before = [&](std::int32_t i, const Vec3& x) -> std::int32_t {
        for (int side = 0; side < 8; ++side) {
            std::array<double, 3> cube{};
            bool needed = true; // the cube beyond a wall, only if that wall is near
            for (int k = 0; k < 3; ++k) {
                const double low = std::floor((x[k] - distance) / width),
                             high = std::floor((x[k] + distance) / width);
                const bool upper = side >> k & 1;
                cube[static_cast<std::size_t>(k)] = upper ? high : low;
                if (upper && high == low) needed = false;
            }
            if (!needed) continue;
            const std::uint64_t h = hash(cube);
            for (auto e = std::lower_bound(cubes.begin(), cubes.end(), Entry(h, -1));
                 e != cubes.end() && e->first == h && e->second < i; ++e)
                if ((points[static_cast<std::size_t>(e->second)] - x).norm() <= distance)
                    return e->second;
        }
        return -1;
    };
    for (std::size_t i = 0; i < first.size(); ++i) {
        const auto index = static_cast<std::int32_t>(i);
        const std::int32_t partner =
            first[i] != index ? first[i] : nearest_before(index, points[i]);
        if (partner >= 0) pairs.push_back({partner, index});
    }
    return pairs;
}

} // namespace amontons
