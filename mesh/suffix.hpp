#pragma once

#include "mesh/base/error.hpp"
#include "mesh/format/text.hpp"

#include <string>
#include <string_view>

// Readers choose the format by the suffix of a file's name; for .cpp files alone.

namespace amontons {

inline bool has_suffix(const std::string& path, std::string_view suffix)
{
    return lower_case(path).ends_with(suffix);
}

[[noreturn]] inline void refuse_suffix(const std::string& path, const char* allowed)
{
    const std::size_t dot = path.find_last_of("./");
    const bool has_dot = dot != std::string::npos && path[dot] == '.';
    FileIssues(path).fatal(
        "", has_dot ? "suffix " + quoted_text(path.substr(dot)) : "a name without suffix", allowed);
}

} // namespace amontons
