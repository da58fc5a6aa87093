#pragma once

#include "contact/fclib.hpp"

namespace amontons {

/// A generated problem and what it is.
struct NamedProblem {
    std::string name, family;
    GlobalProblem problem;
};

/// Problems of all families. Sizes and contrasts follow the seed, the families do not.
/// @param size  1: seconds in all for a good solver; larger: about that many times the contacts
std::vector<NamedProblem> problem_set(unsigned seed, double size = 1);

/// The local problem of it, with names that a file keeps.
FclibProblem as_file(const NamedProblem& p);

} // namespace amontons
