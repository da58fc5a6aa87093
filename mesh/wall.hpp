#pragma once

#include "mesh/base/late.hpp"
#include "mesh/surface_mesh.hpp"

#include <memory>
#include <string>
#include <vector>

// A wall is the boundary of a region of free space, given as a twice differentiable signed
// distance; wires, rods and bodies touch it. Contact needs its value (gap), gradient (normal)
// and Hessian (curvature of the wall) at points near the wall, and its sign everywhere.

namespace amontons {

/// The signed distance to a wall near one point.
struct WallSample {
    double distance = 0;         ///< > 0 in the free space [m]
    Vec3 normal = Vec3::Zero();  ///< unit gradient of the distance, into the free space
    Mat3 hessian = Mat3::Zero(); ///< second derivative of the distance [1/m]
    /// Length of the gradient: 1 where the distance is exact; a sampled one is less steep at
    /// creases, and up to 1.5 beside them. (ratio)
    double slope = 1;
};

/// Lipschitz constant of a wall's distance (ratio): 1 where it is exact; a sampled one overshoots
/// beside creases (a patient's coarse aorta: 1.17 in one of 1000 places).
constexpr double kSteepestWall = 1.25;

/// Result of a search from one query to the next, which only makes the next one faster; start with
/// {}. Two calls with the same x give the same bits for any hint.
struct WallHint {
    /// Where the last call found the nearest point: a guess for the next one.
    std::int32_t piece = -1;
    std::int32_t far = -1; ///< of clearance()
};

/// A region of free space with a wall around it. Cheap to move, not copyable.
/// Not safe for use by several threads at once (it fills a cache): each takes a share().
class Wall {
public:
    struct Geometry; ///< swept tube or sampled surface; defined in wall.cpp
    explicit Wall(std::unique_ptr<Geometry> geometry);
    Wall(Wall&&) noexcept;
    Wall& operator=(Wall&&) noexcept;
    ~Wall();

    /// The same wall for use by another thread; samples are shared, and taken once.
    Wall share() const;

    /// Signed distance, unit normal and Hessian at x; continuous normal everywhere within
    /// the wall's smallest radius of curvature.
    WallSample sample(const Vec3& x, WallHint& hint) const;

    /// The signed distance alone [m].
    double distance(const Vec3& x, WallHint& hint) const;

    /// A lower bound of `distance` that costs less [m]: of a sampled wall without sampling, where x
    /// is far from it; of a tube from the piece of the hint. -infinity where there is none.
    double clearance(const Vec3& x, WallHint& hint) const;

    /// Sets how a sampled wall is sampled.
    /// @param cache    folder in which earlier runs have stored samples, which are read; "": none
    /// @param threads  number that take samples (the same bits for any number); with more than one,
    ///                 samples are also taken ahead of points that move
    void prepare(const std::string& cache, int threads);
    /// Stores the samples in the folder given to prepare(). A wall in closed form has none.
    /// @return  a line for each file that was read, written, ignored or could not be written, with
    ///          the reason
    std::vector<std::string> keep() const;

private:
    std::unique_ptr<Geometry> geometry_;
};

class SweptTube;
class DistanceField;

/// The wall of a swept tube: free inside, closed form.
Wall make_wall(SweptTube tube);

/// The wall given by a sampled distance.
Wall make_wall(DistanceField field);

/// Walls in closed form. `inside`: the free space is inside the ball or the infinite cylinder,
/// else around it; above a plane it is where its normal points.
/// @param radius  [m], > 0
/// @param axis, normal  any length > 0
/// @throws InputError  if a number is not finite, a radius not positive or a direction zero
Wall make_ball_wall(const Vec3& centre, double radius, bool inside);
/// An infinite cylinder around the axis through `point` [m]. @throws InputError  as above
Wall make_cylinder_wall(const Vec3& point, const Vec3& axis, double radius, bool inside);
/// A plane through `point` [m]; the free space is where its normal points. @throws InputError  as
/// above
Wall make_plane_wall(const Vec3& point, const Vec3& normal);

/// A way out of the free space: a disc across a vessel.
struct Opening {
    std::string name;
    Vec3 centre = Vec3::Zero();   ///< [m]
    Vec3 outward = Vec3::UnitX(); ///< unit, out of the free space
    double radius = 0;            ///< [m]
};

/// A named side vessel: points of the free space nearer to its centreline than to any other.
struct Branch {
    std::string name;
    /// From the take-off at the parent's wall to its end [m]; of a ball its middle; of a box two
    /// corners.
    std::vector<Vec3> centreline;
    std::vector<double> radius; ///< at each point of the centreline [m]
    enum Kind {
        side_vessel,
        line, ///< given; it may begin in a trunk shared with others, which belongs to none of them
        ball,
        box
    } kind = side_vessel;
};

/// The number of triangles of a surface; the surface is made where the number is used.
inline Late<std::size_t> triangles_in(Late<SurfaceMesh> surface)
{
    return Late<std::size_t>{[surface = std::move(surface)] { return surface->triangles.size(); }};
}

/// The geometry of an obstacle.
struct WallModel {
    Late<SurfaceMesh> surface;     ///< for pictures, files and passage tests
    Wall wall;                     ///< for contact
    std::vector<Opening> openings; ///< inlet first where there is one
    std::vector<Branch> branches;
    Late<double> deviation; ///< largest distance between `surface` and the wall's zero set [m]
    /// Number of triangles of `surface`, where possible without making it.
    Late<std::size_t> triangle_count = triangles_in(surface);

    /// As Wall::share.
    WallModel share() const
    {
        return {surface, wall.share(), openings, branches, deviation, triangle_count};
    }
};

/// The branch that holds x, in model.branches; -1 in the main vessel or in none. A branch continues
/// straight beyond its open end.
int branch_number_at(const WallModel& model, const Vec3& x);
/// Its name, or "".
std::string branch_at(const WallModel& model, const Vec3& x);

/// The opening through whose disc the segment from -> to leaves the free space, the first on
/// the way; nullptr if none. A step that ends on the disc has not left.
const Opening* opening_passed(const WallModel& model, const Vec3& from, const Vec3& to);

} // namespace amontons
