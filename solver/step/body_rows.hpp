#pragma once

#include "contact/problem.hpp"
#include "solver/step/body_contacts.hpp"
#include "solver/step/couplings.hpp"

#include <array>
#include <span>

// Contacts and couplings as rows of one problem: where each stands, what it maps to on its bodies,
// and its value at the iterate.

namespace amontons {

/// Rows of some contacts, and what maps them to the bodies.
struct Rows {
    std::vector<int> chosen; ///< contacts of the list, then couplings
    std::vector<int> first;  ///< row of each
    int count = 0;
    std::vector<SparseColumns> columns; ///< of each body, unknowns x its rows
    std::vector<std::vector<int>> row;  ///< of each body: where its columns stand
};

/// All contacts and couplings of a step, and whose they are.
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

/// A contact of a step that is followed to its end: where it was and where it comes to. Between the
/// two, at BodyContact's own place and frame, its force acts.
struct FollowedContact {
    Mat3 frame = Mat3::Identity(), end_frame = Mat3::Identity(); ///< at the start, at the end
    Vec3 point = Vec3::Zero(), end_point = Vec3::Zero();         ///< [m]
    double gap = 0;                                              ///< at the start [m]
    double approach = 0;                                         ///< of the gap there [m/s]
};

/// A contact's frame, turned by the least angle to this normal.
Mat3 turned_frame(const Mat3& frame, const Vec3& normal);

/// 3 with friction, else 1.
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

/// The rows of p.chosen, into the rest of p.
void make_rows(const Contacts& k, Rows& p);

/// A contact or coupling and the force of its rows on its first side [N].
struct ActingForce {
    /// Number of the contact.
    int contact;
    /// On body a, in space [N].
    Vec3 force;
};
/// These forces on the unknowns of each body: C r, without C.
std::vector<Eigen::VectorXd> forces_on_bodies(const Contacts& k,
                                              std::span<const ActingForce> acting);

/// Rows of some, of those that are there for every contact and coupling.
/// @param p  its `chosen` is given, ascending
void choose_rows(const Rows& all, Rows& p);

/// Value of every row at the iterate: gap and slip (quasi-static), or what the velocity at the end
/// must not fall below and the velocity of slip (dynamic).
/// @param followed  of every contact, in steps that follow them
/// @param all  of every contact and coupling, three numbers each
void row_values(const Contacts& k, const StepInput& step, std::span<const FollowedContact> followed,
                std::vector<Vec3>& all);

/// G with G^T G = C^T A^+ C of a body.
Eigen::MatrixXd compliance_root(Body& body, const SparseColumns& C);

/// W of all bodies by what they are. @param G  of each body, C^T A^-1 C = G^T G
Delassus delassus_of_bodies(const Rows& rows, std::vector<Eigen::MatrixXd> G,
                            const std::vector<std::pair<int, double>>& soft);

/// W of all bodies, dense where most of it is.
/// @param soft  rows and what is added to their diagonal
Delassus sum_of_bodies(const Rows& rows, const std::vector<Eigen::MatrixXd>& W,
                       const std::vector<std::pair<int, double>>& soft);

} // namespace amontons
