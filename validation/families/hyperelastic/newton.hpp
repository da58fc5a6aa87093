#pragma once

#include "validation/solid_run.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace amontons::validation {

/// The order of Newton's last steps: the best of log e3 / log e2, log e2 / log e1 and
/// sqrt(log e3 / log e1) of the last three errors, which are relative, so that e' = C e^p with C
/// about 1. 2: quadratic; 1.5 at most of steps that divide by 1000. An error below rounding
/// stands as that, so the last ratio alone states too little; the last but one may rise: nearly
/// incompressible bodies take turns, one iteration leaves changes of volume, small and stiffly
/// resisted, the next one takes them back. 0 without three errors below 0.3.
inline double newton_order(const std::vector<double>& errors)
{
    constexpr double kRounding = 1e-13, kNear = 0.3;
    if (errors.size() < 3) return 0;
    double log_e[3];
    for (std::size_t i = 0; i < 3; ++i) {
        const double e = errors[errors.size() - 3 + i];
        if (!(e < kNear)) return 0;
        log_e[i] = std::log(std::max(e, kRounding));
    }
    return std::max({log_e[2] / log_e[1], log_e[1] / log_e[0], std::sqrt(log_e[2] / log_e[0])});
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

/// Makes a solid hyperelastic: the constants beside the material are removed.
inline void set_material(SolidInput& solid, MaterialInput m)
{
    solid.youngs_modulus = solid.poisson_ratio = 0;
    solid.material = std::move(m);
}

} // namespace amontons::validation
