#include "solver/beam/rod_matrix.hpp"

#include "mesh/base/dense.hpp"

#include <algorithm>

namespace amontons {
namespace {

ConstMap6 view(const Node6& n)
{
    return ConstMap6(n.value);
}

} // namespace

Mat6 dense(const Block6& b)
{
    Mat6 m;
    for (int j = 0; j < 6; ++j)
        for (int i = 0; i < 6; ++i)
            m(i, j) = b(i, j);
    return m;
}

void set_block(Block6& b, const Mat6& m)
{
    for (int j = 0; j < 6; ++j)
        for (int i = 0; i < 6; ++i)
            b(i, j) = m(i, j);
}

void add_to_block(Block6& b, const Mat6& m)
{
    for (int j = 0; j < 6; ++j)
        for (int i = 0; i < 6; ++i)
            b(i, j) += m(i, j);
}

RodMatrix::RodMatrix(int nodes, bool closed)
    : chain(nodes)
    , first_with_last{}
    , last_with_first{}
    , closed_(closed)
{
}

void RodMatrix::set_zero(int first)
{
    chain.set_first(closed_ ? 0 : std::max(first - 1, 0));
    chain.set_zero();
    chain.set_first(0);
    first_with_last = last_with_first = Block6{};
}

void RodMatrix::scale(double by)
{
    const Column6 f = splat6(by);
    const auto block = [&](Block6& b) {
        for (Column6& c : b.column)
            c *= f;
    };
    for (int i = 0; i < chain.size(); ++i) {
        block(chain.diagonal(i));
        if (i + 1 == chain.size()) break;
        block(chain.upper(i));
        block(chain.lower(i));
    }
    block(first_with_last);
    block(last_with_first);
}

int RodMatrix::factor(int first)
{
    if (!closed_) return factors_.factor(chain, first);
    int negative = factors_.factor(chain, 1);
    const std::size_t n = std::size_t(chain.size());
    Z_.assign(6, std::vector<Node6>(n, Node6{}));
    Mat6 S = dense(chain.diagonal(0));
    for (int j = 0; j < 6; ++j) {
        std::vector<Node6>& z = Z_[std::size_t(j)];
        for (int i = 0; i < 6; ++i) {
            z[1].value[i] += chain.lower(0)(i, j);
            z[n - 1].value[i] += last_with_first(i, j);
        }
        factors_.solve(z);
        S.col(j) -= dense(chain.upper(0)) * view(z[1]) + dense(first_with_last) * view(z[n - 1]);
    }
    negative += int((symmetric_eigenvalues(Mat6(0.5 * (S + S.transpose()))).array() <= 0).count());
    inverse_S_ = inverse_of(S);
    return negative;
}

void RodMatrix::solve(std::vector<Node6>& x) const
{
    factors_.solve(x);
    if (!closed_) return;
    const std::size_t n = std::size_t(chain.size());
    const Vec6 first = inverse_S_ * (view(x[0]) - dense(chain.upper(0)) * view(x[1]) -
                                     dense(first_with_last) * view(x[n - 1]));
    Map6(x[0].value) = first;
    for (std::size_t i = 1; i < n; ++i)
        for (int j = 0; j < 6; ++j)
            x[i].column -= splat6(first[j]) * Z_[std::size_t(j)][i].column;
}

void RodMatrix::multiply(const std::vector<Node6>& x, std::vector<Node6>& out, int first) const
{
    const int n = chain.size();
    out.assign(std::size_t(n), Node6{});
    for (int i = first; i < n; ++i) {
        const std::size_t k = std::size_t(i);
        out[k].column = amontons::multiply(chain.diagonal(i), x[k]);
        if (i > first) out[k].column += amontons::multiply(chain.lower(i - 1), x[k - 1]);
        if (i + 1 < n) out[k].column += amontons::multiply(chain.upper(i), x[k + 1]);
    }
    if (!closed_) return;
    out[0].column += amontons::multiply(first_with_last, x.back());
    out.back().column += amontons::multiply(last_with_first, x[0]);
}

} // namespace amontons
