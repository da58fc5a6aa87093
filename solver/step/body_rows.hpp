#pragma once

#include "contact/problem.hpp"
#include "solver/step/body_contacts.hpp"
#include "solver/step/couplings.hpp"

#include <array>
#include <span>

// Contacts and couplings as rows of one problem: their position among the rows, their columns C on
// the bodies' unknowns, and their values at the iterate.

namespace amontons {

/// Rows of some contacts, and what maps them to the bodies.
struct Rows {
    std::vector<int> chosen;            ///< numbers of contacts, ascending, then of couplings
    std::vector<int> first;             ///< first row of each
    int count = 0;                      ///< number of rows
    std::vector<SparseColumns> columns; ///< of each body, unknowns x its rows
    std::vector<std::vector<int>> row;  ///< of each body: the row of each of its columns
};

/// All contacts and couplings of a step, with their bodies and pairs.
struct Contacts {
    /// All bodies.
    const std::vector<BodyRef>& bodies;
    const std::vector<ContactPair>& pairs;
    /// The contacts.
    const BodyContacts& all;
    /// Rows of the couplings.
    const std::vector<CouplingRow>& joints;
    const std::vector<Coupling>& couplings;
};

/// A contact of a step whose rows are evaluated at its end (docs/theory/motion.md): place and frame
/// at the start and at the end. Its force acts at the place and in the frame of BodyContact,
/// between the two.
struct FollowedContact {
    Mat3 frame = Mat3::Identity(), end_frame = Mat3::Identity(); ///< at the start, at the end
    Vec3 point = Vec3::Zero(), end_point = Vec3::Zero();         ///< [m]
    double gap = 0;                                              ///< at the start [m]
    double approach = 0; ///< rate at which the gap closes at the start [m/s]
};

/// A contact's frame, turned by the least angle to this normal.
Mat3 turned_frame(const Mat3& frame, const Vec3& normal);

/// Number of rows of a contact: 3 with friction, else 1.
int rows_of(std::span<const ContactPair> pairs, const BodyContact& c);

/// Contact c or, after the contacts, coupling c - contacts: its place on one of its bodies.
struct Side {
    /// Number of the body; -1: none.
    int body = -1;
    BodyPlace place;
    /// 1 or -1: sign of the body in the relative motion.
    double sign = 1;
};
/// The two sides of a contact or a coupling's row.
std::array<Side, 2> sides_of(const Contacts& k, int c);

/// Fills p with the rows of p.chosen.
void make_rows(const Contacts& k, Rows& p);

/// A contact or coupling and the force of its rows on its first side [N].
struct ActingForce {
    /// Number of the contact.
    int contact;
    /// On body a, in space [N].
    Vec3 force;
};
/// The generalised forces C r of these forces on the unknowns of each body, without forming C.
/// @param on  out, of each body
void forces_on_bodies(const Contacts& k, std::span<const ActingForce> acting,
                      std::vector<Eigen::VectorXd>& on);

/// Fills p with the rows of p.chosen (ascending), taken from the rows of all contacts and
/// couplings.
void choose_rows(const Rows& all, Rows& p);

/// Value of every row at the iterate: gap and slip [m] (quasi-static), or the excess of the normal
/// velocity at the end over its admissible least value, and the velocity of slip [m/s] (dynamic).
/// @param followed  of every contact, in steps that evaluate rows at their end; else empty
/// @param undone    share of overlaps at the start that dynamic steps undo (ratio)
/// @param all       out: of every contact and coupling, three numbers each
void row_values(const Contacts& k, const StepInput& step, std::span<const FollowedContact> followed,
                double undone, std::vector<Vec3>& all);

/// G with G^T G = C^T A^+ C of a body.
Eigen::MatrixXd compliance_root(StepMatrix& A, const SparseColumns& C);

/// W of all bodies in the form DelassusOfBodies.
/// @param G     of each body, C^T A^-1 C = G^T G
/// @param soft  rows and the compliances that are added to their diagonal [m/N or 1/kg]
Delassus delassus_of_bodies(const Rows& rows, std::vector<Eigen::MatrixXd> G,
                            const std::vector<std::pair<int, double>>& soft);

/// W of all bodies as a matrix, dense where most of its entries are other than zero.
/// @param W     of each body, between its rows
/// @param soft  rows and the compliances that are added to their diagonal [m/N or 1/kg]
Delassus sum_of_bodies(const Rows& rows, const std::vector<Eigen::MatrixXd>& W,
                       const std::vector<std::pair<int, double>>& soft);

} // namespace amontons
