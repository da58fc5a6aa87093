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

/// Adds N N^T to the matrix: of each node with a force, a share of its own stiffness at rest along
/// the force, and across it what a wall of that curvature adds. A force that stays where the node
/// passes would turn a body that is pressed all around.
/// @return  N
SparseColumns stiffen(const SolidUnknowns& unknowns, const SolidMatrix& matrix, SparseMatrix& S,
                      const Eigen::VectorXd& force, double along, double across_size)
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
            size += along * matrix.K.coeff(at + i, at + i) / 3;
        const Vec3 n = f.normalized(), t = n.unitOrthogonal();
        const double across = across_size * f.norm();
        Mat3 root;
        root << std::sqrt(size) * n, std::sqrt(across) * t, std::sqrt(across) * n.cross(t);
        for (int i = 0; i < 3; ++i) // what is prescribed needs no hold
            if (unknowns.dofs.number[std::size_t(at + i)] < 0) root.row(i).setZero();
        const Mat3 added = root * root.transpose();
        for (int j = 0; j < 3; ++j)
            for (int i = 0; i < 3; ++i)
                if (added(i, j) != 0) S.coeffRef(at + i, at + j) += added(i, j);
        for (int j = 0; j < (across > 0 ? 3 : 1); ++j, ++columns)
            for (int i = 0; i < 3; ++i)
                if (root(i, j) != 0)
                    entries.emplace_back(unknowns.dofs.number[std::size_t(at + i)], columns,
                                         root(i, j));
    }
    SparseColumns N(Eigen::Index(unknowns.dofs.free.size()), columns);
    N.setFromTriplets(entries.begin(), entries.end());
    return N;
}

} // namespace

void SolidBody::stabilise_with(const Eigen::VectorXd& force)
{
    for (std::size_t i = 0; i < unknowns_.dof.size(); ++i)
        contact_.firm[unknowns_.dof[i]] = force[Eigen::Index(i)];
}

double next_shift(const StepInput& step, const SolidContactForces& contact, SolidTangent& tangent)
{
    if (step.dynamic && tangent.shift >= 1) return 0;
    if (tangent.shift <= 0 && tangent.shift > -double(kStabilisations.size()) && !step.dynamic &&
        !contact.on_unknowns.isZero(0)) {
        // From one before the last iteration's on: what holds only just appears and disappears.
        tangent.shift =
            tangent.shift < 0 ? tangent.shift - 1 : std::min(-1.0, tangent.last_shift + 1);
        while (contact.firm.isZero(0) && kStabilisations[std::size_t(-tangent.shift) - 1].firm)
            tangent.shift -= 1;
        return 1;
    }
    tangent.indefinite = true;
    tangent.shift = tangent.shift > 0
                        ? kShiftGrowth * tangent.shift // last_shift may be negative
                        : std::max(kFirstShift, tangent.last_shift / (kShiftGrowth * kShiftGrowth));
    return tangent.shift <= kGreatestShift ? tangent.shift : 0;
}

void stabilise(const SolidModel& model, const SolidUnknowns& unknowns, const SolidMatrix& matrix,
               const StepInput& step, const SolidContactForces& contact, SolidTangent& tangent,
               SparseMatrix& S)
{
    const double scale = step.dynamic ? 1 / step.h : 1;
    const Stabilisation& by = tangent.shift < 0 ? kStabilisations[std::size_t(-tangent.shift) - 1]
                                                : kStabilisations.back();
    tangent.stabilised =
        stiffen(unknowns, matrix, S, scale * (by.firm ? contact.firm : contact.on_unknowns),
                by.along, by.across / model.size);
}

bool SolidBody::is_stabilised() const
{
    if (unknowns_.modes.cols() > 0) return border_.negative > 0 && tangent_.shift <= 0;
    return tangent_.shift < 0 && tangent_.stabilised.cols() > 0;
}

int SolidBody::true_tangent_compliance(const SparseColumns& C, Eigen::MatrixXd& more)
{
    if (unknowns_.modes.cols() > 0) { // W is of the true matrix already
        more.setZero(C.cols(), C.cols());
        return border_.negative;
    }
    if (!volumes_.loads.empty() || tangent_.skew.nonZeros() > 0 ||
        tangent_.stabilised.cols() > kMostColumns)
        return -1;
    const Eigen::Index free = tangent_.stabilised.rows(), rows = C.cols(),
                       columns = tangent_.stabilised.cols();
    SparseColumns both(free, rows + columns);
    both.leftCols(rows) = C.rows() == free ? C : SparseColumns(C.topRows(free));
    both.rightCols(columns) = tangent_.stabilised;
    Eigen::MatrixXd all;
    matrix_->factor.compliance(both, all);
    const Eigen::MatrixXd open =
        Eigen::MatrixXd::Identity(columns, columns) - all.bottomRightCorner(columns, columns);
    const int negative = int((symmetric_eigenvalues(open).array() < 0).count());
    tangent_.open.compute(open);
    const Eigen::MatrixXd seen = all.bottomLeftCorner(columns, rows);
    more = seen.transpose() * tangent_.open.solve_all(seen);
    more = (0.5 * (more + more.transpose())).eval();
    return negative;
}

Eigen::VectorXd SolidBody::unstabilised(const Eigen::VectorXd& y) const
{
    if (unknowns_.modes.cols() > 0) return y;
    const Eigen::Index free = tangent_.stabilised.rows();
    Eigen::VectorXd all = y;
    all.head(free) += solved(
        model_, unknowns_, *matrix_, border_,
        tangent_.stabilised *
            tangent_.open.solve(Eigen::VectorXd(tangent_.stabilised.transpose() * y.head(free))));
    return all;
}

} // namespace amontons
