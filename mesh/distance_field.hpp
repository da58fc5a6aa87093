#pragma once

#include "mesh/wall.hpp"

#include <functional>
#include <vector>

// A signed distance sampled on a grid and made twice differentiable by cubic B-splines.

namespace amontons {

/// Signed distance to a surface [m], > 0 in the free space, defined everywhere.
/// `near` is the caller's memory between neighbouring points, to be fast; it starts at -1 and
/// must not change the value.
using SignedDistance = std::function<double(const Vec3& x, std::int32_t& near)>;

/// Uniform tensor-product cubic B-splines that interpolate a signed distance on a grid, to
/// fourth order. Blocks of the grid are filled when a query first touches them; a value never
/// depends on the order of the queries.
///
/// `distance` is the spline itself (not divided by the size of its gradient), so that its
/// level sets are exactly orthogonal to `normal`.
/// Memory: about 11 kB for each block of 8^3 cells touched.
class DistanceField {
public:
    /// @param source   true distance, called at grid points only
    /// @param origin   a grid point [m]
    /// @param spacing  of the grid [m], > 0
    DistanceField(SignedDistance source, const Vec3& origin, double spacing);
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

    SignedDistance source_;
    Vec3 origin_;
    double spacing_;
    std::unique_ptr<Cache> cache_;
};

} // namespace amontons
