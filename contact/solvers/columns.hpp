#pragma once

#include "contact/problem.hpp"

#include <vector>

namespace amontons {

/// W by the columns of its contacts, as solvers that move one contact at a time read it.
///
/// Dense W is used where it is; sparse W is copied into blocks, one for each pair of contacts
/// that feel each other, four numbers a column: what a vector register holds. Refers to the
/// problem. Matrix-free W has no columns.
class Columns {
public:
    /// Numbers from one column of a block of sparse W to the next.
    static constexpr int kStride = 4;

    explicit Columns(const ContactProblem& problem);

    /// u += W(:, contact) change. @param change  as many numbers as the contact has rows
    void add(int contact, const double* change, Eigen::VectorXd& u) const;

    /// u of a sweep: as it is for dense W, else kStride numbers for each contact.
    void spread(const Eigen::VectorXd& u, Eigen::VectorXd& slots) const;
    void collect(const Eigen::VectorXd& slots, Eigen::VectorXd& u) const;
    /// Where a contact's u begins in it.
    int slot(int contact) const { return is_dense() ? first_row(contact) : kStride * contact; }
    /// add() on it.
    void add_to_slots(int contact, const double* change, Eigen::VectorXd& slots) const;
    /// Stored blocks: what a product or a sweep costs is proportional to it.
    std::size_t blocks() const;

    int first_row(int contact) const { return offset_[static_cast<std::size_t>(contact)]; }
    int rows(int contact) const { return first_row(contact + 1) - first_row(contact); }

    bool is_dense() const { return problem_.W.is_dense(); }
    /// The contacts that feel this one, itself among them, ascending; sparse W only.
    const int* neighbours_begin(int contact) const { return neighbour_.data() + at(contact); }
    const int* neighbours_end(int contact) const { return neighbour_.data() + at(contact + 1); }
    /// The block of the k-th neighbour, rows(neighbour) x rows(contact), a column every kStride
    /// numbers.
    const double* neighbour_block(int contact, int k) const
    {
        return value_.data() + first_value_[static_cast<std::size_t>(contact)] +
               k * kStride * rows(contact);
    }

private:
    void add_dense(int contact, const double* change, double* u) const;
    std::size_t at(int contact) const { return start_[static_cast<std::size_t>(contact)]; }

    const ContactProblem& problem_;
    std::vector<int> offset_;
    // Sparse only: blocks of a contact's column, from start_[contact] to start_[contact + 1].
    std::vector<std::size_t> start_;
    std::vector<Eigen::Index> first_value_;
    std::vector<int> neighbour_;
    Eigen::VectorXd value_;
};

} // namespace amontons
