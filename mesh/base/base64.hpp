#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace amontons {

/// Bytes as text of RFC 4648: letters of six bits, padded by '=' to a multiple of four.
std::string to_base64(std::string_view bytes);

/// The bytes of such a text, exactly as it is written; none if it is another text.
std::optional<std::string> from_base64(std::string_view text);

} // namespace amontons
