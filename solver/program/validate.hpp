#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace amontons {

struct Session;

/// What `amontons validate` was called with.
struct ValidateArguments {
    std::vector<std::string> cases;
    std::string suite, report, data = "../shared/data";
    int jobs = 0;
    bool list = false;
    // Of the suites "random" and "mixed":
    std::optional<std::uint64_t> seed;
    std::optional<int> count; ///< of scenes
    std::optional<int> scene; ///< that one alone
    std::string program;      ///< that is tried; "": this one
};

/// Runs cases and prints their rows. The program amontons-validate does it itself (validate.cpp);
/// amontons becomes that program (validate_elsewhere.cpp), so that a user who runs scenes neither
/// builds nor loads the cases.
void validate(const ValidateArguments& arguments, Session& session);

} // namespace amontons
