#include "contact/problem.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

namespace amontons {
namespace {

constexpr const char* kProblem = "contact problem"; // stands where a file name would

std::string text(double value)
{
    std::ostringstream out;
    out << value;
    return out.str();
}

std::string size_text(Eigen::Index rows, Eigen::Index columns)
{
    return std::to_string(rows) + " x " + std::to_string(columns);
}

/// The first few places are told one by one; thousands of NaN are one fault, not thousands.
constexpr int kToldOneByOne = 10;

} // namespace

std::vector<int> row_offsets(const ContactProblem& problem)
{
    const int n = contact_count(problem);
    std::vector<int> offset(static_cast<std::size_t>(n) + 1, 0);
    for (int i = 0; i < n; ++i) {
        const auto k = static_cast<std::size_t>(i);
        offset[k + 1] = offset[k] + rows_of(kind_of(problem, i));
    }
    return offset;
}

double asymmetry(const Eigen::MatrixXd& W)
{
    // By tiles that stay in cache together with their mirror image.
    constexpr Eigen::Index kTile = 32;
    double difference = 0, size = 0;
    for (Eigen::Index j = 0; j < W.cols(); j += kTile)
        for (Eigen::Index i = j; i < W.rows(); i += kTile) {
            const Eigen::Index rows = std::min(kTile, W.rows() - i);
            const Eigen::Index columns = std::min(kTile, W.cols() - j);
            const auto lower = W.block(i, j, rows, columns);
            const auto upper = W.block(j, i, columns, rows);
            const double twice = i == j ? 0.5 : 1; // a diagonal tile is its own mirror image
            difference += 2 * twice * (lower - upper.transpose()).squaredNorm();
            size += twice * (lower.squaredNorm() + upper.squaredNorm());
        }
    if (std::isnormal(size) && std::isfinite(difference)) return std::sqrt(difference / size);
    // The squares left the range of doubles, or W is zero, or not finite.
    const double scale = W.size() > 0 ? W.cwiseAbs().maxCoeff() : 0;
    if (scale == 0) return 0;
    return ((W - W.transpose()) / scale).norm() / (W / scale).norm();
}

std::vector<Issue> issues(const ContactProblem& problem)
{
    std::vector<Issue> found;
    const auto tell = [&](std::string place, std::string what, std::string allowed) {
        found.push_back({kProblem, std::move(place), std::move(what), std::move(allowed)});
    };

    const Eigen::Index n = problem.mu.size();
    if (!problem.kind.empty() && static_cast<Eigen::Index>(problem.kind.size()) != n) {
        tell("kind", std::to_string(problem.kind.size()) + " entries",
             "none, or one per contact: " + std::to_string(n));
        return found;
    }
    const Eigen::Index rows = row_offsets(problem).back();
    if (problem.q.size() != rows)
        tell("q", std::to_string(problem.q.size()) + " rows", std::to_string(rows));
    if (problem.W.rows() != rows || problem.W.cols() != rows)
        tell("W", size_text(problem.W.rows(), problem.W.cols()), size_text(rows, rows));

    int told = 0;
    for (Eigen::Index i = 0; i < n && told < kToldOneByOne; ++i)
        if (!(problem.mu[i] >= 0) || !std::isfinite(problem.mu[i])) {
            tell("mu[" + std::to_string(i) + "]", text(problem.mu[i]), "finite, >= 0");
            ++told;
        }
    told = 0;
    for (Eigen::Index i = 0; i < problem.q.size() && told < kToldOneByOne; ++i)
        if (!std::isfinite(problem.q[i])) {
            tell("q[" + std::to_string(i) + "]", text(problem.q[i]), "finite");
            ++told;
        }
    told = 0;
    const bool square = problem.W.rows() == problem.W.cols();
    const double measure = square ? asymmetry(problem.W) : 0;
    if (measure > kMaxAsymmetry)
        tell("W", "asymmetry |W - W^T| / |W| = " + text(measure), "<= " + text(kMaxAsymmetry));
    // A finite measure needs finite entries: the search for others is for the report only.
    if (square && std::isfinite(measure)) return found;
    for (Eigen::Index j = 0; j < problem.W.cols(); ++j)
        for (Eigen::Index i = 0; i < problem.W.rows() && told < kToldOneByOne; ++i)
            if (!std::isfinite(problem.W(i, j))) {
                tell("W(" + std::to_string(i) + ", " + std::to_string(j) + ")",
                     text(problem.W(i, j)), "finite");
                ++told;
            }
    return found;
}

} // namespace amontons
