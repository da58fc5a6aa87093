#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

// A validation case measures something whose value is known from elsewhere, and states by how much
// its result differs. Tolerances are never adjusted: a case that fails is reported with its
// numbers.

namespace amontons::validation {

/// A result beside its reference along something, for a plot.
struct ReferenceCurve {
    std::string x_label, y_label;
    std::vector<double> x, reference, value; ///< all of the same length

    /// A point; NaN where there is no reference or no result.
    void add(double at, double reference_there, double value_there);
};

/// The same points in the order of x.
ReferenceCurve by_x(ReferenceCurve curve);

/// One number beside its reference.
struct Measured {
    std::string quantity;
    double reference = 0;
    double value = 0;
    double error = 0;          ///< relative unless the quantity's name states otherwise
    double tolerance = 0;      ///< of the error
    std::string note;          ///< what else is worth stating, or ""
    ReferenceCurve curve = {}; ///< what the number is the worst of, if there is a plot of it
    std::string left_out = ""; ///< why it does not count, "" if it does; see left_out(), missed()

    bool passed() const { return error <= tolerance; } // false for NaN
    bool failed() const { return left_out.empty() && !passed(); }
};

/// |value - reference| / |reference|
Measured relative(std::string quantity, double reference, double value, double tolerance);
/// |value - reference|
Measured absolute(std::string quantity, double reference, double value, double tolerance);
/// A size that is 0 at its best, such as an error or a count.
Measured at_most(std::string quantity, double value, double tolerance);

/// What the benchmark has and the case does not measure. It is reported with its reason.
Measured left_out(std::string quantity, std::string why);
/// A row that misses the tolerance of its source: reported with its error and why it does not get
/// there. Once it passes, it is a row like any other.
Measured missed(Measured row, std::string why);

/// Raises the worst so far to a value that is larger or no number: NaN is kept once it has
/// occurred.
void raise_to(double& worst, double value);

/// A published or closed-form result, and how it is measured here. What it is states
/// validation/cases/<name>/README.md.
struct Case {
    std::string_view name;
    std::string_view suite;    ///< "benchmarks" | "stability"
    std::string_view source;   ///< of the reference
    std::string_view verified; ///< how that was checked
    std::vector<Measured> (*measure)();
    std::string_view left_out = ""; ///< why it does not run; then there is no measure
};

/// All cases, in the order in which they are reported.
const std::vector<Case>& cases();

/// Result of a case.
struct CaseResult {
    std::string name, suite, source;
    std::string verified; ///< how the reference was checked
    std::string about;    ///< the first paragraph of the case's README.md
    std::vector<Measured> rows;
    std::string left_out; ///< why it did not run, "" if it did
    double seconds = 0;
    bool passed() const; ///< a case that measures nothing does not
};

/// Runs a case. One that cannot be run to its end (an exception), or measures nothing, has a row
/// that failed.
CaseResult run_case(const Case& c);
/// The same of what has no place in the list.
CaseResult run_case(std::string name, std::string suite, std::string source,
                    const std::function<std::vector<Measured>()>& measure);

} // namespace amontons::validation
