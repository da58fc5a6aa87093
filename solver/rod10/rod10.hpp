#pragma once

#include "mesh/base/types.hpp"
#include "solver/rod10/plain_lu.hpp"

#include <array>
#include <span>
#include <vector>

// The deformable rod for haptics of WSCG 2003, as published: small displacements of a straight rod
// that is clamped at its first node, five degrees of freedom a node (no torsion), one rotation for
// the whole rod. Displacements are along the axes of space, the two turns about the rod's own y and
// z: hence the 1 in the transformation.
// Source: "Simulating Deformable Tools with Haptic Feedback in a Virtual Environment", WSCG 2003
// short papers, tables 1 to 3, equations 1, 4, 8, 9.

namespace amontons {

using Mat10 = Eigen::Matrix<double, 10, 10>;

/// The rod of WSCG 2003: 10 unknowns an element, small displacements.
struct Rod10 {
    double length = 0.45;        ///< [m]
    double diameter = 0.004;     ///< [m]
    double youngs_modulus = 2e7; ///< [Pa]
    int nodes = 10;              ///< evenly along it; >= 2

    /// Of the cross-section [m^2].
    double area() const;
    double inertia() const;                                 ///< of bending [m^4]
    double element() const { return length / (nodes - 1); } ///< [m]
    /// Number of unknowns.
    int unknowns() const { return 5 * (nodes - 1); }
    double bending() const { return youngs_modulus * inertia(); } ///< EI [N m^2]
};

/// @throws InputError  with all that is wrong
void check(const Rod10& rod);

/// Table 1: stiffness of an element, along its own axes. Order: x, y, z, turns about y and z of the
/// first node, then of the second.
Mat10 element_stiffness(const Rod10& rod);
/// Table 2: from space to the rod's axes. @param angles  about x, y, z: turned about x first [rad]
Mat3 rotation_of_angles(const Vec3& angles);
/// Table 2. @param to_rod  rows: the rod's axes in space
Mat10 element_transformation(const Mat3& to_rod);

/// Equations 8 and 9: stored numbers of the matrix.
std::size_t stored_full(int nodes);
/// Numbers that a band of so many nodes stores.
std::size_t stored_band(int nodes);

/// Steps 2 to 6 of the procedure: the matrix of the whole rod without its clamped node.
BandMatrix assemble_band(const Rod10& rod, const Mat3& to_rod);
/// The stiffness matrix as a full matrix, in the frame of the rod.
FullMatrix assemble_full(const Rod10& rod, const Mat3& to_rod);

/// Loads and deflections of a node.
struct Rod10Node {
    Vec3 along = Vec3::Zero();    ///< force [N] or displacement [m], in space
    std::array<double, 2> turn{}; ///< moments [N m] or turns [rad] about the rod's y and z
};

/// The rod with its factor. Steps 2 to 7 may be left out for some frames: then the deflections are
/// those of the last orientation that was factored.
class Rod10Solver {
public:
    /// @param every  frames between two factors; 1: each frame, as it should be
    /// @throws InputError  sizes that no rod has, `every` below 1
    explicit Rod10Solver(const Rod10& rod, int every = 1);

    /// A frame: the rod points where it is reported; steps 2 to 7 if it is time for them.
    /// @param to_rod  rows: the rod's axes in space
    void orient(const Mat3& to_rod);

    /// Step 8. @param loads  of every node; those of the first, clamped one enter the hand
    std::vector<Rod10Node> deflections(std::span<const Rod10Node> loads) const;

    /// A moment in space as a load. The rod has no torsion.
    /// @throws InputError  if the moment turns about the rod's axis
    Rod10Node moment(const Vec3& in_space) const;

    /// |K D - R| / |R| of the last factor's matrix: what round-off has left of the answer's digits.
    double relative_residual(std::span<const Rod10Node> loads,
                             std::span<const Rod10Node> deflections) const;

private:
    Rod10 rod_;
    int every_, frame_ = 0;
    Mat3 now_ = Mat3::Identity(), factored_ = Mat3::Identity();
    BandMatrix matrix_, factor_;
};

} // namespace amontons
