#pragma once

#include <Eigen/Core>

namespace amontons {

/// Where a node's unknowns begin: three of a solid's, six of a rod's.
inline Eigen::Index at3(std::size_t node)
{
    return 3 * Eigen::Index(node);
}
/// The first of a node's six unknowns.
inline Eigen::Index at6(std::size_t node)
{
    return 6 * Eigen::Index(node);
}

} // namespace amontons
