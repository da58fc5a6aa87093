#pragma once

#include "contact/problem.hpp"

#include <vector>

namespace amontons {

/// W by the columns of its contacts, for solvers that change one contact at a time.
///
/// Dense W is used in place; sparse W is copied into blocks, one for each pair of coupled contacts,
/// four numbers a column: the width of a vector register. Of a W of bodies the columns of G are
/// copied: the effect of a contact is on the motions v = G r of its bodies. Refers to the problem.
/// Matrix-free W has no columns.
class Columns {
public:
    /// Numbers from one column of a block of sparse W to the next.
    static constexpr int kStride = 4;

    explicit Columns(const ContactProblem& problem);

    /// u += W(:, contact) change. @param change  as many numbers as the contact has rows
    void add(int contact, const double* change, Eigen::VectorXd& u) const;

    /// u in the layout of a sweep, "slots": u itself for dense W and W of bodies, else kStride
    /// numbers for each contact.
    void spread(const Eigen::VectorXd& u, Eigen::VectorXd& slots) const;
    /// Copies u from the slots of columns to rows, one contact after another.
    void collect(const Eigen::VectorXd& slots, Eigen::VectorXd& u) const;
    /// First number of a contact's u among the slots.
    int slot(int contact) const { return in_slots() ? kStride * contact : first_row(contact); }
    /// slots += W(:, contact) change.
    void add_to_slots(int contact, const double* change, Eigen::VectorXd& slots) const;
    /// Number of stored blocks, or the equivalent amount of G; the cost of a product or a sweep is
    /// proportional to it.
    std::size_t blocks() const;

    /// The first row of a contact in u, r and q.
    int first_row(int contact) const { return offset_[static_cast<std::size_t>(contact)]; }
    /// Rows of a contact: 1 or 3.
    int rows(int contact) const { return first_row(contact + 1) - first_row(contact); }

    /// W of bodies: v = G r, the motions of all bodies one after another.
    void start(const Eigen::VectorXd& r, Eigen::VectorXd& v) const;
    /// W of bodies: u = q + W r of a contact, from v = G r.
    /// @param u  as many numbers as it has rows
    void read(int contact, const Eigen::VectorXd& r, const Eigen::VectorXd& v, double* u) const;
    /// v += G_i change of the contact, over its bodies.
    void add_to_bodies(int contact, const double* change, Eigen::VectorXd& v) const;

    /// True if W is dense.
    bool is_dense() const { return problem_.W.is_dense(); }
    /// True if W is known by its bodies.
    bool is_of_bodies() const { return problem_.W.is_of_bodies(); }
    /// A contact on a body: its columns of G, k numbers each, and where the body's v begins.
    struct Piece {
        std::size_t G = 0; ///< see columns_of()
        int k = 0, at = 0, part = 0;
    };
    /// A piece's columns of G, one after the other. They are stored contact by contact, so that a
    /// loop over the contacts of a pile reads memory in order. Entries of G.
    const double* columns_of(const Piece& piece) const { return number_.data() + piece.G; }
    /// v += G change of a piece; u += G^T v. v and u begin at those of the body and the contact.
    void add_to_motion(const Piece& piece, int contact, const double* change, double* v) const;
    /// u += G^T v of a piece; v begins at those of the body, u at those of the contact.
    void add_motion(const Piece& piece, int contact, const double* v, double* u) const;
    /// The pieces of a contact: one for each of its bodies.
    const Piece* pieces_begin(int contact) const { return piece_.data() + at(contact); }
    /// One past its last piece.
    const Piece* pieces_end(int contact) const { return piece_.data() + at(contact + 1); }
    /// The contacts that W couples with this one, itself included, ascending; sparse W only.
    const int* neighbours_begin(int contact) const { return neighbour_.data() + at(contact); }
    /// One past the last neighbour of a contact.
    const int* neighbours_end(int contact) const { return neighbour_.data() + at(contact + 1); }
    /// The block of the k-th neighbour, rows(neighbour) x rows(contact), a column every kStride
    /// numbers.
    const double* neighbour_block(int contact, int k) const
    {
        return value_.data() + first_value_[static_cast<std::size_t>(contact)] +
               k * kStride * rows(contact);
    }

private:
    void make_pieces();
    bool in_slots() const { return problem_.W.is_sparse(); }
    void add_dense(int contact, const double* change, double* u) const;
    std::size_t at(int contact) const { return start_[static_cast<std::size_t>(contact)]; }

    const ContactProblem& problem_;
    std::vector<int> offset_;
    // Sparse only: blocks of a contact's column, from start_[contact] to start_[contact + 1].
    std::vector<std::size_t> start_;
    std::vector<Eigen::Index> first_value_;
    std::vector<int> neighbour_;
    Eigen::VectorXd value_;
    // Of bodies only: pieces of a contact, from start_[contact] to start_[contact + 1].
    std::vector<Piece> piece_;
    std::vector<double> number_; // of G
    Eigen::Index motions_ = 0;   // numbers in v
};

} // namespace amontons
