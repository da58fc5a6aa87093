#include "mesh/base/utf8.hpp"

#include <cstdint>

namespace amontons {
namespace {

struct Character {
    std::uint32_t code = 0;
    std::size_t bytes = 0; ///< 0: none
};

Character first_of(std::string_view text)
{
    if (text.empty()) return {};
    const auto byte = [&](std::size_t i) {
        return std::uint32_t(static_cast<unsigned char>(text[i]));
    };
    const std::uint32_t lead = byte(0);
    if (lead < 0x80) return {lead, 1};
    const std::size_t n = lead >= 0xc2 && lead < 0xe0   ? 2
                          : lead >= 0xe0 && lead < 0xf0 ? 3
                          : lead >= 0xf0 && lead < 0xf5 ? 4
                                                        : 0;
    if (n == 0 || text.size() < n) return {};
    std::uint32_t code = lead & (0xffu >> (n + 1));
    for (std::size_t i = 1; i < n; ++i) {
        if ((byte(i) & 0xc0) != 0x80) return {};
        code = code << 6 | (byte(i) & 0x3f);
    }
    constexpr std::uint32_t kLeast[] = {0, 0, 0x80, 0x800, 0x10000}; // shorter would do
    const bool surrogate = code >= 0xd800 && code < 0xe000;
    return code < kLeast[n] || code > 0x10ffff || surrogate ? Character() : Character{code, n};
}

} // namespace

std::size_t utf8_character(std::string_view text)
{
    return first_of(text).bytes;
}

bool is_utf8(std::string_view text)
{
    while (!text.empty()) {
        const std::size_t n = utf8_character(text);
        if (n == 0) return false;
        text.remove_prefix(n);
    }
    return true;
}

bool is_printable(std::string_view text)
{
    while (!text.empty()) {
        const auto [c, n] = first_of(text);
        if (n == 0 || c < 0x20 || (c >= 0x7f && c < 0xa0) || (c >= 0x200e && c <= 0x200f) ||
            (c >= 0x2028 && c <= 0x202e) || (c >= 0x2066 && c <= 0x2069) || c == 0xfeff)
            return false;
        text.remove_prefix(n);
    }
    return true;
}

} // namespace amontons
