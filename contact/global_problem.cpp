#include "contact/global_problem.hpp"

#include "contact/number_text.hpp"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <sstream>

// W = H^T M^-1 H needs M^-1 only where contacts touch. With P M P^T = L D L^T and the touched
// unknowns last in P, the columns of P H begin in the last rows, so that
//
//   Y = L^-1 P H   stays within the trailing block of L,   W = Y^T D^-1 Y.
//
// W is symmetric and semidefinite by construction. Which entries of Y are not zero follows from
// the elimination tree (parent of j: the first entry of L below the diagonal in column j): the
// paths from a column's entries up to the root. So block-diagonal M costs what its blocks cost.

namespace amontons {
namespace {

using Permutation = Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int>;

constexpr const char* kGlobalProblem = "global contact problem"; // stands where a file name would
/// A pivot below this times its diagonal entry is zero up to round-off.
constexpr double kPivot = 64 * std::numeric_limits<double>::epsilon();

std::string sparse_size_text(const Eigen::SparseMatrix<double>& A)
{
    return std::to_string(A.rows()) + " x " + std::to_string(A.cols());
}

bool all_finite(const Eigen::SparseMatrix<double>& A)
{
    return A.nonZeros() == 0 || Eigen::SparseMatrix<double>(A).coeffs().allFinite();
}

double asymmetry(const Eigen::SparseMatrix<double>& M)
{
    const double size =
        M.nonZeros() > 0 ? Eigen::SparseMatrix<double>(M).coeffs().abs().maxCoeff() : 0;
    if (size == 0) return 0;
    const Eigen::SparseMatrix<double> scaled = M / size; // squares stay in range
    return (scaled - Eigen::SparseMatrix<double>(scaled.transpose())).norm() / scaled.norm();
}

/// Numbers of the connected components of M's graph, one for each unknown.
std::vector<int> components(const Eigen::SparseMatrix<double>& M)
{
    std::vector<int> root(static_cast<std::size_t>(M.rows()));
    std::iota(root.begin(), root.end(), 0);
    const auto find = [&](int i) {
        while (root[static_cast<std::size_t>(i)] != i) {
            int& up = root[static_cast<std::size_t>(i)];
            up = root[static_cast<std::size_t>(up)];
            i = up;
        }
        return i;
    };
    for (int j = 0; j < M.outerSize(); ++j)
        for (Eigen::SparseMatrix<double>::InnerIterator it(M, j); it; ++it) {
            const int a = find(static_cast<int>(it.row())), b = find(j);
            root[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
        }
    for (int i = 0; i < M.rows(); ++i)
        root[static_cast<std::size_t>(i)] = find(i);
    return root;
}

/// How many entries W can have: two rows are coupled where they touch the same component of M.
/// Counted where that is quick, else an upper bound.
double predicted_entries(const Eigen::SparseMatrix<double>& M, const Eigen::SparseMatrix<double>& H)
{
    constexpr double kQuick = 1e8;
    const std::vector<int> component = components(M);
    std::vector<std::vector<int>> rows(component.size()); // that touch a component
    for (int j = 0; j < H.outerSize(); ++j)
        for (Eigen::SparseMatrix<double>::InnerIterator it(H, j); it; ++it) {
            std::vector<int>& here =
                rows[static_cast<std::size_t>(component[static_cast<std::size_t>(it.row())])];
            if (here.empty() || here.back() != j) here.push_back(j);
        }
    double entries = 0;
    for (const std::vector<int>& here : rows)
        entries += std::pow(static_cast<double>(here.size()), 2);
    const auto n = static_cast<double>(H.cols());
    if (entries > kQuick) return std::min(entries, n * n);

    entries = 0;
    std::vector<int> last_column(static_cast<std::size_t>(H.cols()), -1),
        seen(component.size(), -1);
    for (int j = 0; j < H.outerSize(); ++j)
        for (Eigen::SparseMatrix<double>::InnerIterator it(H, j); it; ++it) {
            const auto c = static_cast<std::size_t>(component[static_cast<std::size_t>(it.row())]);
            if (seen[c] == j) continue;
            seen[c] = j;
            for (const int other : rows[c])
                if (last_column[static_cast<std::size_t>(other)] != j) {
                    last_column[static_cast<std::size_t>(other)] = j;
                    ++entries;
                }
        }
    return entries;
}

/// Minimum degree; with `touched_last`, those that H touches come last, else in the same order.
Permutation order(const Eigen::SparseMatrix<double>& M, const Eigen::SparseMatrix<double>& H,
                  bool touched_last)
{
    const Eigen::Index n = M.rows();
    Permutation by_degree(n);
    if (n == 0) return by_degree;
    Eigen::AMDOrdering<int>()(M.selfadjointView<Eigen::Lower>(), by_degree);
    if (!touched_last) return by_degree.inverse(); // AMD gives the old index of each new one
    std::vector<char> touched(static_cast<std::size_t>(n), 0);
    for (int j = 0; j < H.outerSize(); ++j)
        for (Eigen::SparseMatrix<double>::InnerIterator it(H, j); it; ++it)
            touched[static_cast<std::size_t>(it.row())] = 1;
    Permutation place(n);
    int next = 0;
    for (const char last : {'\0', '\1'})
        for (Eigen::Index k = 0; k < n; ++k) {
            const int old = by_degree.indices()[k];
            if (touched[static_cast<std::size_t>(old)] == last) place.indices()[old] = next++;
        }
    return place;
}

} // namespace

std::vector<Issue> issues(const GlobalProblem& p)
{
    std::vector<Issue> found;
    const auto report = [&](std::string place, std::string what, std::string allowed) {
        found.push_back({kGlobalProblem, std::move(place), std::move(what), std::move(allowed)});
    };
    const Eigen::Index dofs = p.M.rows();
    const Eigen::Index n = p.mu.size();
    if (!p.kind.empty() && static_cast<Eigen::Index>(p.kind.size()) != n) {
        report("kind", std::to_string(p.kind.size()) + " entries",
               "none, or one per contact: " + std::to_string(n));
        return found;
    }
    ContactProblem laws;
    laws.mu = p.mu;
    laws.kind = p.kind;
    const Eigen::Index rows = row_offsets(laws).back();
    if (p.M.cols() != dofs) report("M", sparse_size_text(p.M), "a square matrix");
    if (p.H.rows() != dofs || p.H.cols() != rows)
        report("H", sparse_size_text(p.H), std::to_string(dofs) + " x " + std::to_string(rows));
    if (p.f.size() != dofs)
        report("f", std::to_string(p.f.size()) + " entries", std::to_string(dofs));
    if (p.w.size() != rows)
        report("w", std::to_string(p.w.size()) + " entries", std::to_string(rows));
    const char* number = "a number that is not finite";
    if (!all_finite(p.M))
        report("M", number, "finite");
    else if (p.M.cols() == dofs)
        if (const double skew = asymmetry(p.M); skew > kMaxBodyAsymmetry)
            report("M", "asymmetry |M - M^T| / |M| = " + number_text(skew),
                   "<= " + number_text(kMaxBodyAsymmetry) + ", both triangles stored");
    if (!all_finite(p.H)) report("H", number, "finite");
    if (!p.f.allFinite()) report("f", number, "finite");
    if (!p.w.allFinite()) report("w", number, "finite");
    if (!(p.mu.array() >= 0).all() || !p.mu.allFinite())
        report("mu", "a number that is negative or not finite", "finite, >= 0");
    return found;
}

struct CondensedProblem::Factor {
    Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower, Eigen::NaturalOrdering<int>>
        ldlt;
    Permutation place; ///< of an unknown in the factor
    Eigen::VectorXd D;

