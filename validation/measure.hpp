#pragma once

#include <string>
#include <string_view>
#include <vector>

// A validation case measures something whose value is known from elsewhere, and says by how much
// it misses. It never adjusts itself: a case that fails says so with its honest numbers.

namespace amontons::validation {

/// One number beside its reference.
struct Measured {
    std::string quantity;
    double reference = 0;
    double value = 0;
    double error = 0;     ///< as the quantity's name says: relative unless it says otherwise
    double tolerance = 0; ///< of the error
    std::string note;     ///< what else is worth saying, or ""

    bool passed() const { return error <= tolerance; } // false for NaN
};

/// |value - reference| / |reference|
Measured relative(std::string quantity, double reference, double value, double tolerance);
/// |value - reference|
Measured absolute(std::string quantity, double reference, double value, double tolerance);
/// A size that is 0 at its best, such as an error or a count.
Measured at_most(std::string quantity, double value, double tolerance);

/// A published or closed-form result, and how it is measured here.
struct Case {
    std::string_view name;
    std::string_view suite;  ///< "benchmarks" | "stability"
    std::string_view source; ///< of the reference
    std::vector<Measured> (*measure)();
};

/// All cases, in the order in which they are told.
const std::vector<Case>& cases();

/// What came of a case.
struct CaseResult {
    const Case* which = nullptr;
    std::vector<Measured> rows;
    std::string left_out; ///< why it did not run, "" if it did
    double seconds = 0;
    bool passed() const;
};

/// Runs a case. A case that cannot be run to its end (an exception) has a row that failed.
CaseResult run_case(const Case& c);

} // namespace amontons::validation
