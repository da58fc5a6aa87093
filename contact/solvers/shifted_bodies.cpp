#include "contact/solvers/shifted_bodies.hpp"

#include <algorithm>
#include <tuple>

namespace amontons {

ShiftedBodies::ShiftedBodies(const ContactProblem& problem, const Columns& columns,
                             const Eigen::VectorXd& scale)
    : problem_(problem)
    , columns_(columns)
    , scale_(scale)
{
}

void ShiftedBodies::analyse()
{
    if (analysed_) return;
    analysed_ = true;
    const DelassusOfBodies& W = problem_.W.of_bodies();
    const auto parts = static_cast<int>(W.parts.size());
    first_block_.assign(1, 0);
    for (int p = 0; p < parts; ++p)
        first_block_.push_back(first_block_.back() + blocks(p));

    // Pairs of bodies by contacts; a body alone is a pair of its own.
    using Touch = std::tuple<int, int, int, int, int>; // bodies, columns, rows
    std::vector<Touch> touches;
    for (int p = 0; p < parts; ++p)
        touches.emplace_back(p, p, 0, 0, 0);
    for (int i = 0; i < contact_count(problem_); ++i) {
        const auto places = W.places(columns_.first_row(i));
        for (std::size_t k = 0; k < places.size(); ++k)
            for (std::size_t l = k + 1; l < places.size(); ++l) // by ascending bodies
                touches.emplace_back(places[k].part, places[l].part, places[k].column,
                                     places[l].column, columns_.rows(i));
    }
    std::sort(touches.begin(), touches.end());
    std::vector<std::vector<int>> pattern(static_cast<std::size_t>(first_block_.back()));
    const auto couple = [&](int a, int b) {
        for (int j = 0; j < blocks(b); ++j)
            for (int i = 0; i < blocks(a); ++i)
                pattern[static_cast<std::size_t>(first_block_[std::size_t(b)] + j)].push_back(
                    first_block_[std::size_t(a)] + i);
    };
    for (const auto& [a, b, column_a, column_b, rows] : touches) {
        if (pairs_.empty() || pairs_.back().a != a || pairs_.back().b != b) {
            pairs_.push_back({a, b, shared_.size(), shared_.size(), 0});
            couple(a, b);
            if (a != b) couple(b, a);
        }
        if (rows == 0) continue;
        shared_.push_back({column_a, column_b, rows});
        pairs_.back().end = shared_.size();
    }
    std::vector<std::size_t> start{0};
    std::vector<int> neighbour;
    for (std::vector<int>& column : pattern) {
        std::sort(column.begin(), column.end());
        neighbour.insert(neighbour.end(), column.begin(), column.end());
        start.push_back(neighbour.size());
    }
    lu_.analyse(start, neighbour);
    const auto keep = [&](int a, int b) {
        for (int j = 0; j < blocks(b); ++j)
            for (int i = 0; i < blocks(a); ++i)
                places_.push_back(
                    lu_.place(first_block_[std::size_t(a)] + i, first_block_[std::size_t(b)] + j));
    };
    for (Pair& pair : pairs_) {
        pair.places = places_.size();
        keep(pair.a, pair.b);
        if (pair.a != pair.b) keep(pair.b, pair.a);
    }
    right_.resize(W.parts.size());
    left_.resize(W.parts.size());
    for (int p = 0; p < parts; ++p) {
        const std::vector<int>& rows = W.parts[std::size_t(p)].rows;
        right_[std::size_t(p)] = G(p) * Eigen::VectorXd(scale_(rows)).asDiagonal();
    }
}

double ShiftedBodies::filling_cost() const
{
    double sum = 0;
    for (const DelassusOfBodies::Part& part : problem_.W.of_bodies().parts) {
        const auto k = static_cast<double>(part.G.rows());
        sum += (0.4 * k * k + 10 * k) * static_cast<double>(part.rows.size());
    }
    return sum;
}

void ShiftedBodies::add(const Eigen::MatrixXd& product, int blocks_down, int blocks_right,
                        const BlockLu::Place* place)
{
    Mat3 block;
    for (int j = 0; j < blocks_right; ++j)
        for (int i = 0; i < blocks_down; ++i, ++place) {
            const Eigen::Index rows = std::min<Eigen::Index>(3, product.rows() - 3 * i);
            const Eigen::Index columns = std::min<Eigen::Index>(3, product.cols() - 3 * j);
            block.setZero();
            block.topLeftCorner(rows, columns) = product.block(3 * i, 3 * j, rows, columns);
            lu_.add_at(*place, block);
        }
}

bool ShiftedBodies::factorise(const std::vector<LinearisedLaw>& law, double shift)
{
    analyse();
    const DelassusOfBodies& W = problem_.W.of_bodies();
    inverse_.assign(law.size(), Mat3::Zero());
    for (std::size_t i = 0; i < law.size(); ++i) {
        if (law[i].open) continue;
        const int rows = columns_.rows(static_cast<int>(i));
        const int first = columns_.first_row(static_cast<int>(i));
        Mat3 E = law[i].D;
        for (int a = 0; a < 3; ++a)
            E(a, a) =
                a < rows ? E(a, a) + shift + W.give[first + a] * scale_[first] * scale_[first] : 1;
        const Mat3 inverse = E.inverse();
        if (!inverse.allFinite()) return false;
        inverse_[i].topLeftCorner(rows, rows) = inverse.topLeftCorner(rows, rows);
    }
    for (std::size_t p = 0; p < W.parts.size(); ++p)
        left_[p].resize(right_[p].rows(), right_[p].cols());
    for (int i = 0; i < contact_count(problem_); ++i) {
        const int rows = columns_.rows(i);
        for (const DelassusOfBodies::Place& at : W.places(columns_.first_row(i)))
            left_[std::size_t(at.part)].middleCols(at.column, rows).noalias() =
                right_[std::size_t(at.part)]
                    .middleCols(at.column, rows)
                    .lazyProduct(inverse_[std::size_t(i)].topLeftCorner(rows, rows));
    }
    lu_.clear();
    Eigen::MatrixXd product, left, right, mirrored;
    for (const Pair& pair : pairs_) {
        const Eigen::MatrixXd &left_a = left_[std::size_t(pair.a)],
                              &right_a = right_[std::size_t(pair.a)],
                              &left_b = left_[std::size_t(pair.b)],
                              &right_b = right_[std::size_t(pair.b)];
        const int down = blocks(pair.a), across = blocks(pair.b);
        if (pair.a == pair.b) {
            product.setIdentity(3 * down, 3 * down);
            product.topLeftCorner(left_a.rows(), left_a.rows()).noalias() +=
                left_a * right_a.transpose();
            add(product, down, down, places_.data() + pair.places);
            continue;
        }
        Eigen::Index columns = 0;
        for (std::size_t k = pair.begin; k < pair.end; ++k)
            columns += shared_[k].rows;
        const auto gather = [&](const Eigen::MatrixXd& from, int Shared::*column,
                                Eigen::MatrixXd& to) {
            to.resize(from.rows(), columns);
            Eigen::Index at = 0;
            for (std::size_t k = pair.begin; k < pair.end; at += shared_[k++].rows)
                to.middleCols(at, shared_[k].rows) =
                    from.middleCols(shared_[k].*column, shared_[k].rows);
        };
        gather(left_a, &Shared::a, left);
        gather(right_b, &Shared::b, right);
        product.noalias() = left * right.transpose();
        add(product, down, across, places_.data() + pair.places);
        gather(left_b, &Shared::b, left);
        gather(right_a, &Shared::a, right);
        product.noalias() = left * right.transpose();
        add(product, across, down,
            places_.data() + pair.places + static_cast<std::size_t>(down * across));
    }
    return lu_.factorise();
}

void ShiftedBodies::solve(const Eigen::VectorXd& b, Eigen::VectorXd& x) const
{
    const DelassusOfBodies& W = problem_.W.of_bodies();
    Eigen::VectorXd z = Eigen::VectorXd::Zero(3 * first_block_.back());
    for (std::size_t p = 0; p < W.parts.size(); ++p)
        z.segment(3 * first_block_[p], left_[p].rows()).noalias() =
            left_[p] * Eigen::VectorXd(b(W.parts[p].rows));
    lu_.solve(z);
    x = b;
    for (std::size_t p = 0; p < W.parts.size(); ++p) {
        const Eigen::VectorXd moved =
            right_[p].transpose() * z.segment(3 * first_block_[p], right_[p].rows());
        for (std::size_t i = 0; i < W.parts[p].rows.size(); ++i)
            x[W.parts[p].rows[i]] -= moved[static_cast<Eigen::Index>(i)];
    }
    for (int i = 0; i < contact_count(problem_); ++i) {
        const int row = columns_.first_row(i), rows = columns_.rows(i);
        x.segment(row, rows) =
            (inverse_[std::size_t(i)].topLeftCorner(rows, rows) * x.segment(row, rows)).eval();
    }
}

} // namespace amontons
