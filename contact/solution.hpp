#pragma once

#include "contact/certificate.hpp"

#include <vector>

namespace amontons {

/// One evaluation of the error on the way.
struct ErrorPoint {
    /// Sweeps, projections or Newton steps so far.
    int iteration = 0;
    /// Wall time since the start [s].
    double seconds = 0;
    double error = 0; ///< natural map, relative [-]
};

/// What a solve returns, also when it failed: the best reaction found, and how good it is.
struct ContactSolution {
    Eigen::VectorXd reaction; ///< r, rows, contact by contact (n, t1, t2) [N or N s]
    Eigen::VectorXd u;        ///< W r + q, rows: gap and slip [m], or velocity [m/s]
    Certificate certificate;
    std::vector<ErrorPoint> history; ///< every iteration at first, then thinned to a few hundred
};

} // namespace amontons
