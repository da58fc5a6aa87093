#include "solver/step/body_rows.hpp"

#include "mesh/base/dense.hpp"
#include "solver/body/rigid_body.hpp"
#include "solver/linear/semidefinite_root.hpp"

#include <algorithm>
#include <numeric>

namespace amontons {
namespace {

constexpr double kOverlap = 1e-6; // of a body's size: more is no error of the steps

} // namespace

int rows_of(std::span<const ContactPair> pairs, const BodyContact& c)
{
    return friction_of(pairs, c) > 0 ? 3 : 1;
}

std::array<Side, 2> sides_of(const Contacts& k, int c)
{
    std::array<Side, 2> s;
    const int contacts = int(k.all.contact.size());
    if (c < contacts) {
        const BodyContact& contact = k.all.contact[std::size_t(c)];
        s[0] = {contact.a, k.all.place_a(contact), 1};
        s[1] = {contact.b, k.all.place_b(contact), -1};
        return s;
    }
    const Coupling& joint = k.couplings[std::size_t(c - contacts)];
    const CouplingRow& row = k.joints[std::size_t(c - contacts)];
    s[0] = {joint.a.body, row.place_a(joint), 1};
    s[1] = {joint.b.body, row.place_b(joint), -1};
    for (Side& side : s) // of the iterate: contacts stay where the step found them
        side.place.half_way = true;
    return s;
}

namespace {

/// Columns of the matrices of several bodies, in the order of their rows.
class ColumnsOfBodies {
public:
    /// @param column  its entries in any order
    void add(int body, int row, std::vector<Eigen::Triplet<double>>& column)
    {
        const std::size_t begin = inner_.size();
        inner_.resize(begin + column.size());
        value_.resize(begin + column.size());
        int last = -1;
        std::size_t end = begin;
        for (const auto& entry : column) {
            if (entry.row() == last) {
                value_[end - 1] += entry.value();
                continue;
            }
            if (entry.row() < last) {
                inner_.resize(begin);
                value_.resize(begin);
                std::ranges::stable_sort(column, {}, [](const auto& e) { return e.row(); });
                return add(body, row, column);
            }
            inner_[end] = last = entry.row();
            value_[end++] = entry.value();
        }
        inner_.resize(end);
        value_.resize(end);
        columns_.push_back({body, row, begin, end});
    }
    /// Adds a column of another matrix.
    void add(int body, int row, const SparseColumns& from, Eigen::Index column)
    {
        const std::size_t before = inner_.size();
        const int begin = from.outerIndexPtr()[column], end = from.outerIndexPtr()[column + 1];
        inner_.insert(inner_.end(), from.innerIndexPtr() + begin, from.innerIndexPtr() + end);
        value_.insert(value_.end(), from.valuePtr() + begin, from.valuePtr() + end);
        columns_.push_back({body, row, before, inner_.size()});
    }
    /// To each body its own. @param unknowns  of each body
    void distribute(std::span<const Eigen::Index> unknowns, Rows& p) const
    {
        const std::size_t bodies = unknowns.size();
        std::vector<int> columns(bodies, 0), entries(bodies, 0);
        for (const Column& c : columns_) {
            ++columns[std::size_t(c.body)];
            entries[std::size_t(c.body)] += int(c.end - c.begin);
        }
        p.row.resize(bodies);
        p.columns.resize(bodies);
        for (std::size_t b = 0; b < bodies; ++b) {
            p.row[b].clear();
            p.row[b].reserve(std::size_t(columns[b]));
            p.columns[b].resize(unknowns[b], columns[b]);
            p.columns[b].resizeNonZeros(entries[b]);
        }
        for (const Column& c : columns_) {
            std::vector<int>& row = p.row[std::size_t(c.body)];
            SparseColumns& to = p.columns[std::size_t(c.body)];
            int* const outer = to.outerIndexPtr() + row.size();
            const auto begin = std::ptrdiff_t(c.begin), end = std::ptrdiff_t(c.end);
            std::copy(inner_.begin() + begin, inner_.begin() + end, to.innerIndexPtr() + *outer);
            std::copy(value_.begin() + begin, value_.begin() + end, to.valuePtr() + *outer);
            outer[1] = *outer + int(end - begin);
            row.push_back(c.row);
        }
    }

private:
    struct Column {
        int body, row;
        std::size_t begin, end; // of its entries
    };
    std::vector<Column> columns_;
    std::vector<int> inner_;
    std::vector<double> value_;
};

} // namespace

void make_rows(const Contacts& k, Rows& p)
{
    std::vector<Eigen::Index> unknowns;
    for (const BodyRef& b : k.bodies)
        unknowns.push_back(b.body->matrix().unknowns());
    ColumnsOfBodies columns;
    std::vector<Eigen::Triplet<double>> column;
    const int contacts = int(k.all.contact.size());
    p.count = 0;
    p.first.clear();
    for (const int c : p.chosen) {
        p.first.push_back(p.count);
        const bool joint = c >= contacts;
        const int n = joint ? 1 : rows_of(k.pairs, k.all.contact[std::size_t(c)]);
        for (const Side& s : sides_of(k, c)) {
            if (s.body < 0) continue;
            const std::size_t b = std::size_t(s.body);
            if (unknowns[b] == 0) continue;
            for (int i = 0; i < n; ++i) {
                const Vec3 d = joint ? k.joints[std::size_t(c - contacts)].direction
                                     : Vec3(k.all.contact[std::size_t(c)].frame.col(i));
                column.clear();
                k.bodies[b].body->add_column(s.place, d, s.sign, 0, column);
                columns.add(s.body, p.count + i, column);
            }
        }
        p.count += n;
    }
    columns.distribute(unknowns, p);
}

void forces_on_bodies(const Contacts& k, std::span<const ActingForce> acting,
                      std::vector<Eigen::VectorXd>& on)
{
    on.resize(k.bodies.size());
    for (std::size_t b = 0; b < on.size(); ++b)
        on[b].setZero(k.bodies[b].body->matrix().unknowns());
    std::vector<Eigen::Triplet<double>> column;
    for (const ActingForce& a : acting)
        for (const Side& s : sides_of(k, a.contact)) {
            if (s.body < 0) continue;
            Eigen::VectorXd& sum = on[std::size_t(s.body)];
            if (sum.size() == 0) continue;
            const BodyRef& b = k.bodies[std::size_t(s.body)];
            if (b.rigid && b.body == b.rigid) { // a hand's has unknowns of its own
                b.rigid->add_force(s.place, s.sign * a.force, sum);
                continue;
            }
            column.clear();
            b.body->add_column(s.place, a.force, s.sign, 0, column);
            for (const auto& entry : column)
                sum[entry.row()] += entry.value();
        }
}

void choose_rows(const Rows& all, Rows& p)
{
    if (p.chosen == all.chosen) {
        p = all;
        return;
    }
    std::vector<int> now(std::size_t(all.count), -1); // of each row of all
    p.count = 0;
    p.first.clear();
    for (const int c : p.chosen) {
        const auto i = std::size_t(c);
        const int end = i + 1 < all.first.size() ? all.first[i + 1] : all.count;
        p.first.push_back(p.count);
        for (int row = all.first[i]; row < end; ++row)
            now[std::size_t(row)] = p.count++;
    }
    ColumnsOfBodies columns;
    std::vector<Eigen::Index> unknowns;
    for (std::size_t b = 0; b < all.row.size(); ++b) {
        unknowns.push_back(all.columns[b].rows());
        for (std::size_t j = 0; j < all.row[b].size(); ++j)
            if (const int row = now[std::size_t(all.row[b][j])]; row >= 0)
                columns.add(int(b), row, all.columns[b], Eigen::Index(j));
    }
    columns.distribute(unknowns, p);
}

void row_values(const Contacts& k, const StepInput& step, std::span<const FollowedContact> followed,
                double undone, std::vector<Vec3>& all)
{
    const int contacts = int(k.all.contact.size());
    all.resize(std::size_t(contacts) + k.couplings.size());
    const double lever = step.h * step.rule.end; // of the end velocity on the place
    for (std::size_t c = 0; c < all.size(); ++c) {
        const bool joint = int(c) >= contacts;
        if (joint) {
            const CouplingRow& row = k.joints[c - std::size_t(contacts)];
            all[c] = {step.dynamic ? row.value / lever : row.value, 0, 0};
            continue;
        }
        Vec3 moved = Vec3::Zero(), velocity = Vec3::Zero(), before = Vec3::Zero(),
             past = Vec3::Zero();
        const FollowedContact* const ways = followed.empty() ? nullptr : &followed[c];
        for (const Side& s : sides_of(k, int(c))) {
            if (s.body < 0) continue;
            const Body& b = *k.bodies[std::size_t(s.body)].body;
            if (ways) {
                moved += s.sign * b.displacement(s.place);
                velocity +=
                    s.sign * b.velocity({s.place.nodes, ways->end_point}, VelocityAt::iterate);
            } else if (!step.dynamic) {
                moved += s.sign * b.displacement(s.place);
            } else {
                velocity += s.sign * b.velocity(s.place, VelocityAt::iterate);
                before += s.sign * b.velocity(s.place, VelocityAt::start);
                past += s.sign * b.velocity(s.place, VelocityAt::past);
            }
        }
        const BodyContact& contact = k.all.contact[c];
        const ContactPair& pair = k.pairs[std::size_t(contact.pair)];
        if (!step.dynamic) {
            all[c] = contact.frame.transpose() * moved;
            all[c][0] = contact.gap;
            continue;
        }
        all[c] = (ways ? ways->end_frame : contact.frame).transpose() * velocity;
        const double now = all[c][0],
                     approach = ways ? ways->approach : contact.frame.col(0).dot(before);
        if (contact.sliding_at_start && ways)
            all[c].tail<2>() = contact.frame.rightCols<2>().transpose() * moved / lever;
        else if (contact.sliding_at_start)
            all[c].tail<2>() += contact.frame.rightCols<2>().transpose() * past / step.rule.end;
        all[c][0] = contact.gap / lever;
        // An overlap at the start is removed over several steps.
        const double size = k.bodies[std::size_t(contact.a)].body->size();
        const double left =
            ways ? ways->gap : contact.gap - lever * now - step.h * contact.frame.col(0).dot(past);
        if (left < -kOverlap * size) all[c][0] += (1 - undone) * (-left) / lever;
        // What overlaps at the start is separated before time 0, where nothing strikes.
        if (pair.restitution > 0 && step.start >= 0) {
            // Newton's law where the surfaces would touch within the step, in Moreau's form: what
            // separates already may approach by as much times the coefficient. If it were kept from
            // that, an impact beside it would lift all that lies on it at the same velocity, and
            // generate energy (Moreau 1988, section 9).
            // Else they have no row: the law of gaps would anticipate a part of the impact.
            const bool closes = left + 0.5 * step.h * approach <= 0;
            all[c][0] = closes ? now + pair.restitution * approach : size / lever;
        }
    }
}

namespace {

/// Rows of the same bodies couple with the same rows.
struct CoupledRows {
    std::vector<int> rows;               // ascending
    std::vector<std::vector<int>> place; // of each body in turn: where its own rows are in `rows`
};

CoupledRows coupled_rows(const Rows& rows, std::span<const int> bodies)
{
    CoupledRows coupled;
    for (const int b : bodies)
        coupled.rows.insert(coupled.rows.end(), rows.row[std::size_t(b)].begin(),
                            rows.row[std::size_t(b)].end());
    std::vector<int>& all = coupled.rows;
    std::sort(all.begin(), all.end());
    all.erase(std::unique(all.begin(), all.end()), all.end());
    for (const int b : bodies) {
        std::vector<int>& place = coupled.place.emplace_back();
        for (const int row : rows.row[std::size_t(b)])
            place.push_back(int(std::lower_bound(all.begin(), all.end(), row) - all.begin()));
    }
    return coupled;
}

/// The sum in the place where it stays: of a large pile, sorting lists of all entries would take
/// longer than its contact problem.
Eigen::SparseMatrix<double> sparse_sum(const Rows& rows, const std::vector<Eigen::MatrixXd>& W,
                                       const std::vector<std::pair<int, double>>& soft)
{
    // Of each row: its bodies, and the numbers of its columns there.
    const auto n = std::size_t(rows.count);
    std::vector<int> start(n + 1, 0);
    for (const std::vector<int>& of_body : rows.row)
        for (const int row : of_body)
            ++start[std::size_t(row) + 1];
    std::partial_sum(start.begin(), start.end(), start.begin());
    std::vector<int> body(std::size_t(start.back())), column(body.size()),
        next(start.begin(), start.end() - 1);
    for (std::size_t b = 0; b < rows.row.size(); ++b)
        for (std::size_t j = 0; j < rows.row[b].size(); ++j) {
            const auto at = std::size_t(next[std::size_t(rows.row[b][j])]++);
            body[at] = int(b);
            column[at] = int(j);
        }
    const auto bodies_of = [&](std::size_t row) {
        return std::span(body).subspan(std::size_t(start[row]),
                                       std::size_t(start[row + 1] - start[row]));
    };

    std::vector<double> row_compliance(n, 0);
    for (const auto& [row, s] : soft)
        row_compliance[std::size_t(row)] += s;
    std::vector<CoupledRows> patterns;
    std::vector<int> pattern(n);
    std::vector<int> outer(n + 1, 0);
    for (std::size_t j = 0; j < n; ++j) {
        const std::span<const int> own = bodies_of(j);
        // Rows of a pair of bodies follow each other.
        if (j == 0 || own.empty() || !std::ranges::equal(own, bodies_of(j - 1))) {
            patterns.push_back(coupled_rows(rows, own));
            if (own.empty() && row_compliance[j] > 0) patterns.back().rows.push_back(int(j));
        }
        pattern[j] = int(patterns.size()) - 1;
        outer[j + 1] = outer[j] + int(patterns.back().rows.size());
    }

    Eigen::SparseMatrix<double> sum(rows.count, rows.count);
    sum.resizeNonZeros(outer.back());
    std::copy(outer.begin(), outer.end(), sum.outerIndexPtr());
    for (std::size_t j = 0; j < n; ++j) {
        const CoupledRows& coupled = patterns[std::size_t(pattern[j])];
        std::copy(coupled.rows.begin(), coupled.rows.end(), sum.innerIndexPtr() + outer[j]);
        double* const value = sum.valuePtr() + outer[j];
        std::fill_n(value, coupled.rows.size(), 0.0);
        for (std::size_t k = 0; k < coupled.place.size(); ++k) {
            const auto at = std::size_t(start[j]) + k;
            const double* const w = W[std::size_t(body[at])].col(column[at]).data();
            const std::vector<int>& place = coupled.place[k];
            for (std::size_t i = 0; i < place.size(); ++i)
                value[place[i]] += w[i];
        }
        if (row_compliance[j] > 0)
            value[std::ranges::lower_bound(coupled.rows, int(j)) - coupled.rows.begin()] +=
                row_compliance[j];
    }
    return sum;
}

} // namespace

Eigen::MatrixXd compliance_root(StepMatrix& A, const SparseColumns& C)
{
    constexpr int kRigid = 6; // unknowns of a rigid body: A is far smaller than W
    if (A.unknowns() == kRigid) {
        Eigen::MatrixXd inverse(kRigid, kRigid);
        for (int i = 0; i < kRigid; ++i)
            inverse.col(i) = A.solve(Eigen::VectorXd(Eigen::VectorXd::Unit(kRigid, i)));
        const Eigen::MatrixXd root = cholesky_root(0.5 * (inverse + inverse.transpose()));
        if (root.size() > 0) return root * C;
    }
    Eigen::MatrixXd W;
    A.compliance(C, W);
    return semidefinite_root(W);
}

Delassus delassus_of_bodies(const Rows& rows, std::vector<Eigen::MatrixXd> G,
                            const std::vector<std::pair<int, double>>& soft)
{
    DelassusOfBodies W;
    W.compliance = Eigen::VectorXd::Zero(rows.count);
    for (const auto& [row, s] : soft)
        W.compliance[row] += s;
    for (std::size_t b = 0; b < G.size(); ++b)
        if (G[b].size() > 0) W.parts.push_back({rows.row[b], std::move(G[b])});
    return Delassus(std::move(W));
}

namespace {

/// sum(row, row) += W, in runs of rows that follow each other: most of a body's do.
void add_block(const Eigen::MatrixXd& W, const std::vector<int>& row, Eigen::MatrixXd& sum)
{
    for (Eigen::Index begin = 0, end; begin < W.rows(); begin = end) {
        const int first = row[std::size_t(begin)];
        for (end = begin + 1; end < W.rows() && row[std::size_t(end)] == first + end - begin;)
            ++end;
        for (Eigen::Index j = 0; j < W.cols(); ++j)
            sum.col(row[std::size_t(j)]).segment(first, end - begin) +=
                W.col(j).segment(begin, end - begin);
    }
}

} // namespace

Delassus sum_of_bodies(const Rows& rows, const std::vector<Eigen::MatrixXd>& W,
                       const std::vector<std::pair<int, double>>& soft)
{
    constexpr double kDenseShare = 0.3;
    double entries = 0;
    for (const Eigen::MatrixXd& own : W)
        entries += double(own.size());
    const int n = rows.count;
    if (entries > kDenseShare * double(n) * double(n)) {
        Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(n, n);
        for (std::size_t b = 0; b < W.size(); ++b)
            add_block(W[b], rows.row[b], dense);
        for (const auto& [row, s] : soft)
            dense(row, row) += s;
        return Delassus(std::move(dense));
    }
    return Delassus(sparse_sum(rows, W, soft));
}

} // namespace amontons