    Factor(const Eigen::SparseMatrix<double>& M, const Permutation& order) : place(order)
    {
        if (M.rows() == 0) return;
        const Eigen::SparseMatrix<double> symmetric =
            0.5 * (M + Eigen::SparseMatrix<double>(M.transpose()));
        Eigen::SparseMatrix<double> permuted(M.rows(), M.cols());
        permuted = symmetric.twistedBy(place);
        ldlt.compute(permuted);
        const auto refuse = [](const std::string& what) {
            throw InputError({{kGlobalProblem, "M", what,
                               "a positive definite matrix (no body free to move by itself, no "
                               "negative mass or stiffness)"}});
        };
        if (ldlt.info() != Eigen::Success) refuse("a singular matrix");
        D = ldlt.vectorD();
        const Permutation old = place.inverse();
        for (Eigen::Index k = 0; k < D.size(); ++k) {
            const double diagonal = permuted.coeff(k, k);
            if (D[k] > kPivot * diagonal && diagonal > 0) continue;
            refuse("a matrix that is " +
                   std::string(D[k] < -kPivot * std::abs(diagonal) ? "indefinite" : "singular") +
                   ": pivot " + number_text(D[k]) + " in row " + std::to_string(old.indices()[k]) +
                   ", with " + number_text(diagonal) + " on the diagonal");
        }
    }

