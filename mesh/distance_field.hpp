#pragma once

#include "mesh/wall.hpp"

#include <memory>
#include <span>
#include <vector>

// A signed distance sampled on a grid and made twice differentiable by cubic B-splines.

namespace amontons {

/// A signed distance [m], > 0 in the free space, defined everywhere.
class DistanceSource {
public:
    virtual ~DistanceSource() = default;

    /// The distance at the n^3 points corner + edges (i, j, k), k fastest. One call per brick of a
    /// field; must give the same bits each time.
    /// @param edges  columns: the steps of the grid, orthogonal and of one length [m]
    virtual void sample_cube(const Vec3& corner, const Mat3& edges, int n, double* out) const = 0;
};

/// Directions that turn with points: towards the one farthest from their mean, across it to the
/// one farthest from that line, and a third; any across the line where all are on it [-].
/// @return  columns, a right-handed orthonormal frame; of points within 1e-9 of each other in
///          distance the first counts
Mat3 axes_of(std::span<const Vec3> points);

/// Uniform tensor-product cubic B-splines that interpolate a signed distance on a grid, to
/// fourth order. Blocks of the grid are filled when a query first touches them; a value never
/// depends on the order of the queries.
///
/// `distance` is the spline itself (not divided by the size of its gradient), so that its
/// level sets are exactly orthogonal to `normal`.
/// Memory: 11 kB for each block of 8^3 cells touched, and 0.6 kB for each 4^3 samples in or
/// around them.
class DistanceField {
public:
    /// @param source   true distance, not null
    /// @param origin   a grid point [m]
    /// @param spacing  of the grid [m], > 0
    /// @param axes     columns: unit directions of the grid. They should stand by what is sampled:
    ///                 then a scene that is turned is sampled at the same places.
    DistanceField(std::unique_ptr<DistanceSource> source, const Vec3& origin, double spacing,
                  const Mat3& axes = Mat3::Identity());
    DistanceField(DistanceField&&) noexcept;
    DistanceField& operator=(DistanceField&&) noexcept;
    ~DistanceField();

    WallSample sample(const Vec3& x, WallHint& hint) const;
    double distance(const Vec3& x, WallHint& hint) const;

    double spacing() const { return spacing_; } ///< [m]
    std::size_t block_count() const;            ///< filled so far
    std::size_t memory() const;                 ///< of blocks and samples [bytes]

private:
    struct Cache;
    const double* cell_(const Vec3& x, WallHint& hint, Vec3& fraction) const;

    std::unique_ptr<DistanceSource> source_;
    Vec3 origin_;
    double spacing_;
    Mat3 axes_;
    std::unique_ptr<Cache> cache_;
};

} // namespace amontons
