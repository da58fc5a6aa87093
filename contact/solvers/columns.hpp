#pragma once

#include "contact/problem.hpp"

#include <vector>

namespace amontons {

/// W by the columns of its contacts, as solvers that move one contact at a time read it.
///
/// Dense W is used where it is; sparse W is copied into blocks, one for each pair of contacts
/// that feel each other. Refers to the problem. Matrix-free W has no columns.
class Columns {
public:
    explicit Columns(const ContactProblem& problem);

    /// u += W(:, contact) change. @param change  as many numbers as the contact has rows
    void add(int contact, const double* change, Eigen::VectorXd& u) const;
    /// Stored blocks: what a product or a sweep costs is proportional to it.
    std::size_t blocks() const;

    int first_row(int contact) const { return offset_[static_cast<std::size_t>(contact)]; }
    int rows(int contact) const { return first_row(contact + 1) - first_row(contact); }

    bool is_dense() const { return problem_.W.is_dense(); }
    /// The contacts that feel this one, itself among them, ascending; sparse W only.
    const int* neighbours_begin(int contact) const { return neighbour_.data() + at(contact); }
    const int* neighbours_end(int contact) const { return neighbour_.data() + at(contact + 1); }
    /// The block of the k-th neighbour, rows(neighbour) x rows(contact), column by column.
    const double* neighbour_block(int contact, int k) const
    {
        return value_.data() + place_[at(contact) + static_cast<std::size_t>(k)];
    }

private:
    std::size_t at(int contact) const { return start_[static_cast<std::size_t>(contact)]; }

    const ContactProblem& problem_;
    std::vector<int> offset_;
    // Sparse only: blocks of a contact's column, from start_[contact] to start_[contact + 1].
    std::vector<std::size_t> start_, place_;
    std::vector<int> neighbour_;
    std::vector<double> value_;
};

} // namespace amontons
