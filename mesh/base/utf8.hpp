#pragma once

#include <cstddef>
#include <string_view>

namespace amontons {

/// Bytes of the character that a text begins with; 0 if it begins with none of UTF-8.
std::size_t utf8_character(std::string_view text);

/// All of a text is UTF-8.
bool is_utf8(std::string_view text);

/// UTF-8 without control characters and without those that change the direction or the line.
bool is_printable(std::string_view text);

} // namespace amontons
