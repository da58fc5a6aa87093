#pragma once

#include <string_view>

// What every test program does alike: one case may be selected by its name, and the exit
// code whether it passed, failed or could not be tried here.

namespace amontons {

/// Exit code of a program whose test cases were all skipped; CTest reports it as "Skipped".
constexpr int kSkipped = 77;

/// States that the running test case cannot be tried here; the case then returns.
/// @param why  what is missing, such as "the module petsc is not built (petsc-dev)"
void skip_test(std::string_view why);

/// Runs the test cases that the arguments select (doctest's; all without).
/// @return  0 passed; 1 a check failed, or the arguments match no test case; kSkipped if every case
///          that ran was skipped
int run_tests(int argc, char** argv);

} // namespace amontons
