#pragma once

#include "solver/beam/nesting.hpp"
#include "solver/linear/block_skyline.hpp"
#include "solver/step/wire_step.hpp"

#include <array>
#include <vector>

// Instruments in one another, brought to equilibrium together: Newton's method on all of them,
// inside it one linearised contact problem of all contacts, on walls and in bores, solved by
// pivoting as for one wire. Nodes are ordered by their length past the common introducer, so that
// the matrix is banded and its factor O(n). docs/theory/beams.md.

namespace amontons {

/// A contact of the common problem, on a wall or in a bore.
struct CoaxialContact {
    /// The contact.
    const Candidate* contact = nullptr;
    const NestedContact* nested = nullptr; ///< of a bore
    int nesting = -1;
    int wire = 0; ///< whose candidate it is
    Reaction* reaction = nullptr;
    int nodes = 0;               ///< 2, or 4 in a bore
    std::array<int, 4> slot{};   ///< of those nodes
    int lowest = 0, highest = 0; ///< slots
    bool follows = false;        ///< the neighbour of the contact before it in the list
};

/// A contact in a bore that carried a reaction when the step began.
struct NestedBefore {
    int index = 0; ///< into Nesting::reaction
    Vec3 n;
    double normal = 0, bound = 0; ///< r_n, mu r_n [N]
    Vec3 tangential;              ///< [N]
};

/// Where instruments were when a step began.
struct CoaxialStart {
    /// States of pairs of instruments.
    std::vector<NestingStart> nestings;
    /// Contacts at the start, of each pair.
    std::vector<std::vector<NestedBefore>> touched;
};

/// Instruments that are solved together.
struct Coaxial {
    /// The instruments.
    std::vector<WireBody*> wires;
    std::vector<Nesting> nestings;
    std::vector<std::array<int, 2>> pairs;            ///< inner, outer of each nesting
    std::vector<std::vector<NestedContact>> contacts; ///< of the last iterate, per nesting

    /// Work arrays. A slot is a node's place in the common order; -1: not out.
    std::vector<std::vector<int>> slot;
    std::vector<int> top; ///< pattern of the matrix
    BlockSkyline base, system;
    std::vector<Node6> gradient, right, increment;
    std::vector<CoaxialContact> all;
    std::vector<NewtonWorkspace::Trial> trial;
    /// Shift of the last factor [N/m].
    double shift = 0;
};

/// Stores the reference from which slip in the bores is measured.
CoaxialStart mark_coaxial_start(const Coaxial& c);

/// Moves reactions in the bores along with the outer instruments; those on walls of points that are
/// now in a bore are dropped.
/// @param shift  of the wires' bases [m]
void shift_coaxial_reactions(Coaxial& c, const std::vector<double>& shift);

/// As solve_equilibrium, of all.
NewtonReport solve_coaxial(Coaxial& c, const std::vector<StepStart>& start,
                           const CoaxialStart& nested, const std::vector<ViscousPull>& anchors,
                           const NewtonOptions& options);

/// Solves with the last factor.
/// @param x  in and out, per wire and node
void solve_last_system(const Coaxial& c, std::vector<std::vector<Node6>>& x);

/// As friction_work, in the bores [J].
double coaxial_friction_work(const Coaxial& c, const CoaxialStart& start);
/// Work of the normal reactions in the bores over a step in motion, on both instruments, by the
/// trapezoid rule [J].
double coaxial_normal_work(const Coaxial& c, const CoaxialStart& start);

/// As solve_linearised and close_active_rows (coaxial_pivot.cpp).
void solve_linearised(Coaxial& c, const Residual& residual, const NewtonOptions& options,
                      double& shift, NewtonReport& report);
/// Closes the active rows by a dense system of their own.
/// @param force  reactions below it do not count [N]
void close_active_rows(Coaxial& c, double force);

} // namespace amontons
