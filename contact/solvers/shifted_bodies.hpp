#pragma once

#include "contact/linear/block_lu.hpp"
#include "contact/solvers/smoothed_law.hpp"
#include "contact/solvers/work.hpp"

#include <span>
#include <vector>

namespace amontons {

/// (S W S + E) x = b for a W of bodies, S a scale per contact and E = D + shift a block of each
/// closed contact: with G S W's factor in that scale,
///
///     (I + sum G E^-1 G^T) z = sum G E^-1 b,      x = E^-1 (b - G^T z).
///
/// The matrix couples bodies, not contacts: in a pile six unknowns take the place of a hundred
/// rows. Source: Sherman, Morrison & Woodbury's formula. Digits are lost as E gets small: the
/// caller refines.
class ShiftedBodies {
public:
    ShiftedBodies(const ContactProblem& problem, const Columns& columns,
                  const Eigen::VectorXd& scale); ///< refers to all three

    /// Finds the elimination order and the pattern of the factor, once.
    void analyse();
    /// Estimated time of a factor [ns on one core of 2024], once analysed.
    double cost() const { return lu_.cost(); }
    /// A lower bound of it that needs no analysis [ns].
    double filling_cost() const;
    /// @returns false if it is singular to working precision
    /// @param shift  added to W + D, > 0, in the scale of the problem [-]
    bool factorise(const std::vector<LinearisedLaw>& law, double shift);
    /// x on closed rows, 0 on open ones.
    void solve(const Eigen::VectorXd& b, Eigen::VectorXd& x) const;
    /// Motions of some contacts by unit forces on them in addition to their reactions, while all
    /// contacts respond by their E: rows and columns are the contacts' rows, one after another.
    Eigen::MatrixXd response(const std::vector<int>& contacts) const;
    /// E^-1, 0 of an open contact.
    const Mat3& inverse(int contact) const { return inverse_[std::size_t(contact)]; }

private:
    /// Contacts between the same bodies.
    struct Group {
        std::size_t begin = 0, end = 0; ///< in contact_
        std::size_t places = 0;         ///< in places_: of each pair of its bodies, (a, b) by b
        bool rigid = false;             ///< one or two bodies of six motions
    };
    std::span<const Columns::Piece> pieces(int contact) const
    {
        return {columns_.pieces_begin(contact), columns_.pieces_end(contact)};
    }
    static int blocks_of(const Columns::Piece& p) { return (p.k + 2) / 3; }
    int first_block(const Columns::Piece& p) const { return first_block_[std::size_t(p.part)]; }
    Eigen::Map<const Eigen::MatrixXd> G(const Columns::Piece& p, int contact) const
    {
        return {columns_.columns_of(p), p.k, columns_.rows(contact)};
    }
    void add_rigid(const Group& group);
    void add_any(const Group& group);

    const ContactProblem& problem_;
    const Columns& columns_;
    const Eigen::VectorXd& scale_;
    bool analysed_ = false;
    std::vector<int> first_block_; ///< of each body
    std::vector<int> contact_;     ///< by groups
    std::vector<Group> groups_;
    std::vector<BlockLu::Place> places_;
    std::vector<BlockLu::Place> diagonal_; ///< of each block
    BlockLu lu_;
    std::vector<Mat3> inverse_;                 ///< E^-1 of each contact, 0 of open ones
    std::vector<Eigen::MatrixXd> left_, right_; ///< workspace: of a group's bodies
    Eigen::MatrixXd product_;                   ///< workspace
    mutable Eigen::VectorXd z_;                 ///< workspace
};

} // namespace amontons
