#pragma once

#include "mesh/bounding_tree.hpp"
#include "mesh/winding_number.hpp"

#include <memory>

// What a surface encloses, without what is thinner or narrower than a width: a solid that can be
// meshed where the surface passes through itself or folds back like a knife.

namespace amontons {

/// The inside of a surface as the places where a smooth function is negative.
///
/// The signed distance is sampled on a grid with the width as spacing and taken as the coefficients
/// of uniform cubic B-splines: twice differentiable, and the distance itself beside a plane. Walls,
/// flaps and gaps thinner than about 0.9 widths vanish, edges are rounded (a right angle loses
/// about 0.3 widths), a tube of radius R shrinks by width^2 / (6 R). Inside is where the surface
/// winds around once or more: parts that overlap are one.
class RoundedSolid {
public:
    /// @param surface  closed; copied
    /// @param width    > 0 [m]
    RoundedSolid(const SurfaceMesh& surface, double width);
    ~RoundedSolid();

    /// Value and gradient at a place.
    struct Sample {
        double value = 0; ///< < 0 inside; beside smooth parts the signed distance [m]
        /// Of the value, by place.
        Vec3 gradient = Vec3::Zero();
    };

    /// Value and gradient at x [m]. Farther than about 7 widths from the surface the value is about
    /// that distance, and the gradient zero. The grid is sampled where a query first needs it.
    Sample at(const Vec3& x) const;

    /// Moves x to the surface (value 0) by Newton's method.
    /// @returns false if none is found within two widths
    bool project(Vec3& x) const;

    double width() const { return width_; }

private:
    struct Grid;

    BoundingTree tree_;
    WindingNumber winding_;
    Vec3 origin_ = Vec3::Zero();
    double width_;
    std::unique_ptr<Grid> grid_;
};

} // namespace amontons
