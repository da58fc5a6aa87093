#include "contact/surface/multipliers.hpp"

#include "mesh/base/dense.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace amontons {
namespace {

using Functions = decltype(FaceMultipliers::functions);

/// Rows of the middle nodes in D M^-1 of the reference triangle with quadratic functions.
Functions middle_functions()
{
    Eigen::Matrix<double, 6, 6> M = Eigen::Matrix<double, 6, 6>::Zero();
    Eigen::Matrix<double, 6, 1> D = Eigen::Matrix<double, 6, 1>::Zero();
    for (const QuadraturePoint& p : triangle_points(5)) {
        const Eigen::Matrix<double, 6, 1> N = face_shape_values(6, p.xi);
        M += p.weight * N * N.transpose();
        D += p.weight * N;
    }
    const Mat6 inverse = inverse_of(M);
    Functions functions = Functions::Zero();
    functions.topRows<3>() = (D.asDiagonal() * inverse).bottomRows<3>();
    return functions;
}

/// D M^-1 of the true quadrilateral.
void dual_bilinear(const FaceInPlane& face, FaceMultipliers& out)
{
    Eigen::Matrix4d M = Eigen::Matrix4d::Zero();
    Eigen::Vector4d D = Eigen::Vector4d::Zero();
    for (const QuadraturePoint& p : square_points(3)) {
        const FaceSpot at = spot(face, p.xi.head<2>());
        const double weight = p.weight * at.along[0].cross(at.along[1]).norm();
        const Eigen::Vector4d N = at.values.head<4>();
        M += weight * N * N.transpose();
        D += weight * N;
    }
    const Eigen::Matrix4d inverse = M.inverse();
    out.functions.leftCols<4>() = D.asDiagonal() * inverse;
    for (int i = 0; i < 4; ++i)
        out.full[static_cast<std::size_t>(i)] = D[i];
}

} // namespace

FaceMultipliers face_multipliers(const FaceInPlane& face)
{
    FaceMultipliers out;
    out.functions.setZero();
    out.count = face.nodes == 4 ? 4 : 3;
    for (int i = 0; i < out.count; ++i)
        out.node[static_cast<std::size_t>(i)] = face.nodes == 6 ? 3 + i : i;
    if (face.nodes == 3) {
        const Vec3 twice = (face.node[1] - face.node[0]).cross(face.node[2] - face.node[0]);
        out.functions.topLeftCorner<3, 3>() = 4 * Mat3::Identity() - Mat3::Ones();
        out.full.fill(twice.norm() / 6);
    } else if (face.nodes == 6) {
        static const Functions middle = middle_functions();
        out.functions = middle;
        for (const QuadraturePoint& p : triangle_points(5)) {
            const FaceSpot at = spot(face, p.xi.head<2>());
            const Eigen::Vector4d psi = middle * at.values;
            for (int i = 0; i < 3; ++i)
                out.full[static_cast<std::size_t>(i)] +=
                    p.weight * at.along[0].cross(at.along[1]).norm() * psi[i];
        }
    } else {
        dual_bilinear(face, out);
    }
    return out;
}

std::span<const QuadraturePoint> points_for_bend(double bend)
{
    // Right to exp(-kDigits).
    constexpr double kMostBend = 0.99, kDigits = 23;
    constexpr int kLeastAlong = 4, kMostAlong = 12;
    bend = std::min(bend, kMostBend);
    // With a singularity at 1/bend a power is rho times smaller than the one before; n points are
    // right to the power 2 n - 2.
    const double rho = 1 / bend + std::sqrt(1 / (bend * bend) - 1);
    const int points = 1 + int(std::ceil(kDigits / (2 * std::log(rho))));
    return triangle_points_along(std::clamp(points, kLeastAlong, kMostAlong));
}

ConvexPolygon nearest_part(int nodes, int multiplier)
{
    ConvexPolygon part;
    if (nodes == 4) {
        const Vec2 corner[4] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
        const auto at = [&](int i) { return corner[i % 4]; };
        const int i = multiplier;
        part.add(at(i));
        part.add((at(i) + at(i + 1)) / 2);
        part.add(Vec2::Zero());
        part.add((at(i) + at(i + 3)) / 2);
        return part;
    }
    const Vec2 corner[3] = {{0, 0}, {1, 0}, {0, 1}};
    const Vec2 a = corner[multiplier], b = corner[(multiplier + 1) % 3],
               c = corner[(multiplier + 2) % 3], middle{1.0 / 3, 1.0 / 3};
    part.add(a);
    part.add(nodes == 6 ? b : Vec2((a + b) / 2));
    part.add(middle);
    if (nodes == 3) part.add((a + c) / 2);
    return part;
}

} // namespace amontons
