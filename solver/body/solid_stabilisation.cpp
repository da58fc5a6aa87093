#include "solver/body/solid_body.hpp"

#include "mesh/base/dense.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

// A hyperelastic solid that is stable by its contacts alone: its own tangent A under dead forces is
// not positive, and has no Cholesky factor. What is factored is L = A + N N^T, stiffer where
// contacts push. A step that is to be Newton's takes N N^T out again (Sherman, Morrison &
// Woodbury):
//   A^-1 = L^-1 + L^-1 N (1 - S)^-1 N^T L^-1,   S = N^T L^-1 N,
// and A has as many negative eigenvalues as 1 - S (inertia of a Schur complement). Whether contacts
// hold them is decided where all bodies are known: solver/step/body_stabilisation.cpp.

namespace amontons {
namespace {

/// The ways to stabilise the matrix at contacts, tried one after the other. First at those with
/// bodies that do not move, along their forces, by so many times the node's own stiffness. Then
/// also across the forces, as on a wall with a curvature of so many over the body's size. Last also
/// at contacts with compliant bodies, the body's own other side included.
struct Stabilisation {
    bool firm = false;
    double along = 0, across = 0;
};
constexpr std::array<Stabilisation, 11> kStabilisations{{{true, 1, 0},
                                                         {true, 30, 0},
                                                         {true, 1, 1},
                                                         {true, 1, 4},
                                                         {true, 1, 16},
                                                         {true, 1, 64},
                                                         {false, 1, 0},
                                                         {false, 1, 1},
                                                         {false, 1, 4},
                                                         {false, 1, 16},
                                                         {false, 1, 64}}};
constexpr double kNoForce = 1e-6;  ///< on a node, of the largest on one
constexpr int kMostColumns = 1500; ///< of N: dense algebra on them
constexpr double kFirstShift = 1e-3, kGreatestShift = 1e3, kShiftGrowth = 10;

} // namespace

void SolidBody::stabilise_with(const Eigen::VectorXd& force)
{
    for (std::size_t i = 0; i < unknown_.size(); ++i)
        support_stiffness_[unknown_[i]] = force[Eigen::Index(i)];
}

/// The next way to make the matrix positive: a line of the table, from 1, negative; then shares of
/// the stiffness at rest. @return  0 if none is left
double SolidBody::next_shift()
{
    if (step_.dynamic && shift_ >= 1) return 0;
    if (shift_ <= 0 && shift_ > -double(kStabilisations.size()) && !step_.dynamic &&
        !contact_.isZero(0)) {
        // From one before the last iteration's on: what holds only just appears and disappears.
        shift_ = shift_ < 0 ? shift_ - 1 : std::min(-1.0, last_shift_ + 1);
        while (support_stiffness_.isZero(0) && kStabilisations[std::size_t(-shift_) - 1].firm)
            shift_ -= 1;
        return 1;
    }
    indefinite_ = true;
    shift_ = shift_ > 0 ? kShiftGrowth * shift_ // last_shift_ may be negative
                        : std::max(kFirstShift, last_shift_ / (kShiftGrowth * kShiftGrowth));
    return shift_ <= kGreatestShift ? shift_ : 0;
}

/// Adds N N^T to the matrix: of each node with a force, a share of its own stiffness at rest along
/// the force, and across it what a wall of that curvature adds. A force that stays where the node
/// passes would turn a body that is pressed all around.
/// @return  N
SparseColumns SolidBody::stiffen(SparseMatrix& S, const Eigen::VectorXd& force, double along,
                                 double across_size) const
{
    // Round-off of a contact's weights is no contact: such a node moves freely.
    const double least = kNoForce * force.cwiseAbs().maxCoeff();
    std::vector<Eigen::Triplet<double>> entries;
    int columns = 0;
    for (Eigen::Index at = 0; at + 3 <= force.size(); at += 3) {
        const Vec3 f = force.segment<3>(at);
        if (!(f.norm() > least)) continue;
        double size = 0;
        for (int i = 0; i < 3; ++i)
            size += along * matrix_->K.coeff(at + i, at + i) / 3;
        const Vec3 n = f.normalized(), t = n.unitOrthogonal();
        const double across = across_size * f.norm();
        Mat3 root;
        root << std::sqrt(size) * n, std::sqrt(across) * t, std::sqrt(across) * n.cross(t);
        for (int i = 0; i < 3; ++i) // what is prescribed needs no hold
            if (dofs_.number[std::size_t(at + i)] < 0) root.row(i).setZero();
        const Mat3 added = root * root.transpose();
        for (int j = 0; j < 3; ++j)
            for (int i = 0; i < 3; ++i)
                if (added(i, j) != 0) S.coeffRef(at + i, at + j) += added(i, j);
        for (int j = 0; j < (across > 0 ? 3 : 1); ++j, ++columns)
            for (int i = 0; i < 3; ++i)
                if (root(i, j) != 0)
                    entries.emplace_back(dofs_.number[std::size_t(at + i)], columns, root(i, j));
    }
    SparseColumns N(Eigen::Index(dofs_.free.size()), columns);
    N.setFromTriplets(entries.begin(), entries.end());
    return N;
}

/// The matrix with the shift of next_shift().
void SolidBody::stabilise(SparseMatrix& S)
{
    const double scale = step_.dynamic ? 1 / step_.h : 1;
    const Stabilisation& by =
        shift_ < 0 ? kStabilisations[std::size_t(-shift_) - 1] : kStabilisations.back();
    stabilised_ =
        stiffen(S, scale * (by.firm ? support_stiffness_ : contact_), by.along, by.across / size_);
}

bool SolidBody::is_stabilised() const
{
    if (free_modes_.cols() > 0) return border_negative_ > 0 && shift_ <= 0;
    return shift_ < 0 && stabilised_.cols() > 0;
}

int SolidBody::true_tangent_compliance(const SparseColumns& C, Eigen::MatrixXd& more)
{
    if (free_modes_.cols() > 0) { // W is of the true matrix already
        more.setZero(C.cols(), C.cols());
        return border_negative_;
    }
    if (!volumes_.empty() || skew_.nonZeros() > 0 || stabilised_.cols() > kMostColumns) return -1;
    const Eigen::Index free = stabilised_.rows(), rows = C.cols(), columns = stabilised_.cols();
    SparseColumns both(free, rows + columns);
    both.leftCols(rows) = C.rows() == free ? C : SparseColumns(C.topRows(free));
    both.rightCols(columns) = stabilised_;
    Eigen::MatrixXd all;
    matrix_->factor.compliance(both, all);
    const Eigen::MatrixXd open =
        Eigen::MatrixXd::Identity(columns, columns) - all.bottomRightCorner(columns, columns);
    const int negative = int((symmetric_eigenvalues(open).array() < 0).count());
    true_tangent_.compute(open);
    const Eigen::MatrixXd seen = all.bottomLeftCorner(columns, rows);
    more = seen.transpose() * true_tangent_.solve_all(seen);
    more = (0.5 * (more + more.transpose())).eval();
    return negative;
}

Eigen::VectorXd SolidBody::unstabilised(const Eigen::VectorXd& y) const
{
    if (free_modes_.cols() > 0) return y;
    const Eigen::Index free = stabilised_.rows();
    Eigen::VectorXd all = y;
    all.head(free) += solved(
        stabilised_ * true_tangent_.solve(Eigen::VectorXd(stabilised_.transpose() * y.head(free))));
    return all;
}

} // namespace amontons