    const Eigen::SparseMatrix<double>& L() const
    {
        return ldlt.matrixL().nestedExpression();
    } // without the diagonal

    Eigen::VectorXd solve(const Eigen::VectorXd& x) const
    {
        if (x.size() == 0) return x;
        Eigen::VectorXd y = place * x;
        y = ldlt.solve(y);
        return place.inverse() * y;
    }

    /// Column after column of Y = L^-1 P H, each with the rows that may be non-zero, ascending.
    /// take(column, rows, values): `values` has all dofs, and is zero elsewhere.
    template <class Take>
    void forward(const Eigen::SparseMatrix<double>& H, int first, int count, Take take) const
    {
        const Eigen::SparseMatrix<double>& lower = L();
        const auto n = static_cast<std::size_t>(lower.rows());
        std::vector<int> mark(n, -1), rows;
        Eigen::VectorXd y = Eigen::VectorXd::Zero(lower.rows());
        for (int j = first; j < first + count; ++j) {
            rows.clear();
            for (Eigen::SparseMatrix<double>::InnerIterator it(H, j); it; ++it) {
                int k = place.indices()[it.row()];
                y[k] = it.value();
                while (mark[static_cast<std::size_t>(k)] != j) {
                    mark[static_cast<std::size_t>(k)] = j;
                    rows.push_back(k);
                    const Eigen::SparseMatrix<double>::InnerIterator below(lower, k);
                    if (!below) break;
                    k = static_cast<int>(below.row());
                }
            }
            std::sort(rows.begin(), rows.end());
            for (const int k : rows)
                if (y[k] != 0)
                    for (Eigen::SparseMatrix<double>::InnerIterator it(lower, k); it; ++it)
                        y[it.row()] -= it.value() * y[k];
            take(j, rows, y);
            for (const int k : rows)
                y[k] = 0;
        }
    }

    /// Y scaled by D^-1/2, so that W = Y^T Y.
    Eigen::SparseMatrix<double> half(const Eigen::SparseMatrix<double>& H) const
    {
        std::vector<Eigen::Triplet<double>> entries;
        forward(H, 0, static_cast<int>(H.cols()),
                [&](int j, const std::vector<int>& rows, const Eigen::VectorXd& y) {
                    for (const int k : rows)
                        entries.emplace_back(k, j, y[k] / std::sqrt(D[k]));
                });
        Eigen::SparseMatrix<double> Y(H.rows(), H.cols());
        Y.setFromTriplets(entries.begin(), entries.end());
        return Y;
    }

