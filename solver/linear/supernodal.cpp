#include "solver/linear/supernodal.hpp"

#include "mesh/base/error.hpp"
#include "mesh/base/threads.hpp"
#include "solver/linear/blas.hpp"
#include "solver/linear/cholmod_api.hpp"
#include "solver/linear/supernodes.hpp"

#include <algorithm>
#include <cholmod.h>
#include <cmath>
#ifdef __GLIBC__
#include <malloc.h>
#endif
#include <new>
#include <numeric>
#include <utility>

namespace amontons {
namespace {

/// Right-hand sides solved at once: enough for matrix products, a few per cent of L's memory.
constexpr Eigen::Index kBlock = 48;

/// From here on L's memory counts [80 MB].
constexpr std::size_t kManyEntries = 10'000'000;

/// To the system: what assembly and analysis gave back lies in pieces that the C library keeps, as
/// much as a fifth of L.
void return_free_memory()
{
#ifdef __GLIBC__
    malloc_trim(0);
#endif
}

std::span<const std::int32_t> ints(const void* data, std::size_t size)
{
    return {static_cast<const std::int32_t*>(data), size};
}

} // namespace

struct SupernodalFactor::Parts {
    cholmod_common common{};
    cholmod_factor* L = nullptr;
    SupernodalOptions options;
    bool factored = false;
    std::int64_t pattern_entries = 0; // of the matrix given to analyse

    // The lower triangle of P A P^T, and where each of its values is among those of A.
    std::vector<std::int32_t> start, row, source;
    std::vector<double> value;

    std::vector<std::int32_t> place; // of each dof in the order
    std::vector<std::int32_t> of_column, parent;
    mutable RowBlock block;
    mutable std::vector<double> work;
    mutable std::vector<char> reached, needed;

    bool opened = false; // common: CHOLMOD is not loaded for factors that are never made
    Parts() = default;
    void open()
    {
        cholmod_api().start(&common);
        opened = true;
        common.print = 0; // failures are results
        common.supernodal = CHOLMOD_SUPERNODAL;
        common.nmethods = 1;
        common.method[0].ordering = CHOLMOD_GIVEN;
        common.postorder = 1;
    }
    ~Parts()
    {
        if (!opened) return;
        cholmod_api().free_factor(&L, &common);
        cholmod_api().finish(&common);
    }
    Parts(const Parts&) = delete;
    Parts& operator=(const Parts&) = delete;

