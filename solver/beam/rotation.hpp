#pragma once

#include "mesh/base/types.hpp"

#include <cmath>

// Rotations as unit quaternions (w, x, y, z) in plain arrays, as BeamNode stores them.

namespace amontons {

/// A unit quaternion of the hot loops.
struct Quaternion {
    /// Scalar and vector, of norm 1.
    double q[4] = {1, 0, 0, 0};
};

/// a b: b first, then a.
/// Arrays of 4 numbers each (w, x, y, z), of norm 1.
inline void quaternion_product(const double a[4], const double b[4], double out[4])
{
    const double r[4] = {a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
                         a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
                         a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
                         a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]};
    for (int i = 0; i < 4; ++i)
        out[i] = r[i];
}

/// q <- q exp(theta), theta in the body frame [rad]; keeps q a unit quaternion.
inline void rotate_in_body(double q[4], const Vec3& theta)
{
    const double half2 = 0.25 * theta.squaredNorm();
    double c, s; // cos(half), sin(half)/(2 half)
    if (half2 < 1e-6) {
        c = 1 - half2 * (0.5 - half2 / 24);
        s = 0.5 - half2 * (1.0 / 12 - half2 / 240);
    } else {
        const double half = std::sqrt(half2);
        c = std::cos(half);
        s = std::sin(half) / (2 * half);
    }
    const double r[4] = {c, s * theta.x(), s * theta.y(), s * theta.z()};
    quaternion_product(q, r, q);
    const double n = 1 / std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    for (int i = 0; i < 4; ++i)
        q[i] *= n;
}

/// Rotation matrix; its columns are the body's axes in space.
/// @param q  4 numbers (w, x, y, z), of norm 1
inline Mat3 rotation_matrix(const double q[4])
{
    const double w = q[0], x = q[1], y = q[2], z = q[3];
    Mat3 r;
    r << 1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y), //
        2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),  //
        2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y);
    return r;
}

/// First axis of the body in space: a beam's tangent.
/// @param q  4 numbers (w, x, y, z), of norm 1
inline Vec3 first_axis(const double q[4])
{
    return {1 - 2 * (q[2] * q[2] + q[3] * q[3]), 2 * (q[1] * q[2] + q[0] * q[3]),
            2 * (q[1] * q[3] - q[0] * q[2])};
}

/// Quaternion of a proper rotation matrix.
Quaternion quaternion_of(const Mat3& rotation);

/// Rotation between a (t = 0) and b (t = 1), on the shorter way; normalised linear.
/// @param t  in [0, 1] (share)
inline Quaternion interpolate(const double a[4], const double b[4], double t)
{
    const double d = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
    const double s = d < 0 ? -t : t;
    Quaternion r;
    double n = 0;
    for (int i = 0; i < 4; ++i) {
        r.q[i] = (1 - t) * a[i] + s * b[i];
        n += r.q[i] * r.q[i];
    }
    n = 1 / std::sqrt(n);
    for (double& v : r.q)
        v *= n;
    return r;
}

/// Cross product matrix: skew(a) b = a x b.
inline Mat3 skew_matrix(const Vec3& a)
{
    Mat3 m;
    m << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
    return m;
}

} // namespace amontons
