#pragma once

#include "contact/linear/block_lu.hpp"
#include "contact/solvers/smoothed_law.hpp"
#include "contact/solvers/work.hpp"

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

    /// Order and pattern, once.
    void analyse();
    /// What a factor costs [ns on one core of 2024], once analysed.
    double cost() const { return lu_.cost(); }
    /// The least that it costs [ns].
    double filling_cost() const;
    /// @returns false if it is singular to working precision
    bool factorise(const std::vector<LinearisedLaw>& law, double shift);
    /// x on closed rows, 0 on open ones.
    void solve(const Eigen::VectorXd& b, Eigen::VectorXd& x) const;

private:
    /// Bodies a <= b that touch: the contacts that they share, and where each is among the columns
    /// of the two.
    struct Pair {
        int a = 0, b = 0;
        std::size_t begin = 0, end = 0; ///< in shared_
        std::size_t places = 0;         ///< of the blocks (a, b), then (b, a), in places_
    };
    struct Shared {
        int a = 0, b = 0, rows = 0; ///< first columns
    };
    int blocks(int part) const { return (size(part) + 2) / 3; }
    int size(int part) const { return int(G(part).rows()); }
    const Eigen::MatrixXd& G(int part) const
    {
        return problem_.W.of_bodies().parts[std::size_t(part)].G;
    }
    void add(const Eigen::MatrixXd& product, int blocks_down, int blocks_right,
             const BlockLu::Place* place);

    const ContactProblem& problem_;
    const Columns& columns_;
    const Eigen::VectorXd& scale_;
    bool analysed_ = false;
    std::vector<int> first_block_; ///< of each body
    std::vector<Pair> pairs_;
    std::vector<Shared> shared_;
    std::vector<BlockLu::Place> places_;
    BlockLu lu_;
    std::vector<Mat3> inverse_;                 ///< E^-1 of each contact, zero of open ones
    std::vector<Eigen::MatrixXd> right_, left_; ///< of each body: S G, and S G E^-1
};

} // namespace amontons
