#include "solver/solid/corotational.hpp"

#include "mesh/base/dense.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>

namespace amontons {
namespace {

Mat3 cross_matrix(const Vec3& a)
{
    Mat3 m;
    m << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
    return m;
}

/// J in J dtheta = sum_i g_i x (R^T dx_i), the turn that the polar rotation makes.
Mat3 turn_stiffness(const CorotationalElement& e, const CorotationalState& s)
{
    Mat3 S = Mat3::Zero();
    for (Eigen::Index i = 0; i < e.X.cols(); ++i)
        S += (e.X.col(i) + s.u.segment<3>(3 * i)) * e.gradient.col(i).transpose();
    S = 0.5 * (S + S.transpose()).eval();
    return S.trace() * Mat3::Identity() - S;
}

using TurnOfPlaces = Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, kMostSolidDofs>;

/// dtheta = G (R^T dx), 3 x 3n.
TurnOfPlaces turn_of_places(const CorotationalElement& e, const Mat3& J)
{
    const Mat3 inverse = J.inverse();
    TurnOfPlaces G(3, 3 * e.X.cols());
    for (Eigen::Index i = 0; i < e.X.cols(); ++i)
        G.middleCols<3>(3 * i) = inverse * cross_matrix(e.gradient.col(i));
    return G;
}

/// K <- R K R^T, block by block.
void turn_into_space(const Mat3& R, ElementMatrix& K)
{
    for (Eigen::Index j = 0; j < K.cols(); j += 3)
        for (Eigen::Index i = 0; i <= j; i += 3) {
            const Mat3 block = R * K.block<3, 3>(i, j) * R.transpose();
            K.block<3, 3>(i, j) = block;
            K.block<3, 3>(j, i) = block.transpose();
        }
}

} // namespace

CorotationalElement make_corotational(ElementKind kind, const ElementPoints& X, const Mat6& C)
{
    CorotationalElement e;
    solid_stiffness(kind, X, C, e.K);
    e.X = X.colwise() - X.rowwise().mean();
    const bool tetrahedron = kind != ElementKind::H8;
    const Vec3 centre = tetrahedron ? Vec3(0.25, 0.25, 0.25) : Vec3(0, 0, 0);
    const ShapeGradients d = shape_gradients(kind, centre);
    const Mat3 jacobian = X * d.transpose();
    e.gradient = jacobian.inverse().transpose() * d;
    return e;
}

Mat3 polar_rotation(const Mat3& F)
{
    Mat3 R = F;
    const double size = R.norm() / std::sqrt(3.0);
    if (R.determinant() > 1e-3 * size * size * size) {
        // Higham's scaled Newton iteration; quadratic, and exact on rotations.
        for (int i = 0; i < 40; ++i) {
            const Mat3 inverse = R.inverse().transpose();
            const double scale = std::sqrt(inverse.norm() / R.norm());
            const Mat3 next = 0.5 * (scale * R + inverse / scale);
            const double change = (next - R).norm();
            R = next;
            if (change < 1e-15 * std::sqrt(3.0) + 1e-16) break;
            if (change < 1e-8) { // one more without scaling is at round-off
                R = 0.5 * (R + Mat3(R.inverse().transpose()));
                break;
            }
        }
        return R;
    }
    const SingularValues3 svd = singular_values(F);
    Mat3 D = Mat3::Identity();
    D(2, 2) = (svd.U * svd.V.transpose()).determinant() < 0 ? -1 : 1;
    return svd.U * D * svd.V.transpose();
}

CorotationalState corotational_forces(const CorotationalElement& e, const ElementPoints& x,
                                      ElementVector& forces)
{
    const Eigen::Index n = e.X.cols();
    CorotationalState s;
    const Vec3 centre = x.rowwise().mean();
    Mat3 F = Mat3::Zero();
    for (Eigen::Index i = 0; i < n; ++i)
        F += (x.col(i) - centre) * e.gradient.col(i).transpose();
    s.rotation = polar_rotation(F);
    s.u.resize(3 * n);
    for (Eigen::Index i = 0; i < n; ++i)
        s.u.segment<3>(3 * i) = s.rotation.transpose() * (x.col(i) - centre) - e.X.col(i);
    forces.noalias() = e.K * s.u;
    s.energy = 0.5 * s.u.dot(forces);
    Vec3 moment = Vec3::Zero();
    for (Eigen::Index i = 0; i < n; ++i)
        moment += (e.X.col(i) + s.u.segment<3>(3 * i)).cross(Vec3(forces.segment<3>(3 * i)));
    const Vec3 turn = turn_stiffness(e, s).inverse() * moment;
    for (Eigen::Index i = 0; i < n; ++i) {
        const Vec3 f = Vec3(forces.segment<3>(3 * i)) - turn.cross(Vec3(e.gradient.col(i)));
        forces.segment<3>(3 * i) = s.rotation * f;
    }
    return s;
}

void corotational_rate_forces(const CorotationalElement& e, const CorotationalState& s,
                              const ElementVector& v, ElementVector& forces)
{
    const Eigen::Index n = e.X.cols();
    const TurnOfPlaces G = turn_of_places(e, turn_stiffness(e, s));
    ElementVector rate(3 * n);
    for (Eigen::Index i = 0; i < n; ++i)
        rate.segment<3>(3 * i) = s.rotation.transpose() * v.segment<3>(3 * i);
    const Vec3 spin = G * rate;
    for (Eigen::Index i = 0; i < n; ++i)
        rate.segment<3>(3 * i) -= spin.cross(Vec3(e.X.col(i) + s.u.segment<3>(3 * i)));
    forces.noalias() = e.K * rate;
    Vec3 moment = Vec3::Zero();
    for (Eigen::Index i = 0; i < n; ++i)
        moment += (e.X.col(i) + s.u.segment<3>(3 * i)).cross(Vec3(forces.segment<3>(3 * i)));
    forces.noalias() -= G.transpose() * moment;
    for (Eigen::Index i = 0; i < n; ++i)
        forces.segment<3>(3 * i) = (s.rotation * forces.segment<3>(3 * i)).eval();
}

void corotational_stiffness(const CorotationalElement& e, const CorotationalState& s,
                            ElementMatrix& K)
{
    const Eigen::Index n = e.X.cols();
    const Mat3 J = turn_stiffness(e, s);
    const TurnOfPlaces G = turn_of_places(e, J);
    // P = 1 - Z G with Z_i dtheta = dtheta x xi_i.
    Eigen::Matrix<double, Eigen::Dynamic, 3, 0, kMostSolidDofs, 3> Z(3 * n, 3);
    for (Eigen::Index i = 0; i < n; ++i)
        Z.middleRows<3>(3 * i) = -cross_matrix(e.X.col(i) + s.u.segment<3>(3 * i));
    const Eigen::Matrix<double, Eigen::Dynamic, 3, 0, kMostSolidDofs, 3> KZ = e.K * Z;
    const Mat3 ZKZ = Z.transpose() * KZ;
    K = e.K;
    K.noalias() -= KZ * G;
    K.noalias() -= G.transpose() * KZ.transpose();
    K.noalias() += G.transpose() * (ZKZ * G);
    turn_into_space(s.rotation, K);
}

// f_i = R fhat_i with fhat_i = (K u)_i - w x g_i, J w = tau, tau = sum_i xi_i x (K u)_i. With
// dtheta = G dx and du = P dx in the element's frame:
//   dfhat_i = (K du)_i - dw x g_i,   J dw = dtau - dJ w,
//   dtau = sum_i du_i x (K u)_i + xi_i x (K du)_i,
//   dJ w = tr(dS) w - dS w,  dS = sum_i du_i g_i^T (symmetric by the choice of dtheta),
//   df_i = R (dfhat_i + dtheta x fhat_i).
void corotational_tangent(const CorotationalElement& e, const CorotationalState& s,
                          ElementMatrix& K)
{
    const Eigen::Index n = e.X.cols();
    const Mat3 J = turn_stiffness(e, s);
    const Mat3 J_inverse = J.inverse();
    const TurnOfPlaces G = turn_of_places(e, J);
    const ElementVector Ku = e.K * s.u;
    Vec3 moment = Vec3::Zero();
    ElementMatrix P = ElementMatrix::Identity(3 * n, 3 * n);
    for (Eigen::Index i = 0; i < n; ++i) {
        const Vec3 xi = e.X.col(i) + s.u.segment<3>(3 * i);
        P.middleRows<3>(3 * i) += cross_matrix(xi) * G;
        moment += xi.cross(Vec3(Ku.segment<3>(3 * i)));
    }
    const Vec3 w = J_inverse * moment;
    K.noalias() = e.K * P;
    TurnOfPlaces dmoment = TurnOfPlaces::Zero(3, 3 * n);
    for (Eigen::Index i = 0; i < n; ++i) {
        const Vec3 xi = e.X.col(i) + s.u.segment<3>(3 * i), g = e.gradient.col(i);
        const Mat3 of_u =
            -cross_matrix(Ku.segment<3>(3 * i)) - w * g.transpose() + g.dot(w) * Mat3::Identity();
        dmoment += of_u * P.middleRows<3>(3 * i) + cross_matrix(xi) * K.middleRows<3>(3 * i);
    }
    const TurnOfPlaces dw = J_inverse * dmoment;
    for (Eigen::Index i = 0; i < n; ++i) {
        const Vec3 g = e.gradient.col(i);
        const Vec3 f = Vec3(Ku.segment<3>(3 * i)) - w.cross(g);
        K.middleRows<3>(3 * i) += cross_matrix(g) * dw - cross_matrix(f) * G;
    }
    K = 0.5 * (K + K.transpose()).eval(); // symmetric but for round-off
    turn_into_space(s.rotation, K);
}

} // namespace amontons
