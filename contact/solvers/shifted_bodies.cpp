#include "contact/solvers/shifted_bodies.hpp"

#include <algorithm>
#include <map>

namespace amontons {
namespace {

constexpr int kRigidMotions = 6; ///< motions of a rigid body, whose products are laid out ahead
using RigidColumns = Eigen::Matrix<double, kRigidMotions, 3>;
using RigidBlock = Eigen::Matrix<double, kRigidMotions, kRigidMotions>;

/// Adds a product of two bodies by blocks; place is that of its first one.
template <class Product>
void add_product(BlockLu& lu, const Product& product, const BlockLu::Place* place)
{
    Mat3 block;
    for (Eigen::Index j = 0; j < product.cols(); j += 3)
        for (Eigen::Index i = 0; i < product.rows(); i += 3, ++place) {
            const auto rows = std::min<Eigen::Index>(3, product.rows() - i);
            const auto columns = std::min<Eigen::Index>(3, product.cols() - j);
            if (rows == 3 && columns == 3) {
                lu.add_at(*place, product.template block<3, 3>(i, j));
                continue;
            }
            block.setZero();
            block.topLeftCorner(rows, columns) = product.block(i, j, rows, columns);
            lu.add_at(*place, block);
        }
}

} // namespace

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
    first_block_.assign(1, 0);
    for (const DelassusOfBodies::Part& part : problem_.W.of_bodies().parts)
        first_block_.push_back(first_block_.back() + (int(part.G.rows()) + 2) / 3);

