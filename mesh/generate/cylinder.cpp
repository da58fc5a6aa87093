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
    const WallModel tube = make_tube({line, 0});
    const Late<SurfaceMesh> outside{[inside = tube.surface] {
        SurfaceMesh turned = *inside;
        for (auto& t : turned.triangles)
            std::swap(t[1], t[2]);
        return turned;
    }};
    return {options.inside ? tube.surface : outside, std::move(wall), {}, {}, tube.deviation};
}

} // namespace amontons
