#pragma once

namespace amontons::validation {
struct SceneSuite;
}

namespace amontons {

struct Session;
struct ValidateArguments;

/// `amontons validate --suite random` and `mixed`: random scenes, each with its variants in a child
/// of the program; prints and writes the table of kinds. Exit code 1 if an answer is wrong.
/// @throws InputError  an option that is not allowed
void validate_random(const validation::SceneSuite& suite, const ValidateArguments& arguments,
                     Session& session);

/// @throws InputError  if an option of the suites of random scenes is given without one
void refuse_random_options(const ValidateArguments& arguments);

} // namespace amontons
