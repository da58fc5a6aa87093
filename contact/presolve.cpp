#include "contact/presolve.hpp"

#include <algorithm>
#include <numeric>

namespace amontons {
namespace {

/// Sets of contacts that are joined one by one.
class ContactGroups {
public:
    explicit ContactGroups(int n) : parent_(static_cast<std::size_t>(n)), count_(n)
    {
        std::iota(parent_.begin(), parent_.end(), 0);
    }
    int find(int i)
    {
        while (parent(i) != i)
            i = parent(i) = parent(parent(i));
        return i;
    }
    void join(int i, int j)
    {
        i = find(i);
        j = find(j);
        if (i == j) return;
        parent(std::max(i, j)) = std::min(i, j);
        --count_;
    }
    int count() const { return count_; }

private:
    int& parent(int i) { return parent_[static_cast<std::size_t>(i)]; }
    std::vector<int> parent_;
    int count_;
};

/// The numbers in each of three columns whose rows are the same; 0 if they are not.
int whole_blocks(const Delassus::Sparse& W, int column, int columns)
{
    if (columns != 3) return 0;
    const int* const start = W.outerIndexPtr() + column;
    const int count = start[1] - start[0];
    if (start[2] - start[1] != count || start[3] - start[2] != count) return 0;
    const int* const row = W.innerIndexPtr() + start[0];
    return std::equal(row, row + count, row + count) &&
                   std::equal(row, row + count, row + 2 * count)
               ? count
               : 0;
}

/// What W couples. Searched until all is one group.
ContactGroups coupled(const ContactProblem& problem, const std::vector<int>& offset)
{
    const int n = contact_count(problem);
    ContactGroups groups(n);
    const auto first = [&](int i) { return offset[static_cast<std::size_t>(i)]; };
    if (problem.W.is_matrix_free()) {
        for (int i = 1; i < n; ++i)
            groups.join(0, i);
    } else {
        std::vector<int> owner(static_cast<std::size_t>(problem.q.size()));
        for (int i = 0; i < n; ++i)
            std::fill(owner.begin() + first(i), owner.begin() + first(i + 1), i);
        if (problem.W.is_of_bodies()) {
            for (const DelassusOfBodies::Part& part : problem.W.of_bodies().parts)
                for (const int row : part.rows)
                    groups.join(owner[static_cast<std::size_t>(part.rows.front())],
                                owner[static_cast<std::size_t>(row)]);
            return groups;
        }
        std::vector<int> last_contact(static_cast<std::size_t>(n),
                                      -1); // the contact that joined it last
        const auto join_row = [&](int row, int j) {
            const int i = owner[static_cast<std::size_t>(row)];
            int& last = last_contact[static_cast<std::size_t>(i)];
            if (i == j || last == j) return;
            last = j;
            groups.join(i, j);
        };
        if (problem.W.is_dense()) {
            const Eigen::MatrixXd& W = problem.W.dense();
            for (int j = 0; j < n && groups.count() > 1; ++j)
                for (int c = first(j); c < first(j + 1); ++c) {
                    const double* const value = W.col(c).data();
                    for (int row = 0; row < W.rows(); ++row)
                        if (value[row] != 0) join_row(row, j);
                }
            return groups;
        }
        const Delassus::Sparse& W = problem.W.sparse();
        for (int j = 0; j < n && groups.count() > 1; ++j) {
            const int column = first(j), columns = first(j + 1) - column;
            const int count = whole_blocks(W, column, columns);
            const int* const row = W.innerIndexPtr() + W.outerIndexPtr()[column];
            const double* const value = W.valuePtr() + W.outerIndexPtr()[column];
            for (int k = 0; k < count; ++k)
                if (value[k] != 0 || value[count + k] != 0 || value[2 * count + k] != 0)
                    join_row(row[k], j);
            for (int c = column; count == 0 && c < column + columns; ++c)
                for (Delassus::Sparse::InnerIterator it(W, c); it; ++it)
                    if (it.value() != 0) join_row(static_cast<int>(it.row()), j);
        }
    }
    return groups;
}

/// Copies the rows of a part out of the whole.
/// @param place  of each row of the whole, -1: scratch, left as it was
void extract(const ContactProblem& problem, ProblemPart& part, std::vector<int>& place)
{
    part.problem.level = problem.level;
    part.problem.q = problem.q(part.rows);
    part.problem.mu = problem.mu(part.contacts);
    if (problem.W.is_of_bodies()) {
        part.problem.W = of_rows(problem.W.of_bodies(), part.rows);
        return;
    }
    if (!problem.W.is_sparse()) {
        part.problem.W = problem.W.part(part.rows);
        return;
    }
    const Delassus::Sparse& whole = problem.W.sparse();
    Eigen::Index entries = 0;
    for (std::size_t k = 0; k < part.rows.size(); ++k) {
        place[static_cast<std::size_t>(part.rows[k])] = static_cast<int>(k);
        entries += whole.outerIndexPtr()[part.rows[k] + 1] - whole.outerIndexPtr()[part.rows[k]];
    }
    // Rows keep their order: columns stay sorted.
    Delassus::Sparse W(part.problem.q.size(), part.problem.q.size());
    W.reserve(entries);
    for (std::size_t k = 0; k < part.rows.size(); ++k) {
        W.startVec(static_cast<Eigen::Index>(k));
        for (Delassus::Sparse::InnerIterator it(whole, part.rows[k]); it; ++it)
            if (const int row = place[static_cast<std::size_t>(it.row())]; row >= 0)
                W.insertBackByOuterInnerUnordered(static_cast<Eigen::Index>(k), row) = it.value();
    }
    W.finalize();
    for (const Eigen::Index row : part.rows)
        place[static_cast<std::size_t>(row)] = -1;
    part.problem.W = std::move(W);
}

} // namespace

DelassusOfBodies of_rows(const DelassusOfBodies& whole, const std::vector<Eigen::Index>& rows)
{
    DelassusOfBodies chosen;
    chosen.compliance = whole.compliance(rows);
    std::vector<int> part(whole.parts.size(), -1); // of the chosen ones, by that of the whole
    for (std::size_t k = 0; k < rows.size(); ++k)
        for (const DelassusOfBodies::Place& at : whole.places(rows[k])) {
            int& own = part[static_cast<std::size_t>(at.part)];
            if (own < 0) {
                own = static_cast<int>(chosen.parts.size());
                chosen.parts.emplace_back();
            }
            chosen.parts[static_cast<std::size_t>(own)].rows.push_back(static_cast<int>(k));
        }
    for (std::size_t p = 0; p < part.size(); ++p) {
        if (part[p] < 0) continue;
        DelassusOfBodies::Part& own = chosen.parts[static_cast<std::size_t>(part[p])];
        own.G.resize(whole.parts[p].G.rows(), static_cast<Eigen::Index>(own.rows.size()));
        Eigen::Index column = 0;
        for (const int k : own.rows)
            for (const DelassusOfBodies::Place& at :
                 whole.places(rows[static_cast<std::size_t>(k)]))
                if (at.part == static_cast<int>(p))
                    own.G.col(column++) = whole.parts[p].G.col(at.column);
    }
    return chosen;
}

std::optional<std::vector<ProblemPart>> take_apart(const ContactProblem& problem)
{
    const int n = contact_count(problem);
    const std::vector<int> offset = row_offsets(problem);
    bool rubbing = true; // every frictional contact has friction
    for (int i = 0; i < n; ++i)
        rubbing =
            rubbing && !(kind_of(problem, i) == ContactKind::frictional && problem.mu[i] == 0);
    ContactGroups groups = coupled(problem, offset);
    if (problem.W.is_matrix_free() || (rubbing && groups.count() <= 1)) return {};

    std::vector<ProblemPart> parts;
    std::vector<int> part_of(static_cast<std::size_t>(n), -1);
    std::vector<char> acts; // of each part: r = 0 is not its solution
    for (int i = 0; i < n; ++i) {
        int& own = part_of[static_cast<std::size_t>(groups.find(i))];
        if (own < 0) {
            own = static_cast<int>(parts.size());
            parts.emplace_back();
            acts.push_back(0);
        }
        ProblemPart& part = parts[static_cast<std::size_t>(own)];
        ContactKind kind = kind_of(problem, i);
        if (kind == ContactKind::frictional && problem.mu[i] == 0) kind = ContactKind::frictionless;
        part.contacts.push_back(i);
        part.problem.kind.push_back(kind);
        const int row = offset[static_cast<std::size_t>(i)];
        for (int k = 0; k < rows_of(kind); ++k)
            part.rows.push_back(row + k);
        const double gap = problem.q[row];
        if (kind == ContactKind::bilateral ? gap != 0 : gap < 0)
            acts[static_cast<std::size_t>(own)] = 1;
    }
    std::vector<ProblemPart> acting;
    std::vector<int> place(static_cast<std::size_t>(problem.q.size()), -1);
    for (std::size_t k = 0; k < parts.size(); ++k)
        if (acts[k]) {
            extract(problem, parts[k], place);
            acting.push_back(std::move(parts[k]));
        }
    // The small ones first, so that they do not wait for long ones.
    std::stable_sort(acting.begin(), acting.end(), [](const ProblemPart& a, const ProblemPart& b) {
        return a.rows.size() < b.rows.size();
    });
    return acting;
}

} // namespace amontons
