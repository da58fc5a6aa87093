#pragma once

#include "mesh/base/error.hpp"
#include "mesh/extract_surface.hpp"
#include "mesh/quality.hpp"
#include "mesh/size_check.hpp"

namespace amontons {

/// What counts as a fault.
struct VolumeCheckOptions {
    double sliver = 0.05;               ///< ElementQuality::shape below it is reported [-]
    double largest_size = kLargestSize; ///< [m]
};

/// Properties and possible defects of a mesh of solids. Lists are ascending; numbers count from 0.
struct VolumeReport {
    /// Number of nodes.
    std::int64_t nodes = 0;
    /// Elements of each kind.
    std::array<std::int64_t, kElementKinds> elements{};
    Vec3 lowest = Vec3::Zero(), highest = Vec3::Zero(); ///< box of the nodes in use [m]
    VolumeCheckOptions options;

    std::vector<std::int32_t> not_finite;   ///< nodes
    std::vector<std::int32_t> unreferenced; ///< nodes of no element
    /// Nodes at the same place as one before, or nearer than 1e-9 of the box's diagonal.
    std::vector<std::array<std::int32_t, 2>> coincident;
    std::vector<std::int32_t> collapsed; ///< elements with a node twice
    /// Elements with det J <= 1e-12 (longest edge)^3 at a corner or integration point.
    std::vector<std::int32_t> inverted;
    std::vector<std::int32_t> slivers;               ///< elements, not inverted
    std::vector<std::vector<FaceRef>> crowded_faces; ///< faces of more than two elements
    std::vector<std::vector<FaceRef>> one_sided;     ///< faces whose two elements overlap
    std::vector<CrowdedEdge> crowded_edges;          ///< of the surface; see SurfaceEdges
    /// Nodes of elements that share no other node there: a joint, not a solid.
    std::vector<std::int32_t> pinched;
    std::vector<std::string> empty_sets;    ///< "face set \"top\""
    std::vector<std::string> nameless_sets; ///< "node set 2"

    /// Ranges of the quality.
    QualityReport quality;
    std::vector<ElementQuality> element_quality;
    ExternalSurface surface;
    SurfaceIntegrals integrals;
    /// Of the external surface.
    std::int64_t surface_edges = 0, surface_borders = 0, euler_characteristic = 0;
    /// Connected parts of the surface.
    int surface_parts = 0;

    bool touches_itself() const; ///< crowded edges or pinched nodes
    /// True if the mesh is so large that it is likely in millimetres.
    bool resembles_millimetres() const;
};

/// Determines everything in VolumeReport. O(n log n).
/// @param mesh  indices within its nodes (else std::logic_error)
VolumeReport check_volume(const VolumeMesh& mesh, const VolumeCheckOptions& options = {});

/// Faults with which no solver can work: nodes that are not finite, collapsed, inverted and
/// overlapping elements, edges and nodes where the surface touches itself, and then the nodes at
/// one place that may be the reason. The first of each kind are named with the file's numbers and
/// coordinates; the rest is counted.
std::vector<Issue> errors_of(const VolumeReport& report, const VolumeMesh& mesh,
                             const std::string& file);

/// What may be intended: unreferenced or coincident nodes, slivers, empty sets, a size in
/// millimetres. Coincident nodes are left out where errors_of() names them.
std::vector<Issue> warnings_of(const VolumeReport& report, const VolumeMesh& mesh,
                               const std::string& file);

} // namespace amontons
