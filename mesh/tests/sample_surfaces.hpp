#pragma once

#include "mesh/base/error.hpp"
#include "mesh/surface_mesh.hpp"

#include <cmath>
#include <filesystem>
#include <string>

// Small surfaces whose every property is known, for tests.

namespace amontons {

/// The unit cube [0, 1]^3, normals outwards: 8 vertices, 12 triangles, in the order in which
/// their corners first appear.
inline SurfaceMesh unit_cube()
{
    SurfaceMesh cube;
    for (const auto& [x, y, z] : {std::array{0, 0, 0},
                                  {0, 1, 0},
                                  {1, 1, 0},
                                  {1, 0, 0}, //
                                  {0, 0, 1},
                                  {1, 0, 1},
                                  {1, 1, 1},
                                  {0, 1, 1}})
        cube.points.emplace_back(x, y, z);
    cube.triangles = {{0, 1, 2}, {0, 2, 3}, {4, 5, 6}, {4, 6, 7}, {0, 3, 5}, {0, 5, 4},
                      {3, 2, 6}, {3, 6, 5}, {2, 1, 7}, {2, 7, 6}, {1, 0, 4}, {1, 4, 7}};
    return cube;
}

/// A tube of radius 1 around the z-axis, open at both ends, normals outwards.
inline SurfaceMesh open_tube(int around, int along, double length)
{
    SurfaceMesh tube;
    for (int i = 0; i <= along; ++i)
        for (int j = 0; j < around; ++j) {
            const double angle = 2 * 3.14159265358979323846 * j / around;
            tube.points.emplace_back(std::cos(angle), std::sin(angle), length * i / along);
        }
    for (int i = 0; i < along; ++i)
        for (int j = 0; j < around; ++j) {
            const int a = i * around + j, b = i * around + (j + 1) % around;
            tube.triangles.push_back({a, b, b + around});
            tube.triangles.push_back({a, b + around, a + around});
        }
    return tube;
}

inline SurfaceMesh moved(SurfaceMesh mesh, double factor, const Vec3& by)
{
    for (Vec3& x : mesh.points)
        x = factor * x + by;
    return mesh;
}

/// Both surfaces in one, without any connection.
inline SurfaceMesh together(SurfaceMesh a, const SurfaceMesh& b)
{
    const auto n = static_cast<std::int32_t>(a.points.size());
    a.points.insert(a.points.end(), b.points.begin(), b.points.end());
    for (const auto& [i, j, k] : b.triangles)
        a.triangles.push_back({i + n, j + n, k + n});
    return a;
}

/// What the user is reported when f refuses its input; "" if it does not.
template <class F> std::string refusal(F f)
{
    try {
        f();
    } catch (const InputError& e) {
        return e.what();
    }
    return "";
}

/// A patient's vessels, which may lie beside the sources.
inline std::filesystem::path vessel_data()
{
    return std::filesystem::path(AMONTONS_SOURCE_DIR) / "../shared/data/vessels";
}

} // namespace amontons
