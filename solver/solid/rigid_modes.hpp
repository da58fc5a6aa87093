#pragma once

#include "solver/solid/assembly.hpp"

namespace amontons {

/// Motions of a solid without strain that nothing prescribed prevents, and pins that would.
///
/// With the stiffness K, forces f and reactions r of a body that floats,
///
///     u = K_pinned^-1 (f + H^T r) + R alpha,    R^T (f + H^T r) = 0,
///
/// where K_pinned lacks the pins' rows and columns (u is 0 there before R alpha is added). The
/// second line states that the pins carry no force. Derivation: docs/theory/compliance.md.
struct RigidModes {
    /// 3 nodes x modes [-]. Columns are orthogonal, the mean over the body's nodes of |u|^2 is 1
    /// for each; rows of prescribed degrees of freedom and of nodes of no element are 0. A mesh of
    /// several parts that no element connects has up to six modes of each.
    Eigen::MatrixXd R;
    std::vector<std::int32_t> pins; ///< degrees of freedom, as many as modes, ascending
    /// Some part has pins at contact nodes because its other nodes cannot hold it. A contact row
    /// there has W = 0 although the body can move: check H R as well before it is dropped.
    bool pins_at_contacts = false;
};

/// @param places        of all nodes [m]
/// @param pattern       of the mesh: which nodes are in elements, and connected
/// @param prescribed    degrees of freedom, in any order
/// @param contact_node  of each node: not 0 if it may come into contact; empty: none may
/// @throws std::logic_error  if sizes differ
RigidModes find_rigid_modes(std::span<const Vec3> places, const SolidPattern& pattern,
                            std::span<const std::int32_t> prescribed,
                            std::span<const char> contact_node = {});

/// Those combinations of modes on which springs to the surroundings do no work, with their pins.
/// @param springs  stiffness, both triangles, 3 nodes x 3 nodes [N/m]
/// @param modes    at least one
RigidModes not_resisted(const RigidModes& modes, const SparseMatrix& springs,
                        std::span<const char> contact_node);

/// Below, an eigenvalue of the prescribed rows of the six motions, over the largest, is a motion
/// that they do not prevent [-]. It is the square of a lever over the body's size.
constexpr double kRigidThreshold = 1e-10;

} // namespace amontons
