#pragma once

#include "mesh/base/error.hpp"

#include <string>
#include <string_view>
#include <vector>

namespace CLI {
class App;
}

namespace amontons {

/// Exit codes of the program.
constexpr int kDone = 0, kCaseFailed = 1, kBadInput = 2, kSolveFailed = 3, kInterrupted = 130;

/// Shared data of all commands: the call, and the stream for messages. Only the results of a
/// command are written to stdout; all else is written to stderr.
struct Session {
    std::vector<std::string> arguments;
    bool quiet = false;
    bool verbose = false;
    bool json = false;
    int exit_code = kDone;

    /// A line on stderr, unless the option --quiet is set.
    void print_line(std::string_view text) const;
    /// A line on stderr, if the option --verbose is set.
    void detail(std::string_view text) const;
    /// Warnings, a line each on stderr, unless the option --quiet is set.
    void warn(const std::vector<Issue>& issues) const;
    /// A line on stderr, always.
    void error(std::string_view text) const;
    /// Text on stdout, as it is. @throws WriteError  if it cannot be written
    void print(std::string_view text) const;
    /// States what is wrong with the input, as text and with --json also as JSON on stdout;
    /// sets the exit code.
    void refuse(const std::vector<Issue>& issues);
};

/// The answer of every command with --json to bad input.
std::string refusal_json(const std::vector<Issue>& issues);

/// True if stderr is a terminal that a bar may be drawn on.
bool progress_on_terminal();

// One function per command; each adds itself to the program. New commands are added here and to
// main.cpp.
void add_run(CLI::App& program, Session& session);
void add_serve(CLI::App& program, Session& session);
void add_studio(CLI::App& program, Session& session);
void add_check(CLI::App& program, Session& session);
void add_haptic(CLI::App& program, Session& session);
void add_solve(CLI::App& program, Session& session);
void add_schema(CLI::App& program, Session& session);
void add_mesh(CLI::App& program, Session& session);
void add_study(CLI::App& program, Session& session);
void add_validate(CLI::App& program, Session& session);
void add_render(CLI::App& program, Session& session);
void add_completion(CLI::App& program, Session& session);

} // namespace amontons