    /// W where it is mostly full: by the trailing block of L as a dense matrix.
    Eigen::MatrixXd dense_delassus(const Eigen::SparseMatrix<double>& H) const
    {
        Eigen::Index first = H.rows();
        for (int j = 0; j < H.outerSize(); ++j)
            for (Eigen::SparseMatrix<double>::InnerIterator it(H, j); it; ++it)
                first = std::min<Eigen::Index>(first, place.indices()[it.row()]);
        const Eigen::Index m = H.rows() - first;
        Eigen::MatrixXd Y = Eigen::MatrixXd::Zero(m, H.cols());
        for (int j = 0; j < H.outerSize(); ++j)
            for (Eigen::SparseMatrix<double>::InnerIterator it(H, j); it; ++it)
                Y(place.indices()[it.row()] - first, j) = it.value();
        Eigen::MatrixXd W = Eigen::MatrixXd::Zero(H.cols(), H.cols());
        if (m == 0) return W;
        const Eigen::MatrixXd trailing = L().bottomRightCorner(m, m);
        trailing.triangularView<Eigen::UnitLower>().solveInPlace(Y);
        Y = D.tail(m).cwiseSqrt().cwiseInverse().asDiagonal() * Y;
        W.selfadjointView<Eigen::Lower>().rankUpdate(Y.transpose());
        return W.selfadjointView<Eigen::Lower>();
    }

    /// The contacts' own blocks of W, exact.
    Eigen::SparseMatrix<double> blocks(const Eigen::SparseMatrix<double>& H,
                                       const std::vector<int>& offset) const
    {
        std::vector<Eigen::Triplet<double>> entries;
        for (std::size_t c = 0; c + 1 < offset.size(); ++c) {
            const int first = offset[c], size = offset[c + 1] - first;
            const Eigen::SparseMatrix<double> Y = half(H.middleCols(first, size));
            const Eigen::MatrixXd block =
                Eigen::MatrixXd(Eigen::SparseMatrix<double>(Y.transpose() * Y));
            for (int j = 0; j < size; ++j)
                for (int i = 0; i < size; ++i)
                    entries.emplace_back(first + i, first + j, block(i, j));
        }
        Eigen::SparseMatrix<double> all(H.cols(), H.cols());
        all.setFromTriplets(entries.begin(), entries.end());
        return all;
    }
};

CondensedProblem::CondensedProblem(const GlobalProblem& p, const CondenseOptions& options)
{
    if (std::vector<Issue> found = issues(p); !found.empty()) throw InputError(std::move(found));
    H_ = p.H;
    H_.makeCompressed();
    f_ = p.f;
    contact_.mu = p.mu;
    contact_.kind = p.kind;
    contact_.level = p.level;

    const auto rows = static_cast<double>(H_.cols());
    const double entries = predicted_entries(p.M, H_);
    const bool dense = entries > options.dense_above * rows * rows;
    // Dense: W and, of the same size at most, Y. Sparse: twice an index and a number each.
    const double bytes = dense ? 16 * rows * rows : 24 * entries;
    const bool fits = bytes <= options.memory && entries < std::numeric_limits<int>::max();
    const bool matrix = options.form == CondenseOptions::Form::matrix ||
                        (options.form == CondenseOptions::Form::automatic && fits);

    const auto factor = std::make_shared<const Factor>(p.M, order(p.M, H_, matrix));
    factor_ = factor;
    contact_.q = p.w + H_.transpose() * factor->solve(f_);
    if (!matrix) {
        MatrixFreeDelassus W;
        W.rows = H_.cols();
        W.blocks = factor->blocks(H_, row_offsets(contact_));
        W.apply = [factor, H = H_](const Eigen::VectorXd& r, Eigen::VectorXd& out) {
            const Eigen::VectorXd force = H * r;
            out.noalias() = H.transpose() * factor->solve(force);
        };
        contact_.W = std::move(W);
    } else if (dense) {
        contact_.W = factor->dense_delassus(H_);
    } else {
        const Eigen::SparseMatrix<double> Y = factor->half(H_);
        Eigen::SparseMatrix<double> W = Y.transpose() * Y;
        contact_.W = std::move(W);
    }
}

CondensedProblem::~CondensedProblem() = default;
CondensedProblem::CondensedProblem(CondensedProblem&&) noexcept = default;
CondensedProblem& CondensedProblem::operator=(CondensedProblem&&) noexcept = default;

Eigen::VectorXd CondensedProblem::motion(const Eigen::VectorXd& r) const
{
    const Eigen::VectorXd force = H_ * r + f_;
    return factor_->solve(force);
}

} // namespace amontons
