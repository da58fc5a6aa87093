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
// linear in nodes and contacts as long as few of them couple what is far apart.

namespace amontons {

/// A contact and its rows on the nodes of one or two elements.
struct RodContact {
    Candidate law; ///< gap, slip, friction, stiffness, and the force that is known
    std::array<int, 4> slot{};
    int nodes = 0;
    std::array<int, 2> on{-1, -1}; ///< rods; -1: what stands still
    FourNodeRow normal{}, tangent[2]{};
    bool follows = false; ///< next to the one before, on the same rod and the same other
};

/// A row of a coupling with its weight in the matrix.
struct HeldJoint {
    std::array<int, 2> slot{-1, -1}; ///< -1: what stands still
    std::array<Vec6, 2> row;         ///< on what holds leave
    double value = 0;                ///< with what is prescribed [m]
    double force = 0;                ///< that is known [N]
    double weight = 0;               ///< [N/m]
    bool springs = false;            ///< the weight is its stiffness
};

/// What is kept from one iterate to the next.
struct RodProblem {
    std::vector<RodBody*> rods; ///< of each body; null: it stands still
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
    /// made so: towards stable balances, slower.
    bool guarded = false;
    /// A shorter step is more likely to converge: states that do not fit soon are given up.
    bool hasty = false;
    const std::atomic<bool>* stop = nullptr; ///< set from elsewhere: the answer is none

    /// Where a body's node stands in the matrix.
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

/// What is known of a contact before it is solved.
struct RodContactState {
    const BodyContact* contact = nullptr;
    /// The two sides.
    BodyPlace a, b;
    Vec3 value = Vec3::Zero(); ///< gap and slip at the iterate, in its frame [m]
    Vec3 force = Vec3::Zero(); ///< in its frame [N]
    double friction = 0;
    bool sticks = false;
};

/// Solution of one linearised problem of rods.
struct RodAnswer {
    std::vector<Eigen::VectorXd> motion;          ///< of each body
    std::vector<Vec3> force, value;               ///< of each contact, in its frame [N], [m]
    std::vector<double> joint_force, joint_value; ///< of each joint [N], [m]
    std::vector<char> sticks;
    int factorisations = 0;
    bool fits = true;     ///< the states do
    bool shifted = false; ///< the matrix had to be made positive definite: no step of Newton's
};

/// Newton's motion of rods that have been linearised without contact, and the contact forces with
/// it: states that fit the linearised law, all of them.
RodAnswer solve_rod_contacts(RodProblem& work, const std::vector<RodContactState>& contacts,
                             double tolerance);

/// A motion that closed contacts allow and that gains energy.
struct NegativeMotion {
    double stiffness = 0; ///< its second variation over its square, < 0 [N/m]
    /// Of each body, of its largest part 1: places, and turns times their element's length.
    std::vector<Eigen::VectorXd> motion;
};

/// Whether a balance of rods, linearised there without contact, is stable on the motions that its
/// contacts allow: those that stick none, others along their surfaces, whose curvature counts with
/// the contact force. By the symmetric part of the tangent.
/// @return  the lowest motion; nothing where none gains energy
/// Cost: a factorisation; where contacts have to be held harder or there is such a motion, some
/// dozens.
std::optional<NegativeMotion> negative_motion(RodProblem& work,
                                              const std::vector<RodContactState>& contacts);

/// A motion of rods that rest on contacts which takes no force: neither their own stiffness nor
/// holds, closed contacts, friction or loads resist it. Linearised as for negative_motion().
/// @return  of each body, as NegativeMotion::motion; nothing where all are held
/// Cost: a factorisation and some solves.
std::optional<std::vector<Eigen::VectorXd>>
unheld_motion(RodProblem& work, const std::vector<RodContactState>& contacts);

} // namespace amontons
