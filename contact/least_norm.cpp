#include "contact/least_norm.hpp"

#include "mesh/base/dense.hpp"

#include <cmath>

namespace amontons {
namespace {

constexpr double kStill = 1e-9;  // of the largest motion: neither opens nor slides
constexpr double kRank = 1e-11;  // of the largest pivot
constexpr double kBroken = 1e-9; // of the largest force, against a contact's law

} // namespace

std::optional<Eigen::VectorXd> least_norm_of_same_motion(const ContactProblem& problem,
                                                         const Eigen::VectorXd& r)
{
    if (!problem.W.is_dense()) return std::nullopt;
    const Eigen::VectorXd compliance = problem.W * r, u = compliance + problem.q;
    const double still = kStill * u.cwiseAbs().maxCoeff();
    const std::vector<int> first = row_offsets(problem);
    // r = S x: a column for each way a contact may push.
    Eigen::MatrixXd S = Eigen::MatrixXd::Zero(r.size(), r.size());
    Eigen::Index count = 0;
    std::vector<char> slides(std::size_t(problem.mu.size()), 0);
    for (int i = 0; i < contact_count(problem); ++i) {
        const Eigen::Index k = first[std::size_t(i)];
        const ContactKind kind = kind_of(problem, i);
        if (kind != ContactKind::bilateral && r[k] == 0 && u[k] > still) continue;
        if (kind != ContactKind::frictional) {
            S(k, count++) = 1;
            continue;
        }
        const Eigen::Vector2d way = u.segment<2>(k + 1);
        slides[std::size_t(i)] = way.norm() > still;
        if (!slides[std::size_t(i)]) {
            for (int axis = 0; axis < 3; ++axis)
                S(k + axis, count++) = 1;
            continue;
        }
        const double size = std::hypot(1.0, problem.mu[i]);
        S(k, count) = 1 / size; // of length one: |x| is |r|
        S.block<2, 1>(k + 1, count++) = -problem.mu[i] / size * way.normalized();
    }
    if (count == 0) return std::nullopt;
    const auto ways = S.leftCols(count);
    Eigen::VectorXd out =
        ways * shortest_least_squares(problem.W.dense() * ways, compliance, kRank);

    const double broken = kBroken * out.cwiseAbs().maxCoeff();
    for (int i = 0; i < contact_count(problem); ++i) {
        const Eigen::Index k = first[std::size_t(i)];
        const ContactKind kind = kind_of(problem, i);
        if (kind == ContactKind::bilateral) continue;
        if (out[k] < -broken) return std::nullopt;
        if (kind == ContactKind::frictional && !slides[std::size_t(i)] &&
            out.segment<2>(k + 1).norm() > problem.mu[i] * out[k] + broken)
            return std::nullopt;
    }
    return out;
}

} // namespace amontons
