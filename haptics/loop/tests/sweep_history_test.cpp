#include "haptics/loop/sweep_history.hpp"

#include <Eigen/LU>
#include <doctest/doctest.h>

using namespace amontons;

namespace {

/// Sweeps r -> M r + c with u = W r + q kept by its changes, as the loop keeps it.
template <class Real> struct LinearSweeps {
    static constexpr int kRows = 6;
    using Matrix = Eigen::Matrix<double, kRows, kRows>;
    using Vector = Eigen::Matrix<double, kRows, 1>;
    Matrix M, W;
    Vector c, q, r = Vector::Zero();
    struct alignas(64) {
        Real number[64 / sizeof(Real)] = {};
    } u;

    LinearSweeps()
    {
        // Slow: eigenvalues up to 0.95, far from one another.
        Matrix T;
        for (int i = 0; i < kRows; ++i)
            for (int j = 0; j < kRows; ++j) {
                T(i, j) = i == j ? 1 : 0.1 * std::sin(3 * i + 7 * j);
                W(i, j) = std::cos(i * j);
            }
        Vector values;
        values << 0.95, 0.8, 0.6, 0.3, -0.4, 0;
        M = T * values.asDiagonal() * T.inverse();
        c << 1, -2, 3, 0.5, 1, -1;
        q << 2, 1, 0, 1, 2, 3;
        for (int i = 0; i < kRows; ++i)
            u.number[i] = static_cast<Real>(q[i]);
    }
    void sweep()
    {
        const Vector next = M * r + c;
        const Vector change = W * (next - r);
        for (int i = 0; i < kRows; ++i)
            u.number[i] += static_cast<Real>(change[i]);
        r = next;
    }
    double error() const { return (r - (Matrix::Identity() - M).inverse() * c).norm() / r.norm(); }
    double drift() const
    {
        const Vector true_u = W * r + q;
        double worst = 0;
        for (int i = 0; i < kRows; ++i)
            worst = std::max(worst, std::abs(true_u[i] - static_cast<double>(u.number[i])));
        return worst / true_u.norm();
    }
};

} // namespace

TEST_CASE_TEMPLATE("Sweeps that are linear are known after as many as they have rows", Real, float,
                   double)
{
    LinearSweeps<Real> plain, led;
    SweepHistory<Real> history(6);
    const double round_off = sizeof(Real) == 8 ? 1e-13 : 1e-6;
    // The second tick starts elsewhere, with all that the first one learnt.
    for (const int sweeps : {8, 3}) {
        plain.c[0] += 1;
        led.c[0] += 1;
        history.begin();
        for (int k = 0; k < sweeps; ++k) {
            if (history.can_extrapolate()) history.extrapolate(led.r.data(), led.u.number);
            history.before_sweep(led.r.data(), 6);
            led.sweep();
            history.after_sweep(led.r.data(), led.u.number);
            plain.sweep();
        }
        INFO(sweeps);
        CHECK(led.error() < 1e-3);
        CHECK(plain.error() > 0.1);
        CHECK(led.drift() < 100 * round_off);
    }
}

TEST_CASE("Differences that are rounding do not disturb the sweeps")
{
    LinearSweeps<double> at_rest;
    at_rest.r = (LinearSweeps<double>::Matrix::Identity() - at_rest.M).inverse() * at_rest.c;
    const LinearSweeps<double>::Vector there = at_rest.r, u = at_rest.W * there + at_rest.q;
    for (int i = 0; i < 6; ++i)
        at_rest.u.number[i] = u[i];
    SweepHistory<double> history(6);
    for (int k = 0; k < 40; ++k) {
        // A step that no sweep made: what is left of the past is far too short for it.
        if (k == 20) at_rest.c[1] += 1;
        if (history.can_extrapolate()) history.extrapolate(at_rest.r.data(), at_rest.u.number);
        history.before_sweep(at_rest.r.data(), 6);
        at_rest.sweep();
        history.after_sweep(at_rest.r.data(), at_rest.u.number);
        CHECK(at_rest.drift() < 1e-13);
    }
}
