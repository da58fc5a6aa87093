#pragma once

#include <atomic>
#include <cstddef>
#include <functional>
#include <string>
#include <vector>

// Runs as child processes of the program, which survives however they end.

namespace amontons {

/// A command of this program, or of another one.
struct ChildJob {
    std::vector<std::string> arguments; ///< after the program's name
    double most_seconds = 0;            ///< ended after this wall time [s]; 0: never
    std::string program = "";           ///< its path; "": this program
    int most_cpu_seconds = 0;           ///< ended after this user and system time [s]; 0: never
};

/// How a child process ended, and its output.
struct ChildResult {
    int exit_code = -1; ///< -1 if a signal ended it
    int signal = 0;
    bool out_of_time = false;
    double seconds = 0, cpu_seconds = 0; ///< wall time; user and system time [s]
    std::string output, errors;          ///< stdout, stderr
};

/// Runs jobs, some at a time, in their order. Children end with their parent, also when that is
/// killed.
/// @param at_once  >= 1
/// @param stop     once set, no job is started and those that run are interrupted (SIGINT)
/// @param done     called by this thread as each job ends: its index and result.
///                 Interrupted jobs are not reported
/// @throws std::runtime_error  if no process can be started; what `done` throws. Children that
///                 still run are killed
void run_children(const std::vector<ChildJob>& jobs, int at_once, const std::atomic<bool>& stop,
                  const std::function<void(std::size_t, const ChildResult&)>& done);

/// The last line that a child wrote to stderr, without "error: ".
std::string last_line(const std::string& errors);

} // namespace amontons
