#include "mesh/base/dense.hpp"
#include "solver/body/node_index.hpp"
#include "solver/body/solid_body.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

// A hyperelastic solid that its contacts alone hold, in quasi-static steps. Held at pins it would
// buckle about them under little stress, and what is under stress does not turn without a force. So
// its nodes move by
//     u = w + R a,   C^T w = 0,
// R the rigid modes of the shape as it is, C = R times a number: w is without a mean motion. With K
// the tangent, w = P (f - K R a) where P is the inverse of
//     [ K    C ]
//     [ C^T    ]
// and the multipliers of C^T w = 0, forces that nothing bears, vanish where
//     R^T f - (K R)^T P f = S a,   S = R^T K R - (K R)^T P K R,
// so that R' = R - P K R are the modes and R'^T f the loads on them. S is the stress times the
// volume, small beside what contacts hold the modes with, and is left to the next iteration. What
// is factored is L = K + N N^T, positive: springs at some nodes, and those that stabilise() adds.
// With X = L^-1 [N C],
//     P = L^-1 + X T^-1 X^T,   T = [ 1  0 ] - [N C]^T X,
//                                  [ 0  0 ]
// and K has as many negative eigenvalues among all w as T has more than there are modes: then it is
// contacts that keep the body from buckling (solver/step/body_stabilisation.cpp).

namespace amontons {
namespace {

constexpr std::size_t kSprings = 12; ///< nodes

/// Nodes far from each other.
std::vector<std::int32_t> spread_nodes(const VolumeMesh& mesh, std::span<const std::int32_t> some)
{
    std::vector<std::int32_t> chosen;
    std::vector<double> distance(some.size(), std::numeric_limits<double>::infinity());
    std::size_t next = 0;
    while (chosen.size() < std::min(kSprings, some.size())) {
        const Vec3 x = mesh.nodes[std::size_t(some[next])];
        chosen.push_back(some[next]);
        for (std::size_t i = 0; i < some.size(); ++i)
            distance[i] =
                std::min(distance[i], (mesh.nodes[std::size_t(some[i])] - x).squaredNorm());
        next = std::size_t(std::ranges::max_element(distance) - distance.begin());
    }
    return chosen;
}

} // namespace

/// Adds the springs to the matrix, each as stiff as its node at rest.
void SolidBody::support_body(SparseMatrix& S)
{
    if (springs_.empty()) {
        std::vector<std::int32_t> nodes;
        for (const std::int32_t dof : dofs_.free)
            if (nodes.empty() || nodes.back() != dof / 3) nodes.push_back(dof / 3);
        springs_ = spread_nodes(mesh_, nodes);
    }
    std::vector<Eigen::Triplet<double>> entries;
    int column = 0;
    for (const std::int32_t node : springs_)
        for (Eigen::Index dof = 3 * node; dof < 3 * node + 3; ++dof) {
            const std::int32_t number = dofs_.number[std::size_t(dof)];
            if (number < 0) continue;
            const double size = matrix_->K.coeff(dof, dof);
            S.coeffRef(dof, dof) += size;
            entries.emplace_back(number, column++, std::sqrt(size));
        }
    const int leaned = shift_ != 0 ? int(stabilised_.cols()) : 0;
    for (int j = 0; j < leaned; ++j, ++column)
        for (SparseColumns::InnerIterator it(stabilised_, j); it; ++it)
            entries.emplace_back(it.row(), column, it.value());
    held_up_.resize(Eigen::Index(dofs_.free.size()), column);
    held_up_.setFromTriplets(entries.begin(), entries.end());
}

/// X and T of the factor as it is.
void SolidBody::find_border()
{
    const Eigen::Index held = held_up_.cols(), modes = rigid_->R.cols();
    const double size = std::sqrt(stiffest_ / double(mesh_.nodes.size()));
    Eigen::MatrixXd Z(held_up_.rows(), held + modes);
    Z.leftCols(held) = held_up_;
    for (Eigen::Index m = 0; m < modes; ++m)
        Z.col(held + m) = size * free_part(rigid_->R.col(m));
    border_ = Z;
    matrix_->factor.solve(border_);
    Eigen::MatrixXd T = -Z.transpose() * border_;
    T.diagonal().head(held).array() += 1;
    T = (0.5 * (T + T.transpose())).eval();
    border_matrix_ = LuFactor(T).inverse();
    border_negative_ = int((symmetric_eigenvalues(T).array() < 0).count() - modes);
}

/// R' = R - P K R, and S = (K R)^T R'.
void SolidBody::bend_modes()
{
    mode_stiffness_.resize(free_modes_.cols(), free_modes_.cols());
    for (Eigen::Index m = 0; m < free_modes_.cols(); ++m) {
        free_modes_.col(m) = free_part(rigid_->R.col(m)) - solved(free_part(turning_.col(m)));
        for (Eigen::Index l = 0; l < free_modes_.cols(); ++l)
            mode_stiffness_(l, m) = free_part(turning_.col(l)).dot(free_modes_.col(m));
    }
    mode_stiffness_ = (0.5 * (mode_stiffness_ + mode_stiffness_.transpose())).eval();
}

} // namespace amontons
