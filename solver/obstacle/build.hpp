#pragma once

#include "mesh/base/error.hpp"
#include "mesh/centreline.hpp"
#include "solver/obstacle/obstacle.hpp"
#include "solver/record/step_record.hpp"
#include "solver/scene/scene.hpp"

#include <optional>
#include <vector>

namespace amontons {

/// Makes the obstacles of a scene: runs generators, reads and checks surface files.
/// @param warnings  gets probable mistakes (a size that suggests millimetres)
/// @throws InputError  with all Issues of all obstacles; a mesh's Issue keeps the mesh's file
std::vector<Obstacle> build_obstacles(const Scene& scene, std::vector<Issue>* warnings = nullptr);

/// A surface from a .vtp file, by the module vtk.
/// @throws InputError  no module, or none that reads the file
SurfaceMesh read_vtp(const std::string& path);

/// Where the free space of an obstacle's surface is, and what it encloses.
struct SurfaceFacts {
    std::string side; ///< "inside" | "outside"; "" of a plane
    std::int64_t triangles = 0, holes = 0;
    std::optional<double> volume; ///< enclosed, its holes closed [m^3]; not of a generated vessel,
                                  ///< whose triangles take longer than all else that is checked
};
/// Size, sides and resolution of an obstacle, for `amontons check`.
SurfaceFacts surface_facts(const ObstacleInput& input, const Obstacle& obstacle);

/// For a message about a body inside an obstacle's wall: "; ..." with the likely remedy, where the
/// free space is outside the surface and could be inside; else "".
std::string side_hint(const Scene& scene, const Obstacle& obstacle);

/// The centreline of a surface: from a file, or of pieces.
/// @throws InputError
Centreline build_centreline(const SurfaceInput& surface, const Scene& scene);

/// The centreline that a beam's depth is measured along, if its introducer stands on one.
struct DepthLine {
    /// Name of the wire.
    std::string beam;
    /// The line along which its depth is measured.
    std::optional<Centreline> line;
    double start = 0; ///< arc length of the introducer's end [m]
    double sign = 1;  ///< -1 if the line runs against the wire (factor)

    /// Distance along the line from the introducer's end to the place nearest to x [m].
    double depth(const Vec3& x) const;
};

/// Gives introducers that stand on a centreline their point and direction.
/// @return  one line per beam
/// @throws InputError  if a centreline cannot be read
std::vector<DepthLine> place_introducers(Scene& scene);

/// Any of the beams has such a line.
bool any_depth_line(const std::vector<DepthLine>& lines);
/// Adds NAME_centreline_depth [m] of each beam that has one.
void add_centreline_depths(StepRecord& record, const std::vector<DepthLine>& lines);

/// Scales points, which were read with the factor scale.x() in all directions, by the factor of
/// each direction.
inline void stretch_axes(std::vector<Vec3>& points, const Vec3& scale)
{
    if (scale == Vec3::Constant(scale.x())) return;
    for (Vec3& p : points)
        p = p.cwiseProduct(scale / scale.x());
}

} // namespace amontons
