#include "solver/beam/plane_hold.hpp"

#include <cmath>

namespace amontons {
namespace {

void project(double* v, const Vec3& n)
{
    const double out = n[0] * v[0] + n[1] * v[1] + n[2] * v[2];
    for (int a = 0; a < 3; ++a)
        v[a] -= out * n[a];
    v[3] = v[4] = 0;
}

void project_rows(Block6& b, const Vec3& n)
{
    for (Column6& column : b.column)
        project(reinterpret_cast<double*>(&column), n);
}

void project_columns(Block6& b, const Vec3& n)
{
    const Column6 out =
        splat6(n[0]) * b.column[0] + splat6(n[1]) * b.column[1] + splat6(n[2]) * b.column[2];
    for (int a = 0; a < 3; ++a)
        b.column[a] -= splat6(n[a]) * out;
    b.column[3] = b.column[4] = Column6{};
}

/// Some positive number of the size of x: the diagonal of an unknown that never moves.
double diagonal_of(double x)
{
    return x != 0 ? std::abs(x) : 1;
}

} // namespace

void hold_in_plane(const Wire& wire, BlockTridiagonal& K, std::vector<Node6>& g)
{
    const Vec3 n = *wire.plane;
    for (int i = wire.state.first + 1; i <= wire.last(); ++i) {
        Block6& d = K.diagonal(i);
        const double scale = diagonal_of((d(0, 0) + d(1, 1) + d(2, 2)) / 3);
        const double turn[2] = {diagonal_of(d(3, 3)), diagonal_of(d(4, 4))};
        project_rows(d, n);
        project_columns(d, n);
        for (int a = 0; a < 3; ++a)
            for (int b = 0; b < 3; ++b)
                d(a, b) += scale * n[a] * n[b];
        d(3, 3) = turn[0];
        d(4, 4) = turn[1];
        project(g[std::size_t(i)].value, n);
        project_columns(K.upper(i - 1), n);
        project_rows(K.lower(i - 1), n);
        if (i < wire.last()) {
            project_rows(K.upper(i), n);
            project_columns(K.lower(i), n);
        }
    }
    if (!wire.sheath) return;
    // The held node: (inserted, 0, 0, rotation, 0, 0)
    const int f = wire.state.first;
    Block6& d = K.diagonal(f);
    const double turn = diagonal_of(d(3, 3));
    for (int k = 0; k < 6; ++k) {
        d(3, k) = d(k, 3) = 0;
        K.upper(f)(3, k) = 0;
        K.lower(f)(k, 3) = 0;
    }
    d(3, 3) = turn;
    g[std::size_t(f)].value[3] = 0;
}

void hold_in_plane(const Wire& wire, int element, ContactRow& row)
{
    if (element == wire.state.first) // not moved in space: no direction of it
        row.a.value[3] = 0;
    else
        project(row.a.value, *wire.plane);
    project(row.b.value, *wire.plane);
}

void hold_in_plane(const Wire& wire, Candidate& c)
{
    const Vec3 n = *wire.plane;
    for (ContactRow* row : {&c.hn, &c.ht[0], &c.ht[1]})
        hold_in_plane(wire, c.place.element, *row);
    const Vec3* t[2] = {&c.t1, &c.t2};
    constexpr double kAcross = 1e-6; // what is left of a direction across the plane is round-off
    for (int k = 0; k < 2; ++k) {
        const double out = n.dot(*t[k]);
        if (std::sqrt(std::max(0.0, 1 - out * out)) > kAcross) continue;
        c.slip[k] = c.tangential[k] = 0;
        c.ht[k] = ContactRow{};
    }
}

} // namespace amontons
