#pragma once

#include "solver/body/rod_body.hpp"
#include "solver/step/body_contacts.hpp"
#include "solver/step/four_node_rows.hpp"
#include "solver/step/node_matrix.hpp"
#include "solver/step/wire_newton.hpp"

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

/// What is kept from one iterate to the next.
struct RodProblem {
    std::vector<RodBody*> rods; ///< of each body; null: it stands still
    std::vector<int> first;     ///< of each body: where its nodes begin
    std::vector<RodContact> contact;
    int most_on_one = 0; ///< contacts of one rod
    NodeMatrix base, system;
    std::vector<Node6> gradient, right, increment;
    std::vector<NewtonWorkspace::Trial> trial;
    std::vector<double> stiffness, length; ///< of each node: its element's EI / l^3 [N/m], l [m]
    double softest = 0, shift = 0;         ///< [N/m]
    /// Where the matrix is not positive definite on the motions that contacts leave free, it is
    /// made so: towards stable balances, slower.
    bool guarded = false;
    /// A shorter step is surer to lead on: states that do not fit soon are given up.
    bool hasty = false;
};

/// What is known of a contact before it is solved.
struct RodContactState {
    const BodyContact* contact = nullptr;
    BodyPlace a, b;
    Vec3 value = Vec3::Zero(); ///< gap and slip at the iterate, in its frame [m]
    Vec3 force = Vec3::Zero(); ///< in its frame [N]
    double friction = 0;
    bool sticks = false;
};

struct RodAnswer {
    std::vector<Eigen::VectorXd> motion; ///< of each body
    std::vector<Vec3> force, value;      ///< of each contact, in its frame [N], [m]
    std::vector<char> sticks;
    int factorisations = 0;
    bool fits = true;     ///< the states do
    bool shifted = false; ///< the matrix had to be made positive definite: no step of Newton's
};

/// Newton's motion of rods that have been linearised without contact, and the contact forces with
/// it: states that fit the linearised law, all of them.
RodAnswer solve_rod_contacts(RodProblem& work, const std::vector<RodContactState>& contacts,
                             double tolerance);

} // namespace amontons
