#include "contact/warm_start.hpp"

#include <algorithm>
#include <numeric>

namespace amontons {
namespace {

/// The contacts by identity; those that share one in their order.
std::vector<int> sorted(const std::vector<std::int32_t>& identity)
{
    std::vector<int> order(identity.size());
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
        return identity[static_cast<std::size_t>(a)] < identity[static_cast<std::size_t>(b)];
    });
    return order;
}

void check_size(std::vector<Issue>& found, const char* place, std::size_t size, int expected)
{
    if (size != static_cast<std::size_t>(expected))
        found.push_back({"warm start", place, std::to_string(size), std::to_string(expected)});
}

} // namespace

Eigen::VectorXd matched_warm_start(const ContactProblem& earlier,
                                   const std::vector<std::int32_t>& earlier_identity,
                                   const Eigen::VectorXd& r, const ContactProblem& problem,
                                   const std::vector<std::int32_t>& identity)
{
    const std::vector<int> from = row_offsets(earlier), to = row_offsets(problem);
    std::vector<Issue> found;
    check_size(found, "identities of the earlier problem", earlier_identity.size(),
               contact_count(earlier));
    check_size(found, "identities", identity.size(), contact_count(problem));
    check_size(found, "rows of r", static_cast<std::size_t>(r.size()), from.back());
    if (!found.empty()) throw InputError(std::move(found));

    Eigen::VectorXd start = Eigen::VectorXd::Zero(to.back());
    const std::vector<int> old_order = sorted(earlier_identity), order = sorted(identity);
    auto old = old_order.begin();
    for (const int i : order) {
        const auto at = static_cast<std::size_t>(i);
        const auto id = [&] { return earlier_identity[static_cast<std::size_t>(*old)]; };
        while (old != old_order.end() && id() < identity[at])
            ++old;
        if (old == old_order.end()) break;
        if (id() != identity[at]) continue;
        if (kind_of(earlier, *old) == kind_of(problem, i)) {
            const int rows = to[at + 1] - to[at];
            start.segment(to[at], rows) = r.segment(from[static_cast<std::size_t>(*old)], rows);
        }
        ++old;
    }
    return start;
}

} // namespace amontons
