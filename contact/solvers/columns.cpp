#include "contact/solvers/columns.hpp"

#include <algorithm>

namespace amontons {

Columns::Columns(const ContactProblem& problem) : problem_(problem), offset_(row_offsets(problem))
{
    if (!problem.W.is_sparse()) return;
    const Delassus::Sparse& W = problem.W.sparse();
    const int n = contact_count(problem);
    std::vector<int> owner(static_cast<std::size_t>(W.rows())); // contact of each row
    for (int i = 0; i < n; ++i)
        std::fill(owner.begin() + first_row(i), owner.begin() + first_row(i + 1), i);

    std::vector<int> seen(static_cast<std::size_t>(n), -1); // place in this column's list
    std::vector<int> list;
    start_.reserve(static_cast<std::size_t>(n) + 1);
    start_.push_back(0);
    for (int j = 0; j < n; ++j) {
        list.assign(1, j); // the own block always, to have a place for what is added to it
        for (int column = first_row(j); column < first_row(j + 1); ++column)
            for (Delassus::Sparse::InnerIterator it(W, column); it; ++it)
                if (it.value() != 0) list.push_back(owner[static_cast<std::size_t>(it.row())]);
        std::sort(list.begin(), list.end());
        list.erase(std::unique(list.begin(), list.end()), list.end());
        const int columns = rows(j);
        for (int i : list) {
            seen[static_cast<std::size_t>(i)] = static_cast<int>(neighbour_.size());
            neighbour_.push_back(i);
            place_.push_back(value_.size());
            value_.resize(value_.size() + static_cast<std::size_t>(rows(i) * columns), 0.0);
        }
        for (int c = 0; c < columns; ++c)
            for (Delassus::Sparse::InnerIterator it(W, first_row(j) + c); it; ++it) {
                if (it.value() == 0) continue;
                const int row = static_cast<int>(it.row());
                const int i = owner[static_cast<std::size_t>(row)];
                const std::size_t place =
                    place_[static_cast<std::size_t>(seen[static_cast<std::size_t>(i)])];
                value_[place + static_cast<std::size_t>(c * rows(i) + row - first_row(i))] +=
                    it.value();
            }
        start_.push_back(neighbour_.size());
    }
}

void Columns::add(int contact, const double* change, Eigen::VectorXd& u) const
{
    const int columns = rows(contact);
    double* __restrict v = u.data();
    if (is_dense()) {
        const Eigen::Index n = u.size();
        const double* w0 = problem_.W.dense().data() + first_row(contact) * n;
        if (columns == 1) {
            for (Eigen::Index k = 0; k < n; ++k)
                v[k] += w0[k] * change[0];
            return;
        }
        const double* w1 = w0 + n;
        const double* w2 = w1 + n;
        const double c0 = change[0], c1 = change[1], c2 = change[2];
        for (Eigen::Index k = 0; k < n; ++k)
            v[k] += w0[k] * c0 + w1[k] * c1 + w2[k] * c2;
        return;
    }
    for (std::size_t k = at(contact); k < at(contact + 1); ++k) {
        const double* block = value_.data() + place_[k];
        const int i = neighbour_[k];
        double* target = v + first_row(i);
        if (columns == 3 && rows(i) == 3) {
            const double c0 = change[0], c1 = change[1], c2 = change[2];
            target[0] += block[0] * c0 + block[3] * c1 + block[6] * c2;
            target[1] += block[1] * c0 + block[4] * c1 + block[7] * c2;
            target[2] += block[2] * c0 + block[5] * c1 + block[8] * c2;
            continue;
        }
        for (int c = 0; c < columns; ++c)
            for (int a = 0; a < rows(i); ++a)
                target[a] += *block++ * change[c];
    }
}

std::size_t Columns::blocks() const
{
    const auto n = static_cast<std::size_t>(contact_count(problem_));
    return is_dense() ? n * n : neighbour_.size();
}

} // namespace amontons
