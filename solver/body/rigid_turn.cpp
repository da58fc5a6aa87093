#include "solver/body/rigid_turn.hpp"

#include <Eigen/LU>

namespace amontons {
namespace {

Mat3 cross_matrix(const Vec3& v)
{
    Mat3 m;
    m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
    return m;
}

} // namespace

// P' = C^T end with the turn C of h W, C = (1 + h/2 W^) (1 - h/2 W^)^-1. J W = share P' + past,
// multiplied by 1 + h/2 W^ from the left, is quadratic in W:
//   J W - past - share end + h/2 W x (J W - past + share end) = 0.
Vec3 mean_spin(const Mat3& inertia, const Mat3& inverse, double h, double share, const Vec3& end,
               const Vec3& past, const Vec3& guess)
{
    constexpr int kMostSteps = 50, kMostHalvings = 10;
    constexpr double kRounding = 4e-16;
    const Vec3 sum = past + share * end, rest = share * end - past;
    const auto residual = [&](const Vec3& W) {
        const Vec3 P = inertia * W;
        return Vec3(P - sum + 0.5 * h * W.cross(P + rest));
    };
    Vec3 W = guess.isZero(0) ? Vec3(inverse * sum) : guess;
    Vec3 r = residual(W);
    // The residual is quadratic: a step s of Newton's method leaves h/2 s x I s of it.
    const double left_by_step = 0.5 * h * inverse.norm() * inertia.norm();
    for (int i = 0; i < kMostSteps && !r.isZero(0); ++i) {
        const Mat3 slope =
            inertia + 0.5 * h * (cross_matrix(W) * inertia - cross_matrix(inertia * W + rest));
        const Vec3 step = slope.inverse() * r;
        double part = 1;
        Vec3 next = W - step;
        Vec3 left = residual(next);
        for (int k = 0; k < kMostHalvings && !(left.norm() < r.norm()); ++k) {
            part *= 0.5;
            next = W - part * step;
            left = residual(next);
        }
        if (!(left.norm() < r.norm())) break; // rounding
        W = next;
        r = left;
        const double length = part * step.norm(), rounding = kRounding * W.norm();
        if (length <= rounding || (part == 1 && left_by_step * length * length <= rounding)) break;
    }
    return W;
}

} // namespace amontons
