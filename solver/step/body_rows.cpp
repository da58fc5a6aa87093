#include "solver/step/body_rows.hpp"

#include <algorithm>

namespace amontons {
namespace {

constexpr double kOverlap = 1e-6; // of a body's size: more is no error of the steps
constexpr double kUndone = 0.2;   // of it in one step

} // namespace

int rows_of(const ContactPair& pair)
{
    return pair.friction > 0 ? 3 : 1;
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
    s[0] = {joint.a.body, {joint.a.nodes, row.point_a}, 1};
    s[1] = {joint.b.body, {joint.b.nodes, row.point_b}, -1};
    return s;
}

void make_rows(const Contacts& k, Rows& p)
{
    const std::size_t bodies = k.bodies.size();
    p.columns.assign(bodies, {});
    p.row.assign(bodies, {});
    std::vector<std::vector<Eigen::Triplet<double>>> triplets(bodies);
    const int contacts = int(k.all.contact.size());
    p.count = 0;
    p.first.clear();
    for (const int c : p.chosen) {
        p.first.push_back(p.count);
        const bool joint = c >= contacts;
        const int n = joint ? 1 : rows_of(k.pairs[std::size_t(k.all.contact[std::size_t(c)].pair)]);
        for (const Side& s : sides_of(k, c)) {
            if (s.body < 0) continue;
            const std::size_t b = std::size_t(s.body);
            if (k.bodies[b].body->unknowns() == 0) continue;
            for (int i = 0; i < n; ++i) {
                const Vec3 d = joint ? k.joints[std::size_t(c - contacts)].direction
                                     : Vec3(k.all.contact[std::size_t(c)].frame.col(i));
                k.bodies[b].body->add_column(s.place, d, s.sign, int(p.row[b].size()), triplets[b]);
                p.row[b].push_back(p.count + i);
            }
        }
        p.count += n;
    }
    for (std::size_t b = 0; b < bodies; ++b) {
        p.columns[b].resize(k.bodies[b].body->unknowns(), Eigen::Index(p.row[b].size()));
        p.columns[b].setFromTriplets(triplets[b].begin(), triplets[b].end());
    }
}

void row_values(const Contacts& k, const StepInput& step, std::vector<Vec3>& all)
{
    const int contacts = int(k.all.contact.size());
    all.resize(std::size_t(contacts) + k.couplings.size());
    const double lever = step.h * step.rule.end; // of the end velocity on the place
    for (std::size_t c = 0; c < all.size(); ++c) {
        const bool joint = int(c) >= contacts;
        Vec3 moved = Vec3::Zero(), velocity = Vec3::Zero(), before = Vec3::Zero(),
             past = Vec3::Zero();
        for (const Side& s : sides_of(k, int(c))) {
            if (s.body < 0) continue;
            const Body& b = *k.bodies[std::size_t(s.body)].body;
            if (!step.dynamic) {
                moved += s.sign * b.displacement(s.place);
            } else {
                velocity += s.sign * b.velocity(s.place);
                before += s.sign * b.start_velocity(s.place);
                past += s.sign * b.past_velocity(s.place);
            }
        }
        if (joint) {
            const CouplingRow& row = k.joints[c - std::size_t(contacts)];
            all[c] = {step.dynamic ? row.value / lever : row.value, 0, 0};
            continue;
        }
        const BodyContact& contact = k.all.contact[c];
        const ContactPair& pair = k.pairs[std::size_t(contact.pair)];
        if (!step.dynamic) {
            all[c] = contact.frame.transpose() * moved;
            all[c][0] = contact.gap;
            continue;
        }
        all[c] = contact.frame.transpose() * velocity;
        const double now = all[c][0], approach = contact.frame.col(0).dot(before);
        all[c][0] = contact.gap / lever;
        // An overlap that bodies begin with is undone over some steps: at once it would throw them
        // apart.
        const double size = k.bodies[std::size_t(contact.a)].body->size();
        const double left = contact.gap - lever * now - step.h * contact.frame.col(0).dot(past);
        if (left < -kOverlap * size) all[c][0] += (1 - kUndone) * (-left) / lever;
        if (pair.restitution > 0) {
            // Newton's law where the surfaces would meet within the step.
            // Else they are left alone: the law of gaps would take a part of the blow before it.
            const bool meet = left + 0.5 * step.h * approach <= 0;
            all[c][0] = meet ? now + pair.restitution * std::min(approach, 0.0) : size / lever;
        }
    }
}

Delassus sum_of_bodies(const Rows& rows, const std::vector<Eigen::MatrixXd>& W,
                       const std::vector<std::pair<int, double>>& soft)
{
    constexpr double kDenseShare = 0.3;
    double entries = 0;
    for (const Eigen::MatrixXd& own : W)
        entries += double(own.size());
    const int n = rows.count;
    const auto each = [&](auto&& add) {
        for (std::size_t b = 0; b < W.size(); ++b)
            for (std::size_t j = 0; j < std::size_t(W[b].cols()); ++j)
                for (std::size_t i = 0; i < std::size_t(W[b].rows()); ++i)
                    add(rows.row[b][i], rows.row[b][j], W[b](Eigen::Index(i), Eigen::Index(j)));
        for (const auto& [row, s] : soft)
            add(row, row, s);
    };
    if (entries > kDenseShare * double(n) * double(n)) {
        Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(n, n);
        each([&](int i, int j, double w) { dense(i, j) += w; });
        return Delassus(std::move(dense));
    }
    std::vector<Eigen::Triplet<double>> triplets;
    triplets.reserve(std::size_t(entries) + soft.size());
    each([&](int i, int j, double w) { triplets.emplace_back(i, j, w); });
    Eigen::SparseMatrix<double> sparse(n, n);
    sparse.setFromTriplets(triplets.begin(), triplets.end());
    return Delassus(std::move(sparse));
}

} // namespace amontons
