#pragma once

#include "solver/solid/assembly.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <random>

// Elements of any shape, and what an element without internal modes would do.

namespace amontons::test {

constexpr ElementKind kAllKinds[] = {ElementKind::T4, ElementKind::T10, ElementKind::H8};

class Random {
public:
    explicit Random(unsigned seed) : engine_(seed) {}
    double operator()() { return std::uniform_real_distribution<>(-1, 1)(engine_); }
    Vec3 vector() { return {(*this)(), (*this)(), (*this)()}; }
    Mat3 matrix()
    {
        return Mat3::NullaryExpr([&] { return (*this)(); });
    }
    Mat3 rotation()
    {
        return Eigen::Quaterniond(
                   Eigen::Vector4d::NullaryExpr([&] { return (*this)(); }).normalized())
            .toRotationMatrix();
    }

private:
    std::mt19937 engine_;
};

/// The reference element stretched, sheared and moved; then each node is shaken (T10: its edges
/// and faces become curved).
inline ElementPlaces distorted_element(ElementKind kind, Random& random, double shake = 0.12)
{
    ElementPlaces X = reference_nodes(kind);
    for (Eigen::Index i = 0; i < X.cols(); ++i)
        X.col(i) += shake * (kind == ElementKind::T10 ? 0.5 : 1) * random.vector();
    const Mat3 A = Mat3{Vec3{1.3, 0.8, 0.6}.asDiagonal()} + 0.2 * random.matrix();
    X = (A * X).colwise() + 3 * random.vector();
    return X;
}

/// u = G x at each node.
inline ElementVector linear_displacement(const ElementPlaces& X, const Mat3& G)
{
    const ElementPlaces u = G * X;
    return Eigen::Map<const Eigen::VectorXd>(u.data(), u.size());
}

/// The strain of a displacement gradient.
inline Vec6 strain_of(const Mat3& G)
{
    return {G(0, 0), G(1, 1), G(2, 2), G(0, 1) + G(1, 0), G(1, 2) + G(2, 1), G(0, 2) + G(2, 0)};
}

/// Displacements alone, integrated at the stiffness points, written without the element's code:
/// what an H8 would be without its internal modes.
inline ElementMatrix plain_stiffness(ElementKind kind, const ElementPlaces& X, const Mat6& C)
{
    const Eigen::Index n = X.cols();
    ElementMatrix K = ElementMatrix::Zero(3 * n, 3 * n);
    for (const QuadraturePoint& p : stiffness_points(kind)) {
        const ShapeGradients dN = shape_gradients(kind, p.xi);
        const Mat3 J = X * dN.transpose();
        const ShapeGradients g = J.transpose().inverse() * dN;
        for (Eigen::Index i = 0; i < n; ++i)
            for (int a = 0; a < 3; ++a)
                for (Eigen::Index j = 0; j < n; ++j)
                    for (int b = 0; b < 3; ++b)
                        K(3 * i + a, 3 * j + b) +=
                            p.weight * J.determinant() *
                            strain_of(Vec3::Unit(a) * g.col(i).transpose())
                                .dot(C * strain_of(Vec3::Unit(b) * g.col(j).transpose()));
    }
    return K;
}

inline SparseMatrix assembled_stiffness(const VolumeMesh& mesh, const SolidPattern& pattern,
                                        const SolidMaterial& material)
{
    SparseMatrix K = zero_matrix(pattern);
    assemble_stiffness(mesh, pattern, {&material, 1}, K);
    return K;
}

/// Moves all nodes that are not on the surface of the box [0, 1]^3 back and forth; a T10's middle
/// nodes too, so that its edges inside are curved.
inline void shake_inside(VolumeMesh& mesh, Random& random, double distance)
{
    for (Vec3& x : mesh.nodes)
        if (x.minCoeff() > 1e-9 && x.maxCoeff() < 1 - 1e-9) x += distance * random.vector();
}

} // namespace amontons::test
