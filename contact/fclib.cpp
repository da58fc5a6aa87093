#include "contact/fclib.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <sstream>

// Traps of the format:
// - A matrix with nz = -1 is stored by columns, -2 by rows, >= 0 as nz triplets in which i is the
//   row and p the column, as files have it (the comment in fclib.h states the opposite). For an
//   oblong matrix whose indices fit only the other way round, the other way is meant.
// - Indices start at 0, nzmax may exceed what is used, duplicates add up.
// - H is dofs x rows: u = H^T v + w.

namespace amontons {

const char* const kFclibGroups = "fclib_local fclib_global solution guesses amontons";

namespace {

constexpr Eigen::Index kAnySize = -1;

std::string full_text(double value)
{
    std::ostringstream out;
    out.precision(17);
    out << value;
    return out.str();
}

std::string count(std::size_t n)
{
    return std::to_string(n) + (n == 1 ? " value" : " values");
}

const char* kind_text(const NamedArray& a)
{
    switch (a.value.index()) {
    case 0:
        return "integers";
    case 1:
        return "decimal numbers";
    case 2:
        return "text";
    default:
        return "";
    }
}

/// Finds datasets, and collects their faults.
class Datasets {
public:
    Datasets(const std::vector<NamedArray>& arrays, std::string file) : file_(std::move(file))
    {
        for (const NamedArray& a : arrays)
            by_name_.emplace(a.name, &a);
    }

    bool has(const std::string& name) const { return by_name_.count(name) > 0; }
    bool has_group(const std::string& name) const
    {
        const auto it = by_name_.lower_bound(name + "/");
        return it != by_name_.end() && it->first.compare(0, name.size() + 1, name + "/") == 0;
    }
    const std::map<std::string, const NamedArray*>& all() const { return by_name_; }

    void report(const std::string& name, std::string found, std::string allowed)
    {
        issues_.push_back({file_, "/" + name, std::move(found), std::move(allowed)});
    }
    std::size_t count_issues() const { return issues_.size(); }
    void throw_issues()
    {
        if (!issues_.empty()) throw InputError(std::move(issues_));
    }
    const std::string& file() const { return file_; }

    const std::vector<std::int32_t>* integers(const std::string& name)
    {
        return get<std::vector<std::int32_t>>(name, "integers of 32 bits");
    }

    /// One integer; 0 and an issue if there is none.
    std::optional<int> integer(const std::string& name)
    {
        const std::vector<std::int32_t>* values = integers(name);
        if (!values) return {};
        if (values->size() == 1) return values->front();
        report(name, count(values->size()), "one integer");
        return {};
    }

    /// @param size  that it must have, or kAnySize
    std::optional<Eigen::VectorXd> vector(const std::string& name, Eigen::Index size)
    {
        Eigen::VectorXd v;
        if (const auto it = by_name_.find(name);
            it != by_name_.end() &&
            std::holds_alternative<std::vector<std::int32_t>>(it->second->value)) {
            const std::vector<std::int32_t>& whole =
                std::get<std::vector<std::int32_t>>(it->second->value);
            v = Eigen::Map<const Eigen::VectorXi>(whole.data(),
                                                  static_cast<Eigen::Index>(whole.size()))
                    .cast<double>();
        } else {
            const std::vector<double>* values = get<std::vector<double>>(name, "numbers");
            if (!values) return {};
            v = Eigen::Map<const Eigen::VectorXd>(values->data(),
                                                  static_cast<Eigen::Index>(values->size()));
        }
        if (size != kAnySize && v.size() != size) {
            report(name, count(static_cast<std::size_t>(v.size())), std::to_string(size));
            return {};
        }
        return v;
    }

    std::string text_of(const std::string& name) const
    {
        const auto it = by_name_.find(name);
        if (it == by_name_.end()) return "";
        const auto* found = std::get_if<std::string>(&it->second->value);
        return found ? *found : "";
    }

private:
    template <class T> const T* get(const std::string& name, const char* allowed)
    {
        const auto it = by_name_.find(name);
        if (it == by_name_.end()) {
            report(name, "no such dataset", allowed);
            return nullptr;
        }
        if (const auto* bad = std::get_if<Unreadable>(&it->second->value)) {
            report(name, bad->reason, allowed);
            return nullptr;
        }
        const T* value = std::get_if<T>(&it->second->value);
        if (!value) report(name, kind_text(*it->second), allowed);
        return value;
    }

