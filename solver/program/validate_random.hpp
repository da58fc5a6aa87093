#pragma once

namespace amontons {

struct Session;
struct ValidateArguments;

/// `amontons validate --suite random`: random scenes, each with its variants in a child of the
/// program; prints and writes the table of kinds. Exit code 1 if an answer is wrong.
/// @throws InputError  an option that is not allowed
void validate_random(const ValidateArguments& arguments, Session& session);

/// @throws InputError  if an option of the suite "random" is given without it
void refuse_random_options(const ValidateArguments& arguments);

} // namespace amontons
