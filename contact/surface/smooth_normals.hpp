#pragma once

#include "contact/surface/facets.hpp"

#include <numbers>
#include <optional>

namespace amontons {

/// Which faces share a normal at the nodes of a surface: those that smooth edges around the node
/// connect. Made once, of the surface at rest: an edge does not become sharp by deformation.
class SmoothGroups {
public:
    static constexpr double kSharp = std::numbers::pi / 6; ///< [rad]

    /// A corner of a face, or a middle node of a T6.
    struct Member {
        std::int32_t face = 0, node = 0; ///< the node in the face's own order
    };

    SmoothGroups() = default;
    /// @param places  of all nodes of the mesh, finite [m]
    /// @param sharp   edges with a larger angle between their faces' normals stay sharp [rad]
    SmoothGroups(const ExternalSurface& surface, std::span<const Vec3> places,
                 double sharp = kSharp);

    /// The group of a face at one of its nodes.
    std::size_t group(const ExternalSurface& surface, std::int32_t face, std::size_t node) const
    {
        return group_[static_cast<std::size_t>(surface.starts[std::size_t(face)]) + node];
    }
    /// Number of groups.
    std::size_t groups() const { return begin_.size() - 1; }
    /// The members of a group, by their faces.
    std::span<const Member> members(std::size_t group) const
    {
        return std::span(members_).subspan(begin_[group], begin_[group + 1] - begin_[group]);
    }

private:
    std::vector<std::size_t> group_; // of each node of each face
    std::vector<std::size_t> begin_{0};
    std::vector<Member> members_;
};

/// Normals of a curved surface that is given as faces: each face's unit normal at its nodes, for
/// values in between by its shape functions. Faces around a node share one, the mean of their own
/// weighted with their angles at the node; the normal does not jump where a point slides from one
/// face onto the next, T6 included, whose own normals differ across their sides once they are
/// pressed. Sharp edges part them and stay sharp.
class SmoothNormals {
public:
    static constexpr double kSharp = SmoothGroups::kSharp; ///< [rad]

    /// @param places  of all nodes of the mesh, finite [m]
    /// @param sharp   edges with a larger angle between their faces' normals stay sharp [rad]
    /// @param at_rest  where that angle is examined, of all nodes [m]; empty: at `places`
    SmoothNormals(const ExternalSurface& surface, std::span<const Vec3> places,
                  double sharp = kSharp, std::span<const Vec3> at_rest = {});

    /// The unit normal of a face with these values of its shape functions.
    Vec3 normal(std::int32_t face, const PerNode& values) const;

    /// The unit normal at node k of a face, in the face's own order.
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

/// The same of a surface that bends, of those faces alone that are requested.
class SmoothNormalsOnDemand {
public:
    /// @param surface, places, groups  outlive it
    SmoothNormalsOnDemand(const ExternalSurface& surface, std::span<const Vec3> places,
                          const SmoothGroups& groups);

    /// The unit normal of a face with these values of its shape functions; nothing where the face
    /// has none.
    std::optional<Vec3> normal(std::int32_t face, const PerNode& values);

private:
    bool has_(std::int32_t face) const;
    const Vec3& of_group_(std::size_t group);

    const ExternalSurface& surface_;
    std::span<const Vec3> places_;
    const SmoothGroups& groups_;
    std::vector<std::uint8_t> known_; // of each group
    std::vector<Vec3> normal_;
};

} // namespace amontons
