#include "solver/step/wire_problem.hpp"

#include "solver/beam/soft_contact.hpp"
#include "solver/linear/block_refine.hpp"
#include "solver/step/contact_row.hpp"

#include <algorithm>
#include <cmath>

namespace amontons {
namespace {

constexpr int kRefinements = 3; // elimination without pivoting, where A is indefinite

using Nodes = std::vector<Node6>;

/// Unknowns are displacements and rotations: compared by largest share of each unknown's own row.
double size(const Nodes& x, int first)
{
    double sum = 0;
    for (std::size_t k = static_cast<std::size_t>(first); k < x.size(); ++k)
        for (int i = 0; i < 6; ++i)
            sum += x[k].value[i] * x[k].value[i];
    return std::sqrt(sum);
}

} // namespace

RecordedProblem contact_problem(const WireBody& body)
{
    RecordedProblem out;
    out.problem.level = ContactLevel::position;
    const Wire& wire = body.wire;
    std::vector<const Candidate*> chosen;
    if (wire.outside())
        for (const Candidate& c : body.work->candidates)
            if (c.normal > 0 || c.gap < kNearActive * c.radius) chosen.push_back(&c);
    const auto n = static_cast<Eigen::Index>(chosen.size());
    Eigen::MatrixXd W(3 * n, 3 * n);
    Eigen::VectorXd u(3 * n);
    out.reaction.resize(3 * n);
    out.problem.mu.resize(n);

    BlockTridiagonal A(body.work->base.size()), factored(A.size());
    if (n > 0) {
        A.copy_from(body.work->base, body.work->base.first());
        out.asymmetry = symmetrise(A);
        factored.copy_from(A, A.first());
        out.negative_eigenvalues = factored.factor(A.first());
    }
    const auto row = [&](Eigen::Index k) -> const ContactRow& {
        const Candidate& c = *chosen[static_cast<std::size_t>(k / 3)];
        return k % 3 == 0 ? c.hn : c.ht[k % 3 - 1];
    };
    for (Eigen::Index j = 0; j < 3 * n; ++j) {
        const Candidate& c = *chosen[static_cast<std::size_t>(j / 3)];
        Nodes right = zero_nodes(static_cast<std::size_t>(A.size()));
        add_row(right, c, row(j));
        Nodes x = right;
        factored.solve(x);
        for (int k = 0; k < kRefinements; ++k) {
            Nodes more = residual(A, right, x);
            factored.solve(more);
            for (std::size_t i = static_cast<std::size_t>(A.first()); i < x.size(); ++i)
                x[i].column += more[i].column;
        }
        const double length = size(right, A.first());
        if (length > 0)
            out.inverse_error =
                std::max(out.inverse_error, size(residual(A, right, x), A.first()) / length);
        for (Eigen::Index i = 0; i < 3 * n; ++i)
            W(i, j) = along(x, *chosen[static_cast<std::size_t>(i / 3)], row(i));
    }
    if (n > 0) { // walls that are compliant
        const Eigen::MatrixXd compliance = compliance_of_walls(body.walls, body.work->candidates);
        const auto direction = [&](Eigen::Index i) -> const Vec3& {
            const Candidate& c = *chosen[static_cast<std::size_t>(i / 3)];
            return i % 3 == 0 ? c.n : i % 3 == 1 ? c.t1 : c.t2;
        };
        const auto place = [&](Eigen::Index i) {
            return 3 * (chosen[static_cast<std::size_t>(i / 3)] - body.work->candidates.data());
        };
        for (Eigen::Index i = 0; i < 3 * n; ++i)
            for (Eigen::Index j = 0; j < 3 * n; ++j)
                W(i, j) +=
                    direction(i).dot(compliance.block<3, 3>(place(i), place(j)) * direction(j));
    }
    for (Eigen::Index k = 0; k < n; ++k) {
        const Candidate& c = *chosen[static_cast<std::size_t>(k)];
        out.contact.push_back(c.index);
        out.problem.mu[k] = c.mu;
        u.segment<3>(3 * k) << c.gap, c.slip[0], c.slip[1];
        out.reaction.segment<3>(3 * k) << c.normal, c.tangential[0], c.tangential[1];
    }
    out.problem.q = u - W * out.reaction;
    out.problem.W = std::move(W);
    return out;
}

} // namespace amontons
