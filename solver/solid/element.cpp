#include "solver/solid/element.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>

// H8's internal modes. A trilinear brick bends with parasitic shears, because it lacks the
// quadratic displacements 1 - xi_k^2, and has seven volume constraints (1, xi_k, xi_k xi_l) for the
// one that it should have. Added to the displacement gradient are, with J0 = J at the centre,
//
//     G = v_k (x) g_k,   g_k = (det J0 / det J) xi_k J0^-T e_k         9, v_k any vectors
//     G = s_m 1,         s_m = (det J0 / det J) (xi_2 xi_3, xi_3 xi_1, xi_1 xi_2)      3
//
// The integral of each over the element is a constant times that of xi_k or xi_k xi_l over the
// cube, zero: a constant stress does no work on them, so the patch test is passed on any mesh.
// They vanish at the centre, and are linearly independent of the gradients of the nodes. The v_k
// are free vectors, and a permutation or reflection of the cube's axes maps the set of modes to
// itself: neither a rotation nor another order of the nodes changes the element.

namespace amontons {
namespace {

constexpr int node_count(ElementKind kind)
{
    return kind == ElementKind::T4 ? 4 : kind == ElementKind::T10 ? 10 : 8;
}

constexpr int modes_of(ElementKind kind)
{
    return kind == ElementKind::H8 ? kMostInternalModes : 0;
}

constexpr int points_of(ElementKind kind)
{
    return kind == ElementKind::T4 ? 1 : 8;
}

template <ElementKind kind> using Points = Eigen::Matrix<double, 3, node_count(kind)>;

/// Strains at a point due to the displacements and the internal modes.
template <ElementKind kind>
using StrainRows = Eigen::Matrix<double, 6, 3 * node_count(kind) + modes_of(kind)>;

/// J: column k is the derivative of the place with respect to xi_k.
template <class P, class G> Mat3 jacobian(const P& X, const G& dN)
{
    return X * dN.transpose();
}

/// The three columns of a vector amplitude whose displacement gradient is (vector) (x) g.
template <class Rows> void set_vector_columns(Rows& B, int first, const Vec3& g)
{
    B.template middleCols<3>(first) << g[0], 0, 0, //
        0, g[1], 0,                                //
        0, 0, g[2],                                //
        g[1], g[0], 0,                             //
        0, g[2], g[1],                             //
        g[2], 0, g[0];
}

/// @param B  set to the strains of unit displacements and modes
/// @return   det J
template <ElementKind kind, class P, class G>
double strain_rows(const P& X, const G& dN, const Mat3& J0, const Vec3& xi, StrainRows<kind>& B)
{
    constexpr int n = node_count(kind);
    const Mat3 J = jacobian(X, dN);
    const double j = J.determinant();
    AMONTONS_ASSERT(j > 0);
    const Points<kind> gradients = J.inverse().transpose() * dN;
    for (int i = 0; i < n; ++i)
        set_vector_columns(B, 3 * i, gradients.col(i));
    if constexpr (kind == ElementKind::H8) {
        const double scale = J0.determinant() / j;
        const Mat3 inverse = J0.inverse();
        for (int k = 0; k < 3; ++k)
            set_vector_columns(B, 3 * (n + k), scale * xi[k] * inverse.row(k).transpose());
        const Vec3 volume = scale * Vec3{xi[1] * xi[2], xi[2] * xi[0], xi[0] * xi[1]};
        B.template rightCols<3>().template topRows<3>().rowwise() = volume.transpose();
        B.template rightCols<3>().template bottomRows<3>().setZero();
    }
    return j;
}

/// Shape gradients at the stiffness points, and at the centre of H8, once for all elements.
template <ElementKind kind> struct Table {
    std::array<Points<kind>, points_of(kind)> gradients;
    Points<kind> at_centre;
    Table()
    {
        std::size_t q = 0;
        for (const QuadraturePoint& p : stiffness_points(kind))
            gradients[q++] = shape_gradients(kind, p.xi);
        at_centre = shape_gradients(kind, Vec3::Zero());
    }
};

template <ElementKind kind> const Table<kind>& table()
{
    static const Table<kind> instance;
    return instance;
}

/// Stiffness of displacements and internal modes together; its lower triangle.
template <ElementKind kind> auto joint_stiffness(const ElementPoints& places, const Mat6& C)
{
    constexpr int size = StrainRows<kind>::ColsAtCompileTime;
    const Points<kind> X = places;
    const Mat3 J0 = jacobian(X, table<kind>().at_centre);
    Eigen::Matrix<double, size, size> K = Eigen::Matrix<double, size, size>::Zero();
    StrainRows<kind> B;
    std::size_t q = 0;
    for (const QuadraturePoint& p : stiffness_points(kind)) {
        const double j = strain_rows<kind>(X, table<kind>().gradients[q++], J0, p.xi, B);
        const StrainRows<kind> stress = (p.weight * j) * C * B;
        K.noalias() += B.transpose() * stress;
    }
    return K;
}

/// With K = L L^T on the modes, what they take away is S^T S, S = L^-1 K_au.
struct Condensation {
    static constexpr int kModes = kMostInternalModes, kDofs = 24;
    Eigen::LLT<Eigen::Matrix<double, kModes, kModes>> factor;
    Eigen::Matrix<double, kModes, kDofs> coupling; ///< K_au

