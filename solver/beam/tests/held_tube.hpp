#pragma once

#include "solver/beam/soft_tube.hpp"

namespace amontons {

/// Of the tubes of these tests, inside [m].
inline constexpr double kTubeRadius = 0.01;

inline SoftTubeSupport held_ends(const VolumeMesh& mesh)
{
    SoftTubeSupport support;
    for (const char* end : {"start", "end"})
        for (const std::int32_t n : nodes_of(mesh, *find_set(mesh.face_sets, end)))
            for (int a = 0; a < 3; ++a)
                support.fixed.push_back(3 * n + a);
    return support;
}

/// A tube with both ends held and a pressure inside [Pa].
inline SoftTube held_tube(const SolidTubeOptions& o, const SolidMaterial& material, double pressure)
{
    VolumeMesh mesh = make_solid_tube(o);
    SoftTubeSupport support = held_ends(mesh);
    if (pressure != 0) {
        support.load = Eigen::VectorXd::Zero(3 * Eigen::Index(mesh.nodes.size()));
        add_pressure(mesh, find_set(mesh.face_sets, "inner")->members, pressure, support.load);
    }
    return SoftTube(o, std::move(mesh), material, support);
}

} // namespace amontons
