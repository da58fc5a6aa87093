#include "mesh/base/dense.hpp"
#include "solver/body/node_index.hpp"
#include "solver/body/solid_matrix.hpp"

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

void support_body(const SolidModel& model, const SolidUnknowns& unknowns, const SolidMatrix& matrix,
                  const SparseColumns& stabilised, ContactBorder& border, SparseMatrix& S)
{
    if (border.springs.empty()) {
        std::vector<std::int32_t> nodes;
        for (const std::int32_t dof : unknowns.dofs.free)
            if (nodes.empty() || nodes.back() != dof / 3) nodes.push_back(dof / 3);
        border.springs = spread_nodes(model.mesh, nodes);
    }
    std::vector<Eigen::Triplet<double>> entries;
    int column = 0;
    for (const std::int32_t node : border.springs)
        for (Eigen::Index dof = 3 * node; dof < 3 * node + 3; ++dof) {
            const std::int32_t number = unknowns.dofs.number[std::size_t(dof)];
            if (number < 0) continue;
            const double size = matrix.K.coeff(dof, dof);
            S.coeffRef(dof, dof) += size;
            entries.emplace_back(number, column++, std::sqrt(size));
        }
    for (int j = 0; j < int(stabilised.cols()); ++j, ++column)
        for (SparseColumns::InnerIterator it(stabilised, j); it; ++it)
            entries.emplace_back(it.row(), column, it.value());
    border.held_up.resize(Eigen::Index(unknowns.dofs.free.size()), column);
    border.held_up.setFromTriplets(entries.begin(), entries.end());
}

void find_border(const SolidModel& model, const SolidUnknowns& unknowns, const SolidMatrix& matrix,
                 ContactBorder& border)
{
    const Eigen::Index held = border.held_up.cols(), modes = unknowns.rigid->R.cols();
    const double size = std::sqrt(matrix.stiffest / double(model.mesh.nodes.size()));
    Eigen::MatrixXd Z(border.held_up.rows(), held + modes);
    Z.leftCols(held) = border.held_up;
    for (Eigen::Index m = 0; m < modes; ++m)
        Z.col(held + m) = size * free_part(unknowns, unknowns.rigid->R.col(m));
    border.X = Z;
    matrix.factor.solve(border.X);
    Eigen::MatrixXd T = -Z.transpose() * border.X;
    T.diagonal().head(held).array() += 1;
    T = (0.5 * (T + T.transpose())).eval();
    border.T_inverse = LuFactor(T).inverse();
    border.negative = int((symmetric_eigenvalues(T).array() < 0).count() - modes);
}

void bend_modes(const SolidModel& model, const SolidMatrix& matrix, SolidUnknowns& unknowns,
                ContactBorder& border)
{
    border.mode_stiffness.resize(unknowns.modes.cols(), unknowns.modes.cols());
    for (Eigen::Index m = 0; m < unknowns.modes.cols(); ++m) {
        unknowns.modes.col(m) =
            free_part(unknowns, unknowns.rigid->R.col(m)) -
            solved(model, unknowns, matrix, border, free_part(unknowns, border.turning.col(m)));
        for (Eigen::Index l = 0; l < unknowns.modes.cols(); ++l)
            border.mode_stiffness(l, m) =
                free_part(unknowns, border.turning.col(l)).dot(unknowns.modes.col(m));
    }
    border.mode_stiffness =
        (0.5 * (border.mode_stiffness + border.mode_stiffness.transpose())).eval();
}

} // namespace amontons
