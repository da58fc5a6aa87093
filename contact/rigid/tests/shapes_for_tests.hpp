#pragma once

#include "contact/rigid/shape.hpp"

#include <random>

// Poses and bodies that several tests use.

namespace amontons {

inline Vec3 random_vector(std::mt19937& rng, double size = 1)
{
    std::normal_distribution<double> normal;
    const double x = normal(rng), y = normal(rng), z = normal(rng);
    return size * Vec3{x, y, z};
}

inline Eigen::Quaterniond random_turn(std::mt19937& rng)
{
    std::normal_distribution<double> normal;
    const double w = normal(rng), x = normal(rng), y = normal(rng), z = normal(rng);
    return Eigen::Quaterniond(w, x, y, z).normalized();
}

inline Pose random_pose(std::mt19937& rng, double size = 1)
{
    const Vec3 place = random_vector(rng, size);
    return {place, random_turn(rng)};
}

inline Eigen::Quaterniond turn_about(const Vec3& axis, double angle)
{
    return Eigen::Quaterniond(Eigen::AngleAxisd(angle, axis.normalized()));
}

inline Pose moved(const Pose& by, const Pose& pose)
{
    return {by.place + by.turn * pose.place, (by.turn * pose.turn).normalized()};
}

/// A hexahedron from eight corners in the order of Box (x fastest), each face cut into
/// 2 n^2 triangles.
inline SurfaceMesh hexahedron(const std::array<Vec3, 8>& corner, int n = 1)
{
    // Corners of the faces, counter-clockwise seen from outside.
    constexpr int face[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                                {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
    SurfaceMesh mesh;
    const auto point = [&](const Vec3& x) {
        for (std::size_t i = 0; i < mesh.points.size(); ++i)
            if ((mesh.points[i] - x).norm() < 1e-12) return static_cast<std::int32_t>(i);
        mesh.points.push_back(x);
        return static_cast<std::int32_t>(mesh.points.size() - 1);
    };
    for (const auto& f : face) {
        const auto at = [&](int i, int j) {
            const double s = static_cast<double>(i) / n, t = static_cast<double>(j) / n;
            const auto c = [&](int k) { return corner[static_cast<std::size_t>(f[k])]; };
            return point((1 - s) * (1 - t) * c(0) + s * (1 - t) * c(1) + s * t * c(2) +
                         (1 - s) * t * c(3));
        };
        for (int i = 0; i < n; ++i)
            for (int j = 0; j < n; ++j) {
                mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
                mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
            }
    }
    return mesh;
}

inline std::array<Vec3, 8> box_corners(const Vec3& half)
{
    std::array<Vec3, 8> corner;
    for (int v = 0; v < 8; ++v)
        for (int k = 0; k < 3; ++k)
            corner[static_cast<std::size_t>(v)][k] = (v >> k & 1) != 0 ? half[k] : -half[k];
    return corner;
}

inline TriangleShape triangle_box(const Vec3& half, int n = 1)
{
    return make_triangle_shape(hexahedron(box_corners(half), n));
}

/// An L of thickness 1 along y: the square 0..2 in x and z without its upper right quarter.
inline TriangleShape triangle_l()
{
    SurfaceMesh mesh;
    const double outline[6][2] = {{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 2}};
    for (int y = 0; y < 2; ++y)
        for (const auto& p : outline)
            mesh.points.emplace_back(p[0], y, p[1]);
    constexpr int cut[4][3] = {{0, 1, 3}, {1, 2, 3}, {0, 3, 5}, {3, 4, 5}};
    for (const auto& t : cut) {
        mesh.triangles.push_back({t[0], t[1], t[2]});             // y = 0, outwards is -y
        mesh.triangles.push_back({t[0] + 6, t[2] + 6, t[1] + 6}); // y = 1
    }
    for (int i = 0; i < 6; ++i) {
        const int j = (i + 1) % 6;
        mesh.triangles.push_back({i, i + 6, j});
        mesh.triangles.push_back({j, i + 6, j + 6});
    }
    return make_triangle_shape(mesh);
}

/// A closed prism with n sides, around z.
inline TriangleShape triangle_prism(double radius, double half_length, int n)
{
    SurfaceMesh mesh;
    for (const double z : {-half_length, half_length})
        for (int i = 0; i < n; ++i)
            mesh.points.emplace_back(radius * std::cos(2 * M_PI * i / n),
                                     radius * std::sin(2 * M_PI * i / n), z);
    for (int i = 0; i < n; ++i) {
        const int j = (i + 1) % n;
        mesh.triangles.push_back({i, j, j + n});
        mesh.triangles.push_back({i, j + n, i + n});
        if (i > 0 && i + 1 < n) {
            mesh.triangles.push_back({0, i + 1, i});
            mesh.triangles.push_back({n, n + i, n + i + 1});
        }
    }
    return make_triangle_shape(mesh);
}

} // namespace amontons
