#include "mesh/base/eigen_kernels.hpp"

namespace Eigen::internal {
AMONTONS_EIGEN_KERNELS();
} // namespace Eigen::internal
