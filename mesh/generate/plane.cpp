#include "mesh/generate/plane.hpp"

#include "mesh/base/error.hpp"

#include <Eigen/Geometry>
#include <cmath>

namespace amontons {

WallModel make_plane(const PlaneOptions& options)
{
    Wall wall = make_plane_wall(options.point, options.normal);
    if (!(options.size > 0) || !std::isfinite(options.size))
        throw InputError({Issue{"", "/size", std::to_string(options.size), "> 0 and finite [m]"}});
    const Vec3 normal = options.normal.normalized();
    const Vec3 u = 0.5 * options.size * normal.unitOrthogonal(), v = normal.cross(u);
    SurfaceMesh mesh;
    mesh.points = {options.point - u - v, options.point + u - v, options.point + u + v,
                   options.point - u + v};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    return {std::move(mesh), std::move(wall), {}, {}, 0.0};
}

} // namespace amontons
