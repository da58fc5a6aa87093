#include "contact/problem.hpp"

#include "contact/number_text.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

namespace amontons {
namespace {

constexpr const char* kProblem = "contact problem"; // stands where a file name would

std::string size_text(Eigen::Index rows, Eigen::Index columns)
{
    return std::to_string(rows) + " x " + std::to_string(columns);
}

/// The first few places are reported one by one; thousands of NaN are one fault, not thousands.
constexpr int kReportedOneByOne = 10;

/// Of a W of bodies: are all rows of a contact on the same bodies, one after the other?
bool rows_stay_together(const ContactProblem& problem)
{
    const DelassusOfBodies& W = problem.W.of_bodies();
    int row = 0;
    for (int i = 0; i < contact_count(problem); ++i) {
        const auto first = W.places(row);
        const int rows = rows_of(kind_of(problem, i));
        for (int a = 1; a < rows; ++a)
            if (!std::ranges::equal(first, W.places(row + a), [a](const auto& x, const auto& y) {
                    return x.part == y.part && x.column + a == y.column;
                }))
                return false;
        row += rows;
    }
    return true;
}

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

std::vector<Issue> issues(const ContactProblem& problem)
{
    std::vector<Issue> found;
    const auto report = [&](std::string place, std::string what, std::string allowed) {
        found.push_back({kProblem, std::move(place), std::move(what), std::move(allowed)});
    };

    const Eigen::Index n = problem.mu.size();
    if (!problem.kind.empty() && static_cast<Eigen::Index>(problem.kind.size()) != n) {
        report("kind", std::to_string(problem.kind.size()) + " entries",
               "none, or one per contact: " + std::to_string(n));
        return found;
    }
    const Eigen::Index rows = row_offsets(problem).back();
    if (problem.q.size() != rows)
        report("q", std::to_string(problem.q.size()) + " rows", std::to_string(rows));
    if (problem.W.rows() != rows || problem.W.cols() != rows)
        report("W", size_text(problem.W.rows(), problem.W.cols()), size_text(rows, rows));

    int reported = 0;
    for (Eigen::Index i = 0; i < n && reported < kReportedOneByOne; ++i)
        if (!(problem.mu[i] >= 0) || !std::isfinite(problem.mu[i])) {
            report("mu[" + std::to_string(i) + "]", number_text(problem.mu[i]), "finite, >= 0");
            ++reported;
        }
    reported = 0;
    for (Eigen::Index i = 0; i < problem.q.size() && reported < kReportedOneByOne; ++i)
        if (!std::isfinite(problem.q[i])) {
            report("q[" + std::to_string(i) + "]", number_text(problem.q[i]), "finite");
            ++reported;
        }
    if (problem.W.rows() != problem.W.cols()) return found;
    if (problem.W.is_matrix_free() && problem.W.matrix_free().blocks.rows() != rows) {
        report("W",
               "own blocks of " + std::to_string(problem.W.matrix_free().blocks.rows()) + " rows",
               std::to_string(rows));
        return found;
    }
    if (problem.W.is_of_bodies() && !rows_stay_together(problem)) {
        report("W", "rows of a contact on different bodies", "one after the other on the same");
        return found;
    }
    const double measure = problem.W.asymmetry();
    if (measure > kMaxAsymmetry)
        report("W", "asymmetry |W - W^T| / |W| = " + number_text(measure),
               "<= " + number_text(kMaxAsymmetry));
    // A finite measure needs finite entries: the search for others is for the report only.
    if (std::isfinite(measure)) return found;
    reported = 0;
    const auto examine = [&](Eigen::Index i, Eigen::Index j, double value) {
        if (std::isfinite(value) || reported == kReportedOneByOne) return;
        report("W(" + std::to_string(i) + ", " + std::to_string(j) + ")", number_text(value),
               "finite");
        ++reported;
    };
    if (problem.W.is_dense()) {
        for (Eigen::Index j = 0; j < problem.W.cols(); ++j)
            for (Eigen::Index i = 0; i < problem.W.rows(); ++i)
                examine(i, j, problem.W.dense()(i, j));
    } else if (problem.W.is_sparse()) {
        for (Eigen::Index j = 0; j < problem.W.cols(); ++j)
            for (Delassus::Sparse::InnerIterator it(problem.W.sparse(), j); it; ++it)
                examine(it.row(), j, it.value());
    } else {
        report("W", "a product with a number that is not finite", "finite");
    }
    return found;
}

} // namespace amontons
