#include "contact/fclib.hpp"

#include <algorithm>
#include <limits>

namespace amontons {
namespace {

void put_matrix(std::vector<NamedArray>& out, const std::string& name,
                const Eigen::SparseMatrix<double>& A)
{
    if (A.nonZeros() > std::numeric_limits<std::int32_t>::max())
        throw InputError({{"contact problem", name, std::to_string(A.nonZeros()) + " entries",
                           "<= 2147483647: FCLib counts with 32 bits"}});
    Eigen::SparseMatrix<double> compressed = A;
    compressed.makeCompressed();
    const auto integer = [&](const char* part, Eigen::Index value) {
        out.push_back({name + part, std::vector<std::int32_t>{static_cast<std::int32_t>(value)}});
    };
    const Eigen::Index entries = compressed.nonZeros();
    integer("/nzmax", entries);
    integer("/m", A.rows());
    integer("/n", A.cols());
    integer("/nz", -1);
    const int* p = compressed.outerIndexPtr();
    const int* i = compressed.innerIndexPtr();
    const double* x = compressed.valuePtr();
    out.push_back({name + "/p", std::vector<std::int32_t>(p, p + A.cols() + 1)});
    out.push_back({name + "/i", std::vector<std::int32_t>(i, i + entries)});
    out.push_back({name + "/x", std::vector<double>(x, x + entries)});
}

NamedArray numbers(std::string name, const Eigen::Ref<const Eigen::VectorXd>& v)
{
    return {std::move(name), std::vector<double>(v.data(), v.data() + v.size())};
}

/// Rows of bilateral contacts at the end. @throws InputError  where FCLib has no such contact
Eigen::Index bilateral_rows(const std::vector<ContactKind>& kind)
{
    const auto first = std::find_if(kind.begin(), kind.end(),
                                    [](ContactKind k) { return k != ContactKind::frictional; });
    for (auto k = first; k != kind.end(); ++k)
        if (*k != ContactKind::bilateral)
            throw InputError(
                {{"contact problem", "kind[" + std::to_string(k - kind.begin()) + "]",
                  *k == ContactKind::frictionless ? "a frictionless contact of one row"
                                                  : "a frictional contact after a bilateral one",
                  "FCLib: contacts of 3 rows (mu = 0 without friction), then bilateral rows"}});
    return kind.end() - first;
}

Eigen::SparseMatrix<double> block(const Eigen::SparseMatrix<double>& A, Eigen::Index row,
                                  Eigen::Index column, Eigen::Index rows, Eigen::Index columns)
{
    return Eigen::SparseMatrix<double>(A.middleCols(column, columns)).middleRows(row, rows);
}

void put_local(std::vector<NamedArray>& out, const ContactProblem& p)
{
    if (p.W.is_matrix_free())
        throw InputError({{"contact problem", "W", "a function", "a matrix"}});
    const std::string group = "fclib_local";
    const Eigen::Index extra = bilateral_rows(p.kind), rows = p.q.size() - extra;
    const Eigen::SparseMatrix<double> W =
        p.W.is_dense() ? Eigen::SparseMatrix<double>(p.W.dense().sparseView(0, 0))
                       : p.W.as_sparse();
    out.push_back({group + "/spacedim", std::vector<std::int32_t>{3}});
    put_matrix(out, group + "/W", block(W, 0, 0, rows, rows));
    if (extra > 0) {
        put_matrix(out, group + "/V", block(W, 0, rows, rows, extra));
        put_matrix(out, group + "/R", block(W, rows, rows, extra, extra));
        out.push_back(numbers(group + "/vectors/s", p.q.tail(extra)));
    }
    out.push_back(numbers(group + "/vectors/q", p.q.head(rows)));
    out.push_back(numbers(group + "/vectors/mu", p.mu.head(p.mu.size() - extra)));
}

void put_global(std::vector<NamedArray>& out, const GlobalProblem& p)
{
    const std::string group = "fclib_global";
    const Eigen::Index extra = bilateral_rows(p.kind), rows = p.w.size() - extra;
    out.push_back({group + "/spacedim", std::vector<std::int32_t>{3}});
    put_matrix(out, group + "/M", p.M);
    put_matrix(out, group + "/H", p.H.leftCols(rows));
    if (extra > 0) {
        put_matrix(out, group + "/G", p.H.rightCols(extra));
        out.push_back(numbers(group + "/vectors/b", p.w.tail(extra)));
    }
    out.push_back(numbers(group + "/vectors/f", p.f));
    out.push_back(numbers(group + "/vectors/w", p.w.head(rows)));
    out.push_back(numbers(group + "/vectors/mu", p.mu.head(p.mu.size() - extra)));
}

void put_solution(std::vector<NamedArray>& out, const std::string& group, const FclibSolution& s,
                  Eigen::Index bilateral)
{
    const auto contacts = [&](const Eigen::VectorXd& v) { return v.head(v.size() - bilateral); };
    if (s.v.size() > 0) out.push_back(numbers(group + "/v", s.v));
    if (s.u.size() >= bilateral) out.push_back(numbers(group + "/u", contacts(s.u)));
    if (s.r.size() >= bilateral) out.push_back(numbers(group + "/r", contacts(s.r)));
    if (bilateral > 0 && s.r.size() >= bilateral)
        out.push_back(numbers(group + "/l", s.r.tail(bilateral)));
}

} // namespace

std::vector<NamedArray> fclib_arrays(const FclibProblem& p)
{
    std::vector<NamedArray> out;
    const std::string group = p.local ? "fclib_local" : "fclib_global";
    ContactLevel level = ContactLevel::velocity;
    Eigen::Index bilateral = 0;
    if (p.local) {
        put_local(out, *p.local);
        level = p.local->level;
        bilateral = bilateral_rows(p.local->kind);
    } else if (p.global) {
        put_global(out, *p.global);
        level = p.global->level;
        bilateral = bilateral_rows(p.global->kind);
    }
    out.push_back({group + "/info/title", p.title});
    out.push_back({group + "/info/description", p.description});
    out.push_back({group + "/info/math_info", p.math_info});
    if (p.solution) put_solution(out, "solution", *p.solution, bilateral);
    if (!p.guesses.empty()) {
        out.push_back({"guesses/number_of_guesses",
                       std::vector<std::int32_t>{static_cast<std::int32_t>(p.guesses.size())}});
        for (std::size_t k = 0; k < p.guesses.size(); ++k)
            put_solution(out, "guesses/" + std::to_string(k + 1), p.guesses[k], bilateral);
    }
    out.push_back(
        {"amontons/level", std::string(level == ContactLevel::position ? "position" : "velocity")});
    if (!p.identity.empty()) out.push_back({"amontons/contact", p.identity});
    return out;
}

FclibForm fclib_form(const ContactProblem& p)
{
    if (p.W.is_matrix_free())
        throw InputError({{"contact problem", "W", "a function", "a matrix"}});
    FclibForm form;
    form.problem.level = p.level;
    form.problem.mu = p.mu;
    Eigen::Index rows = 0;
    std::vector<Eigen::Index> added; // the row whose entry of W each new row takes; -1: none new
    for (int i = 0; i < contact_count(p); ++i) {
        const ContactKind kind = kind_of(p, i);
        for (int k = 0; k < rows_of(kind); ++k) {
            form.rows.push_back(rows++);
            added.push_back(-1);
        }
        form.problem.kind.push_back(kind);
        if (kind != ContactKind::frictionless) continue;
        form.problem.kind.back() = ContactKind::frictional;
        form.problem.mu[i] = 0;
        rows += 2;
        added.insert(added.end(), 2, Eigen::Index(form.rows.size()) - 1);
    }
    form.problem.q = Eigen::VectorXd::Zero(rows);
    form.problem.q(form.rows) = p.q;
    const Eigen::VectorXd own = p.W.diagonal();
    if (p.W.is_dense()) {
        Eigen::MatrixXd W = Eigen::MatrixXd::Zero(rows, rows);
        W(form.rows, form.rows) = p.W.dense();
        for (Eigen::Index k = 0; k < rows; ++k)
            if (added[std::size_t(k)] >= 0) W(k, k) = own[added[std::size_t(k)]];
        form.problem.W = std::move(W);
        return form;
    }
    const Delassus::Sparse before = p.W.as_sparse();
    std::vector<Eigen::Triplet<double>> entries;
    for (Eigen::Index j = 0; j < before.outerSize(); ++j)
        for (Delassus::Sparse::InnerIterator it(before, j); it; ++it)
            entries.emplace_back(int(form.rows[std::size_t(it.row())]),
                                 int(form.rows[std::size_t(it.col())]), it.value());
    for (Eigen::Index k = 0; k < rows; ++k)
        if (added[std::size_t(k)] >= 0)
            entries.emplace_back(int(k), int(k), own[added[std::size_t(k)]]);
    Delassus::Sparse W(rows, rows);
    W.setFromTriplets(entries.begin(), entries.end());
    form.problem.W = std::move(W);
    return form;
}

std::vector<NamedArray> fclib_solution_arrays(const FclibSolution& s, Eigen::Index bilateral)
{
    std::vector<NamedArray> out;
    put_solution(out, "solution", s, bilateral);
    return out;
}

} // namespace amontons
