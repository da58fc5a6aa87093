#include "contact/delassus.hpp"

#include <cmath>

// Compiled without contraction: a product fused into the sum that follows would change the sum
// whose error is requested.

namespace amontons {
namespace {

/// Sums with twice the digits of a double: high + low, where low gathers what each rounding of high
/// left (Ogita, Rump & Oishi 2005, algorithm 5.3).
struct TwofoldSums {
    Eigen::VectorXd high, low;

    explicit TwofoldSums(Eigen::Index n)
        : high(Eigen::VectorXd::Zero(n))
        , low(Eigen::VectorXd::Zero(n))
    {
    }
};

inline void add_twofold(double a, double b, double& high, double& low)
{
    const double product = a * b, sum = high + product, moved = sum - high;
    low += ((high - (sum - moved)) + (product - moved)) + std::fma(a, b, -product);
    high = sum;
}

/// sums += factor * column.
void add_column(double factor, const double* column, TwofoldSums& sums)
{
    double *const high = sums.high.data(), *const low = sums.low.data();
    for (Eigen::Index i = 0; i < sums.high.size(); ++i)
        add_twofold(factor, column[i], high[i], low[i]);
}

/// high + low += column . x
void add_dot(const double* column, const TwofoldSums& x, double& high, double& low)
{
    for (Eigen::Index i = 0; i < x.high.size(); ++i) {
        add_twofold(column[i], x.high[i], high, low);
        low += column[i] * x.low[i];
    }
}

} // namespace

void Delassus::apply_exactly(const Eigen::VectorXd& r, const Eigen::VectorXd& q,
                             Eigen::VectorXd& out) const
{
    if (is_matrix_free()) {
        apply(r, out);
        out += q;
        return;
    }
    TwofoldSums u(q.size()); // q last: what cancels in W r must not hide it
    if (is_dense()) {
        for (Eigen::Index j = 0; j < r.size(); ++j)
            if (r[j] != 0) add_column(r[j], dense().col(j).data(), u);
    } else if (is_sparse()) {
        for (Eigen::Index j = 0; j < r.size(); ++j)
            if (r[j] != 0)
                for (Sparse::InnerIterator it(sparse(), j); it; ++it)
                    add_twofold(it.value(), r[j], u.high[it.row()], u.low[it.row()]);
    } else {
        const DelassusOfBodies& W = of_bodies();
        for (Eigen::Index i = 0; i < r.size(); ++i)
            add_twofold(W.compliance[i], r[i], u.high[i], u.low[i]);
        for (const DelassusOfBodies::Part& part : W.parts) {
            TwofoldSums moved(part.G.rows());
            for (std::size_t i = 0; i < part.rows.size(); ++i)
                if (const double force = r[part.rows[i]]; force != 0)
                    add_column(force, part.G.col(static_cast<Eigen::Index>(i)).data(), moved);
            for (std::size_t i = 0; i < part.rows.size(); ++i)
                add_dot(part.G.col(static_cast<Eigen::Index>(i)).data(), moved,
                        u.high[part.rows[i]], u.low[part.rows[i]]);
        }
    }
    for (Eigen::Index i = 0; i < q.size(); ++i)
        add_twofold(1, q[i], u.high[i], u.low[i]);
    out = u.high + u.low;
}

} // namespace amontons
