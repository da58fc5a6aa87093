#pragma once

#include "mesh/volume_mesh.hpp"

namespace amontons {

/// Measures of the shape of one element. Angles and lengths are those of its corners.
struct ElementQuality {
    double volume = 0;            ///< integral of det J, exact [m^3]
    double least_jacobian = 0;    ///< det J at corners and integration points, the least [m^3]
    double greatest_jacobian = 0; ///< and the greatest [m^3]; T4: 6 volumes
    /// 1 for the best shape, 0 for none: of a T4 or T10 the mean ratio of its corners,
    /// 12 (3 V)^(2/3) / (sum of squared edges), of an H8 the least scaled Jacobian of its corners
    /// (det of the three unit edges). Negative if inverted.
    /// Source: the mean ratio as in J. Burkardt's TET_MESH_QUALITY, measure 3.
    double shape = 0;
    double least_dihedral = 0, greatest_dihedral = 0; ///< between faces [rad]
    double shortest_edge = 0, longest_edge = 0;       ///< [m]

    double
    jacobian_ratio() const ///< least / greatest det J: 1 for a T4 or a parallelepiped (ratio)
    {
        return greatest_jacobian > 0 ? least_jacobian / greatest_jacobian : 0;
    }
    /// Longest edge over shortest height (ratio).
    double aspect() const { return shortest_edge > 0 ? longest_edge / shortest_edge : 0; }
};

/// Quality of one element.
ElementQuality quality_of(const VolumeMesh& mesh, const ElementView& element);

/// Range of a quantity over elements.
struct Spread {
    /// In the unit of the quantity.
    double least = 0, median = 0, greatest = 0;
};

/// The same over a mesh; each Spread has one value of each element.
struct QualityReport {
    double volume = 0;        ///< [m^3]
    Spread element_volume;    ///< [m^3]
    Spread least_dihedral;    ///< [rad]
    Spread greatest_dihedral; ///< [rad]
    Spread jacobian_ratio;    ///< [-]
    Spread shape;             ///< [-]
    Spread aspect;            ///< longest edge / shortest edge [-]
    Spread longest_edge;      ///< [m]
    Spread shortest_edge;     ///< [m]
};

/// Ranges over all elements.
QualityReport report_of(const std::vector<ElementQuality>& all);

/// @throws std::logic_error  if an element has a node that the mesh has not
std::vector<ElementQuality> measure_quality(const VolumeMesh& mesh);

} // namespace amontons
