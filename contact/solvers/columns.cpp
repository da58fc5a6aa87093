#include "contact/solvers/columns.hpp"

#include <algorithm>

namespace amontons {

Columns::Columns(const ContactProblem& problem) : problem_(problem), offset_(row_offsets(problem))
{
    if (problem.W.is_of_bodies()) make_pieces();
    if (!problem.W.is_sparse()) return;
    const Delassus::Sparse& W = problem.W.sparse();
    const int n = contact_count(problem);
    std::vector<int> owner(static_cast<std::size_t>(W.rows())); // contact of each row
    for (int i = 0; i < n; ++i)
        std::fill(owner.begin() + first_row(i), owner.begin() + first_row(i + 1), i);

    std::vector<int> seen(static_cast<std::size_t>(n), -1); // place in this column's list
    const auto place_of = [&](int i) -> int& { return seen[static_cast<std::size_t>(i)]; };
    start_.reserve(static_cast<std::size_t>(n) + 1);
    start_.push_back(0);
    Eigen::Index values = 0;
    // The pattern first: most contacts couple by full blocks, whose first column shows it all, in
    // order.
    neighbour_.reserve(static_cast<std::size_t>(W.nonZeros() / 9 + n));
    for (int j = 0; j < n; ++j) {
        const auto mine = static_cast<int>(start_.back());
        for (int column = first_row(j); column < first_row(j + 1); ++column)
            for (Delassus::Sparse::InnerIterator it(W, column); it; ++it) {
                const int i = owner[static_cast<std::size_t>(it.row())];
                if (place_of(i) >= mine || it.value() == 0) continue;
                place_of(i) = mine;
                neighbour_.push_back(i);
            }
        if (place_of(j) < mine) neighbour_.push_back(j); // there for what is added to it
        place_of(j) = mine;
        const auto begin = neighbour_.begin() + mine;
        if (!std::is_sorted(begin, neighbour_.end())) std::sort(begin, neighbour_.end());
        first_value_.push_back(values);
        values += (neighbour_.end() - begin) * kStride * rows(j);
        start_.push_back(neighbour_.size());
    }
    value_.setZero(values);
    for (int j = 0; j < n; ++j) {
        for (std::size_t k = at(j); k < at(j + 1); ++k)
            place_of(neighbour_[k]) = static_cast<int>(k - at(j));
        double* const blocks = value_.data() + first_value_[static_cast<std::size_t>(j)];
        for (int column = first_row(j); column < first_row(j + 1); ++column)
            for (Delassus::Sparse::InnerIterator it(W, column); it; ++it) {
                if (it.value() == 0) continue;
                const auto row = static_cast<int>(it.row());
                const int i = owner[static_cast<std::size_t>(row)];
                blocks[kStride * (place_of(i) * rows(j) + column - first_row(j)) + row -
                       first_row(i)] += it.value();
            }
    }
}

void Columns::make_pieces()
{
    const DelassusOfBodies& W = problem_.W.of_bodies();
    std::vector<int> at(W.parts.size());
    for (std::size_t p = 0; p < W.parts.size(); ++p) {
        at[p] = static_cast<int>(motions_);
        motions_ += W.parts[p].G.rows();
    }
    std::size_t numbers = 0;
    for (const DelassusOfBodies::Part& part : W.parts)
        numbers += static_cast<std::size_t>(part.G.size());
    number_.reserve(numbers);
    start_.push_back(0);
    for (int i = 0; i < contact_count(problem_); ++i) {
        // All rows of a contact are on the same bodies, one after the other.
        for (const DelassusOfBodies::Place& place : W.places(first_row(i))) {
            const Eigen::MatrixXd& G = W.parts[static_cast<std::size_t>(place.part)].G;
            const auto k = static_cast<int>(G.rows());
            if (k == 0) continue;
            piece_.push_back(
                {number_.size(), k, at[static_cast<std::size_t>(place.part)], place.part});
            const double* const G_i = G.col(place.column).data();
            number_.insert(number_.end(), G_i, G_i + k * rows(i));
        }
        start_.push_back(piece_.size());
    }
}

namespace {

constexpr int kRigidRows = 6; ///< rows of G of a rigid body, whose loops are laid out ahead

/// v += G x, u += G^T v. @tparam K  rows of G, 0: `k`
template <int K> void add_columns(const double* G, int k, int rows, const double* x, double* v)
{
    const int size = K > 0 ? K : k;
    for (int c = 0; c < rows; ++c, G += size)
        for (int a = 0; a < size; ++a)
            v[a] += G[a] * x[c];
}

template <int K> void add_products(const double* G, int k, int rows, const double* v, double* u)
{
    const int size = K > 0 ? K : k;
    for (int c = 0; c < rows; ++c, G += size) {
        double sum = 0;
        if constexpr (K > 0) {
            for (int a = 0; a < K; ++a)
                sum += G[a] * v[a];
        } else {
            sum = Eigen::Map<const Eigen::VectorXd>(G, size).dot(
                Eigen::Map<const Eigen::VectorXd>(v, size));
        }
        u[c] += sum;
    }
}

} // namespace

void Columns::add_to_motion(const Piece& piece, int contact, const double* change, double* v) const
{
    if (piece.k == kRigidRows)
        add_columns<kRigidRows>(columns_of(piece), piece.k, rows(contact), change, v);
    else
        add_columns<0>(columns_of(piece), piece.k, rows(contact), change, v);
}

void Columns::add_motion(const Piece& piece, int contact, const double* v, double* u) const
{
    if (piece.k == kRigidRows)
        add_products<kRigidRows>(columns_of(piece), piece.k, rows(contact), v, u);
    else
        add_products<0>(columns_of(piece), piece.k, rows(contact), v, u);
}

void Columns::start(const Eigen::VectorXd& r, Eigen::VectorXd& v) const
{
    v.setZero(motions_);
    for (int i = 0; i < contact_count(problem_); ++i)
        add_to_bodies(i, r.data() + first_row(i), v);
}

void Columns::read(int contact, const Eigen::VectorXd& r, const Eigen::VectorXd& v, double* u) const
{
    const Eigen::VectorXd& compliance = problem_.W.of_bodies().compliance;
    const int first = first_row(contact), count = rows(contact);
    for (int a = 0; a < count; ++a)
        u[a] = problem_.q[first + a] + compliance[first + a] * r[first + a];
    for (const Piece* p = pieces_begin(contact); p != pieces_end(contact); ++p)
        add_motion(*p, contact, v.data() + p->at, u);
}

void Columns::add_to_bodies(int contact, const double* change, Eigen::VectorXd& v) const
{
    for (const Piece* p = pieces_begin(contact); p != pieces_end(contact); ++p)
        add_to_motion(*p, contact, change, v.data() + p->at);
}

void Columns::spread(const Eigen::VectorXd& u, Eigen::VectorXd& slots) const
{
    if (!in_slots()) {
        slots = u;
        return;
    }
    const int n = contact_count(problem_);
    slots.setZero(kStride * n);
    for (int i = 0; i < n; ++i)
        for (int a = 0; a < rows(i); ++a)
            slots[kStride * i + a] = u[first_row(i) + a];
}

void Columns::collect(const Eigen::VectorXd& slots, Eigen::VectorXd& u) const
{
    if (!in_slots()) {
        u = slots;
        return;
    }
    for (int i = 0; i < contact_count(problem_); ++i)
        for (int a = 0; a < rows(i); ++a)
            u[first_row(i) + a] = slots[kStride * i + a];
}

void Columns::add_dense(int contact, const double* change, double* __restrict u) const
{
    const Eigen::Index n = problem_.W.dense().rows();
    const double* w0 = problem_.W.dense().data() + first_row(contact) * n;
    if (rows(contact) == 1) {
        for (Eigen::Index k = 0; k < n; ++k)
            u[k] += w0[k] * change[0];
        return;
    }
    const double* w1 = w0 + n;
    const double* w2 = w1 + n;
    const double c0 = change[0], c1 = change[1], c2 = change[2];
    for (Eigen::Index k = 0; k < n; ++k)
        u[k] += w0[k] * c0 + w1[k] * c1 + w2[k] * c2;
}

void Columns::add(int contact, const double* change, Eigen::VectorXd& u) const
{
    if (is_dense()) {
        add_dense(contact, change, u.data());
        return;
    }
    if (is_of_bodies()) {
        const DelassusOfBodies& W = problem_.W.of_bodies();
        for (int c = 0; c < rows(contact); ++c)
            u[first_row(contact) + c] += W.compliance[first_row(contact) + c] * change[c];
        Eigen::VectorXd v, own;
        for (const Piece* p = pieces_begin(contact); p != pieces_end(contact); ++p) {
            v.setZero(p->k);
            add_columns<0>(columns_of(*p), p->k, rows(contact), change, v.data());
            const DelassusOfBodies::Part& part = W.parts[static_cast<std::size_t>(p->part)];
            own.noalias() = part.G.transpose() * v;
            for (std::size_t i = 0; i < part.rows.size(); ++i)
                u[part.rows[i]] += own[static_cast<Eigen::Index>(i)];
        }
        return;
    }
    const double* block = neighbour_block(contact, 0);
    for (const int* i = neighbours_begin(contact); i != neighbours_end(contact); ++i)
        for (int c = 0; c < rows(contact); ++c, block += kStride)
            for (int a = 0; a < rows(*i); ++a)
                u[first_row(*i) + a] += block[a] * change[c];
}

void Columns::add_to_slots(int contact, const double* change, Eigen::VectorXd& slots) const
{
    if (is_dense()) {
        add_dense(contact, change, slots.data());
        return;
    }
    using Column = Eigen::Array<double, kStride, 1>;
    using Block = Eigen::Map<const Column, Eigen::Aligned32>;
    const double* block = neighbour_block(contact, 0);
    const int* const end = neighbours_end(contact);
    if (rows(contact) == 1) {
        for (const int* i = neighbours_begin(contact); i != end; ++i, block += kStride)
            Eigen::Map<Column, Eigen::Aligned32>(slots.data() + kStride * *i) +=
                Block(block) * change[0];
        return;
    }
    const double c0 = change[0], c1 = change[1], c2 = change[2];
    for (const int* i = neighbours_begin(contact); i != end; ++i, block += 3 * kStride)
        Eigen::Map<Column, Eigen::Aligned32>(slots.data() + kStride * *i) +=
            Block(block) * c0 + Block(block + kStride) * c1 + Block(block + 2 * kStride) * c2;
}

std::size_t Columns::blocks() const
{
    const auto n = static_cast<std::size_t>(contact_count(problem_));
    return is_dense() ? n * n : is_of_bodies() ? number_.size() / 4 : neighbour_.size();
}

} // namespace amontons