    template <class Joint>
    explicit Condensation(const Joint& K)
        : factor(K.template bottomRightCorner<kModes, kModes>())
        , coupling(K.template bottomLeftCorner<kModes, kDofs>())
    {
        // The modes are independent of each other: with C positive definite this cannot fail.
        AMONTONS_ASSERT(factor.info() == Eigen::Success);
    }
};

/// Where a strain of two axes stands among the six.
constexpr int kStrain[3][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}};

/// Of displacements alone. With G_JL = int g_J g_L^T of the shapes' gradients along two axes, the
/// block of the displacements along c and d is sum_JL C_(cJ)(dL) G_JL: nine products of C for all
/// pairs of nodes, in place of six strains at each point.
template <ElementKind kind>
void simple_stiffness(const ElementPoints& places, const Mat6& C, ElementMatrix& result)
{
    constexpr int n = node_count(kind), rows = (n + 3) / 4 * 4; // whole registers
    using Block = Eigen::Matrix<double, rows, n>;
    const Points<kind> X = places;
    std::array<Block, 9> G;
    for (Block& block : G)
        block.setZero();
    Eigen::Matrix<double, rows, 3> left = Eigen::Matrix<double, rows, 3>::Zero();
    std::size_t q = 0;
    for (const QuadraturePoint& p : stiffness_points(kind)) {
        const Points<kind>& dN = table<kind>().gradients[q++];
        const Mat3 J = jacobian(X, dN);
        const double j = J.determinant();
        AMONTONS_ASSERT(j > 0);
        const Points<kind> g = J.inverse().transpose() * dN;
        left.template topRows<n>() = (p.weight * j) * g.transpose();
        for (int L = 0; L < 3; ++L)
            for (int axis = 0; axis < 3; ++axis)
                for (int k = 0; k < n; ++k)
                    G[std::size_t(axis + 3 * L)].col(k) += left.col(axis) * g(L, k);
    }
    result.resize(3 * n, 3 * n);
    for (int c = 0; c < 3; ++c)
        for (int d = c; d < 3; ++d) {
            Block K = Block::Zero();
            for (int L = 0; L < 3; ++L)
                for (int axis = 0; axis < 3; ++axis)
                    K += C(kStrain[c][axis], kStrain[d][L]) * G[std::size_t(axis + 3 * L)];
            for (int k = 0; k < n; ++k)
                for (int i = 0; i < n; ++i) {
                    const double v = c == d ? 0.5 * (K(i, k) + K(k, i)) : K(i, k);
                    result(3 * i + c, 3 * k + d) = result(3 * k + d, 3 * i + c) = v;
                }
        }
}

void brick_stiffness(const ElementPoints& X, const Mat6& C, ElementMatrix& result)
{
    constexpr int dofs = Condensation::kDofs;
    const auto joint = joint_stiffness<ElementKind::H8>(X, C);
    Eigen::Matrix<double, dofs, dofs> K = joint.topLeftCorner<dofs, dofs>();
    const Condensation c(joint);
    const auto S = c.factor.matrixL().solve(c.coupling).eval();
    K.noalias() -= S.transpose() * S;
    result = 0.5 * (K + K.transpose());
}

/// Calls visit(weight det J, shape values) at each mass point.
template <class Visit> void for_mass_points(ElementKind kind, const ElementPoints& X, Visit visit)
{
    for (const QuadraturePoint& p : mass_points(kind)) {
        const double j = jacobian(X, shape_gradients(kind, p.xi)).determinant();
        visit(p.weight * j, shape_values(kind, p.xi));
    }
}

void check_size(ElementKind kind, const ElementPoints& X)
{
    AMONTONS_ASSERT(X.cols() == shape_of(kind).nodes);
}

} // namespace

void solid_stiffness(ElementKind kind, const ElementPoints& X, const Mat6& C, ElementMatrix& K)
{
    check_size(kind, X);
    switch (kind) {
    case ElementKind::T4:
        return simple_stiffness<ElementKind::T4>(X, C, K);
    case ElementKind::T10:
        return simple_stiffness<ElementKind::T10>(X, C, K);
    case ElementKind::H8:
        return brick_stiffness(X, C, K);
    }
}

