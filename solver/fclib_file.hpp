#pragma once

#include "contact/fclib.hpp"

// Files of contact problems, by the run-time module libamontons-fclib. Nothing else maps HDF5.

namespace amontons {

/// Reads an FCLib file.
/// @throws InputError  with everything that is wrong: no such file, no HDF5 file, damaged, larger
///                     than memory, datasets that are missing or make no sense; or no module
FclibProblem read_fclib(const std::string& path);

/// The same from a file's bytes. @param path  for messages  @throws InputError  as read_fclib
FclibProblem parse_fclib(std::string_view bytes, const std::string& path);

/// The bytes of a file with this problem, its solution and its guesses.
/// @throws InputError  if FCLib cannot hold it, or the module is missing
std::string fclib_bytes(const FclibProblem& problem);

/// A file with these datasets, whatever they mean.
std::string fclib_file_of(const std::vector<NamedArray>& arrays);

/// A copy of a file's bytes in which /solution is this one. All else stays as it was.
/// @param bilateral  rows at the end of r and u that are FCLib's lambda
std::string with_solution(std::string_view file, const FclibSolution& solution,
                          Eigen::Index bilateral);

/// Writes a file whole or not at all.
/// @throws InputError, WriteError
void write_fclib(const std::string& path, const FclibProblem& problem);

} // namespace amontons
