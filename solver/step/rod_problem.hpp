#pragma once

#include "solver/body/rod_body.hpp"
#include "solver/step/body_contacts.hpp"
#include "solver/step/four_node_rows.hpp"
#include "solver/step/node_matrix.hpp"
#include "solver/step/rod_joints.hpp"
#include "solver/step/wire_newton.hpp"

#include <optional>

// The contact problem of rods alone, among themselves and with what stands still, without W: the
// contacts' states are pivoted, and their rows are part of the rods' own sparse matrix. Work is
// linear in nodes and contacts while few of the contacts couple distant nodes.

namespace amontons {

/// A contact and its rows on the nodes of one or two elements.
struct RodContact {
    Candidate law; ///< gap, slip, friction, stiffness, and the force of the last iterate
    std::array<int, 4> slot{};
    int nodes = 0;
    std::array<int, 2> on{-1, -1}; ///< rods; -1: a body that does not move
    FourNodeRow normal{}, tangent[2]{};
    bool follows = false; ///< the neighbour of the contact before it, on the same two bodies
};

/// A row of a coupling with its weight in the matrix.
struct HeldJoint {
    std::array<int, 2> slot{-1, -1}; ///< -1: a body that does not move
    std::array<Vec6, 2> row;         ///< on the unknowns that holds leave free
    double value = 0;                ///< including prescribed motions [m]
    double force = 0;                ///< of the last iterate [N]
    double weight = 0;               ///< [N/m]
    bool springs = false;            ///< the weight is its stiffness
};

/// Data of the problem, kept from one iterate to the next.
struct RodProblem {
    std::vector<RodBody*> rods; ///< of each body; null: a body that does not move
    std::vector<int> from;      ///< of each body: nodes before it are held and touch nothing
    std::vector<int> first;     ///< of each body: the slot of that node
    std::vector<RodContact> contact;
    std::vector<RodJoint> joints; ///< set before each problem
    std::vector<HeldJoint> held_joints;
    int most_on_one = 0; ///< contacts of one rod
    NodeMatrix base, system;
    std::vector<Node6> gradient, right, increment;
    std::vector<NewtonWorkspace::Trial> trial;
    std::vector<double> stiffness, length; ///< of each node: its element's EI / l^3 [N/m], l [m]
    double min_stiffness = 0, shift = 0;   ///< [N/m]
    /// Where the matrix is not positive definite on the motions that contacts leave free, it is
    /// shifted: the iteration then tends to stable equilibria, but converges more slowly.
    bool guarded = false;
    /// Stops pivoting early where no consistent states are found, since a shorter step is more
    /// likely to converge.
    bool hasty = false;
    const std::atomic<bool>* stop = nullptr; ///< set from outside, it ends the solve without result

    /// The block row of a body's node in the matrix.
    int slot(int body, int node) const
    {
        return first[std::size_t(body)] + node - from[std::size_t(body)];
    }
    /// Nodes of a body in the matrix, from its `from` on.
    int nodes_of(std::size_t body) const
    {
        return rods[body] ? rods[body]->unknowns() / 6 - from[body] : 0;
    }
};

/// A contact and its values at the iterate.
struct RodContactState {
    const BodyContact* contact = nullptr;
    /// The two sides.
    BodyPlace a, b;
    Vec3 value = Vec3::Zero(); ///< gap and slip at the iterate, in its frame [m]
    Vec3 force = Vec3::Zero(); ///< in its frame [N]
    double friction = 0;       ///< coefficient [-]
    bool sticks = false;
};

/// Solution of one linearised problem of rods.
struct RodAnswer {
    std::vector<Eigen::VectorXd> motion;          ///< of each body
    std::vector<Vec3> force, value;               ///< of each contact, in its frame [N], [m]
    std::vector<double> joint_force, joint_value; ///< of each joint [N], [m]
    std::vector<char> sticks;
    int factorisations = 0;
    bool fits = true;     ///< open, stick and slip are consistent with the motion
    bool shifted = false; ///< the matrix had to be shifted: the motion is no full Newton step
};

/// The Newton step of rods linearised without contact, and the contact forces: the solution of the
/// linearised contact problem.
/// @param tolerance  error of forces, relative to the largest [-]
RodAnswer solve_rod_contacts(RodProblem& work, const std::vector<RodContactState>& contacts,
                             double tolerance);

/// A motion admissible at the closed contacts along which the second variation of the energy is
/// negative.
struct NegativeMotion {
    double stiffness = 0; ///< second variation over the motion's square, < 0 [N/m]
    /// Of each body; the largest component (displacement, or rotation times its element's length)
    /// is 1.
    std::vector<Eigen::VectorXd> motion;
};

/// Tests whether an equilibrium of rods, linearised there without contact, is stable on the motions
/// that its contacts admit: none where they stick, along the surfaces elsewhere, whose curvature
/// times the contact force is part of the second variation. By the symmetric part of the tangent.
/// @return  the lowest mode; nothing where none is negative
/// Cost: a factorisation; some dozens where the weight of contact rows has to be raised or there is
/// such a mode.
std::optional<NegativeMotion> negative_motion(RodProblem& work,
                                              const std::vector<RodContactState>& contacts);

/// A motion of rods that rest on contacts, along which no force acts: neither their own stiffness
/// nor holds, closed contacts, friction or loads resist it. Linearised as for negative_motion().
/// @return  of each body, as NegativeMotion::motion; nothing where every motion is resisted
/// Cost: a factorisation and some solves.
std::optional<std::vector<Eigen::VectorXd>>
unheld_motion(RodProblem& work, const std::vector<RodContactState>& contacts);

} // namespace amontons
