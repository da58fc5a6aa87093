#pragma once

#include "validation/solid_run.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace amontons::validation {

/// The order of Newton's steps: the largest log(e3 / e2) / log(e2 / e1) of three errors in a row
/// above the rounding of forces, or 0 if there are not three that fall. 2: quadratic, 1: linear. Of
/// two errors in a row the larger one counts: nearly incompressible bodies take turns, one
/// iteration leaves changes of volume, small and stiffly resisted, the next one takes them back.
inline double newton_order(const std::vector<double>& errors)
{
    constexpr double kRounding = 1e-13, kNear = 0.3;
    std::vector<double> larger;
    for (std::size_t i = 0; i < errors.size(); ++i) {
        const double e = i + 1 < errors.size() ? std::max(errors[i], errors[i + 1]) : errors[i];
        if (larger.empty() || e < larger.back()) larger.push_back(std::max(e, kRounding));
    }
    double order = 0;
    for (std::size_t i = 2; i < larger.size(); ++i) {
        const double a = larger[i - 2], b = larger[i - 1], c = larger[i];
        if (a < kNear && b < a && c < b) order = std::max(order, std::log(c / b) / std::log(b / a));
    }
    return order;
}

inline std::string as_text(const std::vector<double>& errors)
{
    std::string text;
    for (const double e : errors)
        text += fmt::format("{}{:.1e}", text.empty() ? "" : " ", e);
    return text;
}

inline Measured newton_row(const StepRecord& step, const std::string& of)
{
    Measured row = at_most("2 less the order of Newton's last steps, " + of,
                           std::max(0.0, 2 - newton_order(step.errors)), 0.3);
    row.note = fmt::format("order {:.1f}: {}", newton_order(step.errors), as_text(step.errors));
    return row;
}

/// A row that fails unless the last step of a run converged quadratically (1.7 of 2, for what
/// rounding takes of three errors).
inline Measured newton_row(const SolidRun& run, const std::string& of)
{
    return newton_row(run.last(), of);
}

/// log2 of the errors' ratios between meshes of halved size, against a reference.
inline std::string orders(const std::vector<double>& values, double reference)
{
    std::string text = "order";
    for (std::size_t i = 1; i < values.size(); ++i)
        text += fmt::format(" {:.2f}", std::log2(std::abs(values[i - 1] - reference) /
                                                 std::abs(values[i] - reference)));
    return text;
}

inline MaterialInput material(const std::string& law, std::initializer_list<double> constants)
{
    MaterialInput m;
    m.law = law;
    std::copy(constants.begin(), constants.end(), m.constants.begin());
    return m;
}

/// Makes a solid hyperelastic: the constants beside the material go.
inline void set_material(SolidInput& solid, MaterialInput m)
{
    solid.youngs_modulus = solid.poisson_ratio = 0;
    solid.material = std::move(m);
}

} // namespace amontons::validation
