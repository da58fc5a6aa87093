#include "solver/program/session.hpp"

#include "mesh/base/file.hpp"
#include "solver/scene/json_text.hpp"

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <unistd.h>

namespace amontons {

namespace {

void write_line(std::string_view prefix, std::string_view text)
{
    std::string line;
    if (progress_on_terminal()) line = "\r\033[K"; // over a progress bar that stands there
    line.append(prefix).append(text).append("\n");
    std::fwrite(line.data(), 1, line.size(), stderr);
}

} // namespace

bool progress_on_terminal()
{
    static const bool terminal = ::isatty(STDERR_FILENO) == 1;
    return terminal;
}

void Session::print_line(std::string_view text) const
{
    if (!quiet) write_line("", text);
}

void Session::detail(std::string_view text) const
{
    if (verbose && !quiet) write_line("", text);
}

void Session::warn(const std::vector<Issue>& issues) const
{
    for (const Issue& i : issues)
        print_line(std::string("warning: ") + InputError({i}).what());
}

void Session::error(std::string_view text) const
{
    const bool colour = progress_on_terminal() && !std::getenv("NO_COLOR");
    write_line(colour ? "\033[1;31merror:\033[0m " : "error: ", text);
}

void Session::print(std::string_view text) const
{
    while (!text.empty()) {
        const ssize_t n = ::write(STDOUT_FILENO, text.data(), text.size());
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) throw WriteError("standard output", std::strerror(errno));
        text.remove_prefix(static_cast<std::size_t>(n));
    }
}

void Session::refuse(const std::vector<Issue>& issues)
{
    exit_code = kBadInput;
    for (const Issue& i : issues)
        error(InputError({i}).what());
    if (json) print(refusal_json(issues));
}

std::string refusal_json(const std::vector<Issue>& issues)
{
    JsonText out;
    out.open('{').member("status", "bad_input");
    write_issues(out, "issues", issues);
    return out.close('}').text() + "\n";
}

} // namespace amontons