    std::string file_;
    std::map<std::string, const NamedArray*> by_name_;
    std::vector<Issue> issues_;
};

/// Pointers of a compressed matrix: one more than columns (or rows), from 0, never falling.
bool check_pointers(Datasets& d, const std::string& name, const std::vector<std::int32_t>& p,
                    std::size_t lines, std::size_t stored)
{
    const std::string place = name + "/p";
    if (p.size() != lines + 1) {
        d.report(place, count(p.size()), std::to_string(lines + 1));
        return false;
    }
    if (p[0] != 0) {
        d.report(place + "[0]", std::to_string(p[0]), "0 (indices start at 0)");
        return false;
    }
    for (std::size_t k = 1; k < p.size(); ++k)
        if (p[k] < p[k - 1]) {
            d.report(place + "[" + std::to_string(k) + "]",
                     std::to_string(p[k]) + " after " + std::to_string(p[k - 1]),
                     "pointers that do not fall");
            return false;
        }
    if (static_cast<std::size_t>(p.back()) > stored) {
        d.report(place + "[" + std::to_string(p.size() - 1) + "]", std::to_string(p.back()),
                 "<= " + std::to_string(stored) + ", the size of i and x");
        return false;
    }
    return true;
}

/// @return  the first that is not in [0, end), or -1
std::ptrdiff_t first_outside(const std::vector<std::int32_t>& index, std::size_t used, int end)
{
    for (std::size_t k = 0; k < used; ++k)
        if (index[k] < 0 || index[k] >= end) return static_cast<std::ptrdiff_t>(k);
    return -1;
}

bool check_range(Datasets& d, const std::string& place, const std::vector<std::int32_t>& index,
                 std::size_t used, int end)
{
    const std::ptrdiff_t k = first_outside(index, used, end);
    if (k < 0) return true;
    d.report(place + "[" + std::to_string(k) + "]",
             std::to_string(index[static_cast<std::size_t>(k)]),
             end > 0 ? "0 to " + std::to_string(end - 1) : "none: the matrix is empty");
    return false;
}

std::optional<Eigen::SparseMatrix<double>> matrix(Datasets& d, const std::string& name,
                                                  Eigen::Index rows, Eigen::Index columns)
{
    const std::size_t before = d.count_issues();
    const std::optional<int> m = d.integer(name + "/m"), n = d.integer(name + "/n"),
                             nz = d.integer(name + "/nz");
    // The sizes are bounded by those of vectors that are there, before anything is allocated.
    if (m && *m != rows) d.report(name + "/m", std::to_string(*m), std::to_string(rows) + " rows");
    if (n && *n != columns)
        d.report(name + "/n", std::to_string(*n), std::to_string(columns) + " columns");
    if (nz && *nz < -2)
        d.report(name + "/nz", std::to_string(*nz), "-1 by columns, -2 by rows, >= 0 triplets");
    const std::vector<std::int32_t>* p = d.integers(name + "/p");
    const std::vector<std::int32_t>* i = d.integers(name + "/i");
    const std::optional<Eigen::VectorXd> x = d.vector(name + "/x", kAnySize);
    if (!p || !i || !x || d.count_issues() > before) return {};

    const std::size_t stored = std::min(i->size(), static_cast<std::size_t>(x->size()));
    const auto line = [](Eigen::Index k) { return static_cast<std::size_t>(k); };
    std::size_t used = 0;
    std::vector<std::int32_t> row, column; // of each entry
    if (*nz >= 0) {
        used = static_cast<std::size_t>(*nz);
        for (const auto& [part, size] : {std::pair{"/p", p->size()},
                                         {"/i", i->size()},
                                         {"/x", static_cast<std::size_t>(x->size())}})
            if (size < used)
                d.report(name + part, count(size), "at least nz = " + std::to_string(used));
        if (d.count_issues() > before) return {};
        row = *i;
        column = *p;
        if ((first_outside(row, used, *m) >= 0 || first_outside(column, used, *n) >= 0) &&
            first_outside(row, used, *n) < 0 && first_outside(column, used, *m) < 0)
            std::swap(row, column);
        const bool ok = check_range(d, name + "/i", row, used, *m);
        if (!check_range(d, name + "/p", column, used, *n) || !ok) return {};
    } else {
        const bool by_columns = *nz == -1;
        if (!check_pointers(d, name, *p, line(by_columns ? columns : rows), stored)) return {};
        used = static_cast<std::size_t>(p->back());
        if (!check_range(d, name + "/i", *i, used, by_columns ? *m : *n)) return {};
        std::vector<std::int32_t> lines(used);
        for (std::size_t k = 0; k + 1 < p->size(); ++k)
            std::fill(lines.begin() + (*p)[k], lines.begin() + (*p)[k + 1],
                      static_cast<std::int32_t>(k));
        row = by_columns ? *i : lines;
        column = by_columns ? lines : *i;
    }
    for (std::size_t k = 0; k < used; ++k)
        if (!std::isfinite((*x)[static_cast<Eigen::Index>(k)])) {
            d.report(name + "/x[" + std::to_string(k) + "]",
                     full_text((*x)[static_cast<Eigen::Index>(k)]), "finite");
            return {};
        }
    std::vector<Eigen::Triplet<double>> entries;
    entries.reserve(used);
    for (std::size_t k = 0; k < used; ++k)
        entries.emplace_back(row[k], column[k], (*x)[static_cast<Eigen::Index>(k)]);
    Eigen::SparseMatrix<double> A(rows, columns);
    A.setFromTriplets(entries.begin(), entries.end());
    return A;
}

/// q or w, and mu, with their sizes checked against each other. Empty if wrong.
struct Laws {
    Eigen::VectorXd q, mu;
};
std::optional<Laws> laws(Datasets& d, const std::string& group, const std::string& q_name)
{
    const std::size_t before = d.count_issues();
    const std::optional<int> dimension = d.integer(group + "/spacedim");
    if (dimension && *dimension != 3)
        d.report(group + "/spacedim",
                 std::to_string(*dimension) + (*dimension == 2 ? " (a plane problem)" : ""), "3");
    const auto q = d.vector(group + "/vectors/" + q_name, kAnySize);
    const auto mu = d.vector(group + "/vectors/mu", kAnySize);
    if (q && mu && d.count_issues() == before && q->size() != 3 * mu->size())
        d.report(group + "/vectors/" + q_name, count(static_cast<std::size_t>(q->size())),
                 "3 per contact: " + std::to_string(3 * mu->size()));
    if (d.count_issues() > before) return {};
    if (q->size() > std::numeric_limits<std::int32_t>::max()) {
        d.report(group + "/vectors/" + q_name, count(static_cast<std::size_t>(q->size())),
                 "<= 2147483647 values");
        return {};
    }
    return Laws{*q, *mu};
}

/// (a; b)
Eigen::VectorXd joined(const Eigen::VectorXd& a, const Eigen::VectorXd& b)
{
    Eigen::VectorXd v(a.size() + b.size());
    v << a, b;
    return v;
}

void put(std::vector<Eigen::Triplet<double>>& entries, const Eigen::SparseMatrix<double>& A,
         Eigen::Index row, Eigen::Index column, bool transposed)
{
    for (int j = 0; j < A.outerSize(); ++j)
        for (Eigen::SparseMatrix<double>::InnerIterator it(A, j); it; ++it) {
            const Eigen::Index r = transposed ? j : it.row(), c = transposed ? it.row() : j;
            entries.emplace_back(static_cast<int>(row + r), static_cast<int>(column + c),
                                 it.value());
        }
}

void add_bilateral(Eigen::VectorXd& mu, std::vector<ContactKind>& kind, Eigen::Index rows)
{
    if (rows == 0) return;
    kind.assign(static_cast<std::size_t>(mu.size()), ContactKind::frictional);
    kind.resize(static_cast<std::size_t>(mu.size() + rows), ContactKind::bilateral);
    mu = joined(mu, Eigen::VectorXd::Zero(rows));
}

std::optional<ContactProblem> local_problem(Datasets& d)
{
    const std::string group = "fclib_local";
    const std::optional<Laws> l = laws(d, group, "q");
    if (!l) return {};
    const Eigen::Index rows = l->q.size();
    std::optional<Eigen::SparseMatrix<double>> W = matrix(d, group + "/W", rows, rows);
    Eigen::VectorXd s;
    std::optional<Eigen::SparseMatrix<double>> V, R;
    if (d.has_group(group + "/V") || d.has_group(group + "/R")) {
        const auto found = d.vector(group + "/vectors/s", kAnySize);
        if (!found) return {};
        s = *found;
        V = matrix(d, group + "/V", rows, s.size());
        R = matrix(d, group + "/R", s.size(), s.size());
        if (!V || !R) return {};
    }
    if (!W) return {};
    ContactProblem p;
    p.q = joined(l->q, s);
    p.mu = l->mu;
    add_bilateral(p.mu, p.kind, s.size());
    if (s.size() > 0) {
        std::vector<Eigen::Triplet<double>> entries;
        put(entries, *W, 0, 0, false);
        put(entries, *V, 0, rows, false);
        put(entries, *V, rows, 0, true);
        put(entries, *R, rows, rows, false);
        *W = Eigen::SparseMatrix<double>(p.q.size(), p.q.size());
        W->setFromTriplets(entries.begin(), entries.end());
    }
    const auto n = static_cast<double>(p.q.size());
    if (static_cast<double>(W->nonZeros()) > kFclibDense * n * n)
        p.W = Eigen::MatrixXd(*W);
    else
        p.W = std::move(*W);
    return p;
}

std::optional<GlobalProblem> global_problem(Datasets& d)
{
    const std::string group = "fclib_global";
    const std::optional<Laws> l = laws(d, group, "w");
    const auto f = d.vector(group + "/vectors/f", kAnySize);
    if (!l || !f) return {};
    std::optional<Eigen::SparseMatrix<double>> M = matrix(d, group + "/M", f->size(), f->size());
    std::optional<Eigen::SparseMatrix<double>> H = matrix(d, group + "/H", f->size(), l->q.size());
    Eigen::VectorXd b;
    std::optional<Eigen::SparseMatrix<double>> G;
    if (d.has_group(group + "/G")) {
        const auto found = d.vector(group + "/vectors/b", kAnySize);
        if (!found) return {};
        b = *found;
        G = matrix(d, group + "/G", f->size(), b.size());
        if (!G) return {};
    }
    if (!M || !H) return {};
    GlobalProblem p;
    p.M = std::move(*M);
    p.f = *f;
    p.w = joined(l->q, b);
    p.mu = l->mu;
    add_bilateral(p.mu, p.kind, b.size());
    std::vector<Eigen::Triplet<double>> entries;
    put(entries, *H, 0, 0, false);
    if (G) put(entries, *G, 0, l->q.size(), false);
    p.H = Eigen::SparseMatrix<double>(f->size(), p.w.size());
    p.H.setFromTriplets(entries.begin(), entries.end());
    return p;
}

bool is_empty(const FclibSolution& s)
{
    return s.r.size() == 0 && s.u.size() == 0 && s.v.size() == 0;
}

/// @param rows, bilateral  of the problem; the reading of its reaction r and lambda l
FclibSolution solution(Datasets& d, const std::string& group, Eigen::Index rows,
                       Eigen::Index bilateral, Eigen::Index dofs)
{
    FclibSolution s;
    const auto part = [&](const char* name, Eigen::Index size) {
        Eigen::VectorXd v;
        // libfclib writes what it has; a vector of no entries is as good as none.
        if (!d.has(group + "/" + name)) return v;
        if (const auto found = d.vector(group + "/" + name, kAnySize)) {
            if (found->size() != 0 && size != kAnySize && found->size() != size)
                d.report(group + "/" + name, count(static_cast<std::size_t>(found->size())),
                         std::to_string(size));
            else if (!found->allFinite())
                d.report(group + "/" + name, "a number that is not finite", "finite");
            else
                v = *found;
        }
        return v;
    };
    s.r = part("r", rows - bilateral);
    s.u = part("u", rows - bilateral);
    s.v = part("v", dofs);
    if (bilateral > 0 && (s.r.size() > 0 || rows == bilateral)) {
        Eigen::VectorXd l = part("l", bilateral);
        if (l.size() == 0 && s.r.size() > 0) l.setZero(bilateral);
        s.r = joined(s.r, l);
    }
    if (bilateral > 0 && s.u.size() > 0) s.u = joined(s.u, Eigen::VectorXd::Zero(bilateral));
    return s;
}

/// issues() of the problem, with the file and the datasets in place of its own words.
template <class Problem> void check_rest(Datasets& d, const Problem& p, const std::string& group)
{
    for (const Issue& issue : issues(p)) {
        const bool is_matrix =
            !issue.place.empty() && std::string("WMHG").find(issue.place[0]) != std::string::npos;
        d.report(group + (is_matrix ? "/" : "/vectors/") + issue.place, issue.found, issue.allowed);
    }
}

} // namespace

FclibProblem fclib_problem(const std::vector<NamedArray>& arrays, const std::string& file)
{
    Datasets d(arrays, file);
    FclibProblem p;
    const bool is_local = d.has_group("fclib_local"), is_global = d.has_group("fclib_global");
    if (is_local == is_global) {
        d.report("", is_local ? "a local and a global problem" : "no contact problem",
                 is_local ? "one of them" : "a group fclib_local or fclib_global");
        d.throw_issues();
    }
    ContactLevel level =
        ContactLevel::velocity; // what FCLib's u is unless a file specifies otherwise
    if (d.has("amontons/level")) {
        const std::string found = d.text_of("amontons/level");
        if (found != "position" && found != "velocity")
            d.report("amontons/level", quoted_text(found), "position, velocity");
        p.has_level = true;
        if (found == "position") level = ContactLevel::position;
    }
    const std::string group = is_local ? "fclib_local" : "fclib_global";
    Eigen::Index rows = 0, contacts = 0, bilateral = 0, dofs = kAnySize;
    if (is_local) {
        p.local = local_problem(d);
        d.throw_issues();
        p.local->level = level;
        check_rest(d, *p.local, group);
        rows = p.local->q.size();
        contacts = p.local->mu.size();
        bilateral = std::ranges::count(p.local->kind, ContactKind::bilateral);
    } else {
        p.global = global_problem(d);
        d.throw_issues();
        p.global->level = level;
        check_rest(d, *p.global, group);
        rows = p.global->w.size();
        contacts = p.global->mu.size();
        bilateral = std::ranges::count(p.global->kind, ContactKind::bilateral);
        dofs = p.global->f.size();
    }
    if (d.has_group("solution")) {
        p.solution = solution(d, "solution", rows, bilateral, dofs);
        if (is_empty(*p.solution)) p.solution.reset(); // datasets that are not FCLib's
    }
    if (d.has("guesses/number_of_guesses")) {
        const std::optional<int> n = d.integer("guesses/number_of_guesses");
        if (n && *n < 0) d.report("guesses/number_of_guesses", std::to_string(*n), ">= 0");
        for (int k = 1; n && k <= *n; ++k) {
            const std::string guess = "guesses/" + std::to_string(k);
            if (!d.has_group(guess)) {
                d.report(guess, "no such group",
                         "as many as number_of_guesses states: " + std::to_string(*n));
                break;
            }
            p.guesses.push_back(solution(d, guess, rows, bilateral, dofs));
            if (is_empty(p.guesses.back()) && rows + std::max<Eigen::Index>(dofs, 0) > 0)
                d.report(guess, "no numbers in u, v and r", "a state of the problem");
        }
    }
    if (d.has("amontons/contact"))
        if (const std::vector<std::int32_t>* identity = d.integers("amontons/contact")) {
            if (static_cast<Eigen::Index>(identity->size()) != contacts)
                d.report("amontons/contact", count(identity->size()), std::to_string(contacts));
            p.identity = *identity;
        }
    d.throw_issues();
    p.title = d.text_of(group + "/info/title");
    p.description = d.text_of(group + "/info/description");
    p.math_info = d.text_of(group + "/info/math_info");
    return p;
}

} // namespace amontons
