#pragma once

#include "mesh/extract_surface.hpp"
#include "mesh/volume_mesh.hpp"

#include <span>

// The part of a solid's surface that a joint acts on, and how it moves. Derivation:
// docs/theory/joints.md.

namespace amontons {

/// A node of a patch and its weights.
struct PatchNode {
    /// Number of the node.
    std::int32_t node = 0;
    double weight = 0;       ///< mean of its shape function over the patch [-]
    Vec3 arm = Vec3::Zero(); ///< mean of its shape function times (X - centre) [m]
};

/// Faces on which a joint acts: docs/theory/joints.md.
struct Patch {
    std::vector<PatchNode> nodes; ///< ascending; the weights sum to 1, the arms to 0
    Vec3 centre = Vec3::Zero();   ///< mean place, at rest [m]
    double area = 0;              ///< [m^2]
};

/// The whole of some faces of a mesh.
Patch patch_of_faces(const VolumeMesh& mesh, std::span<const FaceRef> faces);

/// The part of the surface that lies within a radius of a point and is connected with the place
/// nearest to it. Faces cut by the ball count with their share inside.
/// @param at  at rest [m]
/// @return    area 0 if the surface is farther away than the radius
Patch patch_within(const VolumeMesh& mesh, const ExternalSurface& outside, const Vec3& at,
                   double radius);

/// Distance of a point from faces, by the flat triangles of their corners [m].
double distance_to_faces(const VolumeMesh& mesh, std::span<const FaceRef> faces, const Vec3& at);

/// Pose of a patch: its mean place and the rotation R that is work-conjugate to the moment of the
/// traction a + b x R (X - centre): sum R arm x (x - centre) = 0.
struct PatchPose {
    const Patch* patch = nullptr;
    Mat3 turn = Mat3::Identity(); ///< R; between two poses their mean
    Vec3 centre = Vec3::Zero();   ///< mean place [m]
    Mat3 moment = Mat3::Zero();   ///< sum of place arm^T [m^2]
    Mat3 gain = Mat3::Zero();     ///< turn by sum of (turn arm) x motion [1/m^2]
};

/// @param places  of all nodes of the mesh [m]
PatchPose patch_pose(const Patch& patch, std::span<const Vec3> places);

/// The pose between two, for which the mean shift and turn of the nodes' motion from one to the
/// other are exactly the difference of the poses (a discrete gradient).
PatchPose pose_between(const PatchPose& start, const PatchPose& end);

/// Motion of a patch, work-conjugate to the force and the moment at its centre.
struct PatchMotion {
    /// Shift [m] and rotation vector [rad]; or their rates [m/s], [rad/s].
    Vec3 shift = Vec3::Zero(), turn = Vec3::Zero();
};
/// Motion of a patch that follows from those of its nodes.
/// @param motion  motion(node): displacement or velocity of a node, a Vec3 [m] or [m/s]
template <class Motion> PatchMotion patch_motion(const PatchPose& pose, Motion motion)
{
    PatchMotion m;
    for (const PatchNode& n : pose.patch->nodes) {
        const Vec3 d = motion(n.node);
        m.shift += n.weight * d;
        m.turn += Vec3(pose.turn * n.arm).cross(d);
    }
    m.turn = pose.gain * m.turn;
    return m;
}

/// Calls act(node, force) with the nodes' shares of a force and a moment at the centre.
template <class Act>
void spread_on_patch(const PatchPose& pose, const Vec3& force, const Vec3& moment, Act act)
{
    const Vec3 b = pose.gain.transpose() * moment;
    for (const PatchNode& n : pose.patch->nodes)
        act(n.node, Vec3(n.weight * force + b.cross(Vec3(pose.turn * n.arm))));
}

} // namespace amontons
