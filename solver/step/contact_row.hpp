#pragma once

#include "solver/beam/wire_contact.hpp"

#include <vector>

// Derivatives of a contact's motion by a wire's nodes, as vectors over all nodes.

namespace amontons {

/// Vectors of zeros, one for each node.
inline std::vector<Node6> zero_nodes(std::size_t n)
{
    std::vector<Node6> x(n);
    for (Node6& node : x)
        node.column = Column6{};
    return x;
}

/// x += h, a row of the contact.
inline void add_row(std::vector<Node6>& x, const Candidate& c, const ContactRow& row)
{
    const auto e = static_cast<std::size_t>(c.place.element);
    x[e].column += row.a.column;
    x[e + 1].column += row.b.column;
}

/// The product h x of a contact's row and nodal displacements [m].
inline double along(const std::vector<Node6>& x, const Candidate& c, const ContactRow& row)
{
    const auto e = static_cast<std::size_t>(c.place.element);
    double sum = 0;
    for (int i = 0; i < 6; ++i)
        sum += row.a.value[i] * x[e].value[i] + row.b.value[i] * x[e + 1].value[i];
    return sum;
}

} // namespace amontons
