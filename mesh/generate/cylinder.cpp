#include "mesh/generate/cylinder.hpp"

#include "mesh/generate/tube.hpp"

#include <Eigen/Geometry>

namespace amontons {

WallModel make_cylinder(const CylinderOptions& options)
{
    Wall wall = make_cylinder_wall(options.point, options.axis, options.radius, options.inside);
    const double length = options.length > 0 ? options.length : 20 * options.radius;
    const Vec3 axis = options.axis.normalized();
    Centreline line{options.point - length / 2 * axis, axis, axis.unitOrthogonal(), options.radius};
    line.append_line(length, options.radius);
    WallModel tube = make_tube({line, 0});
    if (!options.inside)
        for (auto& t : tube.surface.triangles)
            std::swap(t[1], t[2]);
    return {std::move(tube.surface), std::move(wall), {}, {}, tube.deviation};
}

} // namespace amontons