    std::int32_t size() const { return L ? std::int32_t(L->n) : 0; }
    void check_status() const
    {
        if (common.status == CHOLMOD_OUT_OF_MEMORY) throw std::bad_alloc();
        if (common.status == CHOLMOD_TOO_LARGE)
            throw std::runtime_error("the factor of a matrix with " + std::to_string(place.size()) +
                                     " rows has more than 2^31 - 1 entries");
        AMONTONS_ASSERT(common.status >= CHOLMOD_OK);
    }
    Supernodes supernodes() const
    {
        AMONTONS_ASSERT(factored);
        return tree({static_cast<const double*>(L->x), L->xsize});
    }
    Supernodes tree(std::span<const double> values) const
    {
        return {ints(L->super, L->nsuper + 1),
                ints(L->pi, L->nsuper + 1),
                ints(L->px, L->nsuper + 1),
                ints(L->s, L->ssize),
                values,
                of_column,
                parent};
    }
    std::int32_t wrong_pivot() const;
    void reserve(const FactorSizes& sizes);
    void cut_wide_supernodes();
    void find_tree();
    void find_workspace();
    void permute_pattern(const Eigen::SparseMatrix<double>& A);
    void take(std::span<const double> values);
    void mark_ways(std::span<const std::int32_t> dofs, std::vector<char>& marks) const;
};

/// The first place whose pivot is not a number > 0, or -1. CHOLMOD's own test accepts not-a-number
/// pass, as every comparison with it is false.
std::int32_t SupernodalFactor::Parts::wrong_pivot() const
{
    const Supernodes t = tree({static_cast<const double*>(L->x), L->xsize});
    for (std::int32_t s = 0; s < t.count(); ++s)
        for (int k = 0; k < t.width(s); ++k) {
            const double pivot = t.block(s)[std::ptrdiff_t(k) * (t.height(s) + 1)];
            if (!(pivot > 0 && pivot < std::numeric_limits<double>::infinity()))
                return t.first[std::size_t(s)] + k;
        }
    return -1;
}

/// Makes L one of these sizes, its arrays of integers to be filled, without its numbers.
void SupernodalFactor::Parts::reserve(const FactorSizes& sizes)
{
    cholmod_api().free_factor(&L, &common);
    L = cholmod_api().allocate_factor(std::size_t(sizes.rows), &common);
    check_status();
    L->is_ll = L->is_super = L->is_monotonic = 1;
    L->ordering = CHOLMOD_GIVEN;
    L->nsuper = std::size_t(sizes.supernodes);
    L->ssize = std::size_t(sizes.listed_rows);
    L->xsize = std::size_t(sizes.entries);
    for (void** const array : {&L->super, &L->pi, &L->px})
        *array = cholmod_api().malloc(L->nsuper + 1, sizeof(std::int32_t), &common);
    L->s = cholmod_api().malloc(L->ssize, sizeof(std::int32_t), &common);
    check_status();
}

/// Into supernodes of equal widths, each with the rows of the next ones below its own.
void SupernodalFactor::Parts::cut_wide_supernodes()
{
    const Supernodes whole = tree({});
    std::vector<std::int32_t> first, row, row_start{0}, start{0};
    for (std::int32_t s = 0; s < whole.count(); ++s) {
        const std::int32_t width = whole.width(s), height = whole.height(s),
                           parts = (width + options.widest - 1) / options.widest;
        const auto rows =
            whole.row.subspan(std::size_t(whole.row_start[std::size_t(s)]), std::size_t(height));
        for (std::int32_t k = 0; k < parts; ++k) {
            const auto begin = std::int32_t(std::int64_t(width) * k / parts),
                       end = std::int32_t(std::int64_t(width) * (k + 1) / parts);
            first.push_back(whole.first[std::size_t(s)] + begin);
            row.insert(row.end(), rows.begin() + begin, rows.end());
            row_start.push_back(std::int32_t(row.size()));
            start.push_back(start.back() + (end - begin) * (height - begin));
        }
    }
    if (first.size() == std::size_t(whole.count())) return;
    first.push_back(whole.size());
    const auto permutation = ints(L->Perm, L->n);
    const std::vector<std::int32_t> order(permutation.begin(), permutation.end());
    reserve({whole.size(), std::int64_t(first.size()) - 1, std::int64_t(row.size()), start.back()});
    const auto keep = [](const std::vector<std::int32_t>& from, void* to) {
        std::ranges::copy(from, static_cast<std::int32_t*>(to));
    };
    keep(order, L->Perm);
    keep(first, L->super);
    keep(row_start, L->pi);
    keep(start, L->px);
    keep(row, L->s);
    find_tree();
    find_workspace();
}

void SupernodalFactor::Parts::find_tree()
{
    const auto permutation = ints(L->Perm, L->n);
    place.assign(L->n, 0);
    for (std::size_t k = 0; k < L->n; ++k)
        place[std::size_t(permutation[k])] = std::int32_t(k);
    of_column.assign(L->n, 0);
    parent.assign(L->nsuper, -1);
    const Supernodes t = tree({});
    for (std::int32_t s = 0; s < t.count(); ++s)
        for (std::int32_t k = t.first[std::size_t(s)]; k < t.first[std::size_t(s) + 1]; ++k)
            of_column[std::size_t(k)] = s;
    for (std::int32_t s = 0; s < t.count(); ++s)
        if (t.height(s) > t.width(s))
            parent[std::size_t(s)] = of_column[std::size_t(t.rows_below(s)[0])];
}

/// What CHOLMOD reserves for updates: the most entries, and the most rows, that one supernode sends
/// to one ancestor and to those beyond it.
void SupernodalFactor::Parts::find_workspace()
{
    const Supernodes t = tree({});
    L->maxcsize = L->maxesize = 1;
    for (std::int32_t s = 0; s < t.count(); ++s) {
        const std::int32_t* const rows = t.rows_below(s);
        const int below = t.height(s) - t.width(s);
        L->maxesize = std::max(L->maxesize, std::size_t(below));
        for (int r = 0, end; r < below; r = end) {
            for (end = r; end < below &&
                          of_column[std::size_t(rows[end])] == of_column[std::size_t(rows[r])];)
                ++end;
            L->maxcsize = std::max(L->maxcsize, std::size_t(below - r) * std::size_t(end - r));
        }
    }
}

void SupernodalFactor::Parts::permute_pattern(const Eigen::SparseMatrix<double>& A)
{
    const auto for_each = [&](auto visit) {
        std::int32_t k = 0;
        for (Eigen::Index j = 0; j < A.cols(); ++j)
            for (Eigen::SparseMatrix<double>::InnerIterator it(A, j); it; ++it, ++k) {
                if (it.row() < j) continue;
                const auto [column, r] =
                    std::minmax(place[std::size_t(it.row())], place[std::size_t(j)]);
                visit(std::size_t(column), r, k);
            }
    };
    start.assign(std::size_t(A.cols()) + 1, 0);
    for_each([&](std::size_t column, std::int32_t, std::int32_t) { ++start[column + 1]; });
    std::partial_sum(start.begin(), start.end(), start.begin());
    row.assign(std::size_t(start.back()), 0);
    source.assign(row.size(), 0);
    value.assign(row.size(), 0);
    std::vector<std::int32_t> next(start.begin(), start.end() - 1);
    for_each([&](std::size_t column, std::int32_t r, std::int32_t k) {
        const auto at = std::size_t(next[column]++);
        row[at] = r;
        source[at] = k;
    });
}

void SupernodalFactor::Parts::mark_ways(std::span<const std::int32_t> dofs,
                                        std::vector<char>& marks) const
{
    marks.assign(parent.size(), 0);
    for (const std::int32_t dof : dofs)
        for (std::int32_t s = of_column[std::size_t(place[std::size_t(dof)])];
             s >= 0 && !marks[std::size_t(s)]; s = parent[std::size_t(s)])
            marks[std::size_t(s)] = 1;
}

SupernodalFactor::SupernodalFactor() : parts_(std::make_unique<Parts>()) {}
SupernodalFactor::~SupernodalFactor() = default;
SupernodalFactor::SupernodalFactor(SupernodalFactor&&) noexcept = default;
SupernodalFactor& SupernodalFactor::operator=(SupernodalFactor&&) noexcept = default;

void SupernodalFactor::analyse(const Eigen::SparseMatrix<double>& A,
                               std::span<const std::int32_t> node_of_dof,
                               const SupernodalOptions& options)
{
    AMONTONS_ASSERT(A.isCompressed() && A.rows() == A.cols());
    AMONTONS_ASSERT(std::size_t(A.cols()) == node_of_dof.size());
    parts_ = std::make_unique<Parts>();
    parts_->open();
    Parts& p = *parts_;
    p.options = options;
    p.pattern_entries = A.nonZeros();
    const auto n = std::size_t(A.cols());
    p.place.resize(n);
    p.start.assign(1, 0);
    if (n == 0) return;

    if (p.options.node_order.empty())
        p.options.node_order = elimination_order(node_graph(A, node_of_dof), options.ordering);
    const std::vector<std::int32_t>& order = p.options.node_order;
    std::vector<std::int32_t> place_of_node(order.size(), -1);
    for (std::size_t k = 0; k < order.size(); ++k) {
        AMONTONS_ASSERT(order[k] >= 0 && std::size_t(order[k]) < order.size());
        place_of_node[std::size_t(order[k])] = std::int32_t(k);
    }
    std::vector<std::int32_t> begin(order.size() + 1, 0), permutation(n);
    for (const std::int32_t node : node_of_dof) {
        AMONTONS_ASSERT(node >= 0 && std::size_t(node) < order.size());
        AMONTONS_ASSERT(place_of_node[std::size_t(node)] >= 0);
        ++begin[std::size_t(place_of_node[std::size_t(node)]) + 1];
    }
    std::partial_sum(begin.begin(), begin.end(), begin.begin());
    for (std::size_t dof = 0; dof < n; ++dof) {
        const auto k = std::size_t(place_of_node[std::size_t(node_of_dof[dof])]);
        permutation[std::size_t(begin[k]++)] = std::int32_t(dof);
    }

    cholmod_sparse view{};
    view.nrow = view.ncol = n;
    view.nzmax = std::size_t(A.nonZeros());
    view.p = const_cast<std::int32_t*>(A.outerIndexPtr());
    view.i = const_cast<std::int32_t*>(A.innerIndexPtr());
    view.stype = -1;
    view.itype = CHOLMOD_INT;
    view.xtype = CHOLMOD_PATTERN;
    view.dtype = CHOLMOD_DOUBLE;
    view.packed = 1;
    for (std::size_t k = 0; k < 3; ++k)
        p.common.nrelax[k] = std::size_t(options.relax[k]);
    const BlasThreads threads(options.threads);
    p.L = cholmod_api().analyze_p(&view, permutation.data(), nullptr, 0, &p.common);
    p.check_status();
    AMONTONS_ASSERT(p.L && p.L->is_super);
    p.find_tree();
    p.cut_wide_supernodes();
    p.permute_pattern(A);
}

FactorResult SupernodalFactor::factor(const Eigen::SparseMatrix<double>& A)
{
    take(A);
    return factor_taken();
}

FactorResult SupernodalFactor::refactor(std::span<const double> values)
{
    parts_->take(values);
    return factor_taken();
}

void SupernodalFactor::take(const Eigen::SparseMatrix<double>& A)
{
    AMONTONS_ASSERT(A.isCompressed() && std::size_t(A.cols()) == parts_->place.size());
    if (parts_->start.empty()) { // restored, or dropped
        parts_->permute_pattern(A);
        parts_->pattern_entries = A.nonZeros();
    }
    parts_->take({A.valuePtr(), std::size_t(A.nonZeros())});
}

void SupernodalFactor::Parts::take(std::span<const double> values)
{
    AMONTONS_ASSERT(!start.empty() && std::int64_t(values.size()) == pattern_entries);
    factored = false;
    for (std::size_t k = 0; k < source.size(); ++k)
        value[k] = values[std::size_t(source[k])];
}

void SupernodalFactor::take(std::span<const double> values, std::span<const std::int32_t> where)
{
    Parts& p = *parts_;
    AMONTONS_ASSERT(!p.start.empty() && std::int64_t(where.size()) == p.pattern_entries);
    p.factored = false;
    for (std::size_t k = 0; k < p.source.size(); ++k)
        p.value[k] = values[std::size_t(where[std::size_t(p.source[k])])];
}

void SupernodalFactor::drop_matrix()
{
    Parts& p = *parts_;
    for (std::vector<std::int32_t>* v : {&p.start, &p.row, &p.source})
        std::vector<std::int32_t>().swap(*v);
    std::vector<double>().swap(p.value);
}

FactorResult SupernodalFactor::factor_taken()
{
    Parts& p = *parts_;
    AMONTONS_ASSERT(!p.start.empty());
    if (p.place.empty()) return {true, -1};

    cholmod_sparse view{};
    view.nrow = view.ncol = p.place.size();
    view.nzmax = p.value.size();
    view.p = p.start.data();
    view.i = p.row.data();
    view.x = p.value.data();
    view.stype = -1;
    view.itype = CHOLMOD_INT;
    view.xtype = CHOLMOD_REAL;
    view.dtype = CHOLMOD_DOUBLE;
    view.packed = 1;
    double shift[2] = {0, 0};
    const BlasThreads threads(p.options.threads);
    p.common.status = CHOLMOD_OK;
    if (p.L->xtype == CHOLMOD_PATTERN && p.L->xsize > kManyEntries) return_free_memory();
    cholmod_api().super_numeric(&view, nullptr, shift, p.L, &p.common);
    p.check_status();
    if (p.L->minor < p.L->n) return {false, ints(p.L->Perm, p.L->n)[p.L->minor]};
    const std::int32_t wrong = p.wrong_pivot();
    p.factored = wrong < 0;
    return {p.factored, wrong < 0 ? -1 : permutation()[std::size_t(wrong)]};
}

void SupernodalFactor::solve(Eigen::Ref<Eigen::MatrixXd> X) const
{
    const Parts& p = *parts_;
    AMONTONS_ASSERT(std::size_t(X.rows()) == p.place.size());
    if (p.place.empty()) return;
    const Supernodes L = p.supernodes();
    const BlasThreads threads(p.options.threads);
    for (Eigen::Index first = 0; first < X.cols(); first += kBlock) {
        const Eigen::Index k = std::min(kBlock, X.cols() - first);
        p.block.resize(X.rows(), k);
        for (Eigen::Index i = 0; i < X.rows(); ++i)
            p.block.row(p.place[std::size_t(i)]) = X.row(i).segment(first, k);
        forward(L, {}, p.block, p.work);
        backward(L, {}, p.block, p.work);
        for (Eigen::Index i = 0; i < X.rows(); ++i)
            X.row(i).segment(first, k) = p.block.row(p.place[std::size_t(i)]);
    }
}

Eigen::VectorXd SupernodalFactor::solved(const Eigen::VectorXd& b) const
{
    Eigen::VectorXd x = b;
    solve(x);
    return x;
}

void SupernodalFactor::compliance(const Eigen::SparseMatrix<double>& C, Eigen::MatrixXd& W) const
{
    const Parts& p = *parts_;
    AMONTONS_ASSERT(std::size_t(C.rows()) == p.place.size());
    if (p.place.empty()) {
        W.setZero(C.cols(), C.cols());
        return;
    }
    const BlasThreads threads(p.options.threads);
    tree_compliance(p.supernodes(), C, p.place, W);
}

void SupernodalFactor::inverse_part(std::span<const std::int32_t> rows,
                                    std::span<const std::int32_t> columns,
                                    Eigen::Ref<Eigen::MatrixXd> out, int threads) const
{
    const Parts& p = *parts_;
    AMONTONS_ASSERT(std::size_t(out.rows()) == rows.size() &&
                    std::size_t(out.cols()) == columns.size());
    if (rows.empty() || columns.empty()) return;
    const Supernodes L = p.supernodes();
    const BlasThreads one_each{BlasThreads::OneEach{}};
    p.mark_ways(rows, p.needed);
    const auto fill = [&](std::size_t first, RowBlock& block, std::vector<double>& work,
                          std::vector<char>& reached) {
        const auto some =
            columns.subspan(first, std::min(std::size_t(kBlock), columns.size() - first));
        p.mark_ways(some, reached);
        block.resize(L.size(), Eigen::Index(some.size()));
        for (std::int32_t s = 0; s < L.count(); ++s)
            if (reached[std::size_t(s)] || p.needed[std::size_t(s)])
                block.middleRows(L.first[std::size_t(s)], L.width(s)).setZero();
        for (std::size_t c = 0; c < some.size(); ++c)
            block(p.place[std::size_t(some[c])], Eigen::Index(c)) = 1;
        forward(L, reached, block, work);
        backward(L, p.needed, block, work);
        for (std::size_t r = 0; r < rows.size(); ++r)
            out.row(Eigen::Index(r)).segment(Eigen::Index(first), Eigen::Index(some.size())) =
                block.row(p.place[std::size_t(rows[r])]);
    };
    const std::size_t blocks = (columns.size() + std::size_t(kBlock) - 1) / std::size_t(kBlock);
    share_out(threads, blocks, [&](std::size_t begin, std::size_t end) {
        if (begin == 0 && end == blocks) { // alone, in the memory that stays
            for (std::size_t k = begin; k < end; ++k)
                fill(k * std::size_t(kBlock), p.block, p.work, p.reached);
            return;
        }
        RowBlock block;
        std::vector<double> work;
        std::vector<char> reached;
        for (std::size_t k = begin; k < end; ++k)
            fill(k * std::size_t(kBlock), block, work, reached);
    });
}

double SupernodalFactor::compliance_flops(const Eigen::SparseMatrix<double>& C) const
{
    const Parts& p = *parts_;
    if (p.place.empty()) return 0;
    const Supernodes L = p.supernodes();
    std::vector<std::int32_t> columns(p.parent.size(), 0), last(p.parent.size(), -1);
    for (std::int32_t j = 0; j < C.cols(); ++j)
        for (Eigen::SparseMatrix<double>::InnerIterator it(C, j); it; ++it)
            for (std::int32_t s = p.of_column[std::size_t(p.place[std::size_t(it.row())])];
                 s >= 0 && last[std::size_t(s)] != j; s = p.parent[std::size_t(s)]) {
                last[std::size_t(s)] = j;
                ++columns[std::size_t(s)];
            }
    double operations = 0;
    for (std::int32_t s = 0; s < L.count(); ++s) {
        const double k = columns[std::size_t(s)], width = L.width(s);
        operations += k * width * (2.0 * L.height(s) - width + k);
    }
    return operations;
}

double SupernodalFactor::inverse_part_flops(std::span<const std::int32_t> rows) const
{
    const Parts& p = *parts_;
    if (rows.empty()) return 0;
    p.mark_ways(rows, p.needed);
    const Supernodes L = p.supernodes();
    double operations = 0; // once forward, once backward
    for (std::int32_t s = 0; s < L.count(); ++s)
        if (p.needed[std::size_t(s)])
            operations += 2.0 * L.width(s) * (2.0 * L.height(s) - L.width(s));
    return operations;
}

FactorArrays SupernodalFactor::arrays() const
{
    const Supernodes L = parts_->supernodes();
    return {permutation(), L.first, L.row_start, L.start, L.row, L.value};
}

bool SupernodalFactor::restore(const FactorSizes& sizes,
                               const std::function<bool(const FactorSpace&)>& fill,
                               const SupernodalOptions& options)
{
    parts_ = std::make_unique<Parts>();
    parts_->open();
    {
        Parts& p = *parts_;
        p.options = options;
        p.reserve(sizes);
        p.L->xtype = CHOLMOD_REAL;
        cholmod_factor& L = *p.L;
        FactorSpace space;
        const auto ints_of = [](void* array, std::size_t size) {
            return std::span(static_cast<std::int32_t*>(array), size);
        };
        space.permutation = ints_of(L.Perm, L.n);
        space.first = ints_of(L.super, L.nsuper + 1);
        space.row_start = ints_of(L.pi, L.nsuper + 1);
        space.start = ints_of(L.px, L.nsuper + 1);
        space.row = ints_of(L.s, L.ssize);
        L.x = cholmod_api().malloc(L.xsize, sizeof(double), &p.common);
        space.value = {static_cast<double*>(L.x), L.xsize};
        p.check_status();
        std::vector<char> seen(L.n, 0);
        const auto is_permutation = [&] {
            for (const std::int32_t k : space.permutation)
                if (k < 0 || std::size_t(k) >= L.n || std::exchange(seen[std::size_t(k)], 1))
                    return false;
            return true;
        };
        if (fill(space) && is_permutation() && std::size_t(space.first.back()) == L.n &&
            is_consistent(p.tree(space.value))) {
            p.find_tree();
            p.find_workspace();
            p.start.clear();
            p.factored = p.wrong_pivot() < 0;
        }
    }
    if (!parts_->factored) parts_ = std::make_unique<Parts>();
    return parts_->factored;
}

Eigen::Index SupernodalFactor::size() const
{
    return Eigen::Index(parts_->place.size());
}

bool SupernodalFactor::is_factored() const
{
    return parts_->factored;
}

std::span<const std::int32_t> SupernodalFactor::permutation() const
{
    return parts_->L ? ints(parts_->L->Perm, parts_->L->n) : std::span<const std::int32_t>{};
}

std::int64_t SupernodalFactor::stored_entries() const
{
    return parts_->L ? std::int64_t(parts_->L->xsize) : 0;
}

double SupernodalFactor::flops() const
{
    return parts_->common.fl;
}

double SupernodalFactor::pivot_ratio() const
{
    if (!parts_->factored) return 0;
    const Supernodes L = parts_->supernodes();
    double least = std::numeric_limits<double>::infinity(), most = 0;
    for (std::int32_t s = 0; s < L.count(); ++s)
        for (int k = 0; k < L.width(s); ++k) {
            const double d = L.block(s)[std::ptrdiff_t(k) * (L.height(s) + 1)];
            least = std::min(least, d);
            most = std::max(most, d);
        }
    return (least / most) * (least / most);
}

} // namespace amontons
