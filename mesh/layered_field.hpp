#pragma once

#include "mesh/distance_field.hpp"

#include <string>
#include <vector>

// A sampled distance whose grid is finer where the wall is narrower.

namespace amontons {

/// Around a straight half line a number that is 1, away from it 0, and between them twice
/// differentiable.
struct FieldWindow {
    Vec3 start = Vec3::Zero();  ///< [m]
    Vec3 along = Vec3::UnitZ(); ///< unit
    double from = 0;            ///< 1 from there on, along the line [m]
    double rise = 0;            ///< grows from 0 on this way before it [m], > 0
    double radius = 0;          ///< 1 as far as that from the line [m], > 0
    double fall = 0;            ///< and 0 from that much farther on [m], > 0

    /// With its derivatives.
    FieldSample at(const Vec3& x) const;
    /// Without derivatives; between 0 and 1 (ratio).
    double value(const Vec3& x) const;
};

/// A sampled distance: in windows that of finer grids, between a window and what is outside both,
/// each with its part. Where all are the same distance to within their errors, so is this.
class LayeredField {
public:
    /// A finer grid and where it is used.
    struct Layer {
        DistanceField field;
        FieldWindow window;
    };
    /// @param finer  each is used in its window instead of those before it
    LayeredField(DistanceField everywhere, std::vector<Layer> finer);

    /// As DistanceField's, of all that is used at x.
    LayeredField share() const;
    WallSample sample(const Vec3& x, WallHint& hint) const; ///< as DistanceField's
    double distance(const Vec3& x, WallHint& hint) const;   ///< [m]
    double clearance(const Vec3& x, WallHint& hint) const;  ///< [m]
    void prepare(const std::string& cache, int threads);    ///< as DistanceField's
    std::vector<std::string> keep() const;                  ///< as DistanceField's
    std::size_t memory() const;                             ///< of all grids [bytes]

private:
    std::size_t whole_(const Vec3& x) const;
    const DistanceField& field_(std::size_t k) const { return k == 0 ? all_ : finer_[k - 1].field; }

    DistanceField all_;
    std::vector<Layer> finer_;
};

/// The wall given by such a distance.
Wall make_wall(LayeredField field);

} // namespace amontons
