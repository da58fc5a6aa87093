#include "mesh/predicates.hpp"

#include <cmath>
#include <limits>

namespace amontons {
namespace {

/// An unevaluated sum of two doubles: 106 bits. Compiled with -ffp-contract=off: a fused
/// multiply-add in place of two roundings would break the error terms.
struct Wide {
    double high = 0, low = 0;
};

Wide exact_sum(double a, double b) // Knuth
{
    const double sum = a + b, part = sum - a;
    return {sum, (a - (sum - part)) + (b - part)};
}

Wide normalised(double high, double low) // |high| >= |low|; Dekker
{
    const double sum = high + low;
    return {sum, low - (sum - high)};
}

Wide operator+(Wide a, Wide b)
{
    const Wide high = exact_sum(a.high, b.high), low = exact_sum(a.low, b.low);
    const Wide sum = normalised(high.high, high.low + low.high);
    return normalised(sum.high, sum.low + low.low);
}

Wide operator-(Wide a)
{
    return {-a.high, -a.low};
}

Wide operator-(Wide a, Wide b)
{
    return a + -b;
}

Wide operator*(Wide a, Wide b)
{
    const double product = a.high * b.high;
    const double error = std::fma(a.high, b.high, -product);
    return normalised(product, error + (a.high * b.low + a.low * b.high));
}

template <class T> T difference(double a, double b);
template <> double difference<double>(double a, double b)
{
    return a - b;
}
template <> Wide difference<Wide>(double a, double b)
{
    return exact_sum(a, -b);
}

// 2^-53, the unit roundoff, called epsilon in the paper.
constexpr double kRoundoff = std::numeric_limits<double>::epsilon() / 2;
constexpr double kFilter3 = (7 + 56 * kRoundoff) * kRoundoff;
constexpr double kFilter2 = (3 + 16 * kRoundoff) * kRoundoff;
// Of the wide result, with a generous constant: what is left of rounding in 106 bits.
constexpr double kWideZero = 1e-30;

int sign(double x)
{
    return (x > 0) - (x < 0);
}

template <class T> struct Terms {
    T value;     // of the determinant
    T magnitude; // of the sum of its terms
};

double absolute(double x)
{
    return std::abs(x);
}

Wide absolute(Wide x)
{
    return x.high < 0 ? -x : x;
}

template <class T> Terms<T> determinant3(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d)
{
    const T ax = difference<T>(a[0], d[0]), ay = difference<T>(a[1], d[1]),
            az = difference<T>(a[2], d[2]);
    const T bx = difference<T>(b[0], d[0]), by = difference<T>(b[1], d[1]),
            bz = difference<T>(b[2], d[2]);
    const T cx = difference<T>(c[0], d[0]), cy = difference<T>(c[1], d[1]),
            cz = difference<T>(c[2], d[2]);
    const T bxcy = bx * cy, cxby = cx * by, cxay = cx * ay, axcy = ax * cy, axby = ax * by,
            bxay = bx * ay;
    return {az * (bxcy - cxby) + bz * (cxay - axcy) + cz * (axby - bxay),
            absolute(az) * (absolute(bxcy) + absolute(cxby)) +
                absolute(bz) * (absolute(cxay) + absolute(axcy)) +
                absolute(cz) * (absolute(axby) + absolute(bxay))};
}

template <class T> Terms<T> determinant2(int k, const Vec3& a, const Vec3& b, const Vec3& c)
{
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    const T left = (difference<T>(a[i], c[i])) * (difference<T>(b[j], c[j]));
    const T right = (difference<T>(a[j], c[j])) * (difference<T>(b[i], c[i]));
    return {left - right, absolute(left) + absolute(right)};
}

int wide_sign(const Terms<Wide>& terms)
{
    if (std::abs(terms.value.high) <= kWideZero * terms.magnitude.high) return 0;
    return sign(terms.value.high);
}

} // namespace

int orientation(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d)
{
    const Terms<double> fast = determinant3<double>(a, b, c, d);
    if (std::abs(fast.value) > kFilter3 * fast.magnitude || fast.magnitude == 0)
        return sign(fast.value);
    return wide_sign(determinant3<Wide>(a, b, c, d));
}

int orientation_along(int k, const Vec3& a, const Vec3& b, const Vec3& c)
{
    const Terms<double> fast = determinant2<double>(k, a, b, c);
    if (std::abs(fast.value) > kFilter2 * fast.magnitude || fast.magnitude == 0)
        return sign(fast.value);
    return wide_sign(determinant2<Wide>(k, a, b, c));
}

} // namespace amontons
