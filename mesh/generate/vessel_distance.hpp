#pragma once

#include "mesh/distance_field.hpp"
#include "mesh/generate/edge_seeds.hpp"
#include "mesh/generate/vessel_shape.hpp"

#include <vector>

namespace amontons {

/// The true signed distance to a vessel's wall: the distance of one tube where no other has a part
/// in it; else the least one of the tubes' nearest points that are on the wall, and of the nearest
/// point where tubes join, by Newton's method on (p - x + mu grad F, F) from the nearest of some
/// points there. (Of a tube whose nearest point is inside another the rest of the wall has its
/// nearest point at the edge of what is left, and so where tubes join.)
class VesselDistance : public DistanceSource {
public:
    /// @param origin  of the points where tubes join [m]
    /// @param edge    about the distance between two of them [m]
    VesselDistance(VesselShape shape, const Vec3& origin, double edge);
    VesselDistance(const VesselDistance&) = delete;
    VesselDistance& operator=(const VesselDistance&) = delete;

    /// Farther from the wall than 12 steps the distance may be too small beside a junction.
    void sample_cube(const Vec3& corner, const Mat3& edges, int n, double* out) const override;

    /// The same at one point, without that exception [m].
    double distance(const Vec3& x) const;

    /// The ball in one tube that is the largest: what joins it only adds free space.
    /// @param near  the tube
    double clearance(const Vec3& x, std::int32_t& near) const override;

private:
    struct Near;
    double distance_(const Vec3& x, double band, Near& near) const;
    double near_junction_(const Vec3& x, double value, Near& near) const;
    bool foot_on_wall_(const Vec3& x, std::size_t i, double f, Near& near) const;
    double value_(const Vec3& x, Near& near) const;
    double slide_(const Vec3& x, Vec3 p) const;
    double from_edge_(const Vec3& x, const Vec3& seed, double squared, Near& near) const;
    void find_feet_(Near& near, double f) const;

    VesselShape shape_;
    EdgeSeeds seeds_; // of shape_
};

} // namespace amontons
