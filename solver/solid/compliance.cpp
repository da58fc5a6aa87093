#include "solver/solid/compliance.hpp"

#include "solver/solid/congruence.hpp"

#include <algorithm>

namespace amontons {
namespace {

/// Nodes whose columns are solved at once.
constexpr std::size_t kNodesAtOnce = 16;
/// Right-hand sides of whole solves at once.
constexpr Eigen::Index kSolvedAtOnce = 16;

} // namespace

FactorResult factor_free(const SparseMatrix& whole, const FreeDofs& dofs,
                         const SupernodalOptions& options, SupernodalFactor& factor)
{
    const SparseMatrix free = make_elimination(whole, dofs).ff;
    std::vector<std::int32_t> node_of_dof;
    node_of_dof.reserve(dofs.free.size());
    for (const std::int32_t dof : dofs.free)
        node_of_dof.push_back(dof / 3);
    factor.analyse(free, node_of_dof, options);
    return factor.factor(free);
}

SolidCompliance::SolidCompliance(SupernodalFactor factor, FreeDofs dofs,
                                 std::span<const std::int32_t> surface_nodes, std::size_t memory,
                                 ColumnRows rows)
    : factor_(std::move(factor))
    , dofs_(std::move(dofs))
    , surface_node_(surface_nodes.begin(), surface_nodes.end())
    , surface_number_(dofs_.number.size() / 3, -1)
    , all_rows_(rows == ColumnRows::all)
    , row_nodes_(Eigen::Index(all_rows_ ? dofs_.number.size() / 3 : surface_nodes.size()))
    , column_of_(surface_nodes.size(), -1)
    , place_(surface_nodes.size(), -1)
{
    AMONTONS_ASSERT(factor_.size() == Eigen::Index(dofs_.free.size()));
    AMONTONS_ASSERT(factor_.is_factored() || dofs_.free.empty());
    for (std::size_t s = 0; s < surface_node_.size(); ++s) {
        const auto node = std::size_t(surface_node_[s]);
        AMONTONS_ASSERT(node < surface_number_.size() && surface_number_[node] < 0);
        surface_number_[node] = std::int32_t(s);
    }
    for (std::size_t k = 0; k < std::size_t(row_nodes_); ++k)
        for (std::size_t a = 0; a < 3; ++a) {
            const std::size_t node = all_rows_ ? k : std::size_t(surface_node_[k]);
            if (const std::int32_t number = dofs_.number[3 * node + a]; number >= 0) {
                row_dofs_.push_back(number);
                place_of_row_.push_back(std::int32_t(3 * k + a));
            }
        }
    if (!surface_node_.empty())
        most_columns_ =
            std::min(memory / (9 * sizeof(double) * std::size_t(row_nodes_)), surface_node_.size());
    column_cost_ = 3 * factor_.inverse_part_flops(row_dofs_);
}

void SolidCompliance::set_scale(double scale)
{
    AMONTONS_ASSERT(scale > 0);
    scale_ = scale;
}

void SolidCompliance::drop_nodes()
{
    for (const std::int32_t s : in_contact_)
        place_[std::size_t(s)] = -1;
    in_contact_.clear();
}

void SolidCompliance::order_nodes()
{
    std::sort(in_contact_.begin(), in_contact_.end());
    for (std::size_t k = 0; k < in_contact_.size(); ++k)
        place_[std::size_t(in_contact_[k])] = std::int32_t(k);
}

/// Fills in_contact_ and place_.
void SolidCompliance::find_nodes(const SparseMatrix& C)
{
    drop_nodes();
    for (Eigen::Index k = 0; k < C.nonZeros(); ++k) {
        const std::int32_t node = dofs_.free[std::size_t(C.innerIndexPtr()[k])] / 3;
        const std::int32_t s = surface_number_[std::size_t(node)];
        AMONTONS_ASSERT(s >= 0);
        if (place_[std::size_t(s)] >= 0) continue;
        place_[std::size_t(s)] = 0;
        in_contact_.push_back(s);
    }
    order_nodes();
}

/// A place for a column that this call does not use.
std::int32_t SolidCompliance::free_column()
{
    if (columns_.size() < most_columns_) {
        columns_.emplace_back().value.resize(9 * std::size_t(row_nodes_));
        counts_.bytes += columns_.back().value.size() * sizeof(double);
        return std::int32_t(columns_.size()) - 1;
    }
    const auto oldest =
        std::min_element(columns_.begin(), columns_.end(), [](const Column& a, const Column& b) {
            return a.last_used < b.last_used;
        });
    AMONTONS_ASSERT(oldest->last_used < calls_);
    column_of_[std::size_t(oldest->node)] = -1;
    ++counts_.columns_dropped;
    return std::int32_t(oldest - columns_.begin());
}

void SolidCompliance::solve_columns(std::span<const std::int32_t> missing)
{
    const std::size_t at_once = kNodesAtOnce * std::size_t(threads_);
    Eigen::MatrixXd part;
    std::vector<std::int32_t> numbers, place; // of the columns solved: 3 node + axis, or -1
    for (std::size_t first = 0; first < missing.size(); first += at_once) {
        const auto some = missing.subspan(first, std::min(at_once, missing.size() - first));
        numbers.clear();
        place.clear();
        for (std::size_t k = 0; k < some.size(); ++k) {
            for (std::size_t a = 0; a < 3; ++a)
                if (const std::int32_t number =
                        dofs_.number[3 * std::size_t(surface_node_[std::size_t(some[k])]) + a];
                    number >= 0) {
                    numbers.push_back(number);
                    place.push_back(std::int32_t(3 * k + a));
                }
            // Always as many in a lot, so that a column's last bits do not depend on those beside
            // it, nor on threads.
            const bool lot_ends = (k + 1) % kNodesAtOnce == 0 || k + 1 == some.size();
            if (lot_ends && numbers.size() % (3 * kNodesAtOnce) != 0) {
                const std::size_t lots = numbers.size() / (3 * kNodesAtOnce) + 1;
                numbers.resize(lots * 3 * kNodesAtOnce, numbers.back());
                place.resize(numbers.size(), -1);
            }
        }
        part.resize(Eigen::Index(row_dofs_.size()), Eigen::Index(numbers.size()));
        factor_.inverse_part(row_dofs_, numbers, part, threads_);
        for (const std::int32_t s : some) {
            const std::int32_t slot = free_column();
            Column& c = columns_[std::size_t(slot)];
            c.node = s;
            c.last_used = calls_;
            std::fill(c.value.begin(), c.value.end(), 0.0);
            column_of_[std::size_t(s)] = slot;
        }
        for (std::size_t k = 0; k < place.size(); ++k) {
            if (place[k] < 0) continue;
            const std::int32_t s = some[std::size_t(place[k]) / 3];
            double* const to = columns_[std::size_t(column_of_[std::size_t(s)])].value.data() +
                               3 * row_nodes_ * (place[k] % 3);
            for (std::size_t r = 0; r < place_of_row_.size(); ++r)
                to[place_of_row_[r]] = part(Eigen::Index(r), Eigen::Index(k));
        }
        counts_.columns_solved += std::int64_t(some.size());
    }
}

/// Whether the columns of in_contact_ are there; they are then marked as used.
bool SolidCompliance::has_columns()
{
    for (const std::int32_t s : in_contact_)
        if (column_of_[std::size_t(s)] < 0) return false;
    use_columns();
    return true;
}

/// Whether it is time to solve the columns that are missing; if so they are there afterwards.
bool SolidCompliance::columns_pay(double without)
{
    if (in_contact_.size() > most_columns_) return false;
    const auto missing = std::count_if(in_contact_.begin(), in_contact_.end(), [&](std::int32_t s) {
        return column_of_[std::size_t(s)] < 0;
    });
    spent_ += without;
    const double cost = column_cost_ * double(missing);
    if (spent_ + expected_ < cost) return false;
    expected_ = std::max(0.0, expected_ - std::max(0.0, cost - spent_));
    spent_ = 0;
    use_columns();
    return true;
}

/// Fills the last lot of columns, which costs the same with fewer, while more solves are expected:
/// with nodes next to those that are missing, by number.
void SolidCompliance::add_expected(std::vector<std::int32_t>& missing)
{
    const std::size_t lots = (missing.size() + kNodesAtOnce - 1) / kNodesAtOnce;
    const std::size_t most = std::min(
        lots * kNodesAtOnce, missing.size() + std::min(most_columns_ - columns_.size(),
                                                       std::size_t(expected_ / column_cost_)));
    std::vector<char> chosen(surface_node_.size(), 0);
    for (const std::int32_t s : missing)
        chosen[std::size_t(s)] = 1;
    const std::size_t requested = missing.size();
    for (std::size_t off = 1; off < chosen.size() && missing.size() < most; ++off)
        for (std::size_t k = 0; k < requested && missing.size() < most; ++k)
            for (const std::size_t s : {std::size_t(missing[k]) + off,
                                        std::size_t(missing[k]) - off}) // wraps round: too large
                if (s < chosen.size() && !chosen[s] && column_of_[s] < 0 && missing.size() < most) {
                    chosen[s] = 1;
                    missing.push_back(std::int32_t(s));
                    expected_ -= column_cost_;
                }
}

/// Solves what is missing of in_contact_, for which there must be room.
void SolidCompliance::use_columns()
{
    ++calls_;
    std::vector<std::int32_t> missing;
    for (const std::int32_t s : in_contact_) {
        if (column_of_[std::size_t(s)] < 0)
            missing.push_back(s);
        else
            columns_[std::size_t(column_of_[std::size_t(s)])].last_used = calls_;
    }
    if (missing.empty()) return;
    if (columns_.size() + missing.size() < most_columns_) add_expected(missing);
    solve_columns(missing);
}

/// A solve of one right-hand side, in operations of those of many: memory keeps it from being as
/// quick (205,000 nodes: 1.3 s against 0.09 s for a column among many).
double SolidCompliance::solve_flops() const
{
    constexpr double kSlower = 10;
    return kSlower * 4 * double(factor_.stored_entries());
}

void SolidCompliance::expect(double solves)
{
    expected_ += solves * solve_flops();
}

void SolidCompliance::prepare(std::span<const std::int32_t> nodes)
{
    drop_nodes();
    for (const std::int32_t node : nodes) {
        const std::int32_t s = surface_number_[std::size_t(node)];
        AMONTONS_ASSERT(s >= 0);
        if (place_[std::size_t(s)] >= 0) continue;
        place_[std::size_t(s)] = 0;
        in_contact_.push_back(s);
    }
    order_nodes();
    while (in_contact_.size() > most_columns_) {
        place_[std::size_t(in_contact_.back())] = -1;
        in_contact_.pop_back();
    }
    use_columns();
}

void SolidCompliance::delassus_from_factor(const SparseMatrix& C, Eigen::MatrixXd& W)
{
    ++counts_.from_factor;
    factor_.compliance(C, W);
    W /= scale_;
}

bool SolidCompliance::delassus(const SparseMatrix& C, Eigen::MatrixXd& W)
{
    AMONTONS_ASSERT(C.isCompressed() && C.rows() == Eigen::Index(dofs_.free.size()));
    find_nodes(C);
    if (!has_columns() && !columns_pay(factor_.compliance_flops(C))) {
        delassus_from_factor(C, W);
        return false;
    }
    // The part of A^-1 between nodes in contact, contiguous; often the same as before.
    const std::size_t nodes = in_contact_.size();
    const Eigen::Index n = 3 * Eigen::Index(nodes);
    if (part_nodes_ != in_contact_) {
        part_nodes_ = in_contact_;
        part_.resize(n, n);
        for (std::size_t b = 0; b < nodes; ++b) {
            const Three from = column(in_contact_[b]);
            for (std::size_t a = 0; a < nodes; ++a)
                part_.block<3, 3>(3 * Eigen::Index(a), 3 * Eigen::Index(b)) =
                    from.middleRows<3>(row_of(in_contact_[a]));
        }
    }
    const auto place = [&](Eigen::Index free) {
        const std::int32_t dof = dofs_.free[std::size_t(free)];
        return 3 * Eigen::Index(place_[std::size_t(surface_number_[std::size_t(dof / 3)])]) +
               dof % 3;
    };
    std::vector<Eigen::Index> places(std::size_t(C.nonZeros()));
    for (std::size_t k = 0; k < places.size(); ++k)
        places[k] = place(C.innerIndexPtr()[k]);
    congruence(part_, C, places, W);
    W /= scale_;
    return true;
}

Eigen::VectorXd SolidCompliance::displacement(const Eigen::VectorXd& f) const
{
    AMONTONS_ASSERT(f.size() == Eigen::Index(dofs_.number.size()));
    Eigen::VectorXd some(Eigen::Index(dofs_.free.size()));
    for (std::size_t k = 0; k < dofs_.free.size(); ++k)
        some[Eigen::Index(k)] = f[dofs_.free[k]] / scale_;
    factor_.solve(some);
    Eigen::VectorXd x = Eigen::VectorXd::Zero(f.size());
    for (std::size_t k = 0; k < dofs_.free.size(); ++k)
        x[dofs_.free[k]] = some[Eigen::Index(k)];
    return x;
}

/// What forces on in_contact_, whose columns are there, move: all rows that are kept.
Eigen::VectorXd SolidCompliance::moved_by(std::span<const Vec3> force) const
{
    Eigen::VectorXd x = Eigen::VectorXd::Zero(3 * row_nodes_);
    for (std::size_t k = 0; k < in_contact_.size(); ++k) {
        const Three from = column(in_contact_[k]);
        x += force[k][0] * from.col(0) + force[k][1] * from.col(1) + force[k][2] * from.col(2);
    }
    return x;
}

/// Of all rows that are kept, those of the surface.
Eigen::VectorXd SolidCompliance::on_surface(const Eigen::VectorXd& x) const
{
    if (!all_rows_) return x;
    Eigen::VectorXd out(3 * Eigen::Index(surface_node_.size()));
    for (std::size_t s = 0; s < surface_node_.size(); ++s)
        out.segment<3>(3 * Eigen::Index(s)) = x.segment<3>(3 * surface_node_[s]);
    return out;
}

Eigen::VectorXd SolidCompliance::surface_displacement(const Eigen::VectorXd& f)
{
    const auto surface = static_cast<Eigen::Index>(surface_node_.size());
    AMONTONS_ASSERT(f.size() == 3 * surface);
    drop_nodes();
    for (Eigen::Index s = 0; s < surface; ++s)
        if (!f.segment<3>(3 * s).isZero(0)) in_contact_.push_back(std::int32_t(s));
    order_nodes();
    Eigen::VectorXd x = Eigen::VectorXd::Zero(3 * surface);
    if (!has_columns() && !columns_pay(solve_flops())) {
        ++counts_.from_factor;
        Eigen::VectorXd all = Eigen::VectorXd::Zero(Eigen::Index(dofs_.number.size()));
        for (const std::int32_t s : in_contact_)
            all.segment<3>(3 * surface_node_[std::size_t(s)]) = f.segment<3>(3 * s);
        all = displacement(all);
        for (Eigen::Index s = 0; s < surface; ++s)
            x.segment<3>(3 * s) = all.segment<3>(3 * surface_node_[std::size_t(s)]);
        return x;
    }
    std::vector<Vec3> force;
    for (const std::int32_t c : in_contact_)
        force.push_back(f.segment<3>(3 * c) / scale_);
    return on_surface(moved_by(force));
}

bool SolidCompliance::surface_displacements(const SparseMatrix& F, Eigen::MatrixXd& Y) const
{
    AMONTONS_ASSERT(!all_rows_ && F.rows() == 3 * Eigen::Index(surface_node_.size()));
    std::vector<char> acts(surface_node_.size(), 0);
    for (Eigen::Index k = 0; k < F.nonZeros(); ++k)
        acts[std::size_t(F.innerIndexPtr()[k] / 3)] = 1;
    std::size_t nodes = 0;
    bool all_kept = true;
    for (std::size_t s = 0; s < acts.size(); ++s) {
        nodes += acts[s] ? 1 : 0;
        all_kept = all_kept && (!acts[s] || column_of_[s] >= 0);
    }
    if (!all_kept && nodes <= most_columns_) return false;
    Y.setZero(F.rows(), F.cols());
    if (!all_kept) {
        solve_on_surface(F, Y);
        return true;
    }
    for (Eigen::Index j = 0; j < F.cols(); ++j)
        for (SparseMatrix::InnerIterator at(F, j); at; ++at)
            Y.col(j) += at.value() / scale_ * column(std::int32_t(at.row() / 3)).col(at.row() % 3);
    return true;
}

/// By the factor, some columns at a time: all rows of all of them may not fit into the memory.
void SolidCompliance::solve_on_surface(const SparseMatrix& F, Eigen::MatrixXd& Y) const
{
    const auto number = [&](Eigen::Index row) {
        return dofs_
            .number[3 * std::size_t(surface_node_[std::size_t(row / 3)]) + std::size_t(row % 3)];
    };
    Eigen::MatrixXd X;
    for (Eigen::Index first = 0; first < F.cols(); first += kSolvedAtOnce) {
        X.setZero(Eigen::Index(dofs_.free.size()), std::min(kSolvedAtOnce, F.cols() - first));
        for (Eigen::Index j = 0; j < X.cols(); ++j)
            for (SparseMatrix::InnerIterator at(F, first + j); at; ++at)
                if (number(at.row()) >= 0) X(number(at.row()), j) = at.value() / scale_;
        factor_.solve(X);
        for (Eigen::Index row = 0; row < Y.rows(); ++row)
            if (number(row) >= 0) Y.row(row).segment(first, X.cols()) = X.row(number(row));
    }
}

Eigen::VectorXd SolidCompliance::solved(const Eigen::VectorXd& f)
{
    AMONTONS_ASSERT(f.size() == Eigen::Index(dofs_.free.size()));
    const auto from_factor = [&] { return Eigen::VectorXd(factor_.solved(f) / scale_); };
    if (!all_rows_) return from_factor();
    drop_nodes();
    for (std::size_t s = 0; s < surface_node_.size(); ++s)
        for (std::size_t a = 0; a < 3; ++a)
            if (const std::int32_t k = dofs_.number[3 * std::size_t(surface_node_[s]) + a];
                k >= 0 && f[k] != 0) {
                in_contact_.push_back(std::int32_t(s));
                break;
            }
    order_nodes();
    if (!has_columns() && !columns_pay(solve_flops())) {
        ++counts_.from_factor;
        return from_factor();
    }
    std::vector<Vec3> force;
    for (const std::int32_t s : in_contact_) {
        force.emplace_back(Vec3::Zero());
        for (std::size_t a = 0; a < 3; ++a)
            if (const std::int32_t k =
                    dofs_.number[3 * std::size_t(surface_node_[std::size_t(s)]) + a];
                k >= 0)
                force.back()[Eigen::Index(a)] = f[k] / scale_;
    }
    const Eigen::VectorXd x = moved_by(force);
    Eigen::VectorXd out(f.size());
    for (std::size_t k = 0; k < dofs_.free.size(); ++k)
        out[Eigen::Index(k)] = x[dofs_.free[k]];
    return out;
}

std::vector<double> SolidCompliance::kept() const
{
    const std::size_t n = surface_node_.size();
    std::vector<double> out(kept_size(n), -1);
    out[0] = spent_;
    out[1] = double(calls_);
    out[2] = expected_;
    for (std::size_t slot = 0; slot < columns_.size(); ++slot) {
        const auto s = std::size_t(columns_[slot].node);
        out[3 + s] = double(slot);
        out[3 + n + s] = double(columns_[slot].last_used);
    }
    return out;
}

void SolidCompliance::keep(std::span<const double> kept)
{
    const std::size_t n = surface_node_.size();
    AMONTONS_ASSERT(kept.size() == kept_size(n));
    // Bodies that share a matrix give the same numbers each.
    if (const std::vector<double> have = this->kept(); std::ranges::equal(have, kept)) return;
    std::vector<std::int32_t> nodes; // by slot
    for (std::size_t s = 0; s < n; ++s)
        if (kept[3 + s] >= 0) nodes.push_back(std::int32_t(s));
    std::sort(nodes.begin(), nodes.end(), [&](std::int32_t a, std::int32_t b) {
        return kept[3 + std::size_t(a)] < kept[3 + std::size_t(b)];
    });
    columns_.clear();
    std::fill(column_of_.begin(), column_of_.end(), -1);
    counts_.bytes = 0;
    if (nodes.size() <= most_columns_) solve_columns(nodes);
    for (Column& c : columns_)
        c.last_used = std::int64_t(kept[3 + n + std::size_t(c.node)]);
    spent_ = kept[0];
    calls_ = std::int64_t(kept[1]);
    expected_ = kept[2];
}

} // namespace amontons