void solid_mass(ElementKind kind, const ElementPoints& X, double density, ElementMatrix& M)
{
    check_size(kind, X);
    M.setZero(X.cols(), X.cols());
    for_mass_points(kind, X, [&](double volume, const ShapeValues& N) {
        M.noalias() += (density * volume) * N * N.transpose();
    });
    M = (0.5 * (M + M.transpose())).eval();
}

ShapeValues solid_lumped_mass(ElementKind kind, const ElementPoints& X, double density)
{
    check_size(kind, X);
    ShapeValues mass = ShapeValues::Zero(X.cols());
    double total = 0;
    for_mass_points(kind, X, [&](double volume, const ShapeValues& N) {
        total += density * volume;
        mass += density * volume * (kind == ElementKind::T10 ? N.cwiseAbs2().eval() : N);
    });
    // 1 *: the sum of a vector itself begins where its address is that of a register, and the stack
    // has its values now here, now there.
    if (kind == ElementKind::T10 && total > 0) mass *= total / (1 * mass).sum();
    return mass;
}

double solid_volume(ElementKind kind, const ElementPoints& X)
{
    check_size(kind, X);
    double sum = 0;
    for_mass_points(kind, X, [&](double volume, const ShapeValues&) { sum += volume; });
    return sum;
}

ElementVector solid_body_force(ElementKind kind, const ElementPoints& X, const Vec3& force)
{
    check_size(kind, X);
    ElementVector f = ElementVector::Zero(3 * X.cols());
    for_mass_points(kind, X, [&](double volume, const ShapeValues& N) {
        for (Eigen::Index i = 0; i < N.size(); ++i)
            f.segment<3>(3 * i) += volume * N[i] * force;
    });
    return f;
}

InternalModes solid_internal_modes(ElementKind kind, const ElementPoints& X, const Mat6& C,
                                   const ElementVector& u)
{
    check_size(kind, X);
    AMONTONS_ASSERT(u.size() == 3 * X.cols());
    if (kind != ElementKind::H8) return {};
    constexpr int dofs = 24, modes = kMostInternalModes;
    const Points<ElementKind::H8> places = X;
    const Mat3 J0 = jacobian(places, table<ElementKind::H8>().at_centre);
    Eigen::Matrix<double, modes, modes> K = Eigen::Matrix<double, modes, modes>::Zero();
    Eigen::Matrix<double, modes, 1> f = Eigen::Matrix<double, modes, 1>::Zero();
    StrainRows<ElementKind::H8> B;
    std::size_t q = 0;
    for (const QuadraturePoint& p : stiffness_points(kind)) {
        const auto& dN = table<ElementKind::H8>().gradients[q++];
        const double volume = p.weight * strain_rows<ElementKind::H8>(places, dN, J0, p.xi, B);
        const Eigen::Matrix<double, 6, modes> stress = volume * C * B.rightCols<modes>();
        const Vec6 strain = B.leftCols<dofs>() * u;
        K.noalias() += B.rightCols<modes>().transpose() * stress;
        f.noalias() -= stress.transpose() * strain;
    }
    return K.llt().solve(f);
}

namespace {

template <ElementKind kind>
Vec6 strain(const ElementPoints& places, const ElementVector& u, const InternalModes& modes,
            const Vec3& xi)
{
    constexpr int dofs = 3 * node_count(kind);
    const Points<kind> X = places, dN = shape_gradients(kind, xi);
    StrainRows<kind> B;
    strain_rows<kind>(X, dN, jacobian(X, table<kind>().at_centre), xi, B);
    Vec6 e = B.template leftCols<dofs>() * u;
    if constexpr (kind == ElementKind::H8) e += B.template rightCols<modes_of(kind)>() * modes;
    return e;
}

} // namespace

Vec6 solid_strain(ElementKind kind, const ElementPoints& X, const ElementVector& u,
                  const InternalModes& modes, const Vec3& xi)
{
    check_size(kind, X);
    AMONTONS_ASSERT(u.size() == 3 * X.cols() &&
                    modes.size() == (kind == ElementKind::H8 ? kMostInternalModes : 0));
    switch (kind) {
    case ElementKind::T4:
        return strain<ElementKind::T4>(X, u, modes, xi);
    case ElementKind::T10:
        return strain<ElementKind::T10>(X, u, modes, xi);
    case ElementKind::H8:
        return strain<ElementKind::H8>(X, u, modes, xi);
    }
    assertion_failed("an element kind", __FILE__, __LINE__);
}

} // namespace amontons
