#include "validation/measure.hpp"

#include "mesh/base/phase_timer.hpp"

#include <algorithm>
#include <cmath>
#include <exception>
#include <limits>
#include <numeric>
#include <stdexcept>

namespace amontons::validation {

void ReferenceCurve::add(double at, double reference_there, double value_there)
{
    x.push_back(at);
    reference.push_back(reference_there);
    value.push_back(value_there);
}

ReferenceCurve by_x(ReferenceCurve curve)
{
    std::vector<std::size_t> order(curve.x.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return curve.x[a] < curve.x[b]; });
    ReferenceCurve out{curve.x_label, curve.y_label, {}, {}, {}};
    for (const std::size_t i : order)
        out.add(curve.x[i], curve.reference[i], curve.value[i]);
    return out;
}

Measured relative(std::string quantity, double reference, double value, double tolerance)
{
    return {
        std::move(quantity), reference, value, std::abs(value - reference) / std::abs(reference),
        tolerance,           "",        {},    ""};
}

Measured absolute(std::string quantity, double reference, double value, double tolerance)
{
    return {std::move(quantity), reference, value, std::abs(value - reference),
            tolerance,           "",        {},    ""};
}

Measured at_most(std::string quantity, double value, double tolerance)
{
    return {std::move(quantity), 0, value, std::abs(value), tolerance, "", {}, ""};
}

Measured left_out(std::string quantity, std::string why)
{
    constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
    return {std::move(quantity), kNone, kNone, kNone, kNone, "", {}, std::move(why)};
}

Measured missed(Measured row, std::string why)
{
    if (row.error > row.tolerance) row.left_out = std::move(why); // NaN is no miss, it fails
    return row;
}

void raise_to(double& worst, double value)
{
    if (!std::isnan(worst) && !(value <= worst)) worst = value;
}

bool CaseResult::passed() const
{
    if (!left_out.empty()) return true;
    const auto counts = [](const Measured& m) { return m.left_out.empty(); };
    return std::any_of(rows.begin(), rows.end(), counts) &&
           std::none_of(rows.begin(), rows.end(), [](const Measured& m) { return m.failed(); });
}

CaseResult run_case(const Case& c)
{
    if (!c.left_out.empty()) {
        CaseResult r;
        r.name = c.name;
        r.suite = c.suite;
        r.source = c.source;
        r.left_out = c.left_out;
        return r;
    }
    return run_case(std::string(c.name), std::string(c.suite), std::string(c.source), c.measure);
}

CaseResult run_case(std::string name, std::string suite, std::string source,
                    const std::function<std::vector<Measured>()>& measure)
{
    CaseResult r;
    r.name = std::move(name);
    r.suite = std::move(suite);
    r.source = std::move(source);
    const Stopwatch watch;
    try {
        r.rows = measure();
        if (std::none_of(r.rows.begin(), r.rows.end(),
                         [](const Measured& m) { return m.left_out.empty(); }))
            throw std::runtime_error("nothing was measured");
    } catch (const std::exception& error) {
        const double nan = std::numeric_limits<double>::quiet_NaN();
        r.rows.push_back({"runs to its end", 0, nan, nan, 0, error.what(), {}, ""});
    }
    r.seconds = watch.seconds();
    return r;
}

} // namespace amontons::validation
