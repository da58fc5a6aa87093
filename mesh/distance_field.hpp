#pragma once

#include "mesh/base/file.hpp"
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
    /// field; must give the same bits each time. Several threads call it at once.
    /// @param edges  columns: the steps of the grid, orthogonal and of one length [m]
    virtual void sample_cube(const Vec3& corner, const Mat3& edges, int n, double* out) const = 0;

    /// A lower bound of the distance at one point [m]; -infinity where a bound takes as long as
    /// samples.
    /// @param near  as an earlier call for a point near x returned it, or -1
    virtual double clearance(const Vec3& x, std::int32_t& near) const;

    /// Fingerprint of all that the samples depend on, except the grid; zero: they are not stored on
    /// disk.
    virtual Hash128 fingerprint() const { return {}; }
};

/// A field and its derivatives at one point.
struct FieldSample {
    double value = 0;             ///< [m]
    Vec3 gradient = Vec3::Zero(); ///< [-]
    Mat3 hessian = Mat3::Zero();  ///< times `unit` [m]
    double unit = 1;              ///< squared, of a length in which the Hessian is counted [m^2]
};

/// The wall where a field has such a value and derivatives.
WallSample wall_sample(const FieldSample& field);

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
/// Memory: 2.8 kB for each block of 4^3 cells touched, and 0.6 kB for each 4^3 samples in or
/// around them; at most 80 MB, beyond which what was filled first is dropped, and filled again when
/// it is evaluated again.
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

    /// Another view of the same field. Blocks filled through one view serve all; each view may be
    /// used by a thread of its own. Values do not depend on which view filled a block.
    DistanceField share() const;

    /// Signed distance, normal and Hessian at x [m].
    WallSample sample(const Vec3& x, WallHint& hint) const;
    /// The spline itself at x, which must be finite.
    FieldSample evaluate(const Vec3& x, WallHint& hint) const;
    /// Signed distance at x [m].
    double distance(const Vec3& x, WallHint& hint) const;

    /// As Wall::clearance [m]; a bound only for x in blocks that are not filled, and only where it
    /// is above zero, else -infinity.
    double clearance(const Vec3& x, WallHint& hint) const;
    /// As Wall::prepare: reads samples from the folder `cache`, if there are any.
    void prepare(const std::string& cache, int threads);
    /// As Wall::keep: writes new samples to the cache. @returns  messages, one a line
    std::vector<std::string> keep() const;

    double spacing() const { return spacing_; } ///< [m]
    std::size_t block_count() const;            ///< filled and kept, of this view
    std::size_t memory() const;                 ///< of blocks and samples [bytes]

private:
    struct Shared;
    struct Cache;
    const double* cell_(const Vec3& x, WallHint& hint, Vec3& fraction) const;
    Hash128 fingerprint_() const;

    DistanceField() = default;

    Vec3 origin_ = Vec3::Zero();
    double spacing_ = 1;
    Mat3 axes_ = Mat3::Identity();
    std::shared_ptr<Shared> shared_; // source, samples and filled blocks of all views, under a lock
    std::unique_ptr<Cache> cache_;   // the blocks that this view has taken
};

} // namespace amontons
