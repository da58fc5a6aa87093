#pragma once

#include "mesh/wall.hpp"

#include <memory>
#include <vector>

// A signed distance sampled on a grid and made twice differentiable by cubic B-splines.

namespace amontons {

/// A signed distance [m], > 0 in the free space, defined everywhere.
class DistanceSource {
public:
    virtual ~DistanceSource() = default;

    /// The distance at the n^3 points corner + h (i, j, k), k fastest. One call per brick of a
    /// field; must give the same bits each time.
    virtual void sample_cube(const Vec3& corner, double h, int n, double* out) const = 0;
};

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
    DistanceField(std::unique_ptr<DistanceSource> source, const Vec3& origin, double spacing);
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
    std::unique_ptr<Cache> cache_;
};

} // namespace amontons
