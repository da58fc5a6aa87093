#pragma once

#include "mesh/generate/solid_box.hpp"
#include "mesh/generate/solid_round.hpp"
#include "mesh/generate/solid_tube.hpp"

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

// Small solids whose every property is known, for tests.

namespace amontons {

constexpr ElementKind kAllKinds[] = {ElementKind::T4, ElementKind::T10, ElementKind::H8};

struct SampleVolume {
    std::string name;
    VolumeMesh mesh;
    double volume = 0; ///< of the true shape [m^3]
};

inline VolumeMesh sample_box(ElementKind kind)
{
    SolidBoxOptions box;
    box.lowest = {-1, 2, 0.5};
    box.highest = {1, 3, 2};
    box.cells = {3, 2, 4};
    box.grading = {1, 3, 0.25};
    box.kind = kind;
    return make_solid_box(box);
}

inline VolumeMesh sample_tube(ElementKind kind, std::int32_t fine = 1)
{
    Centreline line{{0.1, 0.2, 0.3}, {1, 1, 0}, {0, 0, 1}, 0.02};
    line.append_arc(0.1, 1.5, 0.3, 0.02);
    return make_solid_tube({line, 0.005, 8 * fine, 2, 5 * fine, kind});
}

/// A box, a ball, a cylinder and a bent tube of each kind.
inline std::vector<SampleVolume> sample_volumes()
{
    constexpr double pi = 3.14159265358979323846;
    std::vector<SampleVolume> all;
    for (const ElementKind kind : kAllKinds) {
        const std::string name = shape_of(kind).name;
        all.push_back({name + " box", sample_box(kind), 3});
        all.push_back({name + " ball", make_solid_ball({{1, 2, 3}, 0.5, 6, kind}), pi / 6});
        all.push_back({name + " cylinder",
                       make_solid_cylinder({{1, 0, 0}, {1, 2, 2}, 0.25, 2, 6, 5, kind}), pi / 8});
        // Pappus: the centroid of each half of the section runs along the arc
        all.push_back(
            {name + " tube", sample_tube(kind), pi * (0.025 * 0.025 - 0.02 * 0.02) * 0.1 * 1.5});
    }
    return all;
}

/// Meshes made by others, with published results, which may lie beside the sources.
inline std::vector<std::filesystem::path> peer_meshes()
{
    const auto folder = std::filesystem::path(AMONTONS_SOURCE_DIR) / "../shared/data/fe/meshes";
    std::vector<std::filesystem::path> all;
    std::error_code none;
    for (const auto& entry : std::filesystem::directory_iterator(folder, none))
        if (entry.path().extension() == ".msh") all.push_back(entry.path());
    std::sort(all.begin(), all.end());
    return all;
}

} // namespace amontons
