#pragma once

#include "contact/surface/facets.hpp"

#include <numbers>

namespace amontons {

/// Normals of a curved surface that is given as faces: each face's unit normal at its nodes, for
/// values in between by its shape functions. Faces around a node share one, the mean of their own
/// weighted with their angles at the node; the normal does not jump where a point slides from one
/// face onto the next, T6 included, whose own normals differ across their sides once they are
/// pressed. Sharp edges part them and stay sharp.
class SmoothNormals {
public:
    static constexpr double kSharp = std::numbers::pi / 6; ///< [rad]

    /// @param places  of all nodes of the mesh, finite [m]
    /// @param sharp   edges with a larger angle between their faces' normals stay sharp [rad]
    /// @param at_rest  where that angle is examined, of all nodes [m]; empty: at `places`
    SmoothNormals(const ExternalSurface& surface, std::span<const Vec3> places,
                  double sharp = kSharp, std::span<const Vec3> at_rest = {});

    /// The unit normal of a face with these values of its shape functions.
    Vec3 normal(std::int32_t face, const PerNode& values) const;

    /// At one of the face's nodes, in its own order.
    const Vec3& corner(std::int32_t face, int k) const
    {
        return normals_[static_cast<std::size_t>(face)][static_cast<std::size_t>(k)];
    }

    /// Whether the face has normals here: not one without area.
    bool has(std::int32_t face) const { return corners_[static_cast<std::size_t>(face)] > 0; }

private:
    std::vector<std::uint8_t> corners_; ///< of each face, 0: none
    std::vector<std::array<Vec3, 6>> normals_;
};

} // namespace amontons
