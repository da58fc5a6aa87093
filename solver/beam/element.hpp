#pragma once

#include "mesh/base/types.hpp"
#include "solver/linear/block_tridiagonal.hpp"

#include <array>
#include <memory>
#include <vector>

// The geometrically exact beam element: two nodes, each a position and a rotation; strains
// constant along the element (the logarithm of the relative pose), so that circles and
// helices are exact; a residual bending flexibility added to the shear flexibility makes its
// bending stiffness that of the cubic element (no locking, order 4 for slender beams); its stretch
// is the mean one of the cubic middle line, so that tension stiffens it as it stiffens that line.
// Equations: docs/theory/beams.md.

namespace amontons {

// Of the unknowns of an element's two nodes: places, turns.
using Vec12 = Eigen::Matrix<double, 12, 1>;
using Mat12 = Eigen::Matrix<double, 12, 12>;

/// Position and section rotation of a node.
struct BeamNode {
    double x[3] = {0, 0, 0}; ///< [m]
    /// Low-order part of the position, which is x + rest. Differences of neighbours, which times EA
    /// are forces, then have no round-off of the distance from the origin.
    double rest[3] = {0, 0, 0}; ///< [m]
    double q[4] = {1, 0, 0, 0}; ///< unit quaternion (w, x, y, z); its frame's axis 1 is the tangent

    /// x + rest, rounded [m].
    Vec3 position() const { return {x[0], x[1], x[2]}; }
    /// Adds d to a coordinate without loss of digits [m].
    void move(int axis, double d)
    {
        // x + rest + d as a rounded sum and its error (Knuth)
        const double add = d + rest[axis], sum = x[axis] + add, back = sum - x[axis];
        rest[axis] = (x[axis] - (sum - back)) + (add - back);
        x[axis] = sum;
    }
    /// Difference of the positions x + rest of two nodes along an axis [m].
    double difference(const BeamNode& from, int axis) const
    {
        return (x[axis] - from.x[axis]) + (rest[axis] - from.rest[axis]);
    }
};

struct TableLaw;

/// Part of an element whose section has laws by table: their part beyond the linear law. Bending is
/// that of a round section: the moment is along the change of curvature.
struct TableShare {
    double length = 0;                                   ///< [m]
    std::shared_ptr<const TableLaw> bending, stretching; ///< null: linear
};

/// Law of one element, linear but for its shares: strains e = (stretch, shear 2, shear 3, twist,
/// curvature 2, curvature 3), energy 1/2 sum_i (S_i e_i^2 - 2 P_i e_i) + constant, where the
/// stretch is the mean one, e_0 + 1/2 (bowing_0 e_1^2 + bowing_1 e_2^2). A straight unstressed
/// element has e = (1, 0, 0, 0, 0, 0).
struct ElementLaw {
    double length = 0;         ///< rest length [m]
    std::array<double, 6> S{}; ///< integral of the stiffness over the element [N m], [N m^3]
    std::array<double, 6> P{}; ///< integral of stiffness times natural strain
    double constant = 0;       ///< [J]
    /// Coefficients of the elongation of the centreline by its S-shaped deflection between the
    /// ends, for each shear [-]; 6/5 for a section rigid in shear. See set_bowing().
    std::array<double, 2> bowing{};
    std::vector<TableShare> beyond; ///< of tables, on the strains less the natural ones, P / S
};

/// Energy of shares, its derivatives by the strains, and the second ones.
struct BeyondLinear {
    /// Of the table beyond its stiffness at rest [J].
    double energy = 0;
    std::array<double, 6> stress{}; ///< of stretch and curvatures; the others are 0
    double stretch = 0;             ///< second derivative by the stretch [N per unit of strain]
    double bend22 = 0, bend23 = 0, bend33 = 0; ///< second derivatives by the curvatures [N m^2]
};
/// The energy of shares beyond the linear law, with its derivatives.
/// @param strain  less the natural one
BeyondLinear beyond_linear(const std::vector<TableShare>& shares,
                           const std::array<double, 6>& strain);
/// Sets the law's bowing from its length and stiffnesses. With r the residual flexibility of
/// bending over all that flexibility in shear, a tension N makes the element's stiffness against
/// shear k + (r^2/5 - (1 - r)^2) N to first order: N/5 is that of a cubic line, -N that of a
/// section which turns against the force (docs/theory/beams.md).
void set_bowing(ElementLaw& law);
/// Derivatives of the law's bowing by the length of the element. See set_bowing().
/// @param dS  derivatives of the law's S by the length
std::array<double, 2> bowing_growth(const ElementLaw& law, const std::array<double, 6>& dS);
/// Mean stretch of the middle line [-]; 1 of a straight unstressed element.
double mean_stretch(const ElementLaw& law, const std::array<double, 6>& strain);
/// Derivatives of an element's energy by its strains (section forces times the length): the first
/// is the tension, the next two the force across the section.
std::array<double, 6> element_stress(const ElementLaw& law, const std::array<double, 6>& strain);

/// Strains of an element, in its own frame.
/// @return  (stretch, shear 2, shear 3 [-], twist, curvature 2, curvature 3 [1/m])
std::array<double, 6> element_strain(const BeamNode& a, const BeamNode& b, double length);

/// Strains of an element without stress: the inverse of its pose is move_along().
/// @return  (stretch of the chord, shear 2, shear 3 [-], twist, curvature 2, curvature 3 [1/m])
std::array<double, 6> natural_strain(const ElementLaw& law);

/// Moves a node along a piece of constant strains: the inverse of element_strain().
/// @param strain  (stretch, shear 2, shear 3 [-], twist, curvature 2, curvature 3 [1/m])
/// @param length  of the piece [m]
void move_along(BeamNode& node, const std::array<double, 6>& strain, double length);

/// Elastic energy [J].
double element_energy(const BeamNode& a, const BeamNode& b, const ElementLaw& law);

/// Sum over strains of stress_i d(strain_i): a gradient with respect to the 12 displacements
/// (positions, body-frame rotations) of both nodes.
/// @param stress  work-conjugate to the strains, times the length [N m], [N m^2]
std::array<double, 12> element_force(const BeamNode& a, const BeamNode& b, double length,
                                     const std::array<double, 6>& stress);

/// Adds energy gradients and Hessians of elements [first, last) to `gradient` and `tangent`;
/// element i joins nodes i and i + 1. Rotations vary as q <- q exp(theta), theta in the body
/// frame; the Hessian is the symmetric one of theta at 0.
/// An element bent by more than 120 degrees gives NaN: the caller's step was too long.
/// @param predicted  per element the strains whose stress the Hessian's geometric part is of; null:
///                  the nodes' own
void add_elements(int first, int last, const std::vector<BeamNode>& nodes,
                  const std::vector<ElementLaw>& laws, BlockTridiagonal& tangent,
                  std::vector<Node6>& gradient,
                  const std::vector<std::array<double, 6>>* predicted = nullptr);

/// Strains after an increment of both nodes, to first order in it.
/// @param da, db  6 each: displacement, rotation in the body frame
std::array<double, 6> predicted_strain(const BeamNode& a, const BeamNode& b, double length,
                                       const double* da, const double* db);

} // namespace amontons
