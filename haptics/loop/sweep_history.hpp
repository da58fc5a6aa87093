#pragma once

#include <Eigen/Core>
#include <vector>

namespace amontons {

/// Anderson's extrapolation of Gauss-Seidel sweeps (D. G. Anderson, J. ACM 12, 1965, 547-560), over
/// the ticks of one operator: r -> r + g(r) is nearly the same map in all of them, so what the
/// sweeps of earlier ticks have shown (a handle on a spring couples all contacts) need not be found
/// again. u = W r + q is moved by the same combination as r. Allocates in the constructor only.
template <class Real> class SweepHistory {
public:
    explicit SweepHistory(int most_rows);

    /// Discards the differences: for another operator, or after an extrapolation that raised the
    /// error.
    void clear();
    /// Begins a tick: r has changed since the last sweep, so no difference is stored across it.
    void begin() { has_last_ = false; }
    /// True if enough differences are stored.
    bool can_extrapolate() const { return known_ > 0 && has_last_; }

    /// Moves r and u to where the sweeps point to; r may leave its cones. Only after a sweep.
    /// @param r  `rows` numbers;  @param u  the same, on 64 bytes, filled with 0 up to a whole line
    void extrapolate(double* r, Real* u);
    /// Before a sweep: stores r.
    void before_sweep(const double* r, int rows);
    /// After a sweep: stores the differences of r and u.
    void after_sweep(const double* r, const Real* u);

private:
    static constexpr int kDepth = 8;
    struct alignas(64) Line {
        Real number[64 / sizeof(Real)];
    };
    using Vector = std::vector<Line>;
    using Small = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kDepth, kDepth>;

    int rows_ = 0, lines_ = 0;
    int known_ = 0, newest_ = -1;
    bool has_last_ = false;
    Vector residual_, last_residual_, last_u_;
    std::vector<double> before_, last_r_;
    Vector residual_change_[kDepth], r_change_[kDepth], u_change_[kDepth];
    Eigen::Matrix<double, kDepth, kDepth> normal_;
};

extern template class SweepHistory<float>;
extern template class SweepHistory<double>;

} // namespace amontons