    std::map<std::vector<int>, std::vector<int>> groups; // contacts of each set of bodies
    std::vector<int> bodies;
    for (int i = 0; i < contact_count(problem_); ++i) {
        bodies.clear();
        for (const Columns::Piece& p : pieces(i))
            bodies.push_back(p.part);
        if (!bodies.empty()) groups[bodies].push_back(i);
    }
    std::vector<std::vector<int>> pattern(std::size_t(first_block_.back()));
    for (int j = 0; j < first_block_.back(); ++j)
        pattern[std::size_t(j)].push_back(j);
    const auto blocks = [&](const Columns::Piece& column, const Columns::Piece& row,
                            const auto& work) {
        for (int j = 0; j < blocks_of(column); ++j)
            for (int i = 0; i < blocks_of(row); ++i)
                work(first_block(row) + i, first_block(column) + j);
    };
    for (const auto& [key, contacts] : groups) {
        const auto own = pieces(contacts.front());
        for (const Columns::Piece& b : own)
            for (const Columns::Piece& a : own)
                blocks(b, a, [&](int i, int j) { pattern[std::size_t(j)].push_back(i); });
    }
    std::vector<std::size_t> start{0};
    std::vector<int> neighbour;
    for (std::vector<int>& column : pattern) {
        std::sort(column.begin(), column.end());
        neighbour.insert(neighbour.end(), column.begin(),
                         std::unique(column.begin(), column.end()));
        start.push_back(neighbour.size());
    }
    lu_.analyse(start, neighbour);
    for (int j = 0; j < first_block_.back(); ++j)
        diagonal_.push_back(lu_.place(j, j));
    for (const auto& [key, contacts] : groups) {
        const auto own = pieces(contacts.front());
        const bool rigid = own.size() <= 2 && std::ranges::all_of(own, [](const auto& p) {
                               return p.k == kRigidMotions;
                           });
        groups_.push_back(
            {contact_.size(), contact_.size() + contacts.size(), places_.size(), rigid});
        contact_.insert(contact_.end(), contacts.begin(), contacts.end());
        for (const Columns::Piece& b : own)
            for (const Columns::Piece& a : own)
                blocks(b, a, [&](int i, int j) { places_.push_back(lu_.place(i, j)); });
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

/// G E^-1 G^T of rigid bodies, contact after contact in registers.
void ShiftedBodies::add_rigid(const Group& group)
{
    const std::size_t bodies = pieces(contact_[group.begin]).size();
    RigidBlock product[4]; // of both bodies with both: (a, b) at 2 b + a
    for (RigidBlock& p : product)
        p.setZero();
    for (std::size_t k = group.begin; k < group.end; ++k) {
        const int contact = contact_[k], rows = columns_.rows(contact);
        const double scale = scale_[columns_.first_row(contact)];
        RigidColumns right[2], left[2];
        for (std::size_t a = 0; a < bodies; ++a) {
            right[a].setZero();
            right[a].leftCols(rows) = scale * G(pieces(contact)[a], contact);
            left[a] = right[a].lazyProduct(inverse_[std::size_t(contact)]);
        }
        for (std::size_t b = 0; b < bodies; ++b)
            for (std::size_t a = 0; a < bodies; ++a)
                product[2 * b + a] += left[a].lazyProduct(right[b].transpose());
    }
    const BlockLu::Place* place = places_.data() + group.places;
    for (std::size_t b = 0; b < bodies; ++b)
        for (std::size_t a = 0; a < bodies; ++a, place += 4)
            add_product(lu_, product[2 * b + a], place);
}

void ShiftedBodies::add_any(const Group& group)
{
    Eigen::Index columns = 0;
    for (std::size_t k = group.begin; k < group.end; ++k)
        columns += columns_.rows(contact_[k]);
    const std::size_t bodies = pieces(contact_[group.begin]).size();
    left_.resize(std::max(left_.size(), bodies));
    right_.resize(left_.size());
    for (std::size_t a = 0; a < bodies; ++a) {
        const int motions = pieces(contact_[group.begin])[a].k;
        left_[a].resize(motions, columns);
        right_[a].resize(motions, columns);
        Eigen::Index at = 0;
        for (std::size_t k = group.begin; k < group.end; ++k) {
            const int contact = contact_[k], rows = columns_.rows(contact);
            auto right = right_[a].middleCols(at, rows);
            right = scale_[columns_.first_row(contact)] * G(pieces(contact)[a], contact);
            left_[a].middleCols(at, rows) =
                right.lazyProduct(inverse_[std::size_t(contact)].topLeftCorner(rows, rows));
            at += rows;
        }
    }
    const BlockLu::Place* place = places_.data() + group.places;
    for (std::size_t b = 0; b < bodies; ++b)
        for (std::size_t a = 0; a < bodies; ++a) {
            product_.noalias() = left_[a] * right_[b].transpose();
            add_product(lu_, product_, place);
            place += ((product_.rows() + 2) / 3) * ((product_.cols() + 2) / 3);
        }
}

bool ShiftedBodies::factorise(const std::vector<LinearisedLaw>& law, double shift)
{
    analyse();
    const Eigen::VectorXd& compliance = problem_.W.of_bodies().compliance;
    inverse_.assign(law.size(), Mat3::Zero());
    for (std::size_t i = 0; i < law.size(); ++i) {
        if (law[i].open) continue;
        const int rows = columns_.rows(static_cast<int>(i));
        const int first = columns_.first_row(static_cast<int>(i));
        Mat3 E = law[i].D;
        for (int a = 0; a < 3; ++a)
            E(a, a) = a < rows
                          ? E(a, a) + shift + compliance[first + a] * scale_[first] * scale_[first]
                          : 1;
        const Mat3 inverse = E.inverse();
        if (!inverse.allFinite()) return false;
        inverse_[i].topLeftCorner(rows, rows) = inverse.topLeftCorner(rows, rows);
    }
    lu_.clear();
    for (const BlockLu::Place& place : diagonal_)
        lu_.add_at(place, Mat3::Identity());
    for (const Group& group : groups_)
        if (group.rigid)
            add_rigid(group);
        else
            add_any(group);
    return lu_.factorise();
}

void ShiftedBodies::solve(const Eigen::VectorXd& b, Eigen::VectorXd& x) const
{
    z_.setZero(3 * first_block_.back());
    x.resize(b.size());
    Vec3 own;
    for (int i = 0; i < contact_count(problem_); ++i) {
        const int row = columns_.first_row(i), rows = columns_.rows(i);
        own.setZero();
        own.head(rows) = scale_[row] * b.segment(row, rows);
        own = inverse_[std::size_t(i)] * own;
        for (const Columns::Piece& p : pieces(i))
            columns_.add_to_motion(p, i, own.data(), z_.data() + 3 * first_block(p));
    }
    lu_.solve(z_);
    for (int i = 0; i < contact_count(problem_); ++i) {
        const int row = columns_.first_row(i), rows = columns_.rows(i);
        own.setZero();
        for (const Columns::Piece& p : pieces(i))
            columns_.add_motion(p, i, z_.data() + 3 * first_block(p), own.data());
        own.head(rows) = b.segment(row, rows) - scale_[row] * own.head(rows);
        own = inverse_[std::size_t(i)] * own;
        x.segment(row, rows) = own.head(rows);
    }
}

Eigen::MatrixXd ShiftedBodies::response(const std::vector<int>& contacts) const
{
    std::vector<int> touched, first(first_block_.size(), -1); // blocks, and the first of each body
    Eigen::Index rows = 0;
    for (const int i : contacts) {
        rows += columns_.rows(i);
        for (const Columns::Piece& p : pieces(i)) {
            int& own = first[std::size_t(p.part)];
            if (own >= 0) continue;
            own = static_cast<int>(touched.size());
            for (int b = 0; b < blocks_of(p); ++b)
                touched.push_back(first_block(p) + b);
        }
    }
    Eigen::MatrixXd C = Eigen::MatrixXd::Zero(3 * Eigen::Index(touched.size()), rows);
    Eigen::Index column = 0;
    for (const int i : contacts) {
        for (const Columns::Piece& p : pieces(i))
            C.block(3 * first[std::size_t(p.part)], column, p.k, columns_.rows(i)) =
                scale_[columns_.first_row(i)] * G(p, i);
        column += columns_.rows(i);
    }
    return lu_.between(touched, C);
}

} // namespace amontons
