#pragma once

#include "solver/linear/block_tridiagonal.hpp"

#include <vector>

namespace amontons {

/// A contact's row on the nodes of one or two elements.
struct FourNodeRow {
    /// Row by the unknowns of four nodes.
    Node6 node[4];
};

/// The operations on rows that pivoting::solve needs. Contact has `nodes`, 2 or 4, and their
/// `slot`.
template <class Contact> struct FourNodeRows {
    /// Rows of this kind.
    using Row = FourNodeRow;
    /// Where the row acts.
    using Place = const Contact&;

    /// The row times d.
    static double apply(const Row& row, const std::vector<Node6>& d, Place at)
    {
        double sum = 0;
        using Padded =
            Eigen::Map<const Eigen::Matrix<double, 8, 1>, Eigen::AlignedMax>; // with zeros
        for (int a = 0; a < at.nodes; ++a)
            sum += Padded(row.node[a].value)
                       .dot(Padded(d[std::size_t(at.slot[std::size_t(a)])].value));
        return sum;
    }
    /// r += s times the row.
    static void add_force(std::vector<Node6>& r, Place at, const Row& h, double s)
    {
        for (int a = 0; a < at.nodes; ++a)
            r[std::size_t(at.slot[std::size_t(a)])].column += h.node[a].column * splat6(s);
    }
    /// a + s b + t c, s and t factors.
    static Row combine(const Row& a, double s, const Row& b, double t, const Row& c)
    {
        Row r;
        for (int i = 0; i < 4; ++i)
            r.node[i].column =
                a.node[i].column + splat6(s) * b.node[i].column + splat6(t) * c.node[i].column;
        return r;
    }
    static Row combine(double s, const Row& b, double t, const Row& c)
    {
        return combine(Row{}, s, b, t, c);
    }
};

} // namespace amontons
