#include "contact/solvers/proximal.hpp"

#include <algorithm>

namespace amontons {
namespace {

constexpr int kProblems = 60;               ///< solved at most
constexpr int kFailures = 9;                ///< after them it ends without a solution
constexpr double kLess = 1. / 3, kMore = 5; ///< alpha after a success, after a failure
constexpr double kLeast = 1e-9, kMost = 10; ///< alpha
constexpr double kCloser = 0.01; ///< error to which each problem is solved, over that of its centre
constexpr double kClosest = 1e-13;

} // namespace

bool follow_proximal_paths(SolverWork& work, ShiftedDelassus& matrix, double alpha)
{
    Proximal proximal;
    proximal.centre = Eigen::VectorXd::Zero(work.r.size());
    double error = 1;
    int failures = 0;
    for (int k = 0; k < kProblems && failures < kFailures; ++k) {
        proximal.alpha = alpha;
        proximal.target = std::max(kClosest, kCloser * std::min(error, kCloser));
        PathEnd end = PathEnd::lost;
        for (const bool from_afar : {false, true}) {
            if (end != PathEnd::lost) break;
            NewtonPath path = kClosePaths[from_afar ? 1 : 0];
            path.from_afar = from_afar;
            work.take(proximal.centre);
            end = follow_path(work, matrix, path, proximal);
        }
        if (end == PathEnd::over) return true;
        if (end == PathEnd::arrived) {
            proximal.centre = work.r;
            error = work.progress.error();
            alpha = std::max(kLeast, kLess * alpha);
        } else {
            ++failures;
            alpha = std::min(kMost, kMore * alpha);
        }
    }
    return false;
}

} // namespace amontons
